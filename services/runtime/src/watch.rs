//! A look at a system from outside, by who is no part of it and must not be ended with it.

use sketchnav_schemas::codes::Process;

use crate::Result;
use crate::bells::Bells;
use crate::system::System;

/// Sees how a system's processes get on, without joining it.
pub struct Watch {
    bells: Bells,
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
