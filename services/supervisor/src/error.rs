//! What may go wrong while a system runs.

use std::fmt::{Display, Formatter};
use std::process::ExitStatus;

use nix::sys::signal::Signal;
use sketchnav_schemas::codes::Process;
use std::os::unix::process::ExitStatusExt;

/// Exit code of a process that was given bad input.
const BAD_INPUT: i32 = 2;
/// Exit code of a recorder whose recording is incomplete because its files could not be written, and of a run that has
/// such a recording.
pub const INCOMPLETE: u8 = 4;

/// What may go wrong while a system runs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system could not be made or joined.
    #[error(transparent)]
    Runtime(#[from] sketchnav_runtime::Error),
    /// No process could make the files of its channels.
    #[error(
        "expected a limit on the size of files of {needed_mib} MiB or more for the channels, found {found_mib} MiB: \
         ulimit -f unlimited"
    )]
    FileLimit {
        /// What the largest channels take.
        needed_mib: u64,
        /// The limit of this process.
        found_mib: u64,
    },
    /// A process could not be started.
    #[error("{process}: starting {program:?}: {source}")]
    Spawn {
        /// Which.
        process: Process,
        /// The program.
        program: String,
        /// Why not.
        source: std::io::Error,
    },
    /// A process could not be waited for.
    #[error("{process}: waiting for its end: {source}")]
    Wait {
        /// Which.
        process: Process,
        /// Why not.
        source: std::io::Error,
    },
    /// A process died before the mission's end, or failed at it.
    #[error("{0}")]
    Died(Death),
    /// A process died as often as it was started again, and got nowhere in between.
    #[error("{0}\nit was started again {1} times and died each time before it made progress: given up")]
    GivenUp(Death, u64),
    /// Nothing more happens in a lockstep.
    #[error(
        "the mission is stuck: every process has waited for another one for {seconds} s; the last answered tick \
         is {tick}{rejected}"
    )]
    Stalled {
        /// For how long.
        seconds: u64,
        /// The tick of the last status.
        tick: u64,
        /// Who has rejected messages, in words.
        rejected: String,
    },
    /// Processes had to be killed because they did not end when asked to.
    #[error("did not end within their time and were killed: {}", .0.iter().map(|p| p.word()).collect::<Vec<_>>().join(", "))]
    Killed(Vec<Process>),
}

impl Error {
    /// Whether a process was given bad input (its exit code is 2), which the user can mend.
    pub fn is_bad_input(&self) -> bool {
        matches!(self, Self::Died(death) if is_bad_input(death.status))
    }
}

/// Whether a process that ended so was given bad input: then it dies of it again.
pub(crate) fn is_bad_input(status: ExitStatus) -> bool {
    status.code() == Some(BAD_INPUT)
}

/// Whether a recorder that ended so has written what it could.
pub(crate) fn is_incomplete(status: ExitStatus) -> bool {
    status.code() == Some(INCOMPLETE.into())
}

/// How a process died.
#[derive(Debug, Clone)]
pub struct Death {
    /// Which.
    pub process: Process,
    /// Its process id.
    pub pid: u32,
    /// How it ended.
    pub status: ExitStatus,
    /// Whether the supervisor ended it, because it gave no sign of life.
    pub hung: bool,
    /// The last lines that it printed.
    pub last_lines: String,
}

impl Death {
    /// Who died how, in a line.
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

    /// The person saw a SIGKILL, and looked for whoever had sent it.
    #[test]
    fn a_process_that_was_ended_for_its_silence_is_named_with_that_reason() {
        let (process, status) = (Process::Planner, ExitStatus::from_raw(9));
        let death = |hung| Death { process, pid: 7, status, hung, last_lines: String::new() };
        assert_eq!(death(false).how(), "planner (process 7) was killed by signal 9 (SIGKILL)");
        assert!(death(true).how().ends_with("(SIGKILL), because it gave no sign of life for too long"));
    }
}
