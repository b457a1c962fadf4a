//! Any text as a mission file: read or refused, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_schemas::mission::Mission;

fuzz_target!(|text: &str| {
    let _ = Mission::parse(text);
});
