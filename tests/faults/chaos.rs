//! Processes are killed while a mission runs in lockstep, and nothing is lost. The recording is identical to the
//! undisturbed one, byte for byte.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use sketchnav_schemas::channels::STATUS;
use support::{Place, Running, SERVICES, building, kill_if_alive, repository, room, send, wait_until};

fn recording(report: &serde_json::Value) -> PathBuf {
    PathBuf::from(report["recording"].as_str().unwrap())
}

fn undisturbed(place: &Place, mission: &str) -> PathBuf {
    let (report, code) = place.mission(&format!("{mission} --out undisturbed"), "undisturbed");
    assert_eq!(code, 0, "{report:#}");
    recording(&report)
}

fn start(place: &Place, mission: &str) -> Running {
    place.start(&format!("{mission} --out disturbed --json --system disturbed"))
}

/// Asserts that nothing is lost or left over, and that every message is the same as in the undisturbed run. Returns how
/// often `processes` were restarted.
fn assert_ends_undisturbed(place: &Place, running: Running, undisturbed: &Path, processes: &[&str]) -> u64 {
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left("disturbed");
    let diff = place.run(&format!("diff {} {}", undisturbed.display(), recording(&report).display()));
    assert_eq!(diff.code, Some(0), "{diff}");
    let restarts = |wanted: &[&str]| -> u64 {
        let lives = report["processes"].as_array().unwrap().iter();
        let lives = lives.filter(|process| wanted.contains(&process["process"].as_str().unwrap()));
        lives.map(|process| process["restarts"].as_u64().unwrap()).sum()
    };
    let info = place.run(&format!("info {} --json", recording(&report).display())).json();
    assert_eq!((&info["missing"], &info["clean_end"]), (&0.into(), &true.into()), "{info:#}");
    // A recorder that was killed before it began has left no part.
    assert!(info["restarts"].as_u64().unwrap() <= restarts(&["recorder"]), "{info:#}");
    restarts(processes)
}

/// Kills processes one after another, each a different number of steps after the one before.
fn kill_in_turn(processes: &[&str]) {
    let place = Place::new();
    let undisturbed = undisturbed(&place, "demo");
    let mut running = start(&place, "demo");
    place.wait_until_driving(&mut running, "disturbed");
    // A single reader listens all along. Starting a new one for each kill would take longer than the mission on a busy
    // machine.
    let mut echo = place.command("echo status --system disturbed").spawn().unwrap();
    let mut lines = BufReader::new(echo.stdout.take().unwrap()).lines().map_while(Result::ok);
    let echo = Running::of(echo);
    let mut kills = 0;
    for (i, process) in processes.iter().cycle().take(10).enumerate() {
        // A reader is first given the channel's history.
        let steps = if i == 0 { STATUS.spec.history() + 1 } else { 1 + 29 * i % 90 };
        if lines.by_ref().take(steps).count() < steps {
            break;
        }
        // No process is found while the previous one is still being restarted.
        let pids = place.serving("disturbed", process);
        kills += u64::from(!pids.is_empty());
        pids.into_iter().for_each(kill_if_alive);
    }
    drop(lines);
    echo.signal(Signal::SIGINT);
    echo.end();
    let restarts = assert_ends_undisturbed(&place, running, &undisturbed, processes);
    // A fast machine reaches the end after a few kills, and the death of the last process killed may then go unnoticed.
    assert!(kills >= 2 && restarts + 1 >= kills, "{kills} kills, {restarts} restarts");
}

#[test]
fn a_killed_localizer_resumes() {
    kill_in_turn(&["localizer"]);
}

#[test]
fn a_killed_planner_resumes() {
    kill_in_turn(&["planner"]);
}

/// Physics, laser noise, people and contacts continue with exactly the same bits.
#[test]
fn a_killed_world_resumes() {
    kill_in_turn(&["world"]);
}

