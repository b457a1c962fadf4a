//! Shared support for tests of whole process trees: a separate place for each user, commands that run in it, and checks
//! for leftovers.
//!
//! Every test has its own root (`XDG_RUNTIME_DIR`), so no test sees the systems of another. Nothing here waits for a fixed time.
//! Instead, tests poll for a condition or wait for a process to end. The time limits only keep a test from hanging forever.
pub mod arms;
pub mod browser;
pub mod building;
pub mod page;
pub mod pages;
pub mod room;
pub mod viewer;

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use tempfile::TempDir;

/// Maximum time that anything may take before it counts as hanging.
const LIMIT: Duration = Duration::from_secs(180);
/// Time between two polls, which leaves the processors to the processes that the test waits for.
const LOOK_AGAIN: Duration = Duration::from_millis(1);
/// The names of a system's processes, without the supervisor.
pub const SERVICES: [&str; 5] = words(channels::SERVICES);

/// The names of the processes that run alongside a driver, which replaces the world.
pub const BESIDE_A_DRIVER: [&str; 4] = {
    let [_world, others @ ..] = SERVICES;
    others
};

const fn words<const N: usize>(processes: [Process; N]) -> [&'static str; N] {
    let (mut words, mut i) = ([""; N], 0);
    while i < N {
        words[i] = processes[i].word();
        i += 1;
    }
    words
}

/// A user's place, with a root for systems and a folder for files.
pub struct Place {
    runtime: TempDir,
    files: TempDir,
    program: PathBuf,
    /// The file that the program, an interpreter, runs.
    script: Option<PathBuf>,
}

/// A command that has ended.
pub struct Ended {
    /// The command's exit code, or `None` if a signal ended the command.
    pub code: Option<i32>,
    /// The command's standard output.
    pub out: String,
    /// The command's standard error.
    pub err: String,
}

/// A running command, which is killed when this is dropped.
pub struct Running {
    child: Option<Child>,
    pid: u32,
}

/// Returns the path of `sketchnav` as built by cargo along with the current test.
pub fn program() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.ancestors().find(|folder| folder.ends_with("deps")).and_then(Path::parent);
    let program = folder.expect("a test in target/PROFILE/deps").join("sketchnav");
    assert!(program.exists(), "{}: expected the program; `cargo build` makes it", program.display());
    program
}

/// Returns the path of an example's program.
fn example(name: &str) -> PathBuf {
    let program = program().with_file_name("examples").join(name);
    let missing = "expected the example; `cargo build --examples` makes it";
    assert!(program.exists(), "{}: {missing}", program.display());
    program
}

fn copy_files(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copy = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy_files(&path, &copy);
        } else {
            fs::copy(&path, copy).unwrap();
        }
    }
}

