//! Recordings out of recordings: repaired, filtered, merged, split. Messages, schemas, attachments and facts
//! go over as they are, byte for byte, whatever they mean; a file of another profile too.
//!
//! Never holds more than the chunks whose times overlap, and never writes a file by itself: who calls gives
//! the sinks.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, records as mcap_records};
use serde::Serialize;

use crate::directory::Topic;
use crate::error::RecordingError;
use crate::index::Index;
use crate::parts::{Open, Piece};
use crate::reader::{Attachment, Part, RawMessage, Recording, Selection};
use crate::records::Damage;
use crate::sequence::{Seen, Sequence};
use crate::writer::{CHUNK_BYTES, RECORDER_METADATA, RESTARTS_METADATA, TOPICS_METADATA, TopicFacts};

/// Metadata that is made anew for the messages that are really there.
const MADE_ANEW: [&str; 2] = [TOPICS_METADATA, "missing"];

/// What became of a copy.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Copied {
    /// Messages in the copy.
    pub messages: u64,
    /// Damaged chunks that were left out.
    pub lost_chunks: u64,
    /// Bytes of the original that could not be read as records.
    pub lost_bytes: u64,
    /// Whether the original had its end and its index.
    pub was_whole: bool,
}

impl Copied {
    /// Whether something of the original is not in the copy.
    pub fn has_loss(&self) -> bool {
        self.lost_chunks + self.lost_bytes > 0
    }
}

/// Writes messages as they are.
pub struct Copy<W: Write> {
    mcap: mcap::Writer<NoSeek<W>>,
    /// By topic as it is declared: its number in the copy.
    topics: Vec<(Arc<Topic>, u16)>,
    facts: BTreeMap<String, (Sequence, TopicFacts)>,
    attached: BTreeSet<(String, usize)>,
    told: BTreeSet<String>,
    messages: u64,
    bytes: u64,
}

impl<W: Write> Copy<W> {
    /// Begins a copy.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn new(sink: W) -> Result<Self, RecordingError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("sketchnav ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        Ok(Self {
            mcap: options.create(NoSeek::new(sink)).map_err(RecordingError::Write)?,
            topics: Vec::new(),
            facts: BTreeMap::new(),
            attached: BTreeSet::new(),
            told: BTreeSet::new(),
            messages: 0,
            bytes: 0,
        })
    }

    /// Messages so far.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Bytes of all messages so far, as they were before compression.
    pub fn message_bytes(&self) -> u64 {
        self.bytes
    }

    /// Declares a topic, where it is new.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn declare(&mut self, topic: &Arc<Topic>) -> Result<u16, RecordingError> {
        if let Some((_, id)) =
            self.topics.iter().find(|(known, _)| Arc::ptr_eq(known, topic) || known == topic)
        {
            return Ok(*id);
        }
        let schema = &topic.schema;
        let schema = match schema.name.is_empty() && schema.data.is_empty() {
            true => Ok(0),
            false => self.mcap.add_schema(&schema.name, &schema.encoding, &schema.data),
        };
        let id =
            schema.and_then(|id| self.mcap.add_channel(id, &topic.name, &topic.encoding, &topic.metadata));
        let id = id.map_err(RecordingError::Write)?;
        self.topics.push((Arc::clone(topic), id));
        self.facts.entry(topic.name.clone()).or_default();
        Ok(id)
    }

    /// Appends a message.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn message(&mut self, message: &RawMessage) -> Result<(), RecordingError> {
        let channel_id = self.declare(&message.topic)?;
        let header = mcap_records::MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.stamp_ns,
            publish_time: message.publish_ns,
        };
        self.mcap.write_to_known_channel(&header, &message.cdr).map_err(RecordingError::Write)?;
        self.messages += 1;
        self.bytes += message.cdr.len() as u64;
        let (sequence, facts) = self.facts.entry(message.topic.name.clone()).or_default();
        facts.see_time(message.stamp_ns);
        let after_seq = sequence.last();
        if let Seen::New { missing: missing @ 1.. } = sequence.see(message.sequence.into()) {
            facts.missing += missing;
            facts.see_gap(after_seq, missing);
        }
        Ok(())
    }

    /// Takes over a file inside the file, once.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn attachment(&mut self, file: &Attachment) -> Result<(), RecordingError> {
        if !self.attached.insert((file.name.clone(), file.data.len())) {
            return Ok(());
        }
        let (name, media_type) = (file.name.clone(), file.media_type.clone());
        let data = file.data.as_slice().into();
        let file = mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data };
        self.mcap.attach(&file).map_err(RecordingError::Write)
    }

    /// Takes over facts, once for each name.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn metadata(&mut self, name: &str, facts: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        if MADE_ANEW.contains(&name) || !self.told.insert(name.to_owned()) {
            return Ok(());
        }
        let metadata = mcap_records::Metadata { name: name.to_owned(), metadata: facts.clone() };
        self.mcap.write_metadata(&metadata).map_err(RecordingError::Write)
    }

    /// Takes over whatever it is.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn part(&mut self, part: &Part) -> Result<(), RecordingError> {
        match part {
            Part::Topic(topic) => self.declare(topic).map(drop),
            Part::Message(message) => self.message(message),
            Part::Metadata(name, facts) => self.metadata(name, facts),
            Part::Attachment(file) => self.attachment(file),
            Part::End { .. } => Ok(()),
        }
    }

    /// Ends the copy with its index and gives the sink back, flushed.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn finish(mut self) -> Result<W, RecordingError> {
        let facts = std::mem::take(&mut self.facts);
        let missing = facts.iter().map(|(topic, (_, facts))| (topic.clone(), facts.missing.to_string()));
        let missing: BTreeMap<_, _> = missing.collect();
        let json = |facts: &TopicFacts| serde_json::to_string(facts).unwrap_or_default();
        let topics = facts.iter().map(|(topic, (_, facts))| (topic.clone(), json(facts))).collect();
        for (name, metadata) in [("missing", missing), (TOPICS_METADATA, topics)] {
            let metadata = mcap_records::Metadata { name: name.to_owned(), metadata };
            self.mcap.write_metadata(&metadata).map_err(RecordingError::Write)?;
        }
        self.mcap.finish().map_err(RecordingError::Write)?;
        let mut sink = self.mcap.into_inner().into_inner();
        sink.flush().map_err(|error| RecordingError::Write(error.into()))?;
        Ok(sink)
    }
}

