//! The supervisor is killed, its processes end with it, and a new supervisor continues where they stopped.

use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use sketchnav_schemas::channels::STATUS;
use support::{BESIDE_A_DRIVER, Ended, Place, Running, room, send, wait_until};

/// Returns the folder of the only run in the folder `out`.
fn folder(place: &Place, out: &str) -> PathBuf {
    place.files().join(out).join("demo-001")
}

fn undisturbed(place: &Place) -> PathBuf {
    let (report, code) = place.mission("demo --out undisturbed", "undisturbed");
    assert_eq!(code, 0, "{report:#}");
    PathBuf::from(report["recording"].as_str().unwrap())
}

fn drive(place: &Place, options: &str) -> Running {
    let mut running = place.start(&format!("demo --json --out killed --system killed {options}"));
    place.wait_until_driving(&mut running, "killed");
    running
}

/// Kills the supervisor and waits until the processes that it started have ended by themselves.
fn kill(place: &Place, running: Running) {
    running.signal(Signal::SIGKILL);
    assert_eq!(running.end().code, None);
    wait_until("the end of the orphans", || place.living().is_empty());
}

fn resume(place: &Place) -> Running {
    place.start(&format!("run --json --resume {}", folder(place, "killed").display()))
}

fn assert_ends_undisturbed(place: &Place, ended: &Ended, undisturbed: &Path, deaths: u64) {
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left("killed");
    let recording = report["recording"].as_str().unwrap();
    let diff = place.run(&format!("diff {} {recording}", undisturbed.display()));
    assert_eq!(diff.code, Some(0), "{diff}");
    let info = place.run(&format!("info {recording} --json")).json();
    assert_eq!((&info["missing"], &info["clean_end"]), (&0.into(), &true.into()), "{info:#}");
    let resumed = info["faults"].as_array().unwrap().iter().filter(|f| f["kind"] == "system resumed").count();
    assert_eq!(resumed as u64, deaths, "{info:#}");
    // The parts of the recording are joined, and no files are left next to it.
    assert!(std::fs::read_dir(folder(place, "killed")).unwrap().count() <= 12);
}

#[test]
fn a_mission_resumes_after_its_supervisor_was_killed() {
    let place = Place::new();
    let undisturbed = undisturbed(&place);
    let running = drive(&place, "");
    kill(&place, running);
    let ended = resume(&place).end();
    assert_ends_undisturbed(&place, &ended, &undisturbed, 1);
}

/// The supervisor is killed several times, the second time while the recorder is stopped.
#[test]
fn a_mission_may_be_killed_and_resumed_repeatedly() {
    let place = Place::new();
    let undisturbed = undisturbed(&place);
    let mut running = drive(&place, "");
    for round in 0..3 {
        let steps = STATUS.spec.history() + 40;
        let echoed = place.run(&format!("echo status --count {steps} --system killed"));
        assert_eq!(echoed.code, Some(0), "{echoed}");
        if round == 1 {
            place.serving("killed", "recorder").into_iter().for_each(|pid| send(pid, Signal::SIGSTOP));
        }
        kill(&place, running);
        running = resume(&place);
        place.wait_until_driving(&mut running, "killed");
    }
    assert_ends_undisturbed(&place, &running.end(), &undisturbed, 3);
}

/// In real time, no process waits for another. The robot stands still after the last step that the world has made.
#[test]
fn a_mission_resumes_in_real_time_too() {
    let place = Place::new();
    room::write(place.files());
    let mut running = place.start("run room.toml --json --out killed --system killed --speed 1");
    place.wait_until_driving(&mut running, "killed");
    kill(&place, running);
    let folder = place.files().join("killed/room-001");
    let ended = place.start(&format!("run --json --resume {}", folder.display())).end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["success"], true, "{ended}");
    place.assert_nothing_left("killed");
}

/// Regression test: when the supervisor of a real robot was killed and the mission was resumed, all processes were started,
/// including the simulated world, which took over from the robot's driver. Now, a process that was left out before is left out
/// again.
#[test]
fn resuming_does_not_replace_a_robot_by_a_simulated_world() {
    let place = Place::new();
    room::write(place.files());
    let mut running =
        place.start("run room.toml --json --out killed --system killed --speed 1 --without world");
    place.wait_until_joined(&mut running, "killed", &BESIDE_A_DRIVER);
    let driver = place.driver("killed");
    let echoed = place.run("echo status --count 20 --system killed");
    assert_eq!(echoed.out.lines().count(), 20, "{echoed}");
    running.signal(Signal::SIGKILL);
    assert_eq!(running.end().code, None);
    wait_until("the end of the services", || place.living().len() == 1);
    let folder = place.files().join("killed/room-001");
    let mut resumed = place.start(&format!("run --json --resume {}", folder.display()));
    // The driver belongs to a system that no longer exists, so it is asked to end.
    assert_eq!(driver.end().code, Some(0));
    place.wait_until_joined(&mut resumed, "killed", &BESIDE_A_DRIVER);
    assert!(place.serving("killed", "world").is_empty());
    let driver = place.driver("killed");
    let ended = resumed.end();
    assert!(ended.err.contains("waiting for world"), "{ended}");
    // The robot's position in the world is unknown, so its own report of arrival counts.
    assert_eq!(ended.json()["tasks"][0]["state"], "reached", "{ended}");
    assert_eq!(driver.end().code, Some(0));
    place.assert_nothing_left("killed");
}

#[test]
fn a_mission_that_cannot_be_resumed_is_reported() {
    let place = Place::new();
    let running = drive(&place, "--speed 5");
    let early = resume(&place).end();
    assert_eq!(early.code, Some(2), "{early}");
    assert!(early.err.contains("is running already"), "{early}");
    kill(&place, running);
    room::write(place.files());
    assert_eq!(place.mission("run room.toml", "next").1, 0);
    let late = resume(&place).end();
    assert_eq!(late.code, Some(2), "{late}");
    assert!(late.err.contains("found nothing to resume"), "{late}");
    assert!(folder(&place, "killed").exists());
    let nowhere = place.run("run --resume nowhere");
    assert_eq!(nowhere.code, Some(2), "{nowhere}");
}