/// Checks what users see: the figures that the command itself reports for its kills.
fn chaos_finds_no_loss(options: &str) {
    let place = Place::new();
    let mission = repository().join("sim/missions/building/building-a.toml");
    let ended = place.run(&format!("chaos {} --json {options}", mission.display()));
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert!(report["kills"].as_u64().unwrap() >= 10, "{report:#}");
    assert_eq!((&report["success"], &report["identical"]), (&true.into(), &true.into()), "{report:#}");
    assert_eq!((&report["lost_messages"], &report["orphans"]), (&0.into(), &0.into()), "{report:#}");
    assert_eq!(report["leftover_files"], serde_json::json!([]), "{report:#}");
    assert_eq!(place.living(), []);
}

#[test]
fn twenty_random_kills_lose_nothing() {
    chaos_finds_no_loss("--kills 20 --seed 5");
}

#[test]
fn killing_starting_processes_loses_nothing() {
    chaos_finds_no_loss("--kills 20 --seed 6 --at-start-up");
}

/// A restarted recorder rereads messages that were not written yet. The recording contains the number of restarts of the recorder.
#[test]
fn a_killed_recorder_leaves_no_gap() {
    kill_in_turn(&["recorder"]);
}

#[test]
fn processes_killed_in_turn_resume() {
    kill_in_turn(&SERVICES);
}

/// All processes die at the same time, so none is left to tell the others what they have missed.
#[test]
fn processes_killed_all_at_once_resume() {
    let place = Place::new();
    let undisturbed = undisturbed(&place, "demo");
    let mut running = start(&place, "demo");
    place.wait_until_driving(&mut running, "disturbed");
    let serving = SERVICES.map(|process| place.serving("disturbed", process));
    serving.concat().into_iter().for_each(kill_if_alive);
    let restarts = assert_ends_undisturbed(&place, running, &undisturbed, &SERVICES);
    assert_eq!(restarts, SERVICES.len() as u64);
}

/// In real time, no process waits for another. The robot stops, and continues when its navigators are back.
#[test]
fn processes_killed_in_real_time_reach_their_goals() {
    let place = Place::new();
    building::write_patient(place.files());
    let mut running = start(&place, &format!("run {} --speed 10", building::PATIENT));
    place.wait_until_driving(&mut running, "disturbed");
    for process in SERVICES {
        let steps = (STATUS.spec.history() + 50).to_string();
        let echoed = place.run(&format!("echo status --count {steps} --system disturbed"));
        assert_eq!(echoed.code, Some(0), "{echoed}");
        place.serving("disturbed", process).into_iter().for_each(kill_if_alive);
    }
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["success"], true, "{ended}");
    place.assert_nothing_left("disturbed");
}

/// A process that dies before it has joined, or while it opens its channels, leaves nothing that prevents its restart.
#[test]
fn processes_killed_while_starting_start_again() {
    let place = Place::new();
    room::write(place.files());
    let undisturbed = undisturbed(&place, "run room.toml");
    let running = start(&place, "run room.toml");
    let mut killed = SERVICES.map(|_| Vec::new());
    while killed.iter().any(|pids| pids.len() < 3) {
        for (process, killed) in SERVICES.iter().zip(&mut killed).filter(|(_, pids)| pids.len() < 3) {
            for pid in place.serving("disturbed", process) {
                if !killed.contains(&pid) {
                    kill_if_alive(pid);
                    killed.push(pid);
                }
            }
        }
    }
    let restarts = assert_ends_undisturbed(&place, running, &undisturbed, &SERVICES);
    assert_eq!(restarts, 3 * SERVICES.len() as u64);
}

/// The supervisor gives up on a process that dies each time before it makes any progress, and the mission fails.
#[test]
fn a_process_that_keeps_dying_is_given_up() {
    let place = Place::new();
    let mut running = start(&place, "demo --speed 5");
    place.wait_until_driving(&mut running, "disturbed");
    let (sender, receiver) = std::sync::mpsc::channel();
    let waiting = std::thread::spawn(move || sender.send(running.end()));
    let ended = loop {
        place.serving("disturbed", "planner").into_iter().for_each(kill_if_alive);
        if let Ok(ended) = receiver.try_recv() {
            break ended;
        }
    };
    waiting.join().unwrap().unwrap();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.err.contains("died each time before it made progress: given up"), "{ended}");
    place.assert_nothing_left("disturbed");
}

