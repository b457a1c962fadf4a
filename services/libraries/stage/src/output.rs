//! What a stage sends.

use sketchnav_schemas::channels::{Channel, ChannelSpec};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message};

use crate::{Denied, StageError};

/// A message that is to be sent.
pub struct Put<'a> {
    /// Its channel.
    pub spec: &'static ChannelSpec,
    /// How many bytes follow it.
    pub cells: usize,
    /// Whether it repeats the last message of the channel, with the same number: see [`Outbox::repeat`].
    pub is_repeated: bool,
    /// Fills the message and its cells, which are all zero.
    pub fill: &'a mut dyn FnMut(&mut [u8], &mut [u8]),
}

/// Where a host takes a stage's messages.
pub trait Sink {
    /// Has the message filled in place, numbers and sends it, and returns the number.
    ///
    /// # Errors
    /// A channel that the process may not write, or one that fails.
    fn put(&mut self, put: Put<'_>) -> Result<u64, StageError>;

    /// The number of the last message of a channel; 0 before the first.
    ///
    /// # Errors
    /// A channel that the process may not write.
    fn last(&self, spec: &ChannelSpec) -> Result<u64, Denied>;
}

/// Where a stage's messages are made. Each gets the time and cause of the instant, or of the message that was heard.
pub struct Outbox<'a> {
    sink: &'a mut dyn Sink,
    header: Header,
    is_resuming: bool,
}

impl<'a> Outbox<'a> {
    /// An outbox for messages of this moment with this cause.
    pub fn new(sink: &'a mut dyn Sink, stamp_ns: u64, source_seq: u64) -> Self {
        Self { sink, header: Header { seq: 0, stamp_ns, source_seq }, is_resuming: false }
    }

    /// Says whether the process is resuming after a kill.
    #[must_use]
    pub fn resuming(self, is_resuming: bool) -> Self {
        Self { is_resuming, ..self }
    }

    /// Sends a message that `fill` fills in place; it is all zero except for its header. Returns its number.
    ///
    /// # Errors
    /// A channel that the process may not write, or one that fails.
    pub fn send<T: Message>(
        &mut self,
        channel: Channel<T>,
        fill: impl FnOnce(&mut T),
    ) -> Result<u64, StageError> {
        self.send_with(channel, 0, |message, _| fill(message))
    }

    /// The same with `cells` bytes following the message.
    ///
    /// # Errors
    /// As [`Outbox::send`]; more cells than the channel takes.
    pub fn send_with<T: Message>(
        &mut self,
        channel: Channel<T>,
        cells: usize,
        fill: impl FnOnce(&mut T, &mut [u8]),
    ) -> Result<u64, StageError> {
        self.put(channel, cells, false, fill)
    }

    /// Sends the last message of a channel again, with the same number, if the process is resuming after a kill. This is for
    /// messages with cells, which are not kept for late readers.
    ///
    /// # Errors
    /// As [`Outbox::send_with`].
    pub fn repeat<T: Message>(
        &mut self,
        channel: Channel<T>,
        cells: usize,
        fill: impl FnOnce(&mut T, &mut [u8]),
    ) -> Result<(), StageError> {
        match self.is_resuming && self.last(channel)? > 0 {
            true => self.put(channel, cells, true, fill).map(drop),
            false => Ok(()),
        }
    }

    /// The number of the last message of a channel; 0 before the first.
    ///
    /// # Errors
    /// [`Denied`] for a channel that the process may not write.
    pub fn last<T>(&self, channel: Channel<T>) -> Result<u64, Denied> {
        self.sink.last(channel.spec)
    }

    fn put<T: Message>(
        &mut self,
        channel: Channel<T>,
        cells: usize,
        is_repeated: bool,
        fill: impl FnOnce(&mut T, &mut [u8]),
    ) -> Result<u64, StageError> {
        let (header, mut fill) = (self.header, Some(fill));
        let mut fill = |message: &mut [u8], cells: &mut [u8]| {
            *erased::header_mut(message) = header;
            if let Some(fill) = fill.take() {
                fill(bytemuck::from_bytes_mut(message), cells);
            }
        };
        self.sink.put(Put { spec: channel.spec, cells, is_repeated, fill: &mut fill })
    }
}
