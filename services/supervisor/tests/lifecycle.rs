//! Whole systems of small processes: how they end, and that they leave nothing behind.
//!
//! A test starts this same binary again as a supervisor, which starts it again as world, planner and recorder. Each test has
//! its own root.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use sketchnav_runtime::{HealthReporter, Node, Step, System, Wake};
use sketchnav_schemas::channels::{COMMAND, HEALTH, MISSION, SCAN, STATUS};
use sketchnav_schemas::channels::{LOCKSTEP_WINDOW, RECORDED};
use sketchnav_schemas::codes::{Process, TaskState};
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::messages::ROUTE;
use sketchnav_supervisor::{Grace, ProcessLine, Progress, Supervisor};

const STEPS: u64 = 1000;
const LONG: Duration = Duration::from_secs(600);
/// Maximum time that anything may take before it counts as hanging.
const LIMIT: Duration = Duration::from_secs(180);
const ROLE: &str = "TEST_ROLE";
const SYSTEM: &str = "TEST_SYSTEM";
/// The plot: `finish`, `endless`, or a process and what it does: `planner-exits`, `world-dies`, `world-stays` (for a grace of
/// eight seconds), `world-stays-long`, `sketcher-stopped` (by the test), `planner-waits`, `world-by-hand` (which never joins).
const PLOT: &str = "TEST_PLOT";
const NOTES: &str = "TEST_NOTES";

// --------------------------------------------------------------------------------------- the actors

#[test]
#[ignore = "a process of the other tests, which start it themselves"]
fn actor() {
    match variable(ROLE).as_str() {
        "supervisor" => supervisor(),
        "world" => world(),
        "planner" => planner(),
        "sketcher" => sketcher(),
        "recorder" => recorder(),
        role => panic!("no such role: {role}"),
    }
}

fn variable(name: &str) -> String {
    std::env::var(name).unwrap()
}

fn act(role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["actor", "--exact", "--ignored", "--nocapture"]).env(ROLE, role);
    command
}

fn node(process: Process) -> Node {
    sketchnav_navigators::register(&[]).unwrap();
    Node::join(System::open(&variable(SYSTEM)).unwrap(), process).unwrap()
}

/// Acts as the supervisor, and prints what happens, one event per line.
fn supervisor() {
    sketchnav_navigators::register(&[]).unwrap();
    let mut run: RunConfig = serde_json::from_str(include_str!("../../runtime/tests/run.json")).unwrap();
    run.system = variable(SYSTEM);
    let is_by_hand = variable(PLOT) == "world-by-hand";
    let mut order = vec![Process::Recorder, Process::Planner, Process::World, Process::Sketcher];
    if is_by_hand {
        run.without = vec![Process::World];
        order.retain(|process| *process != Process::World);
    }
    let lines = order.into_iter();
    let lines = lines.map(|process| ProcessLine { process, command: act(process.word()), resumes: false });
    let stays = ["world-stays", "sketcher-stopped"].contains(&variable(PLOT).as_str());
    let services = if stays { Duration::from_secs(8) } else { LONG };
    let stalled = match variable(PLOT).as_str() {
        "planner-waits" => Duration::from_secs(2),
        "world-by-hand" => Duration::from_millis(100),
        _ => LONG,
    };
    let grace = Grace { services, recorder: LONG, stopped: LONG, stalled };
    let mut supervisor = match Supervisor::start(&run, lines.collect(), grace) {
        Ok(supervisor) => supervisor,
        Err(error) => return println!("\n> refused: {error}"),
    };
    println!("\n> started");
    let end = loop {
        if is_by_hand {
            break format!(
                "{:?}",
                supervisor.poll(Duration::from_secs(2)).map_err(|error| error.to_string())
            );
        }
        match supervisor.poll(LONG) {
            Ok(Progress::Running) => {}
            Ok(progress) => break format!("{progress:?}"),
            Err(error) => break format!("bad input {}: {error}", error.is_bad_input()),
        }
    };
    println!("\n> {}", end.replace('\n', " | "));
    let result = supervisor.shut_down().map_err(|error| error.to_string());
    let steps = supervisor.health(Process::World).map_or(0, |health| health.steps);
    let tasks: Vec<_> = supervisor.ended_tasks().map(|status| status.name.as_str().to_string()).collect();
    println!("\n> down {result:?}, world {steps} steps, tasks {}", tasks.join(" "));
}

