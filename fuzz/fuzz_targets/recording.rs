//! Any bytes as a recording: read as far as they are whole, or refused.
#![no_main]

use std::io::Write;

use libfuzzer_sys::fuzz_target;
use sketchnav_recordings::Recording;
use sketchnav_recordings::info::info;

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("writing it");
    let _ = info(file.path());
    let Ok(recording) = Recording::open(file.path()) else { return };
    if let Ok(parts) = recording.parts() {
        // A damaged file says so and ends.
        parts.take_while(Result::is_ok).for_each(drop);
    }
});
