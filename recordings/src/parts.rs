//! Everything in a recording, piece by piece; or only what a [`Selection`] asks for, out of the chunks
//! that may hold it.

use std::collections::{BTreeSet, VecDeque};
use std::ops::Range;
use std::path::{Path, PathBuf};

use mcap::records::op;

use crate::directory::{Directory, Topic};
use crate::error::RecordingError;
use crate::index::Index;
use crate::reader::{Part, RawMessage};
use crate::record_file::{RecordFile, Stop};
use crate::records::{ChunkEntry, Damage, MessageHead, Record, next_in, unpack};

/// Which messages are wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// These topics; `None`: all.
    pub topics: Option<BTreeSet<String>>,
    /// Those of these times, nanoseconds.
    pub times_ns: Range<u64>,
}

impl Default for Selection {
    fn default() -> Self {
        Self { topics: None, times_ns: 0..u64::MAX }
    }
}

impl Selection {
    /// All messages of these topics.
    pub fn of_topics(topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { topics: Some(topics.into_iter().map(Into::into).collect()), ..Self::default() }
    }

    /// The same within these times, nanoseconds.
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

    /// Whether a chunk may hold something that is wanted.
    fn may_be_in(&self, chunk: &ChunkEntry, directory: &Directory) -> bool {
        let Range { start, end } = self.times_ns;
        let in_time = chunk.last_ns >= start && (chunk.first_ns < end || end == u64::MAX);
        let wanted = |id: &u16| directory.topic(*id).is_some_and(|topic| self.wants_topic(&topic.name));
        in_time && (self.topics.is_none() || chunk.channels.is_empty() || chunk.channels.iter().any(wanted))
    }

    /// The chunks of `index` that may hold what is wanted, in the order of the file.
    pub(crate) fn chunks(&self, index: &Index) -> Vec<ChunkEntry> {
        let wanted = index.chunks.iter().filter(|chunk| self.may_be_in(chunk, &index.directory));
        let mut chunks: Vec<_> = wanted.cloned().collect();
        chunks.sort_by_key(|chunk| chunk.at);
        chunks
    }
}

/// A part of a recording, or a chunk that begins.
pub(crate) enum Piece {
    /// A chunk, whose parts come next.
    Chunk,
    /// A part.
    Part(Part),
    /// The end; nothing comes behind it.
    End {
        /// Whether the writer came to an end.
        clean: bool,
    },
}

/// A recording that is being read.
pub(crate) struct Open {
    path: PathBuf,
    pub(crate) file: RecordFile,
    directory: Directory,
    /// Where the last record of the file begins: the chunk, within one.
    record_at: u64,
    chunk: Vec<u8>,
    offset: usize,
    messages: u64,
}

