//! What went wrong with the processes of a run, what recovered, and the orders given by tools. Only those messages are read.

use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::FAULTS;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::Fault;
use sketchnav_schemas::time::seconds;

use crate::error::RecordingError;
use crate::reader::Recording;

/// Something that went wrong with a process or recovered, or an order given by a tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultInfo {
    /// Simulation time of the mission's last status at that moment.
    pub stamp_s: f64,
    /// A word of [`FaultKind`].
    pub kind: &'static str,
    /// A word of [`Process`].
    pub process: &'static str,
    /// Its process id.
    pub pid: u32,
    /// How often it has been restarted so far, if that is known.
    pub restarts: u32,
    /// Messages that are missing because of it.
    pub missing: u32,
    /// Wall-clock duration of a pause, a silence or a recovery; 0 if none applies.
    pub duration_ms: f64,
    /// Further details, in words.
    pub words: String,
}

impl FaultInfo {
    /// The content of a message on the channel `faults`.
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

/// The faults of the recording at `path`, in order; empty for one from before that channel existed.
///
/// # Errors
/// [`RecordingError::File`], or [`RecordingError::Damaged`].
pub fn faults(path: &Path) -> Result<Vec<FaultInfo>, RecordingError> {
    Ok(Recording::open(path)?.all(FAULTS)?.iter().map(FaultInfo::new).collect())
}