/// Returns true if a file in shared memory belongs to a system in another folder, or was removed in the meantime.
fn is_of_another_folder(file: &str, folder: &str) -> bool {
    let prefix = file.splitn(4, '_').take(3).collect::<Vec<_>>().join("_");
    let owner = fs::read_to_string(format!("{prefix}_owner"));
    owner.map_or(!Path::new(file).exists(), |owner| owner != folder)
}

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    /// Creates an empty place.
    pub fn new() -> Self {
        let runtime = tempfile::tempdir_in("/dev/shm").unwrap();
        fs::set_permissions(runtime.path(), fs::Permissions::from_mode(0o700)).unwrap();
        Self { runtime, files: tempfile::tempdir().unwrap(), program: program(), script: None }
    }

    /// Creates a place where an example replaces `sketchnav`.
    pub fn of_program(example_name: &str) -> Self {
        Self { program: example(example_name), ..Self::new() }
    }

    /// Creates a place where a script, run by this interpreter, replaces `sketchnav`.
    pub fn of_script(interpreter: PathBuf, text: &str) -> Self {
        let place = Self::new();
        let script = place.files().join("navigator.py");
        fs::write(&script, text).unwrap();
        Self { program: interpreter, script: Some(script), ..place }
    }

    /// Creates a place with the files of `sim/missions/FOLDER`. The file `mission` is also available as `mission.toml`.
    pub fn with_missions(folder: &str, mission: &str) -> Self {
        let place = Self::new();
        copy_files(&repository().join("sim/missions").join(folder), place.files());
        fs::copy(place.files().join(mission), place.files().join("mission.toml")).unwrap();
        place
    }

    /// Returns the folder of all systems.
    pub fn root(&self) -> PathBuf {
        self.runtime.path().join("sketchnav")
    }

    /// Returns the folder for missions and recordings.
    pub fn files(&self) -> &Path {
        self.files.path()
    }

    /// Returns a command that runs `sketchnav` in this place, with arguments separated by spaces.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.args(&self.script).args(arguments.split_whitespace());
        self.settle(&mut command);
        command
    }

    /// Makes any command use this place's root and folder.
    pub fn settle(&self, command: &mut Command) {
        command.current_dir(self.files()).env("XDG_RUNTIME_DIR", self.runtime.path());
        command.env("SKETCHNAV_PAD_TOKEN", page::TOKEN);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    }

    /// Runs `sketchnav` to its end.
    pub fn run(&self, arguments: &str) -> Ended {
        self.start(arguments).end()
    }

    /// Runs a `sketchnav` command that must succeed.
    pub fn fine(&self, arguments: &str) -> Ended {
        let ended = self.run(arguments);
        assert_eq!(ended.code, Some(0), "{arguments}: {ended}");
        ended
    }

    /// Runs a mission in lockstep, which must succeed without losing messages, and returns its recording.
    pub fn driven(&self, arguments: &str) -> String {
        let report = self.fine(&format!("run {arguments} --out out --json")).json();
        let found = (&report["success"], &report["lost_messages"]);
        assert_eq!(found, (&Value::Bool(true), &0.into()), "{arguments}: {report}");
        report["recording"].as_str().unwrap().to_owned()
    }

    /// Returns the number of messages on each topic of a recording. Topics without messages are left out.
    pub fn messages(&self, recording: &str) -> BTreeMap<String, u64> {
        let info = self.fine(&format!("info {recording} --json")).json();
        let of_topic =
            |topic: &Value| Some((topic["topic"].as_str()?.to_owned(), topic["messages"].as_u64()?));
        let topics = info["topics"].as_array().unwrap().iter().filter_map(of_topic);
        topics.filter(|(_, count)| *count > 0).collect()
    }

    /// Creates the page of a recording, which must contain all of these texts.
    pub fn page_says(&self, recording: &str, words: &[&str]) {
        self.fine(&format!("report {recording} -o page.html"));
        let page = fs::read_to_string(self.files().join("page.html")).unwrap();
        for words in words {
            assert!(page.contains(words) || page.contains(&words.replace('\'', "&#39;")), "{words}");
        }
    }

    /// Kills processes of a mission `kills` times. The recording must have the same bytes as one without kills.
    pub fn is_identical_after(&self, mission: &str, kills: u32, targets: &str) {
        let output = self.fine(&format!("chaos {mission} --kills {kills} --targets {targets} --json")).json();
        assert_eq!(output["identical"], true, "{mission}: {output}");
    }

    /// Reruns processes of a recording and replays the recording. The messages must be the same each time.
    pub fn is_reproduced(&self, recording: &str, processes: &[&str]) {
        for process in processes {
            let output = self.fine(&format!("rerun {recording} --process {process} --json")).json();
            let found = (&output["identical"], &output["difference"]);
            assert_eq!(found, (&Value::Bool(true), &Value::Null), "{process}");
        }
        let live = "--live localizer,planner,recorder --rate max --record again.mcap";
        self.fine(&format!("replay {recording} {live}"));
        self.fine(&format!("diff {recording} again.mcap"));
    }

    /// Starts `sketchnav`.
    pub fn start(&self, arguments: &str) -> Running {
        Running::spawn(self.command(arguments))
    }

    /// Starts the example driver. The arguments are the name of a system and the number of odometry readings per scan.
    pub fn driver(&self, arguments: &str) -> Running {
        let mut command = Command::new(example("driver"));
        command.args(arguments.split_whitespace());
        self.settle(&mut command);
        Running::spawn(command)
    }

    /// Runs a mission in lockstep as the system `name` and returns its report and the exit code.
    pub fn mission(&self, arguments: &str, name: &str) -> (Value, i32) {
        let ended = self.run(&format!("{arguments} --json --system {name}"));
        let code = ended.code.unwrap_or(-1);
        assert!(code == 0 || code == 1, "{arguments}: {ended}");
        (ended.json(), code)
    }

    /// Returns the running systems as `ps --json` lists them.
    pub fn ps(&self) -> Vec<Value> {
        match self.run("ps --json").json() {
            Value::Array(systems) => systems,
            other => panic!("expected a list, found {other}"),
        }
    }

    /// Returns the names and ids of the processes of the system `name`, or an empty list if it is not running.
    pub fn processes(&self, name: &str) -> Vec<(String, u32)> {
        let systems = self.ps();
        let system = systems.iter().find(|system| system["system"] == name);
        let members = system.and_then(|system| system["processes"].as_array().cloned()).unwrap_or_default();
        let pair = |member: &Value| {
            (member["process"].as_str().unwrap().to_owned(), member["pid"].as_u64().unwrap() as u32)
        };
        members.iter().map(pair).collect()
    }

    /// Returns the id of a process of the system `name`.
    pub fn pid(&self, name: &str, process: &str) -> u32 {
        let processes = self.processes(name);
        processes.iter().find(|(found, _)| found == process).map_or_else(|| panic!("{processes:?}"), |p| p.1)
    }

    /// Returns the ids of the running processes that serve as `process` in the system `name`, whether or not they have joined it
    /// yet.
    pub fn serving(&self, name: &str, process: &str) -> Vec<u32> {
        let call = format!(" serve {process} --system {name} ");
        self.living().into_iter().filter(|(_, line)| line.contains(&call)).map(|(pid, _)| pid).collect()
    }

    /// Waits until all processes of the system `name` have joined it and the planner has sent a few messages.
    pub fn wait_until_driving(&self, running: &mut Running, name: &str) {
        self.wait_until_joined(running, name, &SERVICES);
        let echoed = self.run(&format!("echo status --count 3 --system {name}"));
        assert_eq!(echoed.code, Some(0), "{echoed}");
        assert_eq!(echoed.out.lines().count(), 3, "{echoed}");
    }

    /// Waits until these processes of the system `name` have joined it.
    pub fn wait_until_joined(&self, running: &mut Running, name: &str, wanted: &[&str]) {
        wait_until(&format!("{wanted:?} in system {name}"), || {
            running.must_live();
            let found = self.processes(name);
            wanted.iter().all(|wanted| found.iter().any(|(process, _)| process == wanted))
        });
    }

    /// Returns the files of the system `name`: its folder and its shared memory.
    pub fn files_of(&self, name: &str) -> Vec<String> {
        let folder = self.runtime.path().join("sketchnav").join(name);
        let path = folder.to_string_lossy().into_owned();
        let begin = format!("sketchnav_{name}_");
        let shared = names("/dev/shm").into_iter().filter(|file| file.starts_with(&begin));
        let shared = shared.map(|file| format!("/dev/shm/{file}"));
        let mut remains: Vec<_> = shared.filter(|file| !is_of_another_folder(file, &path)).collect();
        remains.extend(folder.exists().then_some(path));
        remains
    }

    /// Fails if anything is left of the system `name`, or if a process of any system is still running.
    pub fn assert_nothing_left(&self, name: &str) {
        self.assert_no_system_left(name);
        assert_eq!(self.living(), []);
    }

    /// Fails if anything is left of the system `name`. Other systems may still be running. A process that has given up its
    /// lock is no longer part of the system, although it needs a moment to exit.
    pub fn assert_no_system_left(&self, name: &str) {
        assert_eq!(self.files_of(name), Vec::<String>::new());
        let option = format!("--system {name} ");
        wait_until(&format!("the processes of {name} to exit"), || {
            !self.living().iter().any(|(_, line)| line.contains(&option))
        });
    }

    /// Returns every running `sketchnav` process that was started in this place, with its command line. Processes are identified by
    /// their environment.
    pub fn living(&self) -> Vec<(u32, String)> {
        let mark = format!("XDG_RUNTIME_DIR={}", self.runtime.path().display());
        let is_ours = |pid: &u32| {
            let environment = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
            environment.split(|&byte| byte == 0).any(|variable| variable == mark.as_bytes())
        };
        let pids = names("/proc").into_iter().filter_map(|name| name.parse::<u32>().ok());
        pids.filter(is_ours).map(|pid| (pid, command_line(pid))).collect()
    }
}

