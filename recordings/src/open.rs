//! An open recording, which yields its records one after another and decompresses the chunks.

use std::path::{Path, PathBuf};

use mcap::records::op;

use crate::content::{Part, RawMessage, is_packed};
use crate::directory::{Directory, Topic};
use crate::error::RecordingError;
use crate::record_file::{RecordFile, Stop};
use crate::records::{
    ChunkEntry, Damage, FRAME_BYTES, MessageHead, Record, chunk_bytes, is_odd, next_in, unpack,
};

/// A part of a recording, or the beginning of a chunk.
pub(crate) enum Piece {
    /// A chunk, followed by its parts.
    Chunk,
    /// A part.
    Part(Part),
    /// The end, after which nothing follows.
    End {
        /// True if the writer finished.
        clean: bool,
    },
}

/// Name of a record of an unknown kind, for errors.
pub(crate) const ODD: &str = "unknown";

/// A recording that is being read.
pub(crate) struct Open {
    path: PathBuf,
    pub(crate) file: RecordFile,
    directory: Directory,
    /// Offset of the last record that was read or, for a record inside a chunk, of the chunk.
    record_at: u64,
    chunk: Vec<u8>,
    offset: usize,
    messages: u64,
    /// Number of `messages` that were compressed individually.
    packed: u64,
    /// True if a record that would otherwise be skipped counts as damage.
    is_wary: bool,
    /// True if a chunk with a wrong checksum is read anyway.
    keeps_damaged: bool,
    /// Number of chunks with a wrong checksum that were read.
    kept: u64,
}

impl Open {
    pub(crate) fn new(path: &Path) -> Result<Self, RecordingError> {
        let file = RecordFile::open(path).map_err(|stop| recording_error(path, 0, stop))?;
        Ok(Self::of(path, file))
    }

    /// Opens a recording whose magic may be damaged, and returns whether it is.
    pub(crate) fn damaged_file(path: &Path) -> Result<(Self, bool), RecordingError> {
        let (file, is_damaged) =
            RecordFile::open_damaged(path).map_err(|stop| recording_error(path, 0, stop))?;
        Ok((Self::of(path, file), is_damaged))
    }

    fn of(path: &Path, file: RecordFile) -> Self {
        Self {
            path: path.to_owned(),
            file,
            directory: Directory::default(),
            record_at: 0,
            chunk: Vec::new(),
            offset: 0,
            messages: 0,
            packed: 0,
            is_wary: false,
            keeps_damaged: false,
            kept: 0,
        }
    }

    /// Returns the number of messages so far that were compressed individually.
    pub(crate) fn packed(&self) -> u64 {
        self.packed
    }

    /// From now on, treats records of unknown kind as damage.
    pub(crate) fn be_wary(&mut self) {
        self.is_wary = true;
    }

    /// From now on, reads chunks with a wrong checksum if they unpack to their stated length.
    pub(crate) fn keep_damaged(&mut self) {
        self.keeps_damaged = true;
    }

    /// Returns the number of chunks with a wrong checksum that were read anyway.
    pub(crate) fn kept(&self) -> u64 {
        self.kept
    }

    /// Returns the number of messages in the chunk that ends at `end` according to the index records after it, or `None` if
    /// there are no such records. The position in the file stays the same.
    pub(crate) fn messages_by_index(&mut self, end: u64) -> Result<Option<u64>, RecordingError> {
        /// The channel and the length of the entries.
        const HEAD: u64 = 2 + 4;
        const ENTRY: u64 = 8 + 8;
        let (next, mut at, mut messages) = (self.file.at(), end, None);
        while let Some((op::MESSAGE_INDEX, record_end)) = self.frame_at(at)? {
            let entries = (record_end - at).saturating_sub(FRAME_BYTES + HEAD) / ENTRY;
            *messages.get_or_insert(0) += entries;
            at = record_end;
        }
        self.file.seek(next).map_err(|stop| self.stopped(stop))?;
        Ok(messages)
    }

    /// Declares topics before the file does.
    pub(crate) fn declare(&mut self, directory: &Directory) {
        self.directory = directory.clone();
    }

    /// Returns the topics known so far.
    pub(crate) fn directory(&self) -> &Directory {
        &self.directory
    }

    pub(crate) fn into_directory(self) -> Directory {
        self.directory
    }

    pub(crate) fn stopped(&self, stop: Stop) -> RecordingError {
        recording_error(&self.path, self.messages, stop)
    }

    pub(crate) fn damaged(&self, damage: Damage) -> RecordingError {
        self.stopped(Stop::Damage(damage))
    }

    /// Reads the next piece.
    pub(crate) fn next_piece(&mut self) -> Result<Piece, RecordingError> {
        loop {
            let piece = if self.is_in_chunk() { self.in_chunk(&|_, _| true)? } else { self.in_file()? };
            if let Some(piece) = piece {
                return Ok(piece);
            }
        }
    }

    /// Returns the position of the last record that was read, and its length including its frame.
    pub(crate) fn record(&self) -> (u64, u64) {
        (self.record_at, self.file.at() - self.record_at)
    }

