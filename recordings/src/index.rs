//! Where in a recording its chunks lie, and when: out of the summary at the file's end, or, where a kill
//! left none, out of one pass over the file.

use std::collections::BTreeMap;
use std::path::Path;

use crate::directory::Directory;
use crate::error::RecordingError;
use crate::parts::{Open, Piece};
use crate::record_file::Stop;
use crate::records::{ChunkEntry, Record, Statistics, next_in};

/// The chunks of a recording, its topics and counts.
#[derive(Debug, Clone, Default)]
pub struct Index {
    pub(crate) chunks: Vec<ChunkEntry>,
    pub(crate) directory: Directory,
    pub(crate) statistics: Option<Statistics>,
    /// Where the metadata of a name lies; the last of that name.
    metadata: BTreeMap<String, u64>,
    pub(crate) attachments: Vec<(String, u64)>,
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
            Err(Stop::Cut | Stop::Damage(_)) => return Ok(None),
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
                Record::AttachmentIndex(_, name, bytes) => index.attachments.push((name, bytes)),
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
        let mut index = Self::default();
        loop {
            match open.next_piece()? {
                Piece::Chunk(chunk) => index.chunks.push(chunk),
                Piece::End { .. } => break,
                Piece::Part(_) => {}
            }
            open.skip_chunk()?;
        }
        index.directory = open.into_directory();
        Ok(index)
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
        let first = self.chunks.iter().map(|chunk| chunk.first_ns).min()?;
        Some((first, self.chunks.iter().map(|chunk| chunk.last_ns).max()?))
    }

    /// Facts under a name, read from where the index says that they lie.
    pub(crate) fn metadata(
        &self,
        path: &Path,
        name: &str,
    ) -> Result<Option<BTreeMap<String, String>>, RecordingError> {
        let Some(&at) = self.metadata.get(name) else { return Ok(None) };
        let mut open = Open::new(path)?;
        let read = open.file.seek(at).and_then(|()| open.file.advance());
        let opcode = match read {
            Ok(opcode) => opcode,
            Err(stop) => return Err(open.stopped(stop)),
        };
        match Record::parse(opcode, open.file.content()) {
            Ok(Record::Metadata(found, facts)) if found == name => Ok(Some(facts)),
            _ => Ok(None),
        }
    }
}
