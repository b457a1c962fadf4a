//! Whatever bytes a file has: it is read in every way, recovered, or refused; nothing panics.

#![no_main]

use std::io::Write;

use libfuzzer_sys::fuzz_target;
use sketchnav_recordings::copy::{Copy, recover};
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, info};

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("room for it");
    let path = file.path();
    let _ = info::info(path);
    let _ = info::info_of_messages(path);
    if let Ok(mut copy) = Copy::new(Vec::new()) {
        let _ = recover(path, &mut copy);
        let _ = copy.finish();
    }
    if let Ok(recording) = Recording::open(path) {
        let _ = recording.run();
        let _ = recording.select(Selection::default()).map(|all| all.filter(Result::is_ok).count());
        let _ = recording.timeline(Selection::default()).map(|all| all.filter(Result::is_ok).count());
    }
});
