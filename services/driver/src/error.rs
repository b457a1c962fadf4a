//! Errors of drivers.

use sketchnav_runtime::Error;
use sketchnav_schemas::valid::Invalid;

/// An error of a driver, of one of its readings, or of the system that it tries to join.
#[derive(Debug, thiserror::Error)]
pub enum DriverError {
    /// The system already has a world.
    #[error(
        "system {system:?}: expected one that was started with --without world, found one with a world of its own"
    )]
    HasWorld {
        /// Name of the system.
        system: String,
    },
    /// The system waits for its world in each step, but the robot's clock does not wait.
    #[error(
        "system {system:?}: expected one that runs in real time, as with --speed 1, found one in lockstep, in which only \
         simulators can drive"
    )]
    Lockstep {
        /// Name of the system.
        system: String,
    },
    /// Runs of this kind of navigator do not have this channel, or the world does not write it.
    #[error("{channel}: expected a channel that the world writes: {known}")]
    NoChannel {
        /// Name of the channel.
        channel: &'static str,
        /// The channels that the world writes.
        known: String,
    },
    /// A reading is invalid and was not sent.
    #[error("{channel}: {why}")]
    Invalid {
        /// Name of the channel.
        channel: &'static str,
        /// The field, and what was expected and found there.
        why: Invalid,
    },
    /// A message is not later than the previous one and was not sent.
    #[error("{channel}: expected a time after that of the previous one, {before_ns} ns, found {found_ns} ns")]
    Stamp {
        /// Name of the channel.
        channel: &'static str,
        /// Stamp of the previous message.
        before_ns: u64,
        /// Stamp of this one.
        found_ns: u64,
    },
    /// The number of messages between two ticks exceeds the capacity of a channel. The last one was not sent.
    #[error("{channel}: expected at most {most} between two ticks, found another one; end the instant first")]
    TooMany {
        /// Name of the channel.
        channel: &'static str,
        /// Maximum number between two ticks.
        most: usize,
    },
    /// The mission is over, or the driver was asked to end.
    #[error(
        "{channel}: expected nothing after the end of the mission, which the robot spends standing still"
    )]
    Over {
        /// Name of the channel.
        channel: &'static str,
    },
    /// An error of the runtime.
    #[error(transparent)]
    Runtime(#[from] Error),
}

impl DriverError {
    /// Returns true if the driver cannot join the system because of how the system was started or named.
    pub fn concerns_the_system(&self) -> bool {
        matches!(
            self,
            Self::HasWorld { .. }
                | Self::Lockstep { .. }
                | Self::Runtime(Error::NotRunning { .. } | Error::BadName { .. })
        )
    }
}
