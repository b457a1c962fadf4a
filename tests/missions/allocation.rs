//! A running service does not allocate in a step. The processes count their allocations and report them in `health`.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::HEALTH;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Health;
use support::{Place, repository};

/// Number of steps after which all processes have joined. iceoryx2 allocates once each time it connects a reader.
const RUNNING_AFTER_STEPS: u64 = 300;
/// Maximum number of allocations in a step of the world. rapier allocates and frees within its own step, at most 8
/// times per physics step, and ten physics steps make a step of the world (`sim/tests/allocations.rs`).
const MOST_A_STEP_OF_THE_WORLD: u64 = 80;

/// Returns the reports that `process` sent while it was running, in order.
fn reports(report: &Value, process: Process) -> Vec<Health> {
    let recording = Recording::open(Path::new(report["recording"].as_str().unwrap())).unwrap();
    let said = recording.channel(HEALTH).unwrap().map(|message| message.unwrap().0);
    said.filter(|health| health.process == process.code() && health.steps >= RUNNING_AFTER_STEPS).collect()
}

/// Returns the numbers of steps and allocations between the first and the last report.
fn between(report: &Value, process: Process) -> (u64, u64) {
    let reports = reports(report, process);
    let (first, last) = (reports.first().unwrap(), reports.last().unwrap());
    (last.steps - first.steps, last.step_allocations - first.step_allocations)
}

/// Asserts that the localizer and the planner do not allocate. Health is sent once a second by the clock, so the
/// missions in this file run in real time.
fn navigators_allocate_nothing(report: &Value) {
    for process in [Process::Localizer, Process::Planner] {
        let (steps, allocations) = between(report, process);
        assert!(steps >= RUNNING_AFTER_STEPS, "{process}: {steps} steps to judge by");
        assert_eq!(allocations, 0, "{process}, {steps} steps");
    }
}

/// This mission uses the method `beam`, because `outline` allocates about once a second when it judges the floor by the
/// map.
#[test]
fn a_running_navigator_allocates_nothing_and_the_world_no_more_than_rapier_does() {
    let place = Place::with_missions("building", "building-a.toml");
    let path = place.files().join("mission.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(path, text.replace("kind = \"sketch\"", "kind = \"sketch\"\nmethod = \"beam\"")).unwrap();
    let (report, _) = place.mission("run mission.toml --speed 40", "counted");
    navigators_allocate_nothing(&report);
    let (steps, allocations) = between(&report, Process::World);
    assert!(allocations <= MOST_A_STEP_OF_THE_WORLD * steps, "world: {allocations} in {steps} steps");
}

#[test]
fn following_a_drawn_route_allocates_nothing_either() {
    let place = Place::new();
    let mission = repository().join("sim/missions/laboratory/laboratory-route.toml");
    let (report, _) = place.mission(&format!("run {} --speed 25", mission.display()), "route");
    navigators_allocate_nothing(&report);
}
