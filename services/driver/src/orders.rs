//! Receives the commands for a driver, and determines which one applies and whether it is too old.

use std::time::{Duration, Instant};

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::COMMAND;
use sketchnav_schemas::message::{Twist, VelocityCommand};

use crate::error::DriverError;

/// The velocity of a robot at rest.
pub const STANDSTILL: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };
/// Time for which a command is in force after its tick.
const LIMIT: Duration = Duration::from_millis(500);
/// Number of ticks whose times are kept, at least as many as there are in [`LIMIT`] at a thousand per second.
const KEPT: usize = 512;

/// The commands, and the times of the ticks that they respond to.
pub struct Orders {
    commands: Reader<VelocityCommand>,
    /// The last tick of an earlier driver. Responses to it, and to earlier ticks, are obsolete.
    ticks_before: u64,
    newest: Option<VelocityCommand>,
    /// When the last ticks were sent. The time of tick n is at index n modulo the length.
    sent: Vec<(u64, Instant)>,
}

impl Orders {
    pub fn open(node: &Node, ticks_before: u64) -> Result<Self, DriverError> {
        let nothing = (0, Instant::now());
        let commands = node.reader(COMMAND)?;
        Ok(Self { commands, ticks_before, newest: None, sent: vec![nothing; KEPT] })
    }

    /// Records that a tick was sent.
    pub fn ticked(&mut self, tick: u64) {
        self.sent[tick as usize % KEPT] = (tick, Instant::now());
    }

    /// Receives the commands that have arrived.
    pub fn receive(&mut self) -> Result<(), DriverError> {
        while let Some(command) = self.commands.receive_valid()? {
            if command.header.source_seq > self.ticks_before {
                self.newest = Some(*command);
            }
        }
        Ok(())
    }

    /// Returns the number of the tick that the latest command responds to, or 0 before the first one.
    pub fn answered(&self) -> u64 {
        self.newest.map_or(0, |command| command.header.source_seq)
    }

    /// Returns true if the latest command is the last one of the mission.
    pub fn is_last(&self) -> bool {
        self.newest.is_some_and(|command| command.last == 1)
    }

    /// Returns the latest velocity regardless of its age, or a standstill if there is none.
    pub fn newest(&self) -> Twist {
        self.newest.map_or(STANDSTILL, |command| command.twist)
    }

    /// Returns the latest velocity, or a standstill if its tick was more than half a second before this mission time, in
    /// nanoseconds.
    pub fn in_force_at(&self, now_ns: u64) -> Twist {
        let age_ns = |command: &VelocityCommand| now_ns.saturating_sub(command.header.stamp_ns);
        let fresh = self.newest.filter(|command| Duration::from_nanos(age_ns(command)) <= LIMIT);
        fresh.map_or(STANDSTILL, |command| command.twist)
    }

    /// Returns the latest velocity, or a standstill if its tick was sent more than half a second ago.
    pub fn in_force(&self) -> Twist {
        let fresh = self.newest.filter(|command| {
            let tick = command.header.source_seq;
            let (kept, sent) = self.sent[tick as usize % KEPT];
            kept == tick && sent.elapsed() <= LIMIT
        });
        fresh.map_or(STANDSTILL, |command| command.twist)
    }

    /// Returns the number of missing commands, according to their sequence numbers.
    pub fn lost(&self) -> u64 {
        self.commands.lost()
    }
}
