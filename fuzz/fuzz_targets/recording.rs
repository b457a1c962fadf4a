//! Opens arbitrary bytes as a recording, reads its intact parts in every possible way, and recovers it.
#![no_main]

use std::io::Write;

use libfuzzer_sys::fuzz_target;
use sketchnav_recordings::Recording;
use sketchnav_recordings::copy::{Copy, Damaged, recover};
use sketchnav_recordings::info::{info, info_of_messages};
use sketchnav_recordings::reader::Selection;

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("writing it");
    let _ = info(file.path());
    let _ = info_of_messages(file.path());
    if let Ok(mut copy) = Copy::new(Vec::new()) {
        let _ = recover(file.path(), Damaged::Keep, &mut copy);
        let _ = copy.finish();
    }
    let Ok(recording) = Recording::open(file.path()) else { return };
    if let Ok(parts) = recording.parts() {
        // The parts of a damaged file end with an error.
        parts.take_while(Result::is_ok).for_each(drop);
    }
    let _ = recording.run();
    let _ = recording.select(Selection::default()).map(|all| all.filter(Result::is_ok).count());
    let _ = recording.timeline(Selection::default()).map(|all| all.filter(Result::is_ok).count());
});
