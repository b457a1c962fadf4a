//! Errors of a running system.

use std::fmt::{Display, Formatter};
use std::process::ExitStatus;

use nix::sys::signal::Signal;
use sketchnav_schemas::codes::Process;
use std::os::unix::process::ExitStatusExt;

/// Exit code of a process that received bad input.
const BAD_INPUT: i32 = 2;
/// Exit code of a recorder whose recording is incomplete because its files could not be
/// written, and of a run with such a recording.
pub const INCOMPLETE: u8 = 4;

/// Errors of a running system.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system could not be created or joined.
    #[error(transparent)]
    Runtime(#[from] sketchnav_runtime::Error),
    /// The limit on file sizes is too low for the files of the channels.
    #[error(
        "expected a limit on the size of files of {needed_mib} MiB or more for the channels, found {found_mib} MiB: \
         ulimit -f unlimited"
    )]
    FileLimit {
        /// Size of the largest channel's file, in MiB.
        needed_mib: u64,
        /// Limit of this process, in MiB.
        found_mib: u64,
    },
    /// A process could not be started.
    #[error("{process}: starting {program:?}: {source}")]
    Spawn {
        /// The process.
        process: Process,
        /// Path of the program.
        program: String,
        /// Why it could not be started.
        source: std::io::Error,
    },
    /// A process could not be waited for.
    #[error("{process}: waiting for its end: {source}")]
    Wait {
        /// The process.
        process: Process,
        /// Why waiting failed.
        source: std::io::Error,
    },
    /// A process died before the mission ended, or failed when it ended.
    #[error("{0}")]
    Died(Death),
    /// A process died after each restart without making progress in between.
    #[error("{0}\nit was restarted {1} times and died each time before it made progress: given up")]
    GivenUp(Death, u64),
    /// The processes of a lockstep no longer make progress.
    #[error(
        "the mission is stuck: every process has waited for another one for {seconds} s; the last answered tick \
         is {tick}{rejected}"
    )]
    Stalled {
        /// Time without progress, in seconds.
        seconds: u64,
        /// Tick of the last status.
        tick: u64,
        /// Describes which processes have rejected messages.
        rejected: String,
    },
    /// Processes had to be killed because they did not end when asked to.
    #[error("did not end within their time and were killed: {}", .0.iter().map(|p| p.word()).collect::<Vec<_>>().join(", "))]
    Killed(Vec<Process>),
}

impl Error {
    /// Returns true if a process received bad input (exit code 2), which the user can correct.
    pub fn is_bad_input(&self) -> bool {
        matches!(self, Self::Died(death) if is_bad_input(death.status))
    }
}

/// Returns true if a process with the given status received bad input, which would make it fail again.
pub(crate) fn is_bad_input(status: ExitStatus) -> bool {
    status.code() == Some(BAD_INPUT)
}

/// Returns true if a recorder with the given status has written as much as it could.
pub(crate) fn is_incomplete(status: ExitStatus) -> bool {
    status.code() == Some(INCOMPLETE.into())
}

/// The death of a process.
#[derive(Debug, Clone)]
pub struct Death {
    /// The process that died.
    pub process: Process,
    /// Process id of the process.
    pub pid: u32,
    /// How the process ended.
    pub status: ExitStatus,
    /// Whether the supervisor killed the process because it showed no signs of life.
    pub hung: bool,
    /// The last lines of the process's output.
    pub last_lines: String,
}

impl Death {
    /// Describes the process and its death in one line.
    pub fn how(&self) -> String {
        let Self { process, pid, .. } = self;
        match (self.status.code(), self.status.signal()) {
            (Some(0), _) => format!("{process} (process {pid}) ended before the mission"),
            (Some(code), _) => format!("{process} (process {pid}) ended with exit code {code}"),
            (None, signal) => {
                let signal = signal.unwrap_or_default();
                let name = Signal::try_from(signal).map_or("unknown", Signal::as_str);
                let why = if self.hung { ", because it gave no sign of life for too long" } else { "" };
                format!("{process} (process {pid}) was killed by signal {signal} ({name}){why}")
            }
        }
    }
}

impl Display for Death {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.how())?;
        if self.last_lines.is_empty() {
            return f.write_str("; it printed nothing");
        }
        write!(f, "; its last words:\n{}", self.last_lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: the error only mentioned a SIGKILL, so a user went looking for its sender.
    #[test]
    fn a_process_killed_as_unresponsive_is_reported_as_such() {
        let (process, status) = (Process::Planner, ExitStatus::from_raw(9));
        let death = |hung| Death { process, pid: 7, status, hung, last_lines: String::new() };
        assert_eq!(death(false).how(), "planner (process 7) was killed by signal 9 (SIGKILL)");
        assert!(death(true).how().ends_with("(SIGKILL), because it gave no sign of life for too long"));
    }
}
