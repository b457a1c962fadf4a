//! What comes to a stage.

use sketchnav_schemas::channels::{Channel, ChannelSpec};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message};

/// A message with the cells behind it, where it lies.
#[derive(Debug, Clone, Copy)]
pub struct Reading<'a> {
    /// The message.
    pub message: &'a [u8],
    /// The bytes behind it.
    pub cells: &'a [u8],
    /// Whether it came since the instant before.
    pub is_fresh: bool,
}

/// What a host has of an instant.
pub trait Inputs {
    /// The newest message of a channel that belongs to the instant or to one before it.
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>>;
}

/// The inputs of a step: everything that was true at one moment of the world.
pub struct Instant<'a> {
    /// Number of the tick.
    pub tick: u64,
    /// Simulation time.
    pub stamp_ns: u64,
    inputs: &'a dyn Inputs,
}

impl<'a> Instant<'a> {
    /// The instant of the tick number `tick`.
    pub fn new(tick: u64, stamp_ns: u64, inputs: &'a dyn Inputs) -> Self {
        Self { tick, stamp_ns, inputs }
    }

    /// The newest message of a sensor, or the message that the step answers; `None` before the first. A sensor that
    /// is slower than the heartbeat has one of an earlier instant.
    pub fn newest<T: Message>(&self, channel: Channel<T>) -> Option<&'a T> {
        self.inputs.newest(channel.spec).map(|reading| bytemuck::from_bytes(reading.message))
    }

    /// The same where it came since the instant before.
    pub fn fresh<T: Message>(&self, channel: Channel<T>) -> Option<&'a T> {
        let reading = self.inputs.newest(channel.spec).filter(|reading| reading.is_fresh);
        reading.map(|reading| bytemuck::from_bytes(reading.message))
    }
}

/// A message that belongs to no instant.
#[derive(Debug, Clone, Copy)]
pub struct Heard<'a> {
    spec: &'static ChannelSpec,
    message: &'a [u8],
    cells: &'a [u8],
    /// How often this message was heard before, each time with the process dead afterwards.
    pub attempts: u32,
}

impl<'a> Heard<'a> {
    /// A message of the channel `spec`.
    pub fn new(spec: &'static ChannelSpec, message: &'a [u8], cells: &'a [u8]) -> Self {
        Self { spec, message, cells, attempts: 0 }
    }

    /// The same, heard so often before.
    #[must_use]
    pub fn again(self, attempts: u32) -> Self {
        Self { attempts, ..self }
    }

    /// The message, where it is one of this channel.
    pub fn on<T: Message>(&self, channel: Channel<T>) -> Option<&'a T> {
        (self.spec == channel.spec).then(|| bytemuck::from_bytes(self.message))
    }

    /// The bytes behind it.
    pub fn cells(&self) -> &'a [u8] {
        self.cells
    }

    /// Its header.
    pub fn header(&self) -> &'a Header {
        erased::header(self.message)
    }
}

/// The last messages that a predecessor sent.
pub trait Remains {
    /// A copy of the last one of a channel; `None` where there is none, or where its channel has cells.
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>>;
}

impl dyn Remains + '_ {
    /// The last message of a channel.
    pub fn of<T: Message>(&self, channel: Channel<T>) -> Option<T> {
        self.last(channel.spec).map(|message| *bytemuck::from_bytes(bytemuck::cast_slice(&message)))
    }
}