/// Acts as a world in lockstep: sends a scan and waits for the command for it, never far ahead of the recorder.
fn world() {
    if variable(PLOT).starts_with("world-stays") {
        // It ignores the request to end.
        // SAFETY: ignoring a signal touches no memory.
        unsafe { nix::sys::signal::signal(Signal::SIGTERM, nix::sys::signal::SigHandler::SigIgn) }.unwrap();
        let node = Node::join(System::open(&variable(SYSTEM)).unwrap(), Process::Observer).unwrap();
        loop {
            node.nap(LONG);
        }
    }
    let node = node(Process::World);
    let mut scans = node.writer(SCAN).unwrap();
    let mut commands = node.reader(COMMAND).unwrap();
    let mut recorded = node.reader(RECORDED).unwrap();
    let mut safe = 0;
    let mut health = HealthReporter::new(&node).unwrap();
    let mut last = false;
    while !last {
        let step = Step::begin();
        let seq = scans.send(|scan| scan.beam_count = 683).unwrap();
        health.end(step);
        if variable(PLOT) == "world-dies" && seq == 200 {
            kill(nix::unistd::getpid(), Signal::SIGKILL).unwrap();
        }
        let mut answered = false;
        while !answered || seq > safe + LOCKSTEP_WINDOW {
            while let Some(message) = recorded.receive().unwrap() {
                safe = message.header.source_seq;
            }
            while let Some(command) = commands.receive().unwrap() {
                if command.header.source_seq == seq {
                    (answered, last) = (true, command.last == 1);
                }
            }
            let may_continue = answered && seq <= safe + LOCKSTEP_WINDOW;
            if !may_continue && node.wait(LONG) == Wake::Terminate {
                return health.report(0).unwrap();
            }
        }
    }
    // It ends by itself, before the supervisor asks it to.
    health.report(0).unwrap();
}

fn planner() {
    let node = node(Process::Planner);
    if variable(PLOT) == "planner-waits" {
        while node.wait(LONG) != Wake::Terminate {}
        return;
    }
    let mut scans = node.reader(SCAN).unwrap();
    let mut orders = node.reader(MISSION).unwrap();
    let mut routes = node.reader(ROUTE).unwrap();
    let mut commands = node.writer(COMMAND).unwrap();
    let mut statuses = node.writer(STATUS).unwrap();
    let (mut ordered, mut sketched) = (false, false);
    while node.wait(LONG) != Wake::Terminate {
        ordered |= orders.receive().unwrap().is_some();
        sketched |= routes.receive().unwrap().is_some();
        while ordered
            && sketched
            && let Some(scan) = scans.receive().unwrap()
        {
            let seq = scan.header.seq;
            if variable(PLOT) == "planner-exits" && seq == 200 {
                eprintln!("the sketch is upside down");
                std::process::exit(2);
            }
            let last = seq == STEPS && variable(PLOT) == "finish";
            let command = |command: &mut sketchnav_schemas::message::VelocityCommand| {
                command.header.source_seq = seq;
                command.last = last.into();
            };
            commands.send(command).unwrap();
            let state = match seq {
                _ if last => TaskState::Finished,
                _ if seq == STEPS - 10 => TaskState::Reached,
                _ => TaskState::Driving,
            };
            let fill = |status: &mut sketchnav_schemas::message::MissionStatus| {
                status.name = sketchnav_schemas::message::Text::new("kitchen");
                status.state = state.code();
            };
            statuses.send(fill).unwrap();
        }
    }
}

/// Acts as a sketcher that sends its route once. The planner may join later.
fn sketcher() {
    let node = node(Process::Sketcher);
    let mut routes = node.writer(ROUTE).unwrap();
    routes.send(|route| route.task_count = 1).unwrap();
    while node.wait(LONG) != Wake::Terminate {}
}

/// Acts as the recorder, and lists its messages once it has received everything.
fn recorder() {
    let node = node(Process::Recorder);
    let mut scans = node.reader(SCAN).unwrap();
    let mut statuses = node.reader(STATUS).unwrap();
    let mut health = node.reader(HEALTH).unwrap();
    let mut recorded = node.writer(RECORDED).unwrap();
    let mut counts = [0; 3];
    let (mut last, mut counted) = (0, 0);
    let mut may_continue = true;
    while may_continue {
        may_continue = node.nap(Duration::from_millis(5)) != Wake::Terminate;
        while let Some(scan) = scans.receive().unwrap() {
            counts[0] += 1;
            last = scan.header.seq;
        }
        while statuses.receive().unwrap().is_some() {
            counts[1] += 1;
        }
        while health.receive().unwrap().is_some() {
            counts[2] += 1;
        }
        // Not before every channel has been emptied, since the world continues immediately.
        if std::mem::replace(&mut counted, last) != last {
            recorded.send(|message| message.header.source_seq = last).unwrap();
        }
    }
    fs::write(variable(NOTES), format!("{counts:?} lost {}", node.lost_messages())).unwrap();
}

// ---------------------------------------------------------------------------------------- the stage

