//! Joins the parts of a recording.
//!
//! A recorder that is killed leaves a part that ends at an arbitrary point. After the restart, it begins
//! another part, which starts a little before that point rather than after it. Joining the parts yields each
//! message once and a complete index, and counts the messages that are missing from all parts. Empty parts
//! are ignored.

use std::collections::{BTreeMap, VecDeque};
use std::io::Write;
use std::path::Path;

use sketchnav_schemas::channels::has_many_writers;
use sketchnav_schemas::run::RunConfig;

use crate::error::RecordingError;
use crate::reader::{Attachment, Part, RawMessage, Recording};
use crate::records::Damage;
use crate::sources::is_source;
use crate::writer::Writer;

/// Writes the messages of `parts`, in this order, as one recording of `run`. The caller finishes the recording.
///
/// # Errors
/// [`RecordingError`] if a part is damaged, or the sink fails. A part that is merely truncated is not an
/// error.
pub fn join<W: Write>(
    parts: impl IntoIterator<Item = impl AsRef<Path>>,
    run: &RunConfig,
    sink: W,
) -> Result<Writer<W>, RecordingError> {
    let parts: Vec<_> = parts.into_iter().collect();
    let files = sources_of(&parts);
    let mut joined = Joined { writer: Writer::create_with(sink, run, &files)?, said: VecDeque::new() };
    for part in parts {
        match joined.take(part.as_ref()) {
            Err(RecordingError::Damaged { source: Damage::Empty, .. }) => {}
            Err(RecordingError::File { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {}
            taken => taken?,
        }
    }
    Ok(joined.writer)
}

/// Returns the files of the run, which every part that is long enough contains.
fn sources_of(parts: &[impl AsRef<Path>]) -> Vec<Attachment> {
    let mut files = BTreeMap::new();
    for part in parts.iter().filter_map(|part| Recording::open(part.as_ref()).ok()) {
        let sources = part.attachments().iter().filter(|(name, _)| is_source(name));
        files.extend(sources.map(|(name, file)| (name.clone(), file.clone())));
    }
    files.into_values().collect()
}

/// Number of messages of channels with many writers that are remembered. A part begins with the histories of these channels, which
/// are 8 messages of each process (`HEALTH`). Most of them are also at the end of the previous part.
const REMEMBERED: usize = 1024;

struct Joined<W: Write> {
    writer: Writer<W>,
    /// The last messages of the channels with many writers, whose sequence numbers cannot identify them.
    said: VecDeque<Vec<u8>>,
}

impl<W: Write> Joined<W> {
    fn take(&mut self, part: &Path) -> Result<(), RecordingError> {
        for piece in Recording::open(part)?.parts()? {
            match piece? {
                Part::Message(raw) if self.is_new(&raw) => self.writer.write_raw(&raw)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns true if a message is new. On a channel with one writer, all messages may pass, because [`Writer`] recognizes
    /// repetitions by their numbers.
    fn is_new(&mut self, raw: &RawMessage) -> bool {
        if !has_many_writers(&raw.topic.name) {
            return true;
        }
        if self.said.contains(&raw.cdr) {
            return false;
        }
        if self.said.len() == REMEMBERED {
            self.said.pop_front();
        }
        self.said.push_back(raw.cdr.clone());
        true
    }
}
