//! Problems with processes are reported on a separate channel, and are thus part of the recording.

use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_schemas::channels::STATUS;
use support::{Place, Running, kill_if_alive, repository, room, send, wait_until};

/// Starts a mission that lasts until the test has interfered with it.
fn drive(place: &Place, name: &str, speed: &str) -> Running {
    let mut running = place.start(&format!("demo --json --out {name} --system {name} --speed {speed}"));
    place.wait_until_driving(&mut running, name);
    running
}

/// Returns the faults in the only recording in the folder `out`, in order.
fn faults(place: &Place, out: &str) -> Vec<Value> {
    let recording = place.files().join(out).join("demo-001/building-a.mcap");
    let info = place.run(&format!("info {} --json", recording.display()));
    assert_eq!(info.code, Some(0), "{info}");
    info.json()["faults"].as_array().unwrap().clone()
}

fn kinds<'a>(faults: &'a [Value], process: &str) -> Vec<&'a str> {
    let of_process = faults.iter().filter(|fault| fault["process"] == process);
    of_process.map(|fault| fault["kind"].as_str().unwrap()).collect()
}

#[test]
fn a_death_a_restart_and_a_recovery_are_recorded() {
    let place = Place::new();
    let running = drive(&place, "killed", "max");
    let first = place.serving("killed", "localizer");
    first.iter().copied().for_each(kill_if_alive);
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    let faults = faults(&place, "killed");
    assert_eq!(kinds(&faults, "localizer"), ["died", "restarted", "recovered"], "{faults:?}");
    assert_eq!(faults[0]["pid"], first[0]);
    assert!(faults[0]["words"].as_str().unwrap().contains("SIGKILL"), "{faults:?}");
    assert_eq!((&faults[1]["restarts"], &faults[1]["pid"]), (&1.into(), &faults[2]["pid"]), "{faults:?}");
    assert!(faults[2]["duration_ms"].as_f64().unwrap() > 0.0, "{faults:?}");
}

/// A process stopped by SIGSTOP still exists, so only its silence shows that something is wrong.
#[test]
fn a_stopped_process_is_detected_and_nothing_is_lost() {
    let place = Place::new();
    let mission = repository().join("sim/missions/building/building-a.toml");
    let options = "--signal stop --kills 2 --seed 2 --targets planner,world --json";
    let ended = place.run(&format!("chaos {} {options}", mission.display()));
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert_eq!((&report["kills"], &report["identical"]), (&2.into(), &true.into()), "{report:#}");
    let recording = report["recording"].as_str().unwrap();
    let info = place.run(&format!("info {recording} --json")).json();
    let faults = info["faults"].as_array().unwrap();
    for kind in ["injected", "died", "restarted", "recovered"] {
        let count = faults.iter().filter(|fault| fault["kind"] == kind).count();
        assert_eq!(count, 2, "{kind}: {faults:?}");
    }
    // Each stopped process is reported twice: at its deadline and at its limit.
    assert_eq!(faults.iter().filter(|fault| fault["kind"] == "unresponsive").count(), 4, "{faults:?}");
    assert_eq!(place.living(), []);
}

/// In real time, a person briefly stops a process. This is reported, and the process continues without a restart.
#[test]
fn a_process_that_continues_in_time_is_left_alone() {
    let place = Place::new();
    let running = drive(&place, "pause", "5 --stopped-limit 600");
    let planner = place.serving("pause", "planner");
    planner.iter().for_each(|&pid| send(pid, Signal::SIGSTOP));
    // It is reported as soon as its deadline has passed.
    let echoed = place.run("echo faults --count 1 --system pause");
    planner.iter().for_each(|&pid| send(pid, Signal::SIGCONT));
    assert!(echoed.out.contains("no sign of life"), "{echoed}");
    assert_eq!(echoed.json()["message"]["process"], 4, "{echoed}");
    let steps = STATUS.spec.history() + 30;
    let echoed = place.run(&format!("echo status --count {steps} --system pause"));
    assert_eq!(echoed.code, Some(0), "{echoed}");
    assert_eq!(place.serving("pause", "planner"), planner);
    running.signal(Signal::SIGINT);
    running.end();
    let faults = faults(&place, "pause");
    assert_eq!(kinds(&faults, "planner"), ["unresponsive", "responsive again"], "{faults:?}");
}

/// The recorder is asked to end when its supervisor dies. A stopped recorder did not receive this request and kept running
/// until the next system was started.
#[test]
fn a_stopped_recorder_does_not_outlive_its_supervisor() {
    let place = Place::new();
    let running = drive(&place, "gone", "5");
    place.serving("gone", "recorder").into_iter().for_each(|pid| send(pid, Signal::SIGSTOP));
    running.signal(Signal::SIGKILL);
    running.end();
    wait_until("the end of the recorder", || place.living().is_empty());
    // The next system to start removes the remains.
    room::write(place.files());
    place.mission("run room.toml", "next");
    place.assert_nothing_left("gone");
}

#[test]
fn giving_up_a_process_is_reported() {
    let place = Place::new();
    let running = drive(&place, "end", "5 --stopped-limit 600");
    // Without scans, no planner makes any progress.
    place.serving("end", "world").into_iter().for_each(|pid| send(pid, Signal::SIGSTOP));
    let (sender, receiver) = std::sync::mpsc::channel();
    let waiting = std::thread::spawn(move || sender.send(running.end()));
    let ended = loop {
        place.serving("end", "planner").into_iter().for_each(kill_if_alive);
        if let Ok(ended) = receiver.try_recv() {
            break ended;
        }
    };
    waiting.join().unwrap().unwrap();
    assert_eq!(ended.code, Some(3), "{ended}");
    let faults = faults(&place, "end");
    assert_eq!(kinds(&faults, "planner").last(), Some(&"given up"), "{faults:?}");
    let attempts = faults.iter().filter(|fault| fault["kind"] == "restarted").count();
    assert!(attempts >= 8, "{faults:?}");
}