impl Open {
    pub(crate) fn new(path: &Path) -> Result<Self, RecordingError> {
        let file = RecordFile::open(path).map_err(|stop| told(path, 0, stop))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            directory: Directory::default(),
            record_at: 0,
            chunk: Vec::new(),
            offset: 0,
            messages: 0,
        })
    }

    /// Knows the topics before the file declares them.
    pub(crate) fn declare(&mut self, index: &Index) {
        self.directory = index.directory.clone();
    }

    pub(crate) fn into_directory(self) -> Directory {
        self.directory
    }

    pub(crate) fn stopped(&self, stop: Stop) -> RecordingError {
        told(&self.path, self.messages, stop)
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        self.stopped(Stop::Damage(damage))
    }

    /// The next piece.
    pub(crate) fn next_piece(&mut self) -> Result<Piece, RecordingError> {
        loop {
            let piece = if self.is_in_chunk() { self.in_chunk(&|_, _| true)? } else { self.in_file()? };
            if let Some(piece) = piece {
                return Ok(piece);
            }
        }
    }

    /// Where the last record of the file begins, and its length with its frame.
    pub(crate) fn record(&self) -> (u64, u64) {
        (self.record_at, self.file.at() - self.record_at)
    }

    /// The record that begins there.
    pub(crate) fn read_at(&mut self, at: u64) -> Result<Record<'_>, RecordingError> {
        let read = self.file.seek(at).and_then(|()| self.file.advance());
        let opcode = read.map_err(|stop| self.stopped(stop))?;
        Record::parse(opcode, self.file.content()).map_err(|kind| self.damaged(Damage::Content { at, kind }))
    }

    /// The opcode of the record that begins there and where it ends; none where the file ends before it does.
    pub(crate) fn frame_at(&mut self, at: u64) -> Result<Option<(u8, u64)>, RecordingError> {
        match self.file.frame_at(at) {
            Ok(frame) => Ok(Some(frame)),
            Err(Stop::Io(source)) => Err(self.stopped(Stop::Io(source))),
            Err(Stop::Cut(_) | Stop::Damage(_)) => Ok(None),
        }
    }

    fn in_file(&mut self) -> Result<Option<Piece>, RecordingError> {
        let at = self.file.at();
        self.record_at = at;
        let opcode = match self.file.advance() {
            Ok(opcode) => opcode,
            Err(Stop::Cut(_)) => return Ok(Some(Piece::End { clean: false })),
            Err(stop) => return Err(self.stopped(stop)),
        };
        let record = Record::parse(opcode, self.file.content());
        let record = record.map_err(|kind| self.damaged(Damage::Content { at, kind }))?;
        match record {
            Record::Chunk(head, packed) => {
                let unpacked = unpack(&head, packed, at, &mut self.chunk);
                self.offset = 0;
                unpacked.map_err(|damage| {
                    self.chunk.clear();
                    self.damaged(damage)
                })?;
                Ok(Some(Piece::Chunk))
            }
            Record::Footer(..) => Ok(Some(Piece::End { clean: true })),
            Record::Message(head, data) => {
                let raw = self.directory.topic(head.channel).map(|topic| RawMessage::new(topic, head, data));
                self.messages += 1;
                let unknown = Damage::UnknownChannel { at, channel: head.channel };
                raw.map(|raw| Some(Piece::Part(Part::Message(raw)))).ok_or_else(|| self.damaged(unknown))
            }
            record => Ok(self.directory.take(record).map(Piece::Part)),
        }
    }

    /// What comes next in the chunk; nothing where it is a message that is not wanted.
    fn in_chunk(
        &mut self,
        is_wanted: &impl Fn(&Topic, u64) -> bool,
    ) -> Result<Option<Piece>, RecordingError> {
        let at = self.record_at;
        let wrong = |kind| Damage::Content { at, kind };
        let Some((opcode, content)) = next_in(&self.chunk, self.offset) else {
            return Err(self.damaged(wrong("chunk")));
        };
        self.offset = content.end;
        let record = Record::parse(opcode, &self.chunk[content]);
        let record = record.map_err(|kind| self.damaged(wrong(kind)))?;
        let Record::Message(head, data) = record else {
            return Ok(self.directory.take(record).map(Piece::Part));
        };
        let Some(topic) = self.directory.topic(head.channel) else {
            return Err(self.damaged(Damage::UnknownChannel { at, channel: head.channel }));
        };
        self.messages += 1;
        let is_wanted = is_wanted(topic, head.log_ns);
        Ok(is_wanted.then(|| Piece::Part(Part::Message(RawMessage::new(topic, head, data)))))
    }

    /// Takes from the chunk what it declares, and passes over its messages; their earliest time and their
    /// latest, nanoseconds.
    pub(crate) fn skip_chunk(&mut self) -> Result<Option<(u64, u64)>, RecordingError> {
        let mut times: Option<(u64, u64)> = None;
        while self.offset < self.chunk.len() {
            let Some((opcode, content)) = next_in(&self.chunk, self.offset) else {
                return Err(self.damaged(Damage::Content { at: self.record_at, kind: "chunk" }));
            };
            self.offset = content.end;
            if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
                continue;
            }
            match Record::parse(opcode, &self.chunk[content]) {
                Ok(Record::Message(MessageHead { log_ns: ns, .. }, _)) => {
                    times = Some(times.map_or((ns, ns), |(first, last)| (first.min(ns), last.max(ns))));
                }
                Ok(record) => drop(self.directory.take(record)),
                Err(_) => {}
            }
        }
        Ok(times)
    }

    /// Leaves the chunk that is being read; false where there is none.
    pub(crate) fn abandon_chunk(&mut self) -> bool {
        let was_inside = self.is_in_chunk();
        self.offset = self.chunk.len();
        was_inside
    }

    /// Goes to a chunk, or to a run of messages in no chunk: itself, or the first of those.
    fn enter(&mut self, entry: &ChunkEntry) -> Result<Piece, RecordingError> {
        self.offset = self.chunk.len();
        self.file.seek(entry.at).map_err(|stop| self.stopped(stop))?;
        match self.in_file()? {
            Some(piece @ (Piece::Chunk | Piece::Part(Part::Message(_)))) => Ok(piece),
            Some(Piece::End { clean: false }) => Err(self.damaged(Damage::Cut { at: entry.at })),
            _ => Err(self.damaged(Damage::NoIndex)),
        }
    }

    fn is_in_chunk(&self) -> bool {
        self.offset < self.chunk.len()
    }
}

