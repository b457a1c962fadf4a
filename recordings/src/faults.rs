//! Lists what went wrong with the processes of a run, what recovered, and the orders given by tools. Only the messages of the
//! channel `faults` are read.

use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::FAULTS;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::Fault;
use sketchnav_schemas::time::seconds;

use crate::error::RecordingError;
use crate::reader::Recording;

/// A failure or recovery of a process, or an order given by a tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultInfo {
    /// Simulation time of the last status of the mission at that time, in seconds.
    pub stamp_s: f64,
    /// Word of the [`FaultKind`].
    pub kind: &'static str,
    /// Word of the [`Process`].
    pub process: &'static str,
    /// Process id.
    pub pid: u32,
    /// Number of restarts of the process so far, if that is known.
    pub restarts: u32,
    /// Number of messages that are missing because of the fault.
    pub missing: u32,
    /// Wall-clock duration of a pause, a silence or a recovery, in milliseconds. 0 if not applicable.
    pub duration_ms: f64,
    /// Further details, in words.
    pub words: String,
}

impl FaultInfo {
    /// Converts a message of the channel `faults`.
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

/// Returns the faults of the recording at `path`, in order. Empty for a recording from before that channel existed.
///
/// # Errors
/// [`RecordingError::File`], or [`RecordingError::Damaged`].
pub fn faults(path: &Path) -> Result<Vec<FaultInfo>, RecordingError> {
    Ok(Recording::open(path)?.all(FAULTS)?.iter().map(FaultInfo::new).collect())
}
