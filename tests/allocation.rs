//! A service allocates nothing per step once it runs: the processes count it and say so in the report.

mod support;

use serde_json::Value;
use support::{Place, repository, room};

/// Once in a mission: buffers find their size, and iceoryx2 connects a reader that comes while the first
/// steps are under way (some 80 allocations each, the recorder among them). One allocation a step would
/// be 2,000 in the long mission.
const TO_BEGIN_WITH: u64 = 400;
/// rapier allocates inside its step and frees it again: at most 8 times a physics step, ten of which
/// make a step of the world (`sim/tests/allocations.rs`).
const MOST_A_STEP_OF_THE_WORLD: u64 = 80;

struct Process {
    steps: u64,
    allocations: u64,
}

fn process(report: &Value, name: &str) -> Process {
    let processes = report["processes"].as_array().unwrap();
    let found = processes.iter().find(|process| process["process"] == name);
    let number = |key: &str| found.unwrap()[key].as_u64().unwrap();
    Process { steps: number("steps"), allocations: number("step_allocations") }
}

fn allocates_no_more_than_it_may(report: &Value, least_steps: u64) {
    for name in ["localizer", "planner"] {
        let service = process(report, name);
        assert!(service.steps >= least_steps, "{name}: {} steps", service.steps);
        assert!(service.allocations <= TO_BEGIN_WITH, "{name}: {} allocations", service.allocations);
    }
    let world = process(report, "world");
    let most = MOST_A_STEP_OF_THE_WORLD * world.steps;
    assert!(world.allocations <= most, "world: {} in {} steps", world.allocations, world.steps);
}

/// A short mission and one of many times its length: the same bound for both.
#[test]
fn the_navigators_allocate_no_more_in_a_longer_mission() {
    let place = Place::new();
    room::write(place.files());
    let (short, _) = place.mission("run room.toml", "short");
    allocates_no_more_than_it_may(&short, 50);
    let (long, _) = place.mission("demo", "long");
    allocates_no_more_than_it_may(&long, 1500);
}

#[test]
fn following_a_drawn_route_allocates_nothing_more() {
    let place = Place::new();
    let mission = repository().join("sim/missions/laboratory/laboratory-route.toml");
    let (report, _) = place.mission(&format!("run {}", mission.display()), "route");
    allocates_no_more_than_it_may(&report, 300);
}
