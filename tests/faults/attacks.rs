//! Attacks on a whole installation, drawn at random: kills, damaged recordings, nonsense missions, crowds of observers,
//! files of other users, pipes in place of files, and floods of requests to the pad.
//!
//! Each test runs its own kind of attack twice. `SKETCHNAV_ATTACK_MINUTES=60 SKETCHNAV_ATTACK_SEED=7 cargo test --test faults
//! attacks` continues for an hour, and each attack prints its seed. After every attack there must be no panic, no loss and nothing
//! left over, the bytes must be the same as without the attack, and any error must explain what is wrong.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::page::{free_port, wait_for};
use support::{Ended, Place, SERVICES, kill_if_alive, repository, room, send, wait_until};

/// A source of random attacks, and the place in which all of them start.
struct Attacker {
    rng: Pcg64Mcg,
    /// An undisturbed recording of the room.
    undisturbed: PathBuf,
    place: Place,
}

/// Minimum number of times that each attack is made.
const ROUNDS: u64 = 2;

/// Reads a number from the environment.
fn number(name: &str) -> Option<f64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}: expected a number, found {text:?}")))
}

/// Repeats an attack, each time with a different seed.
fn attack(name: &str, attack: fn(&mut Attacker)) {
    let limit = Duration::from_secs_f64(60.0 * number("SKETCHNAV_ATTACK_MINUTES").unwrap_or(0.0));
    let first_seed = number("SKETCHNAV_ATTACK_SEED").unwrap_or(1.0) as u64;
    let (began, mut count) = (Instant::now(), 0);
    while count < ROUNDS || began.elapsed() < limit {
        let seed = first_seed + count;
        println!("{:6.1} s  {name}, seed {seed}", began.elapsed().as_secs_f64());
        attack(&mut Attacker::new(seed));
        count += 1;
    }
}

#[test]
fn kills() {
    attack("kills", Attacker::kills);
}

#[test]
fn recordings() {
    attack("recordings", Attacker::recordings);
}

#[test]
fn missions() {
    attack("missions", Attacker::missions);
}

#[test]
fn observers() {
    attack("observers", Attacker::observers);
}

#[test]
fn files() {
    attack("files", Attacker::files);
}

#[test]
fn strangers() {
    attack("strangers", Attacker::strangers);
}

#[test]
fn pipes() {
    attack("pipes", Attacker::pipes);
}

#[test]
fn pad() {
    attack("pad", Attacker::pad);
}

impl Attacker {
    fn new(seed: u64) -> Self {
        let place = Place::new();
        room::write(place.files());
        let (report, code) = place.mission("run room.toml --out undisturbed", "undisturbed");
        assert_eq!(code, 0, "{report:#}");
        let undisturbed = PathBuf::from(report["recording"].as_str().unwrap());
        Self { rng: Pcg64Mcg::seed_from_u64(seed), undisturbed, place }
    }

    /// Waits for a random time. The time of an attack must not affect the outcome.
    fn pause(&mut self, longest: Duration) {
        std::thread::sleep(longest.mul_f64(self.rng.random::<f64>()));
    }

    fn assert_undisturbed(&self, ended: &Ended, system: &str) {
        assert_eq!(ended.code, Some(0), "{ended}");
        let report = ended.json();
        assert_eq!(report["lost_messages"], 0, "{report:#}");
        let recording = report["recording"].as_str().unwrap();
        let diff = self.place.run(&format!("diff {} {recording}", self.undisturbed.display()));
        assert_eq!(diff.code, Some(0), "{diff}");
        self.place.assert_nothing_left(system);
    }

