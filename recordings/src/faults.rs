//! What went wrong with the processes of a run, what went right again, and the orders of tools. Reads those messages
//! alone.

use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::FAULTS;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::Fault;
use sketchnav_schemas::time::seconds;

use crate::error::RecordingError;
use crate::reader::Recording;

/// Something that went wrong with a process or right again, or an order of a tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultInfo {
    /// Simulation time of the mission's last status by then.
    pub stamp_s: f64,
    /// A word of [`FaultKind`].
    pub kind: &'static str,
    /// A word of [`Process`].
    pub process: &'static str,
    /// Its process id.
    pub pid: u32,
    /// How often it was started again so far, if that is known.
    pub restarts: u32,
    /// Messages that are missing because of it.
    pub missing: u32,
    /// Wall-clock time: a pause, a silence, how long a recovery took; 0 if none is meant.
    pub duration_ms: f64,
    /// What there is to say.
    pub words: String,
}

impl FaultInfo {
    /// What a message of the channel `faults` says.
    pub fn new(fault: &Fault) -> Self {
        Self {
            stamp_s: seconds(fault.header.stamp_ns),
            kind: FaultKind::from_code(fault.kind).map_or("unknown", FaultKind::word),
            process: Process::from_code(fault.process).map_or("unknown", Process::word),
            pid: fault.pid,
            restarts: fault.restarts,
            missing: fault.missing,
            duration_ms: fault.duration_ns as f64 / 1e6,
            words: fault.words.as_str().to_owned(),
        }
    }
}

/// The faults of the recording at `path`, in order; none in one from before there was such a channel.
///
/// # Errors
/// [`RecordingError::File`], or [`RecordingError::Damaged`].
pub fn faults(path: &Path) -> Result<Vec<FaultInfo>, RecordingError> {
    Ok(Recording::open(path)?.all(FAULTS)?.iter().map(FaultInfo::new).collect())
}
