//! Creates recordings from other ones: repairs, filters, merges and splits them. Messages, schemas, attachments and metadata
//! are copied byte for byte, regardless of their content, even from a file with another profile.
//!
//! Only the chunks whose times overlap are in memory at any time, and files are only written to sinks that
//! the caller provides.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use mcap::records as mcap_records;
use serde::Serialize;
use sketchnav_schemas::channels::has_many_writers;

use crate::content::{Part, RawMessage};
use crate::directory::Topic;
use crate::error::RecordingError;
use crate::facts::TopicFacts;
use crate::index::Index;
use crate::open::{ODD, Open, Piece};
use crate::reader::Recording;
use crate::records::{Attachment, Damage, FRAME_BYTES};
use crate::rejected::{DAMAGED, Rejections};
use crate::selection::Selection;
use crate::sequence::Sequence;
use crate::writer::{Mcap, TOPICS_METADATA, begin};

/// Metadata that is not copied, because it is generated again for the messages of the copy.
const REGENERATED: [&str; 2] = [TOPICS_METADATA, "missing"];

/// The result of a copy.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Copied {
    /// Number of messages in the copy.
    pub messages: u64,
    /// Number of damaged chunks that were left out.
    pub lost_chunks: u64,
    /// Number of bytes of the original that could not be read as records.
    pub lost_bytes: u64,
    /// The parts that were left out.
    pub lost: Vec<Lost>,
    /// Number of chunks with a wrong checksum that were copied on request.
    pub kept_damaged: u64,
    /// True if the original had its end and its index.
    pub was_whole: bool,
}

/// A part of a recording that was left out of a copy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Lost {
    /// Offset of the part in the file, in bytes.
    pub at: u64,
    /// Length of the part, in bytes.
    pub bytes: u64,
    /// The reason why the part was left out.
    pub reason: String,
    /// Number of messages in the part, if given in the file.
    pub messages: Option<u64>,
}

/// What to do with chunks whose checksum is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Damaged {
    /// Leaves these chunks out.
    #[default]
    LeaveOut,
    /// Copies their messages, if they can be told apart.
    Keep,
}

impl Copied {
    /// Returns true if something in the original is not in the copy.
    pub fn has_loss(&self) -> bool {
        self.lost_chunks + self.lost_bytes > 0
    }
}

/// Number of messages in a recording, even if it is damaged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held {
    /// Number of readable messages, plus the number in unreadable parts as given in the file.
    pub messages: u64,
    /// True if the file gives the number of messages in each damaged part, so that there cannot be any others.
    pub is_known: bool,
}

/// Writes a copy of a recording. Messages are copied unchanged.
pub struct Copy<W: Write> {
    mcap: Mcap<W>,
    /// The declared topics, each with its number in the copy.
    topics: Vec<(Arc<Topic>, u16)>,
    counts: BTreeMap<String, Count>,
    /// Topics whose messages before the first one were left out on purpose, and therefore do not count as missing.
    late: BTreeSet<String>,
    attached: BTreeSet<String>,
    described: BTreeSet<String>,
    messages: u64,
    bytes: u64,
    left_out: Rejections,
}

/// The counts of a topic so far.
#[derive(Default)]
struct Count {
    /// `None` before the first sequence number.
    sequence: Option<Sequence>,
    facts: TopicFacts,
}

impl<W: Write> Copy<W> {
    /// Begins a copy of ROS 2 messages.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if `sink` fails.
    pub fn new(sink: W) -> Result<Self, RecordingError> {
        Self::of_profile(sink, "ros2")
    }

    /// Like [`Copy::new`], for messages of the profile that the original declares.
    ///
    /// # Errors
    /// Same errors as [`Copy::new`].
    pub fn of_profile(sink: W, profile: &str) -> Result<Self, RecordingError> {
        Ok(Self {
            mcap: begin(sink, profile)?,
            topics: Vec::new(),
            counts: BTreeMap::new(),
            late: BTreeSet::new(),
            attached: BTreeSet::new(),
            described: BTreeSet::new(),
            messages: 0,
            bytes: 0,
            left_out: Rejections::default(),
        })
    }