    /// Kills services and the supervisor at random times, and resumes the mission each time.
    fn kills(&mut self) {
        // A mission that starts over gets a new folder. In a shared folder, an earlier run may be complete, and
        // `--resume` would find that run instead of the one that was killed.
        let start_over = |n: u64| format!("run room.toml --json --out killed-{n} --system killed");
        let mut out = 0;
        let mut running = self.place.start(&start_over(out));
        for _ in 0..self.rng.random_range(1..5) {
            let folder = self.place.files().join(format!("killed-{out}/room-001"));
            self.pause(Duration::from_millis(300));
            let process = SERVICES[self.rng.random_range(0..SERVICES.len())];
            self.place.serving("killed", process).into_iter().for_each(kill_if_alive);
            self.pause(Duration::from_millis(300));
            let is_there = folder.exists();
            running.signal(Signal::SIGKILL);
            let ended = running.end();
            wait_until("the end of the orphans", || self.place.living().is_empty());
            let has_ended = ended.code == Some(0);
            if has_ended {
                return self.assert_undisturbed(&ended, "killed");
            }
            // If the supervisor was killed before its run began, or after everything except the report was done, there
            // is nothing to resume.
            running = if is_there && !self.place.files_of("killed").is_empty() {
                self.place.start(&format!("run --json --resume {}", folder.display()))
            } else {
                out += 1;
                self.place.start(&start_over(out))
            };
        }
        let ended = running.end();
        if ended.code == Some(2) && ended.err.contains("found nothing to resume") {
            return;
        }
        self.assert_undisturbed(&ended, "killed");
    }

    /// Changes, cuts off or duplicates bytes of a recording, and tries every tool on it.
    fn recordings(&mut self) {
        let whole = fs::read(&self.undisturbed).unwrap();
        let path = self.place.files().join("damaged.mcap");
        for _ in 0..6 {
            let mut bytes = whole.clone();
            for _ in 0..self.rng.random_range(1..20) {
                let at = self.rng.random_range(0..bytes.len());
                match self.rng.random_range(0..4) {
                    0 => bytes[at] = self.rng.random(),
                    1 => bytes.truncate(at.max(1)),
                    2 => bytes[at..].iter_mut().take(8).for_each(|byte| *byte = 0xff),
                    _ => {
                        let piece = bytes[at..bytes.len().min(at + 1000)].to_vec();
                        bytes.splice(at..at, piece);
                    }
                }
            }
            fs::write(&path, &bytes).unwrap();
            let tools = [
                "info damaged.mcap --json",
                "recover damaged.mcap -o recovered.mcap",
                "filter damaged.mcap --topics scan -o part.mcap",
                "judge damaged.mcap --json",
                "report damaged.mcap -o page.html",
                "rerun damaged.mcap --process localizer",
                "diff damaged.mcap damaged.mcap",
            ];
            for tool in tools {
                must_be_civil(&self.place.run(tool), tool);
            }
        }
    }

    /// Replaces numbers of a mission, a robot or a floor by absurd ones.
    fn missions(&mut self) {
        let robot = fs::read_to_string(repository().join("sim/robots/robotino.toml")).unwrap();
        fs::write(self.place.files().join("robotino.toml"), &robot).unwrap();
        let mission = fs::read_to_string(self.place.files().join(room::MISSION)).unwrap();
        let own = mission.replace("robot = \"robotino\"", "robot = \"robotino.toml\"");
        for _ in 0..6 {
            let files = [(room::MISSION, own.clone()), ("robotino.toml", robot.clone())];
            let floor = fs::read_to_string(self.place.files().join(room::FLOOR)).unwrap();
            let files = files.into_iter().chain([(room::FLOOR, floor.clone())]);
            let mut files: Vec<_> = files.collect();
            for _ in 0..self.rng.random_range(1..3) {
                let i = self.rng.random_range(0..files.len());
                files[i].1 = self.absurd(&files[i].1);
            }
            for (name, text) in &files {
                fs::write(self.place.files().join(name), text).unwrap();
            }
            let running = self.place.start("run room.toml --json --out nonsense --system nonsense");
            let pid = running.pid();
            let (sender, receiver) = mpsc::channel();
            std::thread::spawn(move || sender.send(running.end()));
            // A mission that is accepted may drive until its task's time limit, which is too long to wait for.
            let ended = receiver.recv_timeout(Duration::from_secs(15)).or_else(|_| {
                send(pid, Signal::SIGINT);
                receiver.recv()
            });
            let ended = ended.unwrap();
            let what: Vec<_> = files.iter().map(|(name, text)| format!("--- {name}\n{text}")).collect();
            must_be_civil(&ended, &what.join("\n"));
            self.place.assert_nothing_left("nonsense");
            fs::write(self.place.files().join(room::FLOOR), floor).unwrap();
        }
    }