/// A root of systems that only this test uses, and the name of its system.
struct Stage {
    root: tempfile::TempDir,
    system: String,
}

struct Play {
    supervisor: Child,
    said: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Stage {
    fn new(system: &str) -> Self {
        // No other name in shared memory may look like that of a test running at the same time.
        let system = format!("{system}-{}", std::process::id());
        Self { root: tempfile::tempdir_in("/dev/shm").unwrap(), system }
    }

    fn play(&self, plot: &str) -> Play {
        let mut supervisor = act("supervisor")
            .env("XDG_RUNTIME_DIR", self.root.path())
            .env(SYSTEM, &self.system)
            .env(PLOT, plot)
            .env(NOTES, self.notes())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(supervisor.stdout.take().unwrap()).lines();
        Play { supervisor, said }
    }

    fn notes(&self) -> PathBuf {
        self.root.path().join("notes")
    }

    fn folder(&self) -> PathBuf {
        self.root.path().join("sketchnav").join(&self.system)
    }

    /// Returns the process ids of the system's processes.
    fn pids(&self) -> Vec<i32> {
        let files = fs::read_dir(self.folder().join("processes")).into_iter().flatten();
        files.filter_map(|file| pid_in(&file.ok()?.path())).collect()
    }

    fn pid(&self, process: Process) -> i32 {
        pid_in(&self.folder().join("processes").join(process.word())).unwrap()
    }

    fn nothing_is_left(&self) {
        assert!(!self.folder().exists(), "{:?}", self.folder());
        let mark = format!("sketchnav_{}_", self.system);
        let shared = fs::read_dir(Path::new("/dev/shm")).unwrap();
        let names = shared.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
        assert_eq!(names.filter(|name| name.starts_with(&mark)).collect::<Vec<_>>(), Vec::<String>::new());
    }
}

impl Play {
    fn line(&mut self) -> String {
        self.said.find_map(|line| Some(line.unwrap().strip_prefix("> ")?.to_string())).unwrap()
    }

    fn until_steps(&self, stage: &Stage) {
        // The world and the planner have joined when their locks exist.
        wait_until("all have joined", || stage.pids().len() == 4);
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.supervisor.id() as i32), signal).unwrap();
    }
}

impl Drop for Play {
    fn drop(&mut self) {
        let _ = self.supervisor.kill();
        let _ = self.supervisor.wait();
    }
}

/// Returns the process id of a lock file's holder, which is the first word of the file.
fn pid_in(lock: &Path) -> Option<i32> {
    fs::read_to_string(lock).ok()?.split_whitespace().next()?.parse().ok()
}

/// Waits until a process that is not our child has ended.
fn gone(pid: i32) {
    let lives = || fs::read_to_string(format!("/proc/{pid}/stat")).is_ok_and(|stat| !stat.contains(") Z "));
    wait_until(&format!("process {pid} has ended"), || !lives());
}

/// Waits for a condition, leaving the processors to the processes that it depends on.
fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < LIMIT, "waited {LIMIT:?} until {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

// -------------------------------------------------------------------------------------------- tests

#[test]
fn every_sent_message_is_recorded() {
    let stage = Stage::new("finish");
    let mut play = stage.play("finish");
    assert_eq!(play.line(), "started");
    assert_eq!(play.line(), "Ended");
    assert_eq!(play.line(), format!("down Ok(()), world {STEPS} steps, tasks kitchen"));
    stage.nothing_is_left();
    let notes = fs::read_to_string(stage.notes()).unwrap();
    assert_eq!(notes, format!("[{STEPS}, {STEPS}, 1] lost 0"));
}

#[test]
fn a_process_that_fails_says_why() {
    let stage = Stage::new("exits");
    let mut play = stage.play("planner-exits");
    assert_eq!(play.line(), "started");
    let said = play.line();
    assert!(said.starts_with("bad input true: planner (process "), "{said}");
    assert!(said.contains("ended with exit code 2; its last words: |"), "{said}");
    assert!(said.ends_with("the sketch is upside down"), "{said}");
    // The recorder still got its time.
    assert!(play.line().starts_with("down Err(\"planner"));
    stage.nothing_is_left();
    assert!(fs::read_to_string(stage.notes()).unwrap().starts_with("[200, 199, "));
}

#[test]
fn a_killed_process_is_named() {
    let stage = Stage::new("dies");
    let mut play = stage.play("world-dies");
    assert_eq!(play.line(), "started");
    let said = play.line();
    assert!(said.starts_with("bad input false: world (process "), "{said}");
    assert!(said.contains("was killed by signal 9 (SIGKILL)"), "{said}");
    play.line();
    stage.nothing_is_left();
}

