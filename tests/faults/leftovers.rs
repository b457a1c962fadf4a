//! However a system ends, no process, no file in shared memory and no folder outlives it, and the recording so far is
//! readable.

use std::path::PathBuf;

use nix::sys::signal::Signal;
use support::{Place, Running, room, send, wait_until};

/// Starts a mission in real time that is slow enough not to end before the test has interfered.
fn drive(place: &Place, name: &str) -> Running {
    start(place, name, "--speed 5")
}

fn start(place: &Place, name: &str, options: &str) -> Running {
    let mut running = place.start(&format!("demo --json --out {name} --system {name} {options}"));
    place.wait_until_driving(&mut running, name);
    running
}

/// Returns the recording of the only run in the folder `out`.
fn recording(place: &Place, out: &str) -> PathBuf {
    place.files().join(out).join("demo-001/building-a.mcap")
}

/// Asserts that the recording can be read and contains the beginning of the mission.
fn holds_the_beginning(place: &Place, out: &str) -> serde_json::Value {
    let ended = place.run(&format!("info {} --json", recording(place, out).display()));
    assert_eq!(ended.code, Some(0), "{ended}");
    let info = ended.json();
    assert_eq!(info["run"]["mission"], "building-a", "{info:#}");
    assert!(info["messages"].as_u64().unwrap() > 0, "{info:#}");
    info
}

#[test]
fn after_a_normal_end_nothing_is_left() {
    let place = Place::new();
    room::write(place.files());
    place.mission("run room.toml", "normal");
    place.assert_nothing_left("normal");
}

fn interrupted_by(signal: Signal, options: &str) {
    let place = Place::new();
    let running = start(&place, "stopped", options);
    running.signal(signal);
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.err.contains("interrupted before the mission ended"), "{ended}");
    place.assert_nothing_left("stopped");
    let info = holds_the_beginning(&place, "stopped");
    assert_eq!(info["clean_end"], true, "the recorder closed its file: {info:#}");
    assert_eq!(info["missing"], 0, "{info:#}");
}

#[test]
fn after_ctrl_c_nothing_is_left() {
    interrupted_by(Signal::SIGINT, "--speed 5");
}

#[test]
fn after_ctrl_c_in_lockstep_nothing_is_left() {
    interrupted_by(Signal::SIGINT, "--speed max");
}

#[test]
fn after_a_request_to_end_nothing_is_left() {
    interrupted_by(Signal::SIGTERM, "--speed 5");
}

/// A terminal that is closed sends SIGHUP.
#[test]
fn after_a_hangup_nothing_is_left() {
    interrupted_by(Signal::SIGHUP, "--speed 5");
}

/// A shell sends Ctrl-C to the supervisor, and an impatient user presses it again and again.
#[test]
fn impatience_leaves_nothing() {
    let place = Place::new();
    let running = drive(&place, "stopped");
    for _ in 0..3 {
        running.signal(Signal::SIGINT);
    }
    assert_eq!(running.end().code, Some(3));
    place.assert_nothing_left("stopped");
    holds_the_beginning(&place, "stopped");
}

/// No supervisor is left to shut the system down. The kernel ends the processes with their supervisor, and the next
/// system to start removes everything else.
#[test]
fn after_the_supervisor_was_killed_the_next_system_clears_what_is_left() {
    let place = Place::new();
    let running = drive(&place, "orphan");
    running.signal(Signal::SIGKILL);
    let ended = running.end();
    assert_eq!(ended.code, None, "{ended}");
    wait_until("the end of the orphans", || place.living().is_empty());
    assert_eq!(place.ps(), Vec::<serde_json::Value>::new(), "a dead system is not listed");

    room::write(place.files());
    let (_, code) = place.mission("run room.toml", "next");
    assert_eq!(code, 0);
    place.assert_nothing_left("orphan");
    place.assert_nothing_left("next");
    holds_the_beginning(&place, "orphan");
}

/// The same name is used again, as by a user whose first attempt died.
#[test]
fn after_the_supervisor_was_killed_its_name_is_free_at_once() {
    let place = Place::new();
    let running = drive(&place, "again");
    running.signal(Signal::SIGKILL);
    assert_eq!(running.end().code, None);
    room::write(place.files());
    let (_, code) = place.mission("run room.toml", "again");
    assert_eq!(code, 0);
    place.assert_nothing_left("again");
}

/// A stopped process does not receive the request to end. It used to be killed after a time limit, and a run that had
/// lost nothing ended with an error. Now the process is continued, and ends with the others.
#[test]
fn a_stopped_process_is_ended_with_the_system() {
    let place = Place::new();
    let running = drive(&place, "stuck");
    send(place.pid("stuck", "localizer"), Signal::SIGSTOP);
    running.signal(Signal::SIGINT);
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(!ended.err.contains("were killed"), "{ended}");
    place.assert_nothing_left("stuck");
    holds_the_beginning(&place, "stuck");
}
