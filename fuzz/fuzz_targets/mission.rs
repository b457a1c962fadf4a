//! Parses arbitrary text as a mission file. If it is valid, the mission is driven for one instant, on a floor that ships with
//! the program and with a small drawing.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::robots;
use sketchnav_sketch::mission::SketchMission;

const DRAWING: &[u8] = br#"{ "canvas": [300, 200],
    "strokes": [ { "points": [[20,20],[280,20],[280,180],[20,180],[20,20]] } ] }"#;

struct Once;

impl Tap for Once {
    fn see(&mut self, _: &'static ChannelSpec, _: &[u8], _: &[u8]) {}
}

impl Onlooker for Once {
    fn has_enough(&self) -> bool {
        true
    }
}

fuzz_target!(|text: &str| {
    let Ok(mut mission) = Mission::parse(text) else { return };
    if SketchMission::of(&mission).is_err() {
        return;
    }
    let floor =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim/missions/laboratory/laboratory.floor.toml");
    (mission.world.floor_plan, mission.world.map) = (floor.to_str().map(str::to_owned), None);
    mission.start.world = [0.9, 6.15];
    let robot = robots::find("robotino").expect("a valid robot").expect("a robot that ships");
    let run = RunConfig::lockstep("fuzz", mission, robot, 1);
    let _ = Rehearsal::by_bytes(&run, DRAWING).and_then(|rehearsal| rehearsal.run(&mut Once));
});