    /// Continues after another copy, whose last sequence numbers are `last`. Messages in that copy do not count as missing
    /// in this one.
    fn resume_after(&mut self, last: &BTreeMap<String, u64>) {
        let continued = |(topic, last): (&String, &u64)| {
            (topic.clone(), Count { sequence: Some(Sequence::after(*last)), ..Count::default() })
        };
        self.counts = last.iter().map(continued).collect();
    }

    /// Declares that messages before the first one of these topics are left out on purpose, and therefore do not count as
    /// missing.
    pub(crate) fn begins_late(&mut self, topics: BTreeSet<String>) {
        self.late = topics;
    }

    /// Returns the last sequence number of each topic.
    fn last_numbers(&self) -> BTreeMap<String, u64> {
        let last = |(topic, count): (&String, &Count)| Some((topic.clone(), count.sequence.as_ref()?.last()));
        self.counts.iter().filter_map(last).collect()
    }

    /// Returns the number of messages so far.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Returns the size of all messages so far before compression, in bytes.
    pub fn message_bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the damaged messages that were left out. See [`RawMessage::is_damaged`].
    pub fn left_out(&self) -> &Rejections {
        &self.left_out
    }

    /// Declares a topic if it is new, and returns its number in the copy.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
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
        self.counts.entry(topic.name.clone()).or_default();
        Ok(id)
    }

    /// Appends a message. A damaged message is counted and left out.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn message(&mut self, message: &RawMessage) -> Result<(), RecordingError> {
        let channel_id = self.declare(&message.topic)?;
        if message.is_damaged() {
            self.left_out.count_damaged(message);
            return Ok(());
        }
        let header = mcap_records::MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.stamp_ns,
            publish_time: message.publish_ns,
        };
        self.mcap.write_to_known_channel(&header, &message.cdr).map_err(RecordingError::Write)?;
        self.messages += 1;
        self.bytes += message.cdr.len() as u64;
        self.count(message);
        Ok(())
    }

    fn count(&mut self, message: &RawMessage) {
        let (name, seq) = (&message.topic.name, u64::from(message.sequence));
        let Some(count) = self.counts.get_mut(name) else { return };
        let first = if self.late.contains(name) { seq.saturating_sub(1) } else { 0 };
        let sequence = count.sequence.get_or_insert_with(|| Sequence::after(first));
        count.facts.see_time(message.stamp_ns);
        count.facts.see_number(sequence, has_many_writers(name), seq);
    }

    /// Copies an attachment, unless one with the same name was copied before.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn attachment(&mut self, file: &Attachment) -> Result<(), RecordingError> {
        if !self.attached.insert(file.name.clone()) {
            return Ok(());
        }
        let (name, media_type) = (file.name.clone(), file.media_type.clone());
        let data = file.data.as_slice().into();
        let file = mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data };
        self.mcap.attach(&file).map_err(RecordingError::Write)
    }

    /// Copies metadata, unless metadata with the same name was copied before.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn metadata(&mut self, name: &str, facts: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        if REGENERATED.contains(&name) || !self.described.insert(name.to_owned()) {
            return Ok(());
        }
        let metadata = mcap_records::Metadata { name: name.to_owned(), metadata: facts.clone() };
        self.mcap.write_metadata(&metadata).map_err(RecordingError::Write)
    }

    /// Copies a part of any kind.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn part(&mut self, part: &Part) -> Result<(), RecordingError> {
        match part {
            Part::Topic(topic) => self.declare(topic).map(drop),
            Part::Message(message) => self.message(message),
            Part::Metadata(name, facts) => self.metadata(name, facts),
            Part::Attachment(file) => self.attachment(file),
            Part::End { .. } => Ok(()),
        }
    }

    /// Ends the copy with its index and returns the flushed sink.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn finish(mut self) -> Result<W, RecordingError> {
        let missing = |(topic, count): (&String, &Count)| (topic.clone(), count.facts.missing.to_string());
        let missing: BTreeMap<_, _> = self.counts.iter().map(missing).collect();
        let topics = self.counts.iter().map(|(topic, count)| Ok((topic.clone(), count.facts.to_json()?)));
        let topics = topics.collect::<Result<BTreeMap<_, _>, RecordingError>>()?;
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