    /// Returns the text with one of its numbers replaced.
    fn absurd(&mut self, text: &str) -> String {
        const NUMBERS: [&str; 12] = [
            "0",
            "-1",
            "1e39",
            "1e308",
            "-1e308",
            "1e-30",
            "nan",
            "inf",
            "1e9",
            "1e-12",
            "4294967296",
            "0.5",
        ];
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-');
        let starts: Vec<_> = text
            .match_indices(is_number)
            .map(|(at, _)| at)
            .filter(|&at| at > 0 && text[..at].ends_with([' ', '[', '=']))
            .collect();
        let Some(&at) = starts.get(self.rng.random_range(0..starts.len().max(1))) else { return text.into() };
        let end = text[at..].find(|c| !is_number(c)).map_or(text.len(), |length| at + length);
        format!("{}{}{}", &text[..at], NUMBERS[self.rng.random_range(0..NUMBERS.len())], &text[end..])
    }

    /// Dozens of observers come and go, most of them killed, and a service dies in the meantime.
    fn observers(&mut self) {
        let mut running = self.place.start("run room.toml --json --out watched --system watched");
        self.place.wait_until_joined(&mut running, "watched", &SERVICES);
        let mut crowd = Vec::new();
        for _ in 0..16 {
            let channel = ["scan", "estimate", "status", "odometry"][self.rng.random_range(0..4)];
            let tool = ["echo", "hz"][self.rng.random_range(0..2)];
            crowd.push(self.place.start(&format!("{tool} {channel} --system watched")));
            if crowd.len() > 9 {
                let one = crowd.swap_remove(self.rng.random_range(0..crowd.len()));
                one.signal([Signal::SIGKILL, Signal::SIGINT][self.rng.random_range(0..2)]);
            }
            self.pause(Duration::from_millis(20));
        }
        let process = SERVICES[self.rng.random_range(0..SERVICES.len())];
        self.place.serving("watched", process).into_iter().for_each(kill_if_alive);
        let ended = running.end();
        crowd.into_iter().for_each(|one| {
            one.signal(Signal::SIGKILL);
            one.end();
        });
        self.assert_undisturbed(&ended, "watched");
    }

    /// A file of another user, or a link, appears among the files of a system.
    fn files(&mut self) {
        let mut running = self.place.start("run room.toml --json --out foreign --system foreign --speed 1");
        self.place.wait_until_joined(&mut running, "foreign", &SERVICES);
        self.pause(Duration::from_millis(500));
        let owner = self.place.files_of("foreign").into_iter().find(|file| file.ends_with("_owner")).unwrap();
        let name =
            ["history_scan", "checkpoint_planner_7", "x.connection", "y.data"][self.rng.random_range(0..4)];
        let foreign = owner.replace("_owner", &format!("_{name}"));
        let victim = self.place.files().join("victim");
        fs::write(&victim, "precious").unwrap();
        std::os::unix::fs::symlink(&victim, &foreign).unwrap();
        let ended = running.end();
        assert_eq!(ended.code, Some(3), "{ended}");
        assert!(ended.err.contains(&format!("{foreign}: expected a regular file owned by user")), "{ended}");
        assert_eq!(fs::read_to_string(victim).unwrap(), "precious");
        let _ = fs::remove_file(&foreign);
        self.place.assert_nothing_left("foreign");
    }

    /// Another user fills `/dev/shm` with files that are named like those of systems. A mission neither touches these
    /// files nor loses anything.
    fn strangers(&mut self) {
        let token = format!("{:016x}", self.rng.random::<u64>());
        let names = |i| PathBuf::from(format!("/dev/shm/sketchnav_x{i}_{token}_z"));
        let files: Vec<_> = (0..self.rng.random_range(1_000..20_000)).map(names).collect();
        for file in &files {
            fs::write(file, "").unwrap();
            // A user who is not allowed to give files away makes links instead, which are rejected as well.
            if std::os::unix::fs::chown(file, Some(65534), Some(65534)).is_err() {
                fs::remove_file(file).unwrap();
                std::os::unix::fs::symlink("/nowhere", file).unwrap();
            }
        }
        let ended = self.place.run("run room.toml --json --out crowded --system crowded");
        let left = files.iter().filter(|file| fs::remove_file(file).is_ok()).count();
        assert_eq!(left, files.len(), "they are not ours");
        self.assert_undisturbed(&ended, "crowded");
    }

