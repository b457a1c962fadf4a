//! The table of channels: who writes what, who may read it, and how much of it is kept.

use std::marker::PhantomData;

use crate::codes::Process;
use crate::message::*;
use crate::ros2::Ros2;

/// How many steps the world in lockstep may run ahead of what the recorder has in its file.
/// Every recorded channel's buffer and history hold more than that.
pub const LOCKSTEP_WINDOW: u64 = 64;
/// The recorder acknowledges every so many scans.
pub const RECORDED_EVERY: u64 = 16;
/// Most cells of a sketch: the canvas of paper 004, IV, 2540 × 1252, in either orientation.
pub const MAX_SKETCH_CELLS: usize = 2540 * 1252;

/// A row of the table.
#[derive(Debug, PartialEq, Eq)]
pub struct ChannelSpec {
    /// Name, unique within a system.
    pub name: &'static str,
    /// The one process that writes it; `None` where every process does (health alone).
    pub writer: Option<Process>,
    /// The processes that may read it, beside the recorder and observers, who may read all.
    pub readers: &'static [Process],
    /// Messages that the writer keeps for a reader that comes late.
    pub history: usize,
    /// Messages that wait for a reader before the oldest is lost.
    pub buffer: usize,
    /// Whether the recorder writes it to the file.
    pub recorded: bool,
    /// Longest slice behind the message, bytes; 0 where there is none.
    pub max_slice_bytes: usize,
}

impl ChannelSpec {
    /// Whether `process` may read the channel.
    pub fn may_read(&self, process: Process) -> bool {
        matches!(process, Process::Recorder | Process::Observer) || self.readers.contains(&process)
    }

    /// Whether `process` may write the channel.
    pub fn may_write(&self, process: Process) -> bool {
        self.writer.is_none_or(|writer| writer == process)
    }

    /// Whether its messages are what sensors read: each is its own cause.
    pub fn is_sensed(&self) -> bool {
        [SCAN.spec, ODOMETRY.spec, TRUTH.spec].iter().any(|sensed| sensed.name == self.name)
    }

    /// Whether the channel is recorded under this topic: its name with a slash before it.
    pub fn is_topic(&self, topic: &str) -> bool {
        topic.strip_prefix('/') == Some(self.name)
    }
}

/// Whether several processes write the channel of this topic, so that its numbers tell nothing.
pub fn has_many_writers(topic: &str) -> bool {
    TABLE.iter().any(|spec| spec.writer.is_none() && spec.is_topic(topic))
}

/// A channel of messages of type `T`.
pub struct Channel<T> {
    /// The channel's row of the table.
    pub spec: &'static ChannelSpec,
    message: PhantomData<fn() -> T>,
}

impl<T> Clone for Channel<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Channel<T> {}

/// Does something with every channel of the table, each with its own message type.
pub trait ChannelVisitor {
    /// What may go wrong.
    type Error;
    /// A channel whose messages have a fixed size.
    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Self::Error>;
    /// A channel whose messages are followed by a slice of bytes.
    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Self::Error>;
}