/// Copies all that can be read of a recording: what a kill cut off up to the cut, without the chunks that are
/// damaged.
///
/// # Errors
/// [`RecordingError::File`], [`RecordingError::Damaged`] where it is no recording at all, [`RecordingError::Write`].
pub fn recover<W: Write>(path: &Path, copy: &mut Copy<W>) -> Result<Copied, RecordingError> {
    let mut open = Open::new(path)?;
    if let Some(index) = Index::of_summary(path)? {
        // Where the chunk that declares them is damaged, the topics are known all the same.
        index.directory.topics().try_for_each(|(_, topic)| copy.declare(topic).map(drop))?;
        open.declare(&index);
    }
    let mut copied = Copied::default();
    loop {
        let at = open.file.at();
        match open.next_piece() {
            Ok(Piece::Part(part)) => copy.part(&part)?,
            Ok(Piece::Chunk(_)) => {}
            Ok(Piece::End { clean: true }) => {
                copied.was_whole = true;
                break;
            }
            Ok(Piece::End { clean: false }) => {
                if !search(&mut open, at, &mut copied)? {
                    break;
                }
            }
            Err(RecordingError::Damaged { source, .. }) => {
                if !pass_over(&mut open, at, &source, &mut copied)? {
                    break;
                }
            }
            Err(error) => return Err(error),
        }
    }
    copied.messages = copy.messages();
    Ok(copied)
}

/// Goes on behind what is damaged; false where nothing behind it makes sense.
fn pass_over(open: &mut Open, at: u64, damage: &Damage, copied: &mut Copied) -> Result<bool, RecordingError> {
    if matches!(damage, Damage::TooLong { at: record, .. } if *record == at) && !open.abandon_chunk() {
        return search(open, at, copied);
    }
    let was_chunk =
        open.abandon_chunk() || !matches!(damage, Damage::Content { kind, .. } if *kind != "chunk");
    match was_chunk {
        true => copied.lost_chunks += 1,
        false => copied.lost_bytes += open.file.at() - at,
    }
    Ok(true)
}

/// Looks for a chunk behind `at`, where the records stop making sense.
fn search(open: &mut Open, at: u64, copied: &mut Copied) -> Result<bool, RecordingError> {
    let found = open.file.find_chunk(at + 1).map_err(|stop| open.stopped(stop))?;
    copied.lost_bytes += found.unwrap_or(open.file.bytes()) - at;
    Ok(found.is_some())
}

