//! Reads arbitrary bytes as a drawing, in whatever format they claim to be.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_sketch::reading::Options;

fuzz_target!(|bytes: &[u8]| {
    let _ = sketchnav_sketch::reading::read(bytes, "fuzz", &Options::default());
});
