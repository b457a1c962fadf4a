//! Any text as a mission file: read or refused, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::sketch_mission::SketchMission;

fuzz_target!(|text: &str| {
    let _ = Mission::parse(text).map(|mission| SketchMission::of(&mission));
});
