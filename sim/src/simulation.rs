//! What a simulation is, whatever it simulates. It advances by instants and says what the robot's sensors read at each. It can
//! be stored between any two instants.
//!
//! A host owns the channels, the numbers and the pace; a simulation knows none of them. It names the channel of a reading and
//! writes the reading where the host wants it: in shared memory, or elsewhere.

use serde::Serialize;
use serde::de::DeserializeOwned;
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::message::{GroundTruth, VelocityCommand};
use sketchnav_schemas::ros2::Ros2;

/// A command older than this stops the robot, nanoseconds of simulation time.
pub const COMMAND_LIMIT_NS: u64 = 500_000_000;

/// A world in which a robot moves and measures. Its whole state is stored and restored with serde; the same state
/// and the same commands give the same bits.
pub trait Simulation: Serialize + DeserializeOwned {
    /// Advances by one instant. A new `command` replaces the previous one; with `None` the robot follows the previous one until
    /// it is too old, and then brakes.
    fn step(&mut self, command: Option<&VelocityCommand>);

    /// Hands out what belongs to the present instant, as often as it is called: the contacts that began or ended, then the
    /// truth, the places of people, the odometry, and the readings of the other sensors since the previous instant, oldest
    /// first.
    ///
    /// # Errors
    /// The first error of `senses`; nothing is handed out after it.
    fn sense<S: Senses>(&self, senses: &mut S) -> Result<(), S::Error>;

    /// Writes where the robot truly is, except for the header.
    fn fill_truth(&self, truth: &mut GroundTruth);

    /// Instants since the start: 0 before the first step.
    fn steps(&self) -> u64;

    /// Time from one instant to the next, nanoseconds.
    fn period_ns(&self) -> u64;

    /// Simulation time of the present instant, nanoseconds since the start.
    fn stamp_ns(&self) -> u64 {
        self.steps() * self.period_ns()
    }
}

/// Takes what a simulation hands out: a host's channels.
pub trait Senses {
    /// What may go wrong.
    type Error;

    /// A reading for `channel`, taken at `stamp_ns`, which is not after the present instant. `fill` writes every field except
    /// the header, wherever the message is to be.
    ///
    /// # Errors
    /// Whatever prevents the host from taking it.
    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Self::Error>;
}
