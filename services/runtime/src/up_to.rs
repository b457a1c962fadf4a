//! A channel, read no further than a moment of simulation time.

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

    /// Goes on to `stamp_ns`, simulation time.
    pub fn advance_to(&mut self, stamp_ns: u64) -> Result<()> {
        loop {
            if self.next.is_none() {
                self.next = self.reader.receive()?;
            }
            match self.next.take_if(|next| next.header().stamp_ns <= stamp_ns) {
                Some(message) => self.newest = Some(message),
                None => return Ok(()),
            }
        }
    }

    /// The newest message whose stamp is not after the moment; `None` before the first.
    pub fn newest(&self) -> Option<&T> {
        self.newest.as_deref()
    }
}
