//! Reads arbitrary text that follows the head of a strokes file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_sketch::reading::Options;

fuzz_target!(|text: &str| {
    let strokes = format!("{{\"canvas\": [64, 48], \"strokes\": {text}");
    let _ = sketchnav_sketch::reading::read(strokes.as_bytes(), "fuzz", &Options::default());
});