/// Copies everything in a recording that can be read. A recording that was cut off by a kill is read up to
/// the cut. Damaged chunks and a damaged beginning are left out and listed.
///
/// # Errors
/// [`RecordingError::File`] if the file cannot be read, [`RecordingError::Foreign`] or [`RecordingError::Damaged`] if it is
/// not a recording at all, and [`RecordingError::Write`] if the sink fails.
pub fn recover<W: Write>(
    path: &Path,
    damaged: Damaged,
    copy: &mut Copy<W>,
) -> Result<Copied, RecordingError> {
    if let Some(index) = Index::of_summary_in(&mut Open::damaged_file(path)?.0)? {
        // This makes the topics known even if the chunk that declares them is damaged.
        index.directory.topics().try_for_each(|(_, topic)| copy.declare(topic).map(drop))?;
    }
    let copied = Salvage::of(path, damaged)?.run(|part| copy.part(&part))?;
    Ok(Copied { messages: copy.messages(), ..copied })
}

/// Counts the messages of a recording. A copy that replaces the recording must not have fewer.
///
/// # Errors
/// Same errors as [`recover`].
pub fn held(path: &Path) -> Result<Held, RecordingError> {
    let stated = Index::of_summary_in(&mut Open::damaged_file(path)?.0)?.and_then(|index| index.statistics);
    let copied = Salvage::of(path, Damaged::LeaveOut)?.run(|_| Ok(()))?;
    let lost: u64 = copied.lost.iter().filter_map(|lost| lost.messages).sum();
    let messages = (copied.messages + lost).max(stated.map_or(0, |statistics| statistics.messages));
    Ok(Held { messages, is_known: copied.lost.iter().all(|lost| lost.messages.is_some()) })
}

/// Returns the profile that a recording declares, no matter how damaged it is: `ros2`, `ros1`, or empty.
///
/// # Errors
/// Same errors as [`recover`].
pub fn profile(path: &Path) -> Result<String, RecordingError> {
    let (mut open, _) = Open::damaged_file(path)?;
    // Reads the first record. If it is damaged, the profile stays empty.
    let _ = open.in_file();
    Ok(open.directory().header.profile.clone())
}

/// Maximum number of lost parts that are listed individually.
const MAX_LOST: usize = 1000;

/// A pass over a recording that may be damaged anywhere.
struct Salvage {
    open: Open,
    copied: Copied,
    /// Number of messages read before the current chunk.
    before_chunk: u64,
}

impl Salvage {
    fn of(path: &Path, damaged: Damaged) -> Result<Self, RecordingError> {
        let (mut open, has_no_magic) = Open::damaged_file(path)?;
        if let Some(index) = Index::of_summary_in(&mut Open::damaged_file(path)?.0)? {
            open.declare(&index.directory);
        }
        open.be_wary();
        if damaged == Damaged::Keep {
            open.keep_damaged();
        }
        let lost_bytes = if has_no_magic { mcap::MAGIC.len() as u64 } else { 0 };
        Ok(Self { open, copied: Copied { lost_bytes, ..Copied::default() }, before_chunk: 0 })
    }

    /// Passes every part that can be read to `take`.
    fn run(
        mut self,
        mut take: impl FnMut(Part) -> Result<(), RecordingError>,
    ) -> Result<Copied, RecordingError> {
        loop {
            let next = self.open.next_piece();
            // Redundant records may precede the piece, so its position is only known now.
            let (at, _) = self.open.record();
            let continues = match next {
                Ok(Piece::Part(Part::Message(message))) if message.is_damaged() => {
                    self.lose_message(at, &message);
                    true
                }
                Ok(Piece::Part(part)) => {
                    self.copied.messages += u64::from(matches!(part, Part::Message(_)));
                    take(part)?;
                    true
                }
                Ok(Piece::Chunk) => {
                    self.before_chunk = self.copied.messages;
                    true
                }
                Ok(Piece::End { clean: true }) => {
                    self.copied.was_whole = true;
                    false
                }
                Ok(Piece::End { clean: false }) => self.search(at, "the file ends within it")?,
                Err(RecordingError::Damaged { source, .. }) => self.pass_over(at, &source)?,
                Err(error) => return Err(error),
            };
            if !continues {
                self.copied.kept_damaged = self.open.kept();
                return Ok(self.copied);
            }
        }
    }

