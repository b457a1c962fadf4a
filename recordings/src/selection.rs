//! Selects messages, and reads them from the chunks that may contain them.

use std::collections::{BTreeSet, VecDeque};
use std::ops::Range;
use std::path::Path;

use crate::content::{Part, RawMessage};
use crate::directory::{Directory, Topic};
use crate::error::RecordingError;
use crate::index::Index;
use crate::open::{Open, Piece};
use crate::records::{ChunkEntry, Damage};

/// The topics and times of the messages to select.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// The topics, or `None` for all of them.
    pub topics: Option<BTreeSet<String>>,
    /// The times, in nanoseconds.
    pub times_ns: Range<u64>,
}

impl Default for Selection {
    fn default() -> Self {
        Self { topics: None, times_ns: 0..u64::MAX }
    }
}

impl Selection {
    /// Selects all messages of these topics.
    pub fn of_topics(topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { topics: Some(topics.into_iter().map(Into::into).collect()), ..Self::default() }
    }

    /// Restricts the selection to these times, in nanoseconds.
    #[must_use]
    pub fn between(self, times_ns: Range<u64>) -> Self {
        Self { times_ns, ..self }
    }

    pub(crate) fn wants_topic(&self, name: &str) -> bool {
        self.topics.as_ref().is_none_or(|topics| topics.contains(name))
    }

    fn wants_time(&self, ns: u64) -> bool {
        self.times_ns.contains(&ns) || (ns == u64::MAX && self.times_ns.end == u64::MAX)
    }

    fn wants(&self, topic: &Topic, ns: u64) -> bool {
        self.wants_topic(&topic.name) && self.wants_time(ns)
    }

    /// Returns true if a chunk may contain a selected message.
    fn may_be_in(&self, chunk: &ChunkEntry, directory: &Directory) -> bool {
        let Range { start, end } = self.times_ns;
        let in_time = chunk.last_ns >= start && (chunk.first_ns < end || end == u64::MAX);
        let wanted = |id: &u16| directory.topic(*id).is_some_and(|topic| self.wants_topic(&topic.name));
        in_time && (self.topics.is_none() || chunk.channels.is_empty() || chunk.channels.iter().any(wanted))
    }

    /// Returns the chunks of `index` that may contain selected messages, in the order of the file.
    pub(crate) fn chunks(&self, index: &Index) -> Vec<ChunkEntry> {
        let wanted = index.chunks.iter().filter(|chunk| self.may_be_in(chunk, &index.directory));
        let mut chunks: Vec<_> = wanted.cloned().collect();
        chunks.sort_by_key(|chunk| chunk.at);
        chunks
    }
}

/// An iterator over the messages of a [`Selection`], in the order of the file. See [`crate::Recording::select`].
pub struct Selected {
    open: Open,
    chunks: VecDeque<ChunkEntry>,
    /// End of the current run of messages outside chunks or, while a chunk is read, of the chunk.
    run_end: u64,
    selection: Selection,
    is_over: bool,
}

impl Selected {
    pub(crate) fn of(path: &Path, index: &Index, selection: Selection) -> Result<Self, RecordingError> {
        let mut open = Open::new(path)?;
        open.declare(&index.directory);
        let chunks = selection.chunks(index).into();
        Ok(Self { open, chunks, run_end: 0, selection, is_over: false })
    }

    /// Returns the number of bytes of the file that have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.open.file.bytes_read()
    }

    /// Restricts the selection to these times, in nanoseconds.
    pub(crate) fn narrow(&mut self, times_ns: Range<u64>) {
        self.selection.times_ns = times_ns;
        let Self { selection, chunks, open, .. } = self;
        chunks.retain(|chunk| selection.may_be_in(chunk, open.directory()));
    }

    fn step(&mut self) -> Result<Option<RawMessage>, RecordingError> {
        loop {
            if let Some(Piece::Part(Part::Message(message))) = self.next_piece()?
                && self.selection.wants(&message.topic, message.stamp_ns)
            {
                return Ok(Some(message));
            }
            if self.chunks.is_empty() && !self.is_inside() {
                return Ok(None);
            }
        }
    }

    fn is_inside(&self) -> bool {
        self.open.is_in_chunk() || self.open.file.at() < self.run_end
    }

    fn next_piece(&mut self) -> Result<Option<Piece>, RecordingError> {
        if self.open.is_in_chunk() {
            let selection = &self.selection;
            return self.open.in_chunk(&|topic, ns| selection.wants(topic, ns));
        }
        if self.is_inside() {
            // A run contains no chunk, and ends before the file does.
            return match self.open.in_file()? {
                Some(Piece::Chunk | Piece::End { .. }) => Err(self.open.damaged(Damage::NoIndex)),
                piece => Ok(piece),
            };
        }
        let Some(entry) = self.chunks.pop_front() else { return Ok(None) };
        let piece = self.open.enter(&entry)?;
        let is_chunk = matches!(piece, Piece::Chunk);
        self.run_end = if is_chunk { self.open.file.at() } else { entry.at.saturating_add(entry.bytes) };
        Ok(Some(piece))
    }

    /// Passes the selected messages of one chunk to `each`.
    pub(crate) fn of_chunk(
        &mut self,
        chunk: ChunkEntry,
        mut each: impl FnMut(RawMessage),
    ) -> Result<(), RecordingError> {
        self.chunks = VecDeque::from([chunk]);
        while let Some(message) = self.step()? {
            each(message);
        }
        Ok(())
    }
}

impl Iterator for Selected {
    type Item = Result<RawMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let step = self.step().transpose();
        self.is_over = !matches!(step, Some(Ok(_)));
        step
    }
}