    /// A named pipe, a device or a folder is given in place of a file. No command may wait for it forever.
    fn pipes(&mut self) {
        let pipe = self.place.files().join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        let commands = [
            "info FILE",
            "judge FILE",
            "run FILE",
            "run room.toml --faults FILE --system piped",
            "rerun FILE --process localizer",
            "import FILE --map floor.yaml -o imported.mcap",
            "relations FILE --calculus qtc-b",
        ];
        for command in commands {
            let other = ["/dev/zero", "/dev/tty", "."][self.rng.random_range(0..3)];
            for (file, found) in [("pipe", "a pipe"), (other, "")] {
                let ended = self.place.run(&command.replace("FILE", file));
                must_be_civil(&ended, command);
                assert!(ended.code != Some(0) && ended.err.contains(found), "{command} {file}: {ended}");
            }
        }
        self.place.assert_nothing_left("piped");
    }

    /// The pad's port receives garbage, incomplete requests and many connections. A page must still get its answer.
    fn pad(&mut self) {
        let port = free_port();
        let mut running =
            self.place.start(&format!("pad --mission room.toml --port {port} --system flooded"));
        wait_for(&mut running, port);
        let mut open = Vec::new();
        for _ in 0..300 {
            let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { continue };
            let bytes = self.rubbish();
            // The pad may hang up at any time.
            let _ = stream.write_all(&bytes);
            if self.rng.random::<bool>() {
                open.push(stream);
            }
        }
        drop(open);
        let page =
            ask(port, &format!("GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n"));
        assert!(page.starts_with("HTTP/1.1 200"), "{page:.300}");
        // Another user of the machine has no token, and a page of another site does not have our origin.
        for (target, headers, status) in [
            ("/api/walls.png", "Host: 127.0.0.1:PORT", 401),
            ("/", "Host: 127.0.0.1:PORT\r\nHost: evil.example:PORT", 403),
            ("/", "Host: 127.0.0.1:PORT\r\nOrigin: http://évil.example", 403),
        ] {
            let headers = headers.replace("PORT", &port.to_string());
            let answer =
                ask(port, &format!("GET {target} HTTP/1.1\r\n{headers}\r\nConnection: close\r\n\r\n"));
            assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{headers}: {answer:.300}");
        }
        running.must_live();
        running.signal(Signal::SIGINT);
        let ended = running.end();
        assert_eq!(ended.code, Some(0), "{ended}");
        self.place.assert_nothing_left("flooded");
    }

    fn rubbish(&mut self) -> Vec<u8> {
        let length = self.rng.random_range(0..4000);
        match self.rng.random_range(0..4) {
            0 => (0..length).map(|_| self.rng.random()).collect(),
            1 => format!(
                "POST /api/sketch HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}00\r\n\r\n{{"
            )
            .into(),
            2 => format!("GET /{} HTTP/1.1\r\n", "x".repeat(length)).into(),
            _ => b"GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n"
                .to_vec(),
        }
    }
}

/// Sends a request and returns the answer.
fn ask(port: u16, request: &str) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// Asserts that a command that was given nonsense ends with one of its own exit codes, explains what is wrong, and does not panic.
fn must_be_civil(ended: &Ended, what: &str) {
    let panicked = ["panicked", "RUST_BACKTRACE", "overflow"].iter().any(|word| ended.err.contains(word));
    assert!(matches!(ended.code, Some(0..=4)) && !panicked, "{what}: {ended}");
    let steers = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    assert!(!ended.out.contains(steers) && !ended.err.contains(steers), "{what}: {ended}");
    assert!(
        ended.code != Some(2) || ended.err.contains("expected") || ended.err.contains(": "),
        "{what}: {ended}"
    );
}
