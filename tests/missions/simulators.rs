//! Third-party simulators in place of the world: `examples/irsim_driver.py` and `examples/mujoco_driver.py` drive missions.
//!
//! Each needs a Python with the wheel of this checkout and the simulator. `SKETCHNAV_WHEEL_PYTHON` names it; without it, the tests
//! are skipped.

use std::path::PathBuf;
use std::process::Command;

use support::{BESIDE_A_DRIVER, Place, Running, building, repository, room};

/// The Python that has the simulator and this checkout's package, if there is one.
fn python_with(simulator: &str) -> Option<PathBuf> {
    needs::python(simulator, "SKETCHNAV_WHEEL_PYTHON", &format!("{simulator}, sketchnav._core"))
}

/// Drives a mission in a simulator by its example driver. Every task must be reached according to the simulator's truth.
fn drive(simulator: &str, prepare: impl FnOnce(&Place) -> &'static str) {
    let Some(python) = python_with(simulator) else { return };
    let place = Place::new();
    let mission = prepare(&place);
    let mut running = place.start(&format!("run {mission} --system theirs --json --without world"));
    place.wait_until_joined(&mut running, "theirs", &BESIDE_A_DRIVER);
    let mut command = Command::new(python);
    command.arg(repository().join(format!("examples/{simulator}_driver.py"))).arg("theirs");
    place.settle(&mut command);
    let driver = Running::spawn(command);
    let report = running.end().json();
    let ended = driver.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!((&report["success"], &report["lost_messages"]), (&true.into(), &0.into()), "{report:#}");
    let tasks = report["tasks"].as_array().unwrap();
    let is_judged = |task: &serde_json::Value| task["reached"] == true && task["final_error_m"].is_number();
    assert!(!tasks.is_empty() && tasks.iter().all(is_judged), "{report:#}");
    place.assert_nothing_left("theirs");
}

/// An omnidirectional robot in the building of the demo, to the first two goals.
fn demo(place: &Place) -> &'static str {
    building::write(&place.files().join("demo.toml"), |mission| {
        mission["task"].as_array_mut().unwrap().truncate(2);
    });
    "demo.toml"
}

/// A differential robot in two rooms.
fn two_rooms(place: &Place) -> &'static str {
    room::write(place.files());
    let text = std::fs::read_to_string(place.files().join(room::MISSION)).unwrap();
    let text = text.replace("robotino", "turtlebot3").replace("time_limit_s = 60", "time_limit_s = 120");
    std::fs::write(place.files().join("small.toml"), text).unwrap();
    "small.toml"
}

#[test]
fn irsim_drives_the_demo() {
    drive("irsim", demo);
}

#[test]
fn irsim_drives_a_differential_robot() {
    drive("irsim", two_rooms);
}

#[test]
fn mujoco_drives_the_demo() {
    drive("mujoco", demo);
}

#[test]
fn mujoco_drives_a_differential_robot() {
    drive("mujoco", two_rooms);
}

/// In a suite, the simulator only replaces the world: the drawing, the processes and the judge are those of every trial.
#[test]
fn a_suite_is_driven_in_a_simulator() {
    let Some(python) = python_with("mujoco") else { return };
    let place = Place::new();
    let ended = place.run(&format!(
        "eval deformed --only building/0/1/1 --world mujoco --python {} --project {} --json",
        python.display(),
        repository().display()
    ));
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert_eq!(report["suite"], "deformed@mujoco", "{report:#}");
    let outcomes = report["outcomes"].as_array().unwrap();
    let is_driven = |task: &serde_json::Value| {
        task["kind"] == "reached"
            && task["path_m"].as_f64() > Some(1.0)
            && task["cost"]["busy_s"].as_f64() > Some(0.0)
    };
    assert!(!outcomes.is_empty() && outcomes.iter().all(is_driven), "{report:#}");
}