    /// Continues after a damaged part. Returns false if nothing readable follows it.
    fn pass_over(&mut self, at: u64, damage: &Damage) -> Result<bool, RecordingError> {
        let was_inside = self.open.abandon_chunk();
        let end = self.open.file.at();
        if !was_inside && end - at <= FRAME_BYTES && matches!(damage, Damage::TooLong { .. }) {
            // Only the length of the record was read, and it is invalid.
            return self.search(at, &damage.to_string());
        }
        let reason = damage.to_string();
        if was_inside || is_of_chunk(damage) {
            let read = if was_inside { self.copied.messages - self.before_chunk } else { 0 };
            let indexed = self.open.messages_by_index(end)?;
            let messages = indexed.map(|indexed| indexed.saturating_sub(read));
            self.copied.lost_chunks += 1;
            self.lose(Lost { at, bytes: end - at, reason, messages });
        } else {
            self.copied.lost_bytes += end - at;
            if holds_something(damage) {
                let messages = matches!(damage, Damage::UnknownChannel { .. }).then_some(1);
                self.lose(Lost { at, bytes: end - at, reason, messages });
            }
        }
        Ok(true)
    }

    /// Searches for a chunk after `at`, where the records stop making sense. Returns false if there is none.
    fn search(&mut self, at: u64, reason: &str) -> Result<bool, RecordingError> {
        let found = self.open.file.find_chunk(at + 1).map_err(|stop| self.open.stopped(stop))?;
        let bytes = found.unwrap_or(self.open.file.bytes()) - at;
        self.copied.lost_bytes += bytes;
        if bytes > 0 {
            self.lose(Lost { at, bytes, reason: reason.to_owned(), messages: None });
        }
        Ok(found.is_some())
    }

    /// Leaves out one message of the chunk that begins at byte `at`.
    fn lose_message(&mut self, at: u64, message: &RawMessage) {
        let bytes = message.cdr.len() as u64;
        let reason = format!("{}, message {}: {DAMAGED}", message.topic.name, message.sequence);
        self.copied.lost_bytes += bytes;
        self.lose(Lost { at, bytes, reason, messages: Some(1) });
    }

    fn lose(&mut self, lost: Lost) {
        if self.copied.lost.len() < MAX_LOST {
            self.copied.lost.push(lost);
        }
    }
}

/// Returns true if a chunk as a whole is damaged, rather than another record of the file.
fn is_of_chunk(damage: &Damage) -> bool {
    match damage {
        Damage::Content { kind, .. } | Damage::Checksum { kind, .. } => *kind == "chunk",
        Damage::TooLong { .. } | Damage::Compression { .. } | Damage::Decompression { .. } => true,
        _ => false,
    }
}

/// Returns true if the damaged record, which is not a chunk, had content of its own. Records of the index only repeat content.
fn holds_something(damage: &Damage) -> bool {
    match damage {
        Damage::Content { kind, .. } => {
            matches!(*kind, "schema" | "channel" | "message" | "metadata" | "attachment" | ODD)
        }
        _ => true,
    }
}

/// Copies the selected messages in the order of the file, and everything that is not a message. If the selected times begin
/// after the recording does, nothing counts as missing before a topic's first message.
///
/// # Errors
/// [`RecordingError`] if the recording cannot be read or the copy cannot be written.
pub fn filter<W: Write>(
    recording: &Recording,
    selection: &Selection,
    copy: &mut Copy<W>,
) -> Result<(), RecordingError> {
    describe(recording, copy)?;
    copy.late = match selection.times_ns.start {
        0 => late_topics(recording)?,
        _ => topic_names(recording)?,
    };
    for message in recording.select(selection.clone())? {
        copy.message(&message?)?;
    }
    Ok(())
}

