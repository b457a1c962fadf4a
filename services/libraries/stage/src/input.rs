//! What comes to a stage.

use sketchnav_schemas::channels::{Channel, ChannelSpec, MISSION, ORDERS};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message, MissionCommand};

use crate::access::{Access, Denied};

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
    access: &'a Access,
    inputs: &'a dyn Inputs,
}

impl<'a> Instant<'a> {
    /// The instant of the tick number `tick`, for the process of `access`.
    pub fn new(access: &'a Access, tick: u64, stamp_ns: u64, inputs: &'a dyn Inputs) -> Self {
        Self { tick, stamp_ns, access, inputs }
    }

    /// The newest message of a sensor, or the message that the step answers; `None` before the first. A sensor that
    /// is slower than the heartbeat has one of an earlier instant.
    ///
    /// # Errors
    /// [`Denied`] for a channel of which no message can ever come.
    pub fn newest<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        Ok(self.reading(channel.spec)?.map(|reading| bytemuck::from_bytes(reading.message)))
    }

    /// The same where it came since the instant before.
    ///
    /// # Errors
    /// As [`Instant::newest`].
    pub fn fresh<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        let reading = self.reading(channel.spec)?.filter(|reading| reading.is_fresh);
        Ok(reading.map(|reading| bytemuck::from_bytes(reading.message)))
    }

    fn reading(&self, spec: &ChannelSpec) -> Result<Option<Reading<'a>>, Denied> {
        self.access.to_step(spec)?;
        Ok(self.inputs.newest(spec))
    }
}

/// A message that belongs to no instant.
#[derive(Debug, Clone, Copy)]
pub struct Heard<'a> {
    access: &'a Access,
    spec: &'static ChannelSpec,
    message: &'a [u8],
    cells: &'a [u8],
    /// How often this message was heard before, each time with the process dead afterwards.
    pub attempts: u32,
}

impl<'a> Heard<'a> {
    /// A message of the channel `spec`, for the process of `access`.
    pub fn new(access: &'a Access, spec: &'static ChannelSpec, message: &'a [u8], cells: &'a [u8]) -> Self {
        Self { access, spec, message, cells, attempts: 0 }
    }

    /// The same, heard so often before.
    #[must_use]
    pub fn again(self, attempts: u32) -> Self {
        Self { attempts, ..self }
    }

    /// The message, if it is one of this channel.
    ///
    /// # Errors
    /// [`Denied`] for a channel of which no message can ever be heard.
    pub fn on<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        self.access.to_hear(channel.spec)?;
        Ok((self.spec == channel.spec).then(|| bytemuck::from_bytes(self.message)))
    }

    /// The order that it is, from the supervisor, the command line or the pad.
    ///
    /// # Errors
    /// [`Denied`] for a process that takes no orders.
    pub fn order(&self) -> Result<Option<&'a MissionCommand>, Denied> {
        Ok(self.on(MISSION)?.or(self.on(ORDERS)?))
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
    /// A copy of the last one of a channel; `None` if there is none, or where its channel has cells.
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>>;
}

impl dyn Remains + '_ {
    /// The last message of a channel.
    pub fn of<T: Message>(&self, channel: Channel<T>) -> Option<T> {
        self.last(channel.spec).map(|message| *bytemuck::from_bytes(bytemuck::cast_slice(&message)))
    }
}
