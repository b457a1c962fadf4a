//! The outputs of a stage.

use sketchnav_schemas::channels::{Channel, ChannelSpec, Role};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message};

use crate::{Denied, StageError};

/// Fills in a message and its cells.
pub type Fill<'a> = dyn FnMut(&mut [u8], &mut [u8]) -> Result<(), StageError> + 'a;

/// A message to be sent.
pub struct Put<'a> {
    /// Channel of the message.
    pub spec: &'static ChannelSpec,
    /// Number of cells, of one byte each, that follow the message.
    pub cells: usize,
    /// True if the message repeats the last one of the channel, with the same number. See [`Outbox::repeat`].
    pub is_repeated: bool,
    /// Fills in the message and its cells, which are zeroed beforehand. If it fails, nothing is sent.
    pub fill: &'a mut Fill<'a>,
}

/// The roles of those messages that respond to an instant.
pub(crate) const RESPONSES: [Role; 3] = [Role::Situation, Role::Command, Role::Status];

/// The destination of a stage's messages, implemented by hosts.
pub trait Sink {
    /// Lets the message be filled in place, then numbers it, sends it and returns its number.
    ///
    /// # Errors
    /// Returns an error if the process may not write the channel or if the channel fails, and any error of
    /// `fill`. In these cases, the message is not sent.
    fn put(&mut self, put: Put<'_>) -> Result<u64, StageError>;

    /// Returns the number of the last message of a channel, or 0 before the first.
    ///
    /// # Errors
    /// [`Denied`] if the process may not write the channel.
    fn last(&self, spec: &ChannelSpec) -> Result<u64, Denied>;
}

/// Sends a stage's messages. Each is stamped with the time and the cause of the instant, or of the message
/// that was delivered.
pub struct Outbox<'a> {
    sink: &'a mut dyn Sink,
    header: Header,
    is_resuming: bool,
    /// Number of messages sent so far for each role in [`RESPONSES`].
    pub(crate) responses: [u32; RESPONSES.len()],
}

impl<'a> Outbox<'a> {
    /// Creates an outbox for messages with the given time and cause.
    pub fn new(sink: &'a mut dyn Sink, stamp_ns: u64, source_seq: u64) -> Self {
        let header = Header { seq: 0, stamp_ns, source_seq };
        Self { sink, header, is_resuming: false, responses: [0; RESPONSES.len()] }
    }

    /// Sets whether the process is resuming after a kill.
    #[must_use]
    pub fn resuming(self, is_resuming: bool) -> Self {
        Self { is_resuming, ..self }
    }

    /// Sends a message and returns its number. `fill` fills in the message in place, which is zeroed except
    /// for its header.
    ///
    /// # Errors
    /// Returns an error if the process may not write the channel, or if the channel fails.
    pub fn send<T: Message>(
        &mut self,
        channel: Channel<T>,
        fill: impl FnOnce(&mut T),
    ) -> Result<u64, StageError> {
        self.send_with(channel, 0, |message, _| fill(message))
    }

    /// Like [`Outbox::send`], but the message is followed by `cells` bytes.
    ///
    /// # Errors
    /// Any error of [`Outbox::send`], and an error if there are more cells than the channel takes.
    pub fn send_with<T: Message>(
        &mut self,
        channel: Channel<T>,
        cells: usize,
        fill: impl FnOnce(&mut T, &mut [u8]),
    ) -> Result<u64, StageError> {
        self.put(channel, cells, false, fill)
    }

    /// Like [`Outbox::send_with`], but for a channel whose message is declared at run time, so `fill`
    /// receives bytes and is allowed to fail.
    ///
    /// # Errors
    /// Any error of [`Outbox::send_with`], and any error of `fill`, after which nothing is sent.
    pub fn send_bytes(
        &mut self,
        spec: &'static ChannelSpec,
        cells: usize,
        fill: impl FnOnce(&mut [u8], &mut [u8]) -> Result<(), StageError>,
    ) -> Result<u64, StageError> {
        self.put_bytes(spec, cells, false, fill)
    }

    /// If the process is resuming after a kill, sends the last message of a channel again, with the same
    /// number. This is for messages with cells, which are not stored for late readers.
    ///
    /// # Errors
    /// Any error of [`Outbox::send_with`].
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

    /// Returns the number of the last message of a channel, or 0 before the first.
    ///
    /// # Errors
    /// [`Denied`] if the process may not write the channel.
    pub fn last<T>(&self, channel: Channel<T>) -> Result<u64, Denied> {
        self.last_of(channel.spec)
    }

    pub(crate) fn last_of(&self, spec: &ChannelSpec) -> Result<u64, Denied> {
        self.sink.last(spec)
    }

    fn put<T: Message>(
        &mut self,
        channel: Channel<T>,
        cells: usize,
        is_repeated: bool,
        fill: impl FnOnce(&mut T, &mut [u8]),
    ) -> Result<u64, StageError> {
        let fill = |message: &mut [u8], cells: &mut [u8]| {
            fill(bytemuck::from_bytes_mut(message), cells);
            Ok(())
        };
        self.put_bytes(channel.spec, cells, is_repeated, fill)
    }

    fn put_bytes(
        &mut self,
        spec: &'static ChannelSpec,
        cells: usize,
        is_repeated: bool,
        fill: impl FnOnce(&mut [u8], &mut [u8]) -> Result<(), StageError>,
    ) -> Result<u64, StageError> {
        let (header, mut fill) = (self.header, Some(fill));
        let mut fill = |message: &mut [u8], cells: &mut [u8]| {
            *erased::header_mut(message) = header;
            fill.take().map_or(Ok(()), |fill| fill(message, cells))
        };
        let seq = self.sink.put(Put { spec, cells, is_repeated, fill: &mut fill })?;
        if let Some(role) = RESPONSES.iter().position(|role| *role == spec.role) {
            self.responses[role] += 1;
        }
        Ok(seq)
    }
}
