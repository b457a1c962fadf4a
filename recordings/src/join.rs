//! Puts the parts of a recording together.
//!
//! A recorder that is killed leaves a part that ends somewhere; its successor begins another one, a little
//! before that place rather than behind it. Joined, each message is there once, the index is whole, and
//! what is missing from all parts is counted. Parts that hold nothing are passed over.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use sketchnav_schemas::channels::{self, Channel, ChannelVisitor};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;

use crate::error::RecordingError;
use crate::reader::{Part, RawMessage, Recording};
use crate::records::Damage;
use crate::writer::Writer;

/// Writes the messages of `parts`, in this order, as one recording of `run`, which is still to be finished.
///
/// # Errors
/// [`RecordingError`] where a part is damaged (not: cut off), or the sink fails.
pub fn join<W: Write>(
    parts: impl IntoIterator<Item = impl AsRef<Path>>,
    run: &RunConfig,
    sink: W,
) -> Result<Writer<W>, RecordingError> {
    let mut joined = Joined { writer: Writer::create(sink, run)?, said: BTreeSet::new() };
    for part in parts {
        match joined.take(part.as_ref()) {
            Err(RecordingError::Damaged { source: Damage::Empty, .. }) => {}
            Err(RecordingError::File { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {}
            taken => taken?,
        }
    }
    Ok(joined.writer)
}

struct Joined<W: Write> {
    writer: Writer<W>,
    /// Of the channels that several processes write, whose numbers tell nothing, what was said.
    said: BTreeSet<Vec<u8>>,
}

impl<W: Write> Joined<W> {
    fn take(&mut self, part: &Path) -> Result<(), RecordingError> {
        for piece in Recording::open(part)?.parts()? {
            if let Part::Message(raw) = piece? {
                // Transforms belong to no channel: they are made again, from the odometry.
                channels::visit(&mut Put { joined: self, raw: &raw })?;
            }
        }
        Ok(())
    }
}

struct Put<'a, W: Write> {
    joined: &'a mut Joined<W>,
    raw: &'a RawMessage,
}

impl<W: Write> ChannelVisitor for Put<'_, W> {
    type Error = RecordingError;

    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), RecordingError> {
        let Joined { writer, said } = &mut *self.joined;
        if self.raw.topic.name.strip_prefix('/') != Some(channel.spec.name) {
            return Ok(());
        }
        if channel.spec.writer.is_none() && !said.insert(self.raw.cdr.clone()) {
            return Ok(());
        }
        let (message, cells) = self.raw.typed::<T>()?;
        writer.write(channel, &message, &cells).map(drop)
    }

    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), RecordingError> {
        self.fixed(channel)
    }
}
