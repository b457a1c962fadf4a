//! A channel, read no further than a moment of simulation time. Invalid messages are rejected.

use sketchnav_schemas::message::Message;

use crate::Result;
use crate::reader::{Reader, Sample};

/// Knows a channel's newest message of a moment, whatever has come since: what a scan is to be put
/// together with, so that the same scan always meets the same message.
pub struct UpTo<T: Message> {
    reader: Reader<T>,
    newest: Option<Sample<T>>,
    next: Option<Sample<T>>,
}

impl<T: Message> UpTo<T> {
    /// Nothing read yet.
    pub fn new(reader: Reader<T>) -> Self {
        Self { reader, newest: None, next: None }
    }

    /// Goes on to `stamp_ns`, simulation time. Whether the moment is settled: its message is here, or a
    /// later one shows that it will not come. Where it is not, ask again when something has come.
    pub fn advance_to(&mut self, stamp_ns: u64) -> Result<bool> {
        loop {
            if self.next.is_none() {
                self.next = self.reader.receive_valid()?;
            }
            match self.next.take_if(|next| next.header().stamp_ns <= stamp_ns) {
                Some(message) => self.newest = Some(message),
                None => break,
            }
        }
        let is_here = self.newest().is_some_and(|newest| newest.header().stamp_ns == stamp_ns);
        Ok(is_here || self.next.is_some())
    }

    /// After which number a successor is to go on, so that it has the newest message too.
    pub fn position(&self) -> u64 {
        self.newest().map_or(0, |newest| newest.header().seq - 1)
    }

    /// As [`Reader::resume_after`].
    pub fn resume_after(&mut self, seq: u64) {
        self.reader.resume_after(seq);
    }

    /// The newest message whose stamp is not after the moment; `None` before the first.
    pub fn newest(&self) -> Option<&T> {
        self.newest.as_deref()
    }
}