/// Regression test: the world waited for a command that never came, and the planner for a scan that it could accept, so both used
/// to stand still in silence.
#[test]
fn a_stalled_lockstep_run_is_reported_and_ended() {
    let stage = Stage::new("waits");
    let mut play = stage.play("planner-waits");
    assert_eq!(play.line(), "started");
    let said = play.line();
    let expected = "bad input false: the mission is stuck: every process has waited for another one for 2 s; the \
                    last answered tick is 0";
    assert_eq!(said, expected);
    assert!(play.line().starts_with("down Ok(())"));
    stage.nothing_is_left();
}

/// Regression test: a mission used to be ended as stuck while it waited for a driver that the user had yet to start.
#[test]
fn a_lockstep_waits_for_a_process_that_is_run_by_hand() {
    let stage = Stage::new("hand");
    let mut play = stage.play("world-by-hand");
    assert_eq!(play.line(), "started");
    assert_eq!(play.line(), "Ok(Running)");
    assert!(play.line().starts_with("down Ok(())"));
    stage.nothing_is_left();
}

#[test]
fn a_process_that_ignores_the_request_to_end_is_killed() {
    let stage = Stage::new("stays");
    let mut play = stage.play("world-stays");
    assert_eq!(play.line(), "started");
    play.until_steps(&stage);
    play.signal(Signal::SIGTERM);
    assert_eq!(play.line(), "Interrupted");
    let said = play.line();
    assert!(said.contains("did not end within their time and were killed: world"), "{said}");
    stage.nothing_is_left();
}

/// Regression test: a process that was stopped when the mission ended did not notice that it was asked to end. It was killed for
/// that, and the run counted as a failure although nothing was missing.
#[test]
fn a_stopped_process_ends_with_the_others() {
    let stage = Stage::new("stopped");
    let mut play = stage.play("sketcher-stopped");
    assert_eq!(play.line(), "started");
    play.until_steps(&stage);
    kill(Pid::from_raw(stage.pid(Process::Sketcher)), Signal::SIGSTOP).unwrap();
    play.signal(Signal::SIGINT);
    assert_eq!(play.line(), "Interrupted");
    let said = play.line();
    assert!(said.starts_with("down Ok(())"), "{said}");
    stage.nothing_is_left();
}

/// Regression test: a process that did not end used to hold the terminal for its whole grace period, however often the user asked.
#[test]
fn a_second_request_to_end_skips_the_wait() {
    let stage = Stage::new("again");
    let mut play = stage.play("world-stays-long");
    assert_eq!(play.line(), "started");
    play.until_steps(&stage);
    play.signal(Signal::SIGINT);
    assert_eq!(play.line(), "Interrupted");
    let pid = Pid::from_raw(play.supervisor.id() as i32);
    let (done, is_done) = std::sync::mpsc::channel::<()>();
    let asking = std::thread::spawn(move || {
        while is_done.recv_timeout(Duration::from_millis(100))
            == Err(std::sync::mpsc::RecvTimeoutError::Timeout)
        {
            kill(pid, Signal::SIGINT).unwrap();
        }
    });
    let said = play.line();
    drop(done);
    asking.join().unwrap();
    assert!(said.contains("did not end within their time and were killed: world"), "{said}");
    stage.nothing_is_left();
}

#[test]
fn ctrl_c_ends_everything_in_order() {
    let stage = Stage::new("ctrl-c");
    let mut play = stage.play("endless");
    assert_eq!(play.line(), "started");
    play.until_steps(&stage);
    play.signal(Signal::SIGINT);
    assert_eq!(play.line(), "Interrupted");
    assert!(play.line().starts_with("down Ok(())"));
    stage.nothing_is_left();
    assert!(stage.notes().exists());
}

#[test]
fn processes_end_when_their_supervisor_is_killed() {
    let stage = Stage::new("killed");
    let mut play = stage.play("endless");
    assert_eq!(play.line(), "started");
    play.until_steps(&stage);
    let pids = stage.pids();
    play.signal(Signal::SIGKILL);
    pids.into_iter().for_each(gone);
    // The next system that starts cleans up. Here it has the same name.
    let mut next = stage.play("finish");
    assert_eq!((next.line(), next.line()), ("started".into(), "Ended".into()));
    next.line();
    stage.nothing_is_left();
}

#[test]
fn a_running_system_is_not_started_twice() {
    let stage = Stage::new("twice");
    let mut play = stage.play("endless");
    assert_eq!(play.line(), "started");
    let said = stage.play("endless").line();
    assert!(said.starts_with("refused: system "), "{said}");
    assert!(said.contains(" is running already (supervisor "), "{said}");
    play.until_steps(&stage);
    play.signal(Signal::SIGTERM);
    assert_eq!(play.line(), "Interrupted");
    play.line();
    stage.nothing_is_left();
}
