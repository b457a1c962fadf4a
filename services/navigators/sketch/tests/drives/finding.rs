//! Drives in a map where the robot may be anywhere. The estimate is always right here, and only the confidence of the localizer
//! changes.

use sketchnav_schemas::codes::TaskState::{self, Finished, Lost, Reached};
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::message::MissionStatus;

use crate::support::*;

const LOOKING: &str = "looking for where it is in the learned map";
const GOALS: [&[[f64; 2]]; 2] = [&[[10.0, 1.0]], &[[2.0, 4.5]]];

fn drive() -> Drive {
    let walls =
        vec![[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 6.0], [12.0, 6.0, 0.0, 6.0], [0.0, 6.0, 0.0, 0.0]];
    let scene = Scene::faithful(walls, [12.0, 6.0], [2.0, 1.0, 2.0]);
    Drive::with(scene, config(ROBOTINO, "by_outline = false\nfinds_itself = true"), &GOALS, 300.0)
}

fn is_state(status: &MissionStatus, state: TaskState) -> bool {
    status.state == state.code()
}

#[test]
fn a_robot_that_finds_its_place_drives_to_its_goals() {
    let mut drive = drive();
    drive.tracking = Tracking::Doubtful;
    let status = drive.until("looking", |status| status.reason.as_str() == LOOKING);
    assert!(is_state(&status, TaskState::Driving), "{status:?}");
    drive.tracking = Tracking::Tracking;
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Reached, Reached, Finished], "{:?}", outcome.ends);
}

/// Each task begins a new search. The second one once began with the five looks of the first, and ended immediately.
#[test]
fn a_search_that_failed_is_not_held_against_the_next_task() {
    let mut drive = drive();
    drive.tracking = Tracking::Doubtful;
    let outcome = drive.run(600.0);
    assert_eq!(outcome.states(), [Lost, Lost, Finished], "{:?}", outcome.ends);
    let reason = "several places look alike after looking around 5 times";
    assert!(outcome.ends[..2].iter().all(|(_, words)| words == reason), "{:?}", outcome.ends);
    assert!(outcome.seconds > 100.0, "{}", outcome.seconds);
}

/// The robot is carried away, so its scans no longer fit its estimate.
#[test]
fn a_robot_that_loses_its_place_on_the_way_stops_to_look_for_it() {
    let mut drive = drive();
    drive.until("on its way", |status| {
        status.reason.as_str().is_empty() && is_state(status, TaskState::Driving)
    });
    drive.tracking = Tracking::Lost;
    drive.until("looking", |status| status.reason.as_str() == LOOKING);
    let before = drive.place();
    drive.until("looking for long", |status| status.header.stamp_ns % 5_000_000_000 == 0);
    let [dx, dy] = [0, 1].map(|axis| drive.place()[axis] - before[axis]);
    assert!(dx.hypot(dy) < 0.3, "{dx}, {dy}");
    drive.tracking = Tracking::Tracking;
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Reached, Reached, Finished], "{:?}", outcome.ends);
}