/// Copies the messages that are wanted, in the order of the file, and everything that is no message.
///
/// # Errors
/// [`RecordingError`].
pub fn filter<W: Write>(
    recording: &Recording,
    selection: &Selection,
    copy: &mut Copy<W>,
) -> Result<(), RecordingError> {
    describe(recording, copy)?;
    for message in recording.select(selection.clone())? {
        copy.message(&message?)?;
    }
    Ok(())
}

/// Takes over what describes a recording.
fn describe<W: Write>(recording: &Recording, copy: &mut Copy<W>) -> Result<(), RecordingError> {
    for (name, facts) in recording.metadata() {
        copy.metadata(name, facts)?;
    }
    for name in [RESTARTS_METADATA, RECORDER_METADATA, "refused"] {
        if let Some(facts) = recording.index()?.metadata(recording.path(), name)? {
            copy.metadata(name, &facts)?;
        }
    }
    recording.attachments().values().try_for_each(|file| copy.attachment(file))
}

/// Copies several recordings as one, in the order of time; of what describes them the first counts.
///
/// # Errors
/// [`RecordingError`].
pub fn merge<W: Write>(recordings: &[Recording], copy: &mut Copy<W>) -> Result<(), RecordingError> {
    recordings.iter().try_for_each(|recording| describe(recording, copy))?;
    let mut lines = Vec::new();
    for recording in recordings {
        lines.push(recording.timeline(Selection::default())?.peekable());
    }
    loop {
        let time = |line: &mut std::iter::Peekable<_>| match line.peek() {
            Some(Ok::<RawMessage, RecordingError>(message)) => Some(message.stamp_ns),
            Some(Err(_)) => Some(0),
            None => None,
        };
        let times = lines.iter_mut().enumerate().filter_map(|(i, line)| Some((time(line)?, i)));
        let Some((_, earliest)) = times.min() else { return Ok(()) };
        if let Some(message) = lines[earliest].next() {
            copy.message(&message?)?;
        }
    }
}

/// When a part is full.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// Messages of so many bytes, before compression.
    Bytes(u64),
    /// So much time, nanoseconds.
    Time(u64),
}

/// What is in a part.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct PartFacts {
    /// Time of its first message, nanoseconds.
    pub first_ns: u64,
    /// Time of its last message, nanoseconds.
    pub last_ns: u64,
    /// Messages by topic.
    pub messages: BTreeMap<String, u64>,
}

/// Copies a recording in parts, in the order of time; each begins with the latched messages that were sent
/// before. `next` opens the sink of the part of that number, from 0.
///
/// # Errors
/// [`RecordingError`].
pub fn split<W: Write>(
    recording: &Recording,
    limit: Option<Limit>,
    mut next: impl FnMut(usize) -> Result<W, RecordingError>,
) -> Result<Vec<PartFacts>, RecordingError> {
    let mut latched: BTreeMap<String, RawMessage> = BTreeMap::new();
    let (mut parts, mut open): (Vec<PartFacts>, Option<Copy<W>>) = (Vec::new(), None);
    for message in recording.timeline(Selection::default())? {
        let message = message?;
        let is_full = parts.last().zip(open.as_ref()).is_some_and(|(part, copy)| match limit {
            None => false,
            Some(Limit::Bytes(bytes)) => copy.message_bytes() + message.cdr.len() as u64 > bytes,
            Some(Limit::Time(ns)) => message.stamp_ns >= part.first_ns.saturating_add(ns),
        });
        if is_full && let Some(full) = open.take() {
            full.finish()?;
        }
        if open.is_none() {
            let mut copy = Copy::new(next(parts.len())?)?;
            describe(recording, &mut copy)?;
            let (first_ns, last_ns) = (message.stamp_ns, message.stamp_ns);
            let mut part = PartFacts { first_ns, last_ns, ..PartFacts::default() };
            for (topic, old) in &latched {
                // Sent again at the part's begin, as a reader that comes late would get it.
                copy.message(&RawMessage { stamp_ns: first_ns, ..old.clone() })?;
                part.messages.insert(topic.clone(), 1);
            }
            parts.push(part);
            open = Some(copy);
        }
        if let (Some(copy), Some(part)) = (&mut open, parts.last_mut()) {
            copy.message(&message)?;
            part.last_ns = part.last_ns.max(message.stamp_ns);
            *part.messages.entry(message.topic.name.clone()).or_default() += 1;
        }
        if message.topic.is_latched() {
            latched.insert(message.topic.name.clone(), message);
        }
    }
    open.map_or(Ok(()), |last| last.finish().map(drop))?;
    Ok(parts)
}
