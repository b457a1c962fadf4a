//! A running service allocates nothing in a step: the processes count allocations and report them in `health`.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::HEALTH;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Health;
use support::{Place, repository};

/// By then all processes have joined: iceoryx2 allocates while it connects a reader, once each.
const RUNNING_AFTER_STEPS: u64 = 300;
/// rapier allocates and frees within its step, at most 8 times per physics step. Ten of these make a step of the world
/// (`sim/tests/allocations.rs`).
const MOST_A_STEP_OF_THE_WORLD: u64 = 80;

/// What `process` reported about itself while it ran, in order.
fn reports(report: &Value, process: Process) -> Vec<Health> {
    let recording = Recording::open(Path::new(report["recording"].as_str().unwrap())).unwrap();
    let said = recording.channel(HEALTH).unwrap().map(|message| message.unwrap().0);
    said.filter(|health| health.process == process.code() && health.steps >= RUNNING_AFTER_STEPS).collect()
}

/// Steps and allocations between the first and the last report.
fn between(report: &Value, process: Process) -> (u64, u64) {
    let reports = reports(report, process);
    let (first, last) = (reports.first().unwrap(), reports.last().unwrap());
    (last.steps - first.steps, last.step_allocations - first.step_allocations)
}

/// Health is sent once a second by the clock, so the missions in this file run by the clock, too.
fn navigators_allocate_nothing(report: &Value) {
    for process in [Process::Localizer, Process::Planner] {
        let (steps, allocations) = between(report, process);
        assert!(steps >= RUNNING_AFTER_STEPS, "{process}: {steps} steps to judge by");
        assert_eq!(allocations, 0, "{process}, {steps} steps");
    }
}

/// Judging the floor by the map allocates about once a second; only the method `outline` does so.
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