impl Directory {
    /// Notes what a record declares; what there is to tell of it.
    fn take(&mut self, record: Record<'_>) -> Option<Part> {
        match record {
            Record::Schema(id, schema) => {
                self.add_schema(id, schema);
                None
            }
            Record::Channel(channel) => self.add_channel(channel).map(Part::Topic),
            Record::Metadata(name, facts) => Some(Part::Metadata(name, facts)),
            Record::Attachment(attachment) => Some(Part::Attachment(attachment)),
            _ => None,
        }
    }
}

fn told(path: &Path, messages: u64, stop: Stop) -> RecordingError {
    let path = path.to_owned();
    match stop {
        Stop::Io(source) => RecordingError::File { path, source },
        Stop::Damage(source) => RecordingError::Damaged { path, messages, source },
        Stop::Cut(at) => RecordingError::Damaged { path, messages, source: Damage::Cut { at } },
    }
}

/// Everything in a recording, in the order of the file: see [`crate::Recording::parts`].
pub struct Parts {
    open: Open,
    is_over: bool,
}

impl Parts {
    pub(crate) fn of(path: &Path) -> Result<Self, RecordingError> {
        Ok(Self { open: Open::new(path)?, is_over: false })
    }
}

impl Iterator for Parts {
    type Item = Result<Part, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.is_over {
            match self.open.next_piece() {
                Ok(Piece::Part(part)) => return Some(Ok(part)),
                Ok(Piece::Chunk) => {}
                Ok(Piece::End { clean }) => {
                    self.is_over = true;
                    return Some(Ok(Part::End { clean }));
                }
                Err(error) => {
                    self.is_over = true;
                    return Some(Err(error));
                }
            }
        }
        None
    }
}

/// The messages that a [`Selection`] asks for, in the order of the file: see [`crate::Recording::select`].
pub struct Selected {
    open: Open,
    chunks: VecDeque<ChunkEntry>,
    /// Where the run of messages in no chunk ends that is being read; within a chunk, the chunk.
    run_end: u64,
    selection: Selection,
    is_over: bool,
}

impl Selected {
    pub(crate) fn of(path: &Path, index: &Index, selection: Selection) -> Result<Self, RecordingError> {
        let mut open = Open::new(path)?;
        open.directory = index.directory.clone();
        let chunks = selection.chunks(index).into();
        Ok(Self { open, chunks, run_end: 0, selection, is_over: false })
    }

    /// How many bytes of the file were read so far.
    pub fn bytes_read(&self) -> u64 {
        self.open.file.bytes_read()
    }

    /// Only those of these times.
    pub(crate) fn narrow(&mut self, times_ns: Range<u64>) {
        self.selection.times_ns = times_ns;
        let Self { selection, chunks, open, .. } = self;
        chunks.retain(|chunk| selection.may_be_in(chunk, &open.directory));
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
            // A run has no chunk in it, and ends before the file does.
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

    /// The messages of one chunk that are wanted.
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