/// Flips a bit in the state of the process's latest checkpoint, or of both checkpoints, and kills the process.
fn damage_and_kill(place: &Place, process: &str, slots: usize) {
    for pid in place.serving("disturbed", process) {
        for (mut bytes, file) in checkpoints_of_stopped(place, process, pid).into_iter().take(slots) {
            bytes[100] ^= 1;
            std::fs::write(file, bytes).unwrap();
        }
        kill_if_alive(pid);
    }
}

/// Stops the process at a time when neither of its checkpoints is half written. Returns the checkpoints, latest first.
fn checkpoints_of_stopped(place: &Place, process: &str, pid: u32) -> Vec<(Vec<u8>, String)> {
    let mark = format!("checkpoint_{process}_");
    let number = |bytes: &[u8]| u64::from_ne_bytes(bytes[8..16].try_into().unwrap());
    loop {
        send(pid, Signal::SIGSTOP);
        wait_until(&format!("{process} to stop"), || is_stopped(pid));
        let files = place.files_of("disturbed").into_iter().filter(|file| file.contains(&mark));
        let mut files: Vec<_> = files.map(|file| (std::fs::read(&file).unwrap(), file)).collect();
        if files.iter().all(|(bytes, _)| number(bytes) > 0) {
            files.sort_by_key(|(bytes, _)| std::cmp::Reverse(number(bytes)));
            return files;
        }
        send(pid, Signal::SIGCONT);
        std::thread::yield_now();
    }
}

/// Returns true if the kernel has stopped all threads of the process.
fn is_stopped(pid: u32) -> bool {
    let mut tasks = std::fs::read_dir(format!("/proc/{pid}/task")).unwrap();
    tasks.all(|task| {
        let stat = std::fs::read_to_string(task.unwrap().path().join("stat"));
        // Threads that have ended in the meantime do not count.
        stat.is_ok_and(|stat| stat.contains(") T "))
    })
}

fn drive_on(place: &Place) -> Running {
    let mut running = start(place, "demo");
    place.wait_until_driving(&mut running, "disturbed");
    let steps = STATUS.spec.history() + 50;
    let echoed = place.run(&format!("echo status --count {steps} --system disturbed"));
    assert_eq!(echoed.code, Some(0), "{echoed}");
    running
}

/// The older checkpoint is less recent, but just as valid.
#[test]
fn a_damaged_checkpoint_is_refused_and_the_other_is_used() {
    for process in ["localizer", "planner", "world"] {
        let place = Place::new();
        let undisturbed = undisturbed(&place, "demo");
        let running = drive_on(&place);
        damage_and_kill(&place, process, 1);
        let restarts = assert_ends_undisturbed(&place, running, &undisturbed, &[process]);
        assert_eq!(restarts, 1, "{process}");
    }
}

/// The state of the process is lost, so it continues from the task and the position in its last messages. This is
/// reported.
#[test]
fn navigators_without_a_valid_checkpoint_continue_from_their_last_messages() {
    for process in ["localizer", "planner"] {
        let place = Place::new();
        let running = drive_on(&place);
        damage_and_kill(&place, process, 2);
        let ended = running.end();
        assert_eq!(ended.code, Some(0), "{process}: {ended}");
        let report = ended.json();
        assert_eq!(report["lost_messages"], 0, "{ended}");
        place.assert_nothing_left("disturbed");
        let info = place.run(&format!("info {} --json", recording(&report).display())).json();
        let refused = info["faults"].as_array().unwrap().iter().filter(|f| f["kind"] == "state refused");
        let words: Vec<_> = refused.map(|fault| fault["words"].as_str().unwrap()).collect();
        assert_eq!(words.len(), 2, "{info:#}");
        assert!(words.iter().all(|words| words.contains("checkpoint refused")), "{words:?}");
    }
}

/// A world without the robot's position cannot continue. The mission fails, and the error says why.
#[test]
fn a_world_without_a_valid_checkpoint_is_given_up() {
    let place = Place::new();
    let running = drive_on(&place);
    damage_and_kill(&place, "world", 2);
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    for words in ["checkpoint refused: expected a state of checksum", "the robot's position is unknown"] {
        assert!(ended.err.contains(words), "{ended}");
    }
    place.assert_nothing_left("disturbed");
}
