//! The interface of all simulations. A simulation advances by instants and yields the readings of the robot's
//! sensors at each. Its state can be stored between any two instants.
//!
//! A host owns the channels, numbers the messages and sets the pace. A simulation does not depend on any of this. It names the
//! channel of a reading and writes the reading to wherever the host wants it, in shared memory or elsewhere.

use serde::Serialize;
use serde::de::DeserializeOwned;
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::message::{GroundTruth, VelocityCommand};
use sketchnav_schemas::ros2::Ros2;

/// Age of a command, in nanoseconds of simulation time, above which the robot ignores it and stops.
pub const COMMAND_LIMIT_NS: u64 = 500_000_000;

/// A world where a robot moves and takes measurements. Its whole state can be stored and restored with serde. The same state and
/// the same commands give bit-identical results.
pub trait Simulation: Serialize + DeserializeOwned {
    /// Advances by one instant. A new `command` replaces the previous one. With `None`, the robot keeps following the previous
    /// command until that is too old, and then brakes.
    fn step(&mut self, command: Option<&VelocityCommand>);

    /// Delivers everything that belongs to the current instant: the contacts that began or ended, then the
    /// truth, the positions of people, the odometry, and the readings of the other sensors since the previous
    /// instant, oldest first. Repeated calls deliver the same.
    ///
    /// # Errors
    /// The first error of `senses`, after which nothing more is delivered.
    fn sense<S: Senses>(&self, senses: &mut S) -> Result<(), S::Error>;

    /// Fills in the true pose of the robot, except for the header.
    fn fill_truth(&self, truth: &mut GroundTruth);

    /// Returns the number of instants since the start, which is 0 before the first step.
    fn steps(&self) -> u64;

    /// Returns the time between two instants, in nanoseconds.
    fn period_ns(&self) -> u64;

    /// Returns the simulation time of the current instant, in nanoseconds since the start.
    fn stamp_ns(&self) -> u64 {
        self.steps() * self.period_ns()
    }
}

/// Receives the readings of a simulation, for example into a host's channels.
pub trait Senses {
    /// Error of a reading.
    type Error;

    /// Receives a reading for `channel`. It was taken at `stamp_ns`, which is not after the current instant.
    /// `fill` fills in every field except the header, wherever the message is located.
    ///
    /// # Errors
    /// Any error that prevents the host from receiving the reading.
    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Self::Error>;
}