macro_rules! channels {
    ($($(#[$meta:meta])* $constant:ident: $visit:ident $message:ty = $name:literal, from $writer:expr, to [$($reader:ident),*],
        history $history:expr, buffer $buffer:expr, recorded $recorded:literal, slice $slice:expr;)*) => {
        $($(#[$meta])* pub const $constant: Channel<$message> = Channel {
            spec: &ChannelSpec {
                name: $name,
                writer: $writer,
                readers: &[$(Process::$reader),*],
                history: $history,
                buffer: $buffer,
                recorded: $recorded,
                max_slice_bytes: $slice,
            },
            message: PhantomData,
        };)*

        /// Every channel, in the order of the table.
        pub const TABLE: &[&ChannelSpec] = &[$($constant.spec),*];

        /// Visits every channel in the order of the table; stops at the first error.
        pub fn visit<V: ChannelVisitor>(visitor: &mut V) -> Result<(), V::Error> {
            $(visitor.$visit($constant)?;)*
            Ok(())
        }
    };
}

channels! {
    /// Laser scans.
    SCAN: fixed LaserScan = "scan", from Some(Process::World), to [Localizer, Planner, Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// Dead reckoning; the reading of a scan's time is sent before the scan.
    ODOMETRY: fixed Odometry = "odometry", from Some(Process::World), to [Localizer, Planner],
        history 128, buffer 128, recorded true, slice 0;
    /// The true pose; no navigator may open it.
    TRUTH: fixed GroundTruth = "truth", from Some(Process::World), to [],
        history 128, buffer 128, recorded true, slice 0;
    /// Touches of walls, furniture and people.
    CONTACT: fixed Contact = "contact", from Some(Process::World), to [],
        history 512, buffer 512, recorded true, slice 0;
    /// The drawing.
    SKETCH: sliced SketchMap = "sketch", from Some(Process::Sketcher), to [Localizer, Planner, Pad],
        history 1, buffer 2, recorded true, slice MAX_SKETCH_CELLS;
    /// The tasks.
    ROUTE: fixed Route = "route", from Some(Process::Sketcher), to [Planner],
        history 1, buffer 2, recorded true, slice 0;
    /// Where the robot is in the drawing.
    ESTIMATE: fixed PoseEstimate = "estimate", from Some(Process::Localizer), to [Planner, Supervisor, Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// A sample of the particle set.
    PARTICLES: fixed Particles = "particles", from Some(Process::Localizer), to [Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// What the planner is about to do.
    PLAN: fixed Plan = "plan", from Some(Process::Planner), to [Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// How the robot is to move.
    COMMAND: fixed VelocityCommand = "command", from Some(Process::Planner), to [World],
        history 128, buffer 128, recorded true, slice 0;
    /// What a person draws.
    DRAWING: sliced Drawing = "drawing", from Some(Process::Pad), to [Sketcher],
        history 1, buffer 4, recorded true, slice MAX_DRAWING_BYTES;
    /// What became of it.
    UNDERSTOOD: fixed Understood = "understood", from Some(Process::Sketcher), to [Pad],
        history 4, buffer 8, recorded true, slice 0;
    /// What the person at the pad wants.
    ORDERS: fixed MissionCommand = "orders", from Some(Process::Pad), to [Planner],
        history 16, buffer 16, recorded true, slice 0;
    /// What the person wants.
    MISSION: fixed MissionCommand = "mission", from Some(Process::Supervisor), to [Planner],
        history 16, buffer 16, recorded true, slice 0;
    /// How the mission stands; the last message of a step.
    STATUS: fixed MissionStatus = "status", from Some(Process::Planner), to [Supervisor, Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// Signs of life, from every process.
    HEALTH: fixed Health = "health", from None, to [Supervisor],
        history 8, buffer 64, recorded true, slice 0;
    /// Kills, deaths, restarts, recoveries.
    FAULTS: fixed Fault = "faults", from Some(Process::Supervisor), to [Pad],
        history 128, buffer 128, recorded true, slice 0;
    /// How long each step took by the clock.
    LATENCY: fixed Latency = "latency", from Some(Process::Recorder), to [],
        history 128, buffer 128, recorded true, slice 0;
    /// What is safe in the file.
    RECORDED: fixed Recorded = "recorded", from Some(Process::Recorder), to [World],
        history 8, buffer 16, recorded false, slice 0;
    /// The echoes of a ring of sonars.
    SONAR: fixed SonarScan = "sonar", from Some(Process::World), to [Localizer, Planner, Pad],
        history 128, buffer 128, recorded true, slice 0;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let mut names: Vec<_> = TABLE.iter().map(|c| c.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), TABLE.len());
    }

    #[test]
    fn no_navigator_reads_the_truth() {
        for process in [Process::Sketcher, Process::Localizer, Process::Planner] {
            assert!(!TRUTH.spec.may_read(process) && !CONTACT.spec.may_read(process), "{process}");
        }
    }

    #[test]
    fn only_health_has_many_writers() {
        for channel in TABLE {
            assert_eq!(channel.writer.is_none(), channel.name == "health", "{}", channel.name);
        }
    }

    #[test]
    fn recorded_channels_hold_more_than_the_lockstep_window() {
        let by_a_person = ["sketch", "route", "mission", "drawing", "understood", "orders"];
        for channel in
            TABLE.iter().filter(|c| c.recorded && c.writer.is_some() && !by_a_person.contains(&c.name))
        {
            assert!(channel.buffer as u64 > LOCKSTEP_WINDOW + RECORDED_EVERY, "{}", channel.name);
        }
    }
}