impl Running {
    /// Starts the command.
    pub fn spawn(mut command: Command) -> Self {
        Self::of(command.spawn().unwrap())
    }

    /// Wraps a command that was already started.
    pub fn of(child: Child) -> Self {
        Self { pid: child.id(), child: Some(child) }
    }

    /// Returns the command's process id.
    pub fn pid(&self) -> u32 {
        self.pid
    }

    /// Sends the command a signal.
    pub fn signal(&self, signal: Signal) {
        send(self.pid, signal);
    }

    /// Fails with the command's output if the command has ended.
    pub fn must_live(&mut self) {
        let ended = self.child.as_mut().and_then(|child| child.try_wait().unwrap()).is_some();
        assert!(!ended, "ended early: {}", self.collect(LIMIT));
    }

    /// Waits until the command ends.
    pub fn end(self) -> Ended {
        self.end_within(LIMIT)
    }

    /// Like [`Running::end`], but with a different time limit.
    pub fn end_within(mut self, limit: Duration) -> Ended {
        self.collect(limit)
    }

    fn collect(&mut self, limit: Duration) -> Ended {
        let child = self.child.take().unwrap();
        let (sender, receiver) = mpsc::channel();
        thread::spawn(move || sender.send(child.wait_with_output()));
        match receiver.recv_timeout(limit) {
            Ok(output) => output.unwrap().into(),
            Err(_) => {
                send(self.pid, Signal::SIGKILL);
                panic!("process {} did not end within {limit:?}", self.pid);
            }
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }
}

impl Ended {
    /// Parses the command's standard output as one JSON value.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("no JSON ({error}): {self}"))
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "exit code {:?}\n--- output\n{}\n--- errors\n{}", self.code, self.out, self.err)
    }
}

/// Sends a signal to a process that a test started.
pub fn send(pid: u32, signal: Signal) {
    kill(Pid::from_raw(pid as i32), signal).unwrap();
}

/// Kills a process that may have already ended by itself.
pub fn kill_if_alive(pid: u32) {
    let _ = kill(Pid::from_raw(pid as i32), Signal::SIGKILL);
}

/// Polls until `holds` is true.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let began = Instant::now();
    while !holds() {
        assert!(began.elapsed() < LIMIT, "waited {LIMIT:?} for {what}");
        thread::sleep(LOOK_AGAIN);
    }
}

/// Returns the repository's folder.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap()
}

fn names(folder: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect()
}

fn command_line(pid: u32) -> String {
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    String::from_utf8_lossy(&line).replace('\0', " ")
}