/// Copies the selected messages of the parts of a growing recording, in order of time, as a separate recording. It begins
/// with the latched messages that were sent earlier.
///
/// # Errors
/// [`RecordingError`] if a part cannot be read or the copy cannot be written.
pub fn window<W: Write>(
    parts: &[Recording],
    selection: &Selection,
    copy: &mut Copy<W>,
) -> Result<(), RecordingError> {
    let start_ns = selection.times_ns.start;
    let mut latched = BTreeMap::new();
    for part in parts {
        describe(part, copy)?;
        copy.late.extend(topic_names(part)?);
        part.topics()?.iter().try_for_each(|topic| match selection.wants_topic(&topic.name) {
            true => copy.declare(topic).map(drop),
            false => Ok(()),
        })?;
        let before = part.latched_before(start_ns)?.into_iter();
        let before = before.filter(|message| selection.wants_topic(&message.topic.name));
        latched.extend(before.map(|message| (message.topic.name.clone(), message)));
    }
    for message in latched.into_values() {
        copy.message(&RawMessage { stamp_ns: start_ns, ..message })?;
    }
    for part in parts {
        part.timeline(selection.clone())?.try_for_each(|message| copy.message(&message?))?;
    }
    Ok(())
}

/// Copies the metadata and attachments of a recording, wherever they are in the file.
pub(crate) fn describe<W: Write>(recording: &Recording, copy: &mut Copy<W>) -> Result<(), RecordingError> {
    let (path, index) = (recording.path(), recording.index()?);
    for name in index.metadata_names() {
        if let Some(facts) = index.metadata(path, name)? {
            copy.metadata(name, &facts)?;
        }
    }
    index.attachments.iter().try_for_each(|entry| copy.attachment(&index.attachment(path, entry)?))
}

pub(crate) fn topic_names(recording: &Recording) -> Result<BTreeSet<String>, RecordingError> {
    Ok(recording.topics()?.iter().map(|topic| topic.name.clone()).collect())
}

/// Returns the topics for which the recording does not state anything missing before the first message, even
/// if its number is not 1. Such a recording is itself part of another one, or was written by other software.
fn late_topics(recording: &Recording) -> Result<BTreeSet<String>, RecordingError> {
    if !recording.is_ours()? {
        // Other software may begin counting anywhere.
        return topic_names(recording);
    }
    let topics = recording.index()?.metadata(recording.path(), TOPICS_METADATA)?.unwrap_or_default();
    let is_late = |facts: TopicFacts| facts.gaps.first().is_none_or(|gap| gap.after_seq > 0);
    let late = topics.into_iter().filter(|(_, json)| serde_json::from_str(json).is_ok_and(is_late));
    Ok(late.map(|(topic, _)| topic).collect())
}

/// Copies several recordings as one, in order of time. The description is that of the first recording. Messages before the
/// first one of a topic do not count as missing.
///
/// # Errors
/// [`RecordingError`] if a recording cannot be read or the copy cannot be written.
pub fn merge<W: Write>(recordings: &[Recording], copy: &mut Copy<W>) -> Result<(), RecordingError> {
    recordings.iter().try_for_each(|recording| describe(recording, copy))?;
    let mut lines = Vec::new();
    for recording in recordings {
        copy.late.extend(topic_names(recording)?);
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

/// The size limit of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// Maximum size of the messages, in bytes, before compression and without the latched messages that are repeated at the
    /// beginning.
    Bytes(u64),
    /// Maximum duration, in nanoseconds.
    Time(u64),
}

/// Facts about a part.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PartFacts {
    /// Time of the first message, in nanoseconds.
    pub first_ns: u64,
    /// Time of the last message, in nanoseconds.
    pub last_ns: u64,
    /// Number of messages by topic.
    pub messages: BTreeMap<String, u64>,
    /// The damaged messages of this part that were left out.
    #[serde(skip_serializing_if = "Rejections::is_empty")]
    pub left_out: Rejections,
}