    /// Reads the record that begins at `at`.
    pub(crate) fn read_at(&mut self, at: u64) -> Result<Record<'_>, RecordingError> {
        let read = self.file.seek(at).and_then(|()| self.file.advance());
        let opcode = read.map_err(|stop| self.stopped(stop))?;
        Record::parse(opcode, self.file.content()).map_err(|kind| self.damaged(Damage::Content { at, kind }))
    }

    /// Returns the opcode of the record that begins at `at` and where it ends, or `None` if the file ends before the record
    /// does.
    pub(crate) fn frame_at(&mut self, at: u64) -> Result<Option<(u8, u64)>, RecordingError> {
        match self.file.frame_at(at) {
            Ok(frame) => Ok(Some(frame)),
            Err(Stop::Io(source)) => Err(self.stopped(Stop::Io(source))),
            Err(Stop::Cut(_) | Stop::Damage(_)) => Ok(None),
        }
    }

    pub(crate) fn in_file(&mut self) -> Result<Option<Piece>, RecordingError> {
        let at = self.file.at();
        self.record_at = at;
        let opcode = match self.file.advance() {
            Ok(opcode) => opcode,
            Err(Stop::Cut(_)) => return Ok(Some(Piece::End { clean: false })),
            Err(stop) => return Err(self.stopped(stop)),
        };
        if self.is_wary && is_odd(opcode, self.file.content()) {
            return Err(self.damaged(Damage::Content { at, kind: ODD }));
        }
        let record = Record::parse(opcode, self.file.content());
        let record = record.map_err(|kind| self.damaged(Damage::Content { at, kind }))?;
        match record {
            Record::Chunk(head, packed) => {
                let end = at + FRAME_BYTES + chunk_bytes(&head, packed);
                let mut unpacked = unpack(&head, packed, at, &mut self.chunk);
                self.offset = 0;
                if self.keeps_damaged && matches!(unpacked, Err(Damage::Checksum { .. })) {
                    (unpacked, self.kept) = (Ok(()), self.kept + 1);
                }
                unpacked.map_err(|damage| {
                    self.chunk.clear();
                    self.damaged(damage)
                })?;
                if self.is_wary && end < self.file.at() {
                    // The record's stated length may be wrong and cover the next chunk, so continue where the chunk's own
                    // content ends.
                    self.file.seek(end).map_err(|stop| self.stopped(stop))?;
                }
                Ok(Some(Piece::Chunk))
            }
            Record::Footer(..) => Ok(Some(Piece::End { clean: true })),
            Record::Message(head, data) => {
                let raw = self.directory.topic(head.channel).map(|topic| RawMessage::new(topic, head, data));
                self.messages += 1;
                self.packed += u64::from(is_packed(data));
                let unknown = Damage::UnknownChannel { at, channel: head.channel };
                raw.map(|raw| Some(Piece::Part(Part::Message(raw)))).ok_or_else(|| self.damaged(unknown))
            }
            record => Ok(self.directory.take(record).map(Piece::Part)),
        }
    }

    /// Reads the next record in the chunk. Returns `None` if it yields no part, or a message that is not wanted.
    pub(crate) fn in_chunk(
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
        self.packed += u64::from(is_packed(data));
        let is_wanted = is_wanted(topic, head.log_ns);
        Ok(is_wanted.then(|| Piece::Part(Part::Message(RawMessage::new(topic, head, data)))))
    }

    /// Takes over the declarations in the rest of the chunk and skips its messages. Returns their earliest and latest time, in
    /// nanoseconds.
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

    /// Abandons the current chunk. Returns false if there is none.
    pub(crate) fn abandon_chunk(&mut self) -> bool {
        let was_inside = self.is_in_chunk();
        self.offset = self.chunk.len();
        was_inside
    }

    /// Moves to a chunk, or to a run of messages outside chunks. Returns the chunk, or the first message of the run.
    pub(crate) fn enter(&mut self, entry: &ChunkEntry) -> Result<Piece, RecordingError> {
        self.offset = self.chunk.len();
        self.file.seek(entry.at).map_err(|stop| self.stopped(stop))?;
        match self.in_file()? {
            Some(piece @ (Piece::Chunk | Piece::Part(Part::Message(_)))) => Ok(piece),
            Some(Piece::End { clean: false }) => Err(self.damaged(Damage::Cut { at: entry.at })),
            _ => Err(self.damaged(Damage::NoIndex)),
        }
    }

    pub(crate) fn is_in_chunk(&self) -> bool {
        self.offset < self.chunk.len()
    }
}

impl Directory {
    /// Takes over the declaration in a record. Returns the record as a part, if it is one.
    fn take(&mut self, record: Record<'_>) -> Option<Part> {
        match record {
            Record::Header(header) => {
                self.header = header;
                None
            }
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

fn recording_error(path: &Path, messages: u64, stop: Stop) -> RecordingError {
    let path = path.to_owned();
    match stop {
        Stop::Damage(Damage::NoMcap(found)) => RecordingError::Foreign { path, found },
        Stop::Io(source) => RecordingError::File { path, source },
        Stop::Damage(source) => RecordingError::Damaged { path, messages, source },
        Stop::Cut(at) => RecordingError::Damaged { path, messages, source: Damage::Cut { at } },
    }
}
