//! Where in a recording its chunks lie, and when: out of the summary at the file's end, or, where a kill
//! left none, out of one pass over the file.

use std::collections::BTreeMap;
use std::path::Path;

use crate::directory::Directory;
use crate::error::RecordingError;
use crate::parts::{Open, Piece};
use crate::reader::{Attachment, Part};
use crate::record_file::Stop;
use crate::records::{AttachmentEntry, ChunkEntry, Damage, Record, Statistics, next_in};
use crate::writer::CHUNK_BYTES;

/// The chunks of a recording, its topics and counts.
#[derive(Debug, Clone, Default)]
pub struct Index {
    pub(crate) chunks: Vec<ChunkEntry>,
    pub(crate) directory: Directory,
    pub(crate) statistics: Option<Statistics>,
    /// Where the metadata of a name lies; the last of that name.
    metadata: BTreeMap<String, u64>,
    pub(crate) attachments: Vec<AttachmentEntry>,
    is_from_summary: bool,
}

impl Index {
    /// The index of the recording at `path`.
    ///
    /// # Errors
    /// [`RecordingError::File`]; [`RecordingError::Damaged`] where a file without a summary is no recording.
    pub(crate) fn read(path: &Path) -> Result<Self, RecordingError> {
        match Self::of_summary(path)? {
            Some(index) => Ok(index),
            None => Self::by_a_pass(path),
        }
    }

    /// The index that the file has at its end; `None` where it has none that fits.
    pub(crate) fn of_summary(path: &Path) -> Result<Option<Self>, RecordingError> {
        let mut open = Open::new(path)?;
        let summary = match open.file.summary() {
            Ok(summary) => summary,
            Err(Stop::Io(source)) => return Err(RecordingError::File { path: path.to_owned(), source }),
            Err(Stop::Cut(_) | Stop::Damage(_)) => return Ok(None),
        };
        let index = Self::parse(&summary);
        Ok(index.filter(|index| index.fits(open.file.bytes())))
    }

    fn parse(summary: &[u8]) -> Option<Self> {
        let mut index = Self { is_from_summary: true, ..Self::default() };
        let mut at = 0;
        while at < summary.len() {
            let (opcode, content) = next_in(summary, at)?;
            at = content.end;
            match Record::parse(opcode, &summary[content]).ok()? {
                Record::Schema(id, schema) => index.directory.add_schema(id, schema),
                Record::Channel(channel) => drop(index.directory.add_channel(channel)),
                Record::ChunkIndex(chunk) => index.chunks.push(chunk),
                Record::Statistics(statistics) => index.statistics = Some(statistics),
                Record::MetadataIndex(at, name) => drop(index.metadata.insert(name, at)),
                Record::AttachmentIndex(attachment) => index.attachments.push(attachment),
                _ => {}
            }
        }
        index.statistics.is_some().then_some(index)
    }

    fn fits(&self, bytes: u64) -> bool {
        let messages = self.statistics.as_ref().map_or(0, |statistics| statistics.messages);
        let inside = |chunk: &ChunkEntry| chunk.at.checked_add(chunk.bytes).is_some_and(|end| end <= bytes);
        self.chunks.iter().all(inside) && (messages == 0 || !self.chunks.is_empty())
    }

    fn by_a_pass(path: &Path) -> Result<Self, RecordingError> {
        let mut open = Open::new(path)?;
        let (mut index, mut is_in_run) = (Self::default(), false);
        loop {
            let piece = open.next_piece()?;
            let (at, bytes) = open.record();
            match piece {
                Piece::Chunk => {
                    let (first_ns, last_ns) = open.skip_chunk()?.unwrap_or((u64::MAX, 0));
                    index.chunks.push(ChunkEntry { first_ns, last_ns, at, bytes, channels: Vec::new() });
                    is_in_run = false;
                }
                Piece::Part(Part::Message(message)) => {
                    index.add_to_run(is_in_run, at, bytes, message.stamp_ns);
                    is_in_run = true;
                }
                Piece::Part(Part::Metadata(name, _)) => drop(index.metadata.insert(name, at)),
                Piece::Part(Part::Attachment(Attachment { name, data, .. })) => {
                    index.attachments.push(AttachmentEntry { name, at, bytes: data.len() as u64 });
                }
                Piece::Part(_) => {}
                Piece::End { .. } => break,
            }
        }
        index.directory = open.into_directory();
        Ok(index)
    }

    /// Takes a message that stands in no chunk, as files without chunks have them: into the run of records
    /// before it, where there is one that is not longer than a chunk.
    fn add_to_run(&mut self, is_in_run: bool, at: u64, bytes: u64, ns: u64) {
        match self.chunks.last_mut().filter(|run| is_in_run && run.bytes < CHUNK_BYTES) {
            Some(run) => {
                (run.first_ns, run.last_ns) = (run.first_ns.min(ns), run.last_ns.max(ns));
                run.bytes = at + bytes - run.at;
            }
            None => {
                let (first_ns, last_ns, channels) = (ns, ns, Vec::new());
                self.chunks.push(ChunkEntry { first_ns, last_ns, at, bytes, channels });
            }
        }
    }

    /// Whether the file itself has the index, because its writer came to an end.
    pub fn is_from_summary(&self) -> bool {
        self.is_from_summary
    }

    /// How many chunks there are.
    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// Time of the first message and of the last, nanoseconds; `None` where there is none.
    pub fn span_ns(&self) -> Option<(u64, u64)> {
        // The times of a chunk without messages are the wrong way round.
        let chunks = || self.chunks.iter().filter(|chunk| chunk.first_ns <= chunk.last_ns);
        let first = chunks().map(|chunk| chunk.first_ns).min()?;
        Some((first, chunks().map(|chunk| chunk.last_ns).max()?))
    }

    /// The names under which there are facts, wherever in the file they stand.
    pub(crate) fn metadata_names(&self) -> impl Iterator<Item = &str> {
        self.metadata.keys().map(String::as_str)
    }

    /// An attachment, read from where the index says that it lies.
    pub(crate) fn attachment(
        &self,
        path: &Path,
        entry: &AttachmentEntry,
    ) -> Result<Attachment, RecordingError> {
        let mut open = Open::new(path)?;
        let found = match open.read_at(entry.at)? {
            Record::Attachment(file) => Some(file),
            _ => None,
        };
        let found = found.filter(|file| file.name == entry.name);
        found.ok_or_else(|| open.stopped(Damage::NoIndex.into()))
    }

    /// Facts under a name, read from where the index says that they lie.
    pub(crate) fn metadata(
        &self,
        path: &Path,
        name: &str,
    ) -> Result<Option<BTreeMap<String, String>>, RecordingError> {
        let Some(&at) = self.metadata.get(name) else { return Ok(None) };
        match Open::new(path)?.read_at(at) {
            Ok(Record::Metadata(found, facts)) if found == name => Ok(Some(facts)),
            Err(error @ RecordingError::File { .. }) => Err(error),
            _ => Ok(None),
        }
    }
}