/// Splits a recording into parts, in order of time. Each part begins with the latched messages that were sent before it.
/// `next` opens the sink for the part with the given number, counted from 0.
///
/// # Errors
/// [`RecordingError`] if the recording cannot be read or a part cannot be written.
pub fn split<W: Write>(
    recording: &Recording,
    limit: Option<Limit>,
    mut next: impl FnMut(usize) -> Result<W, RecordingError>,
) -> Result<Vec<PartFacts>, RecordingError> {
    let mut split = Split { recording, parts: Vec::new(), last: BTreeMap::new(), latched: BTreeMap::new() };
    let mut open: Option<OpenPart<W>> = None;
    for message in recording.timeline(Selection::default())? {
        let message = message?;
        if let Some(full) = open.take_if(|part| part.is_full(limit, &message)) {
            split.close(full)?;
        }
        let part = match &mut open {
            Some(part) => part,
            None => open.insert(split.begin(next(split.parts.len())?, message.stamp_ns)?),
        };
        part.take(&message)?;
        if message.topic.is_latched() && !message.is_damaged() {
            split.latched.insert(message.topic.name.clone(), message);
        }
    }
    open.map_or(Ok(()), |last| split.close(last))?;
    Ok(split.parts)
}

/// A recording while it is being split.
struct Split<'a> {
    recording: &'a Recording,
    /// The completed parts.
    parts: Vec<PartFacts>,
    /// The last sequence number of each topic in the previous part.
    last: BTreeMap<String, u64>,
    /// The last message of each latched topic.
    latched: BTreeMap<String, RawMessage>,
}

impl Split<'_> {
    fn begin<W: Write>(&self, sink: W, first_ns: u64) -> Result<OpenPart<W>, RecordingError> {
        let mut copy = Copy::of_profile(sink, &self.recording.header().profile)?;
        describe(self.recording, &mut copy)?;
        copy.resume_after(&self.last);
        copy.late = late_topics(self.recording)?;
        let facts = PartFacts { first_ns, last_ns: first_ns, ..PartFacts::default() };
        let mut part = OpenPart { copy, facts, latched_bytes: 0 };
        for old in self.latched.values() {
            // The message is sent again at the beginning of the part, as a late reader would receive it.
            part.take(&RawMessage { stamp_ns: first_ns, ..old.clone() })?;
        }
        part.latched_bytes = part.copy.message_bytes();
        Ok(part)
    }

    fn close<W: Write>(&mut self, part: OpenPart<W>) -> Result<(), RecordingError> {
        self.last = part.copy.last_numbers();
        self.parts.push(PartFacts { left_out: part.copy.left_out().clone(), ..part.facts });
        part.copy.finish().map(drop)
    }
}

/// The part that is being written.
struct OpenPart<W: Write> {
    copy: Copy<W>,
    facts: PartFacts,
    /// Size of the messages that were repeated at the beginning, in bytes. The limit does not include them, since it might
    /// be smaller.
    latched_bytes: u64,
}

impl<W: Write> OpenPart<W> {
    fn is_full(&self, limit: Option<Limit>, next: &RawMessage) -> bool {
        let bytes = self.copy.message_bytes() - self.latched_bytes;
        match limit {
            None => false,
            Some(Limit::Bytes(most)) => bytes > 0 && bytes + next.cdr.len() as u64 > most,
            Some(Limit::Time(ns)) => next.stamp_ns >= self.facts.first_ns.saturating_add(ns),
        }
    }

    fn take(&mut self, message: &RawMessage) -> Result<(), RecordingError> {
        self.copy.message(message)?;
        self.facts.last_ns = self.facts.last_ns.max(message.stamp_ns);
        if message.is_damaged() {
            return Ok(());
        }
        *self.facts.messages.entry(message.topic.name.clone()).or_default() += 1;
        Ok(())
    }
}
