//! A look at a system from outside, by who is no part of it and must not be ended with it.

use std::fs;

use sketchnav_schemas::codes::Process;

use crate::Result;
use crate::bells::Bells;
use crate::system::System;

/// Sees how a system's processes get on, without joining it.
pub struct Watch {
    bells: Bells,
}

/// What the kernel says of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcessState {
    /// It computes, or would if there were a core for it.
    Running,
    /// It waits for something.
    Sleeping,
    /// It waits for a device and cannot be disturbed.
    Waiting,
    /// A signal has stopped it.
    Stopped,
    /// A debugger holds it.
    Traced,
    /// It has ended, or there never was one.
    Dead,
}

impl ProcessState {
    /// The state of the process `pid`.
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

    /// The word for people and programs.
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

/// A field of proc_pid_stat(5), counted as there; the third is the first behind the program's name, which is in brackets and
/// may hold anything, whitespace too.
pub(crate) fn stat_field(pid: u32, number: usize) -> Option<String> {
    let stat = fs::read(format!("/proc/{pid}/stat")).ok()?;
    let stat = String::from_utf8_lossy(&stat);
    let (_, rest) = stat.rsplit_once(')')?;
    rest.split_whitespace().nth(number.checked_sub(3)?).map(str::to_owned)
}

impl Watch {
    /// Begins to watch.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) where the system has gone.
    pub fn open(system: &System) -> Result<Self> {
        Ok(Self { bells: Bells::map(&system.bells())? })
    }

    /// How much `process` and those before it have done; counts on over restarts.
    pub fn progress(&self, process: Process) -> u32 {
        self.bells.progress(process)
    }
}
