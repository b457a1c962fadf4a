//! Any mission either drives for an instant or is rejected, and nothing panics. `fuzz/` has the same check as a fuzz target.

use std::path::Path;

use proptest::prelude::*;
use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::robots;

const DRAWING: &[u8] = br#"{ "canvas": [300, 200],
    "strokes": [ { "points": [[20,20],[280,20],[280,180],[20,180],[20,20]] } ] }"#;
const MISSION: &str = r#"
name = "any"
robot = "robotino"
[world]
floor_plan = "floor"
[[world.furniture]]
center = [6.0, 1.0]
size = [0.5, 0.4]
yaw_deg = 0.0
[[world.person]]
waypoints = [[2.0, 1.0], [7.0, 1.0]]
speed_mps = 0.7
radius_m = 0.2
pause_s = 1.0
[start]
world = [0.9, 6.15]
world_heading_deg = 0.0
[navigator]
kind = "sketch"
drawing = "d.json"
start = [50, 50]
start_heading_deg = 0
[[task]]
name = "there"
goal = [250, 150]
time_limit_s = 60.0
there = { center = [1.0, 1.0], radius_m = 1.0 }
"#;

/// Ends a mission after its first instant.
struct Once;

impl Tap for Once {
    fn see(&mut self, _: &'static ChannelSpec, _: &[u8], _: &[u8]) {}
}

impl Onlooker for Once {
    fn has_enough(&self) -> bool {
        true
    }
}

/// Drives a mission for an instant. Returns false if the mission is rejected.
fn drives(text: &str) -> bool {
    let Ok(mut mission) = Mission::parse(text) else { return false };
    let floor =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/laboratory/laboratory.floor.toml");
    (mission.world.floor_plan, mission.world.map) = (floor.to_str().map(str::to_owned), None);
    let Ok(Some(robot)) = robots::find(&mission.robot) else { return false };
    let run = RunConfig::lockstep("any", mission, robot, 1);
    Rehearsal::by_bytes(&run, DRAWING).and_then(|rehearsal| rehearsal.run(&mut Once)).is_ok()
}

#[test]
fn the_unchanged_mission_is_driven() {
    assert!(drives(MISSION));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mission_with_any_numbers_is_driven_or_refused(
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![
            Just("0"), Just("-1"), Just("1e-30"), Just("1e-3"), Just("359.9"), Just("9999"), Just("1e6"), Just("1e39"),
            Just("1e300"), Just("nan"), Just("inf"),
        ]), 1..3),
    ) {
        let is_digit = |c: char| c.is_ascii_digit() || c == '.';
        let mut text = MISSION.to_owned();
        for (which, number) in &changes {
            let begins = |(at, c): (usize, char)| {
                (is_digit(c) && !text[..at].ends_with(is_digit) && text[..at].ends_with([' ', '['])).then_some(at)
            };
            let starts: Vec<_> = text.char_indices().filter_map(begins).collect();
            let start = starts[which.index(starts.len())];
            let end = text[start..].find(|c| !is_digit(c)).map_or(text.len(), |length| start + length);
            text.replace_range(start..end, number);
        }
        drives(&text);
    }
}
