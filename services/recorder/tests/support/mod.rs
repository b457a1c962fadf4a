//! What the tests of the recorder share: a run of a system of its own, and the world's headers.

use std::path::Path;

use sketchnav_schemas::message::Header;
use sketchnav_schemas::run::RunConfig;

/// A run in the system `name`, recorded into `recording`.
pub fn run(name: &str, recording: &Path) -> RunConfig {
    let mut run: RunConfig = serde_json::from_str(include_str!("../run.json")).unwrap();
    run.system = format!("{name}-{}", std::process::id());
    run.recording = Some(recording.to_str().unwrap().to_owned());
    run
}

/// The header of the scan `seq`.
pub fn header(seq: u64) -> Header {
    Header { seq: 0, stamp_ns: seq * 100_000_000, source_seq: seq }
}
