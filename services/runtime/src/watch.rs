//! Watches a system from outside, for a process that does not belong to the system and must not be ended with it.

use std::fs;

use sketchnav_schemas::codes::Process;

use crate::Result;
use crate::bells::Bells;
use crate::system::System;

/// Shows the progress of a system's processes without joining it.
pub struct Watch {
    bells: Bells,
}

/// State of a process according to the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcessState {
    /// Running, or ready to run if a core were free.
    Running,
    /// Waiting for something.
    Sleeping,
    /// Waiting for a device, uninterruptibly.
    Waiting,
    /// Stopped by a signal.
    Stopped,
    /// Stopped by a debugger.
    Traced,
    /// Ended, or never existed.
    Dead,
}

impl ProcessState {
    /// Returns the state of the process `pid`.
    pub fn of(pid: u32) -> Self {
        match stat_field(pid, 3).as_deref() {
            Some("R") => Self::Running,
            Some("S" | "I") => Self::Sleeping,
            Some("D") => Self::Waiting,
            Some("T") => Self::Stopped,
            Some("t") => Self::Traced,
            _ => Self::Dead,
        }
    }

    /// Returns the state as a word, for people and programs.
    pub fn word(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Sleeping => "sleeping",
            Self::Waiting => "waiting",
            Self::Stopped => "stopped",
            Self::Traced => "traced",
            Self::Dead => "dead",
        }
    }
}

/// Returns a field of proc_pid_stat(5), numbered as on that page. The third field is the first after the program's name, which
/// is in parentheses and may contain anything, including whitespace.
pub(crate) fn stat_field(pid: u32, number: usize) -> Option<String> {
    let stat = fs::read(format!("/proc/{pid}/stat")).ok()?;
    let stat = String::from_utf8_lossy(&stat);
    let (_, rest) = stat.rsplit_once(')')?;
    rest.split_whitespace().nth(number.checked_sub(3)?).map(str::to_owned)
}

impl Watch {
    /// Starts watching.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the system is gone.
    pub fn open(system: &System) -> Result<Self> {
        Ok(Self { bells: Bells::map(&system.bells())? })
    }

    /// Returns the amount of new work that `process` and its predecessors have done. The count continues across restarts.
    pub fn progress(&self, process: Process) -> u32 {
        self.bells.progress(process)
    }
}
