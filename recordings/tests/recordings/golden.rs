//! Recordings of earlier versions stay readable: `golden/story.mcap` holds what this version would
//! write. On purpose: `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-recordings golden`.

use std::path::Path;

use sketchnav_recordings::diff::diff;
use sketchnav_recordings::info::info;
use sketchnav_recordings::reader::Recording;

use super::common;

const STEPS: u64 = 30;

#[test]
fn the_golden_recording_still_says_the_same() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/story.mcap");
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        common::record_story(&golden, STEPS);
    }
    let folder = tempfile::tempdir().unwrap();
    let now = folder.path().join("now.mcap");
    common::record_story(&now, STEPS);
    assert_eq!(diff(&golden, &now).unwrap(), None);
    assert_eq!(common::counts(&golden), common::counts(&now));
    assert_eq!(Recording::open(&golden).unwrap().run().unwrap(), common::run_config());
    let info = info(&golden).unwrap();
    assert!(info.clean_end && info.bytes < 50_000, "{} bytes", info.bytes);
}
