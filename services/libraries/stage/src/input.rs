//! The inputs of a stage.

use sketchnav_schemas::channels::{Channel, ChannelSpec, MISSION, ORDERS};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message, MissionCommand};

use crate::access::{Access, Denied};

/// A message and the cells that follow it, by reference.
#[derive(Debug, Clone, Copy)]
pub struct Reading<'a> {
    /// Bytes of the message.
    pub message: &'a [u8],
    /// Cells that follow the message.
    pub cells: &'a [u8],
    /// True if the message arrived since the previous instant.
    pub is_fresh: bool,
}

/// The messages that a host provides for an instant.
pub trait Inputs {
    /// Returns the latest message of a channel, whether from this instant or an earlier one.
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>>;
}

/// The inputs of a step: a snapshot of the world at one instant.
pub struct Instant<'a> {
    /// Number of the tick.
    pub tick: u64,
    /// Simulation time, in nanoseconds.
    pub stamp_ns: u64,
    access: &'a Access,
    inputs: &'a dyn Inputs,
}

impl<'a> Instant<'a> {
    /// Creates the instant of tick number `tick`, for the process that `access` belongs to.
    pub fn new(access: &'a Access, tick: u64, stamp_ns: u64, inputs: &'a dyn Inputs) -> Self {
        Self { tick, stamp_ns, access, inputs }
    }

    /// Returns the process that takes the step, and the kind of navigator.
    pub(crate) fn host(&self) -> (Process, &'a str) {
        self.access.host()
    }

    /// Returns the latest message of a sensor, or the message that this step responds to. Returns `None` before the first message.
    /// If a sensor is slower than the heartbeat, its latest message may be from an earlier instant.
    ///
    /// # Errors
    /// [`Denied`] if the channel can never deliver a message to this process.
    pub fn newest<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        Ok(self.reading(channel.spec)?.map(|reading| bytemuck::from_bytes(reading.message)))
    }

    /// Like [`Instant::newest`], but returns `None` unless the message arrived after the previous instant.
    ///
    /// # Errors
    /// Like [`Instant::newest`].
    pub fn fresh<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        let reading = self.reading(channel.spec)?.filter(|reading| reading.is_fresh);
        Ok(reading.map(|reading| bytemuck::from_bytes(reading.message)))
    }

    /// Returns the latest message of a channel as bytes, like [`Instant::newest`]. This is for hosts of stages whose messages are
    /// declared at run time.
    ///
    /// # Errors
    /// Like [`Instant::newest`].
    pub fn reading(&self, spec: &ChannelSpec) -> Result<Option<Reading<'a>>, Denied> {
        self.access.to_step(spec)?;
        Ok(self.inputs.newest(spec))
    }
}

/// A message that does not belong to an instant.
#[derive(Debug, Clone, Copy)]
pub struct Incoming<'a> {
    access: &'a Access,
    spec: &'static ChannelSpec,
    message: &'a [u8],
    cells: &'a [u8],
    /// Number of earlier deliveries of this message, each of which ended in the death of the process.
    pub attempts: u32,
}

impl<'a> Incoming<'a> {
    /// Creates a message of the channel `spec`, for the process of `access`.
    pub fn new(access: &'a Access, spec: &'static ChannelSpec, message: &'a [u8], cells: &'a [u8]) -> Self {
        Self { access, spec, message, cells, attempts: 0 }
    }

    /// Returns the same message with the number of earlier deliveries set to `attempts`.
    #[must_use]
    pub fn again(self, attempts: u32) -> Self {
        Self { attempts, ..self }
    }

    /// Returns the message if it is from this channel.
    ///
    /// # Errors
    /// [`Denied`] if the channel can never deliver a message to this process.
    pub fn on<T: Message>(&self, channel: Channel<T>) -> Result<Option<&'a T>, Denied> {
        Ok(self.bytes_on(channel.spec)?.map(bytemuck::from_bytes))
    }

    /// Returns the message as bytes if it is from this channel. See [`Instant::reading`].
    ///
    /// # Errors
    /// Like [`Incoming::on`].
    pub fn bytes_on(&self, spec: &ChannelSpec) -> Result<Option<&'a [u8]>, Denied> {
        self.access.to_receive(spec)?;
        Ok((self.spec == spec).then_some(self.message))
    }

    /// Returns the message as an order if it is one, no matter whether the supervisor, the command line or
    /// the pad sent it.
    ///
    /// # Errors
    /// [`Denied`] if the process does not take orders.
    pub fn order(&self) -> Result<Option<&'a MissionCommand>, Denied> {
        Ok(self.on(MISSION)?.or(self.on(ORDERS)?))
    }

    /// Returns the cells that follow the message.
    pub fn cells(&self) -> &'a [u8] {
        self.cells
    }

    /// Returns the header of the message.
    pub fn header(&self) -> &'a Header {
        erased::header(self.message)
    }
}

/// Access to the last messages that the process sent before it was restarted.
pub trait Remains {
    /// Returns a copy of the last message of a channel, or `None` if there is no message or the channel has
    /// cells.
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>>;
}

impl dyn Remains + '_ {
    /// Returns the last message of a channel, or `None` if there is no message or the channel has cells.
    pub fn of<T: Message>(&self, channel: Channel<T>) -> Option<T> {
        self.last(channel.spec).map(|message| *bytemuck::from_bytes(bytemuck::cast_slice(&message)))
    }
}
