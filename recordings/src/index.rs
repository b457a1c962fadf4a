//! The index of a recording: the positions of its chunks and the times that they cover. It comes from the summary at the end of the
//! file or, if the recorder was killed before writing one, from one pass over the file.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;

use crate::content::Part;
use crate::directory::Directory;
use crate::error::RecordingError;
use crate::open::{Open, Piece};
use crate::record_file::Stop;
use crate::records::{Attachment, AttachmentEntry, ChunkEntry, Damage, Record, Statistics, next_in};
use crate::writer::CHUNK_BYTES;

/// The chunks of a recording, its topics and counts.
#[derive(Debug, Clone, Default)]
pub struct Index {
    pub(crate) chunks: Vec<ChunkEntry>,
    pub(crate) directory: Directory,
    pub(crate) statistics: Option<Statistics>,
    /// Offset of the last metadata record of each name, in bytes.
    metadata: BTreeMap<String, u64>,
    /// Offset and length of everything that the summary lists.
    known: BTreeMap<u64, u64>,
    pub(crate) attachments: Vec<AttachmentEntry>,
    is_from_summary: bool,
    is_cut_off: bool,
}

impl Index {
    /// Reads the index of the recording at `path`.
    ///
    /// # Errors
    /// [`RecordingError::File`], or [`RecordingError::Damaged`] if a file without a summary is not a recording.
    pub(crate) fn read(path: &Path) -> Result<Self, RecordingError> {
        match Self::of_summary(path)? {
            Some(index) => Ok(index),
            None => Self::by_a_pass(path),
        }
    }

    /// Reads the index at the end of the file. Returns `None` if there is none, or if it does not match the file.
    pub(crate) fn of_summary(path: &Path) -> Result<Option<Self>, RecordingError> {
        Self::of_summary_in(&mut Open::new(path)?)
    }

    /// Like [`Index::of_summary`], but for an open file, whose position changes.
    pub(crate) fn of_summary_in(open: &mut Open) -> Result<Option<Self>, RecordingError> {
        let summary = match open.file.summary() {
            Ok(summary) => summary,
            Err(stop @ Stop::Io(_)) => return Err(open.stopped(stop)),
            Err(Stop::Cut(_) | Stop::Damage(_)) => return Ok(None),
        };
        let Some(index) = Self::parse(&summary) else { return Ok(None) };
        let is_all = index.fits(open.file.bytes()) && index.is_all(open)?;
        Ok(is_all.then_some(index))
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
                Record::ChunkIndex(chunk) => {
                    index.known.insert(chunk.at, chunk.bytes.checked_add(chunk.index_bytes)?);
                    index.chunks.push(chunk);
                }
                Record::Statistics(statistics) => index.statistics = Some(statistics),
                Record::MetadataIndex(at, bytes, name) => {
                    index.known.insert(at, bytes);
                    index.metadata.insert(name, at);
                }
                Record::AttachmentIndex(attachment) => {
                    index.known.insert(attachment.at, attachment.record_bytes);
                    index.attachments.push(attachment);
                }
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

    /// Returns true if the summary lists every message, chunk, attachment and metadata record of the file. Other software
    /// may write messages both into chunks and between them, and need not list its attachments. Reads the frames of the
    /// records that the summary does not list.
    fn is_all(&self, open: &mut Open) -> Result<bool, RecordingError> {
        let mut at = MAGIC.len() as u64;
        loop {
            if let Some(&bytes) = self.known.get(&at) {
                let Some(end) = at.checked_add(bytes).filter(|end| *end > at) else { return Ok(false) };
                if self.known.range(at + 1..end).next().is_some() {
                    return Ok(false);
                }
                at = end;
                continue;
            }
            match open.frame_at(at)? {
                Some((op::DATA_END | op::FOOTER, _)) => return Ok(true),
                Some((op::MESSAGE | op::CHUNK | op::ATTACHMENT | op::METADATA, _)) | None => {
                    return Ok(false);
                }
                Some((_, end)) => at = end,
            }
        }
    }

    /// Builds the index of a file without a summary.
    ///
    /// # Errors
    /// Same errors as [`Index::read`].
    pub(crate) fn by_a_pass(path: &Path) -> Result<Self, RecordingError> {
        let mut open = Open::new(path)?;
        let (mut index, mut is_in_run) = (Self::default(), false);
        loop {
            let piece = open.next_piece()?;
            let (at, bytes) = open.record();
            match piece {
                Piece::Chunk => {
                    let (first_ns, last_ns) = open.skip_chunk()?.unwrap_or((u64::MAX, 0));
                    index.chunks.push(entry(first_ns, last_ns, at, bytes));
                    is_in_run = false;
                }
                Piece::Part(Part::Message(message)) => {
                    index.add_to_run(is_in_run, at, bytes, message.stamp_ns);
                    is_in_run = true;
                }
                Piece::Part(Part::Metadata(name, _)) => drop(index.metadata.insert(name, at)),
                Piece::Part(Part::Attachment(Attachment { name, data, .. })) => {
                    let (record_bytes, bytes) = (bytes, data.len() as u64);
                    index.attachments.push(AttachmentEntry { name, at, record_bytes, bytes });
                }
                Piece::Part(_) => {}
                Piece::End { clean } => {
                    index.is_cut_off = !clean;
                    break;
                }
            }
        }
        index.directory = open.into_directory();
        Ok(index)
    }

    /// Adds a message that is not in a chunk, as in files without chunks. The message joins the run of records before it,
    /// unless that is already as long as a chunk.
    fn add_to_run(&mut self, is_in_run: bool, at: u64, bytes: u64, ns: u64) {
        match self.chunks.last_mut().filter(|run| is_in_run && run.bytes < CHUNK_BYTES) {
            Some(run) => {
                (run.first_ns, run.last_ns) = (run.first_ns.min(ns), run.last_ns.max(ns));
                run.bytes = at + bytes - run.at;
            }
            None => self.chunks.push(entry(ns, ns, at, bytes)),
        }
    }

    /// Returns true if the index comes from the file's own summary, which means that the writer finished.
    pub fn is_from_summary(&self) -> bool {
        self.is_from_summary
    }

    /// Returns true if the file ends before its writer finished, whether inside a record or after a complete one.
    pub fn is_cut_off(&self) -> bool {
        self.is_cut_off
    }

    /// Returns the number of chunks.
    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// Returns the times of the first and the last message, in nanoseconds, or `None` if there is no message.
    pub fn span_ns(&self) -> Option<(u64, u64)> {
        // A chunk without messages has its times reversed.
        let chunks = || self.chunks.iter().filter(|chunk| chunk.first_ns <= chunk.last_ns);
        let first = chunks().map(|chunk| chunk.first_ns).min()?;
        Some((first, chunks().map(|chunk| chunk.last_ns).max()?))
    }

    /// Returns the names of all metadata records, wherever they are in the file.
    pub(crate) fn metadata_names(&self) -> impl Iterator<Item = &str> {
        self.metadata.keys().map(String::as_str)
    }

    /// Reads an attachment at the position from the index.
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

    /// Reads the metadata of a name at the position from the index.
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

/// Returns an entry for a chunk or a run whose channels are unknown.
fn entry(first_ns: u64, last_ns: u64, at: u64, bytes: u64) -> ChunkEntry {
    ChunkEntry { first_ns, last_ns, at, bytes, index_bytes: 0, channels: Vec::new() }
}
