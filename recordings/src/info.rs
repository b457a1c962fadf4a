//! Summarizes a recording: topics, counts, rates, gaps, the run.
//!
//! If the writer finished, the summary at the end of the file is sufficient, no matter how long the recording
//! is. For any other recording, all messages are read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::{self, HEALTH, has_many_writers};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Health;
use sketchnav_schemas::time::seconds;

use crate::error::RecordingError;
use crate::facts::{Lives, TopicFacts};
use crate::foreign::{Form, OF_ANY_MCAP, OF_ROS2};
use crate::index::Index;
use crate::reader::{Part, RawMessage, Recording, Topic};
use crate::sequence::{Gap, Sequence};
use crate::writer::{LIBRARY, RECORDER_METADATA, RESTARTS_METADATA, RUN_METADATA, TOPICS_METADATA};

/// The summary of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// The file.
    pub path: String,
    /// Size of the file, in bytes.
    pub bytes: u64,
    /// The profile that the file declares for its messages: `ros2`, `ros1`, or empty.
    pub profile: String,
    /// Name of the library that wrote the file.
    pub library: String,
    /// Notes on a recording by other software.
    pub notes: Vec<String>,
    /// True if the writer finished. Otherwise the file is cut off, but its content up to that point is
    /// intact.
    pub clean_end: bool,
    /// Number of times that the recorder was killed and restarted.
    pub restarts: u64,
    /// Number of restarts of each process, according to its own messages.
    pub process_restarts: BTreeMap<String, u64>,
    /// Facts about the run: mission, robot, seed, pace, system, version.
    pub run: BTreeMap<String, String>,
    /// Simulation time from the first message to the last, in seconds.
    pub duration_s: f64,
    /// Number of messages of all topics.
    pub messages: u64,
    /// Number of missing messages of all channels, according to the sequence numbers.
    pub missing: u64,
    /// The topics: first those in the table of channels, in its order, then the others by name.
    pub topics: Vec<TopicInfo>,
    /// The attachments.
    pub attachments: Vec<AttachmentInfo>,
}

impl Info {
    /// Returns the total number of restarts of all processes. The recorder reports its restarts in messages, like any
    /// process, and also counts them itself. Its own count includes lives in which it sent no message, but a file that is
    /// cut off lacks that count, so the larger of the two is used.
    pub fn all_restarts(&self) -> u64 {
        let all: u64 = self.process_restarts.values().sum();
        let by_recorder = self.process_restarts.get(Process::Recorder.word()).copied().unwrap_or(0);
        all - by_recorder + self.restarts.max(by_recorder)
    }
}

/// The content of a topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopicInfo {
    /// Name, such as `/scan`.
    pub topic: String,
    /// ROS 2 type, such as `sensor_msgs/msg/LaserScan`.
    pub ros2_type: String,
    /// Encoding of the messages: `cdr`, `ros1`, `json`.
    pub encoding: String,
    /// Number of messages.
    pub messages: u64,
    /// Messages per second from the first to the last, or `None` if there are fewer than two different times.
    pub rate_hz: Option<f64>,
    /// Simulation time of the first message, in seconds.
    pub first_s: Option<f64>,
    /// Simulation time of the last message, in seconds.
    pub last_s: Option<f64>,
    /// Number of missing messages according to the sequence numbers. 0 if several processes write the topic.
    pub missing: u64,
    /// The first gaps.
    pub gaps: Vec<Gap>,
}

/// A file embedded in the recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// Name of the file.
    pub name: String,
    /// Size of the file, in bytes.
    pub bytes: u64,
}

/// Summarizes the recording at `path`.
///
/// # Errors
/// [`RecordingError::File`], or [`RecordingError::Damaged`].
pub fn info(path: &Path) -> Result<Info, RecordingError> {
    match of_summary(path)? {
        Some(info) => Ok(info),
        None => info_of_messages(path),
    }
}

/// Like [`info`], but reads all messages regardless of the summary, so that damage is noticed.
///
/// # Errors
/// Same errors as [`info`].
pub fn info_of_messages(path: &Path) -> Result<Info, RecordingError> {
    let recording = Recording::open(path)?;
    let mut tally = Tally { is_ours: recording.is_ours()?, ..Tally::default() };
    let mut parts = recording.parts()?;
    for part in &mut parts {
        tally.take(part?);
    }
    tally.packed = parts.packed();
    tally.finish(&recording)
}

/// Summarizes the recording from its summary. Returns `None` if the summary is not sufficient, or if another
/// tool wrote the file: such a tool may have copied our facts about the messages without copying all
/// messages.
fn of_summary(path: &Path) -> Result<Option<Info>, RecordingError> {
    let recording = Recording::open(path)?;
    if !recording.header().library.starts_with(LIBRARY) {
        return Ok(None);
    }
    let Some(index) = Index::of_summary(path)? else { return Ok(None) };
    let Some(statistics) = &index.statistics else { return Ok(None) };
    let Some(facts_by_topic) = index.metadata(path, TOPICS_METADATA)? else { return Ok(None) };
    let mut tally = Tally { clean_end: true, ..Tally::default() };
    for (id, topic) in index.directory.topics() {
        let facts =
            facts_by_topic.get(&topic.name).and_then(|json| serde_json::from_str::<TopicFacts>(json).ok());
        let Some(facts) = facts else { return Ok(None) };
        let known = tally.topics.entry(topic.name.clone()).or_default();
        known.describe(topic);
        known.messages += statistics.by_channel.get(&id).copied().unwrap_or(0);
        known.facts = facts;
    }
    for name in [RUN_METADATA, RECORDER_METADATA, RESTARTS_METADATA] {
        if let Some(facts) = index.metadata(path, name)? {
            tally.take(Part::Metadata(name.to_owned(), facts));
        }
    }
    let attachments = index.attachments.into_iter();
    tally.attachments =
        attachments.map(|file| AttachmentInfo { name: file.name, bytes: file.bytes }).collect();
    tally.finish(&recording).map(Some)
}

fn duration_s(topics: &[TopicInfo]) -> f64 {
    let first = topics.iter().filter_map(|t| t.first_s).reduce(f64::min);
    let last = topics.iter().filter_map(|t| t.last_s).reduce(f64::max);
    first.zip(last).map_or(0.0, |(first, last)| last - first)
}

/// Explains what kind of recording this is if other software wrote it, and the consequences.
fn notes(recording: &Recording, packed: u64, damaged: u64) -> Result<Vec<String>, RecordingError> {
    let mut notes = Vec::new();
    if !recording.is_ours()? {
        notes.push(format!(
            "not a sketchnav recording; supported by {OF_ROS2}, but not by replay, rerun and judge"
        ));
    }
    if packed > 0 {
        notes.push(format!(
            "{packed} messages compressed individually with zstd (compression_mode: MESSAGE); they are read, and copies contain them \
             unpacked"
        ));
    }
    if damaged > 0 {
        notes.push(format!("damaged: {damaged} of them cannot be unpacked; copies leave them out"));
    }
    let topics = recording.topics()?;
    let mut types: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for topic in &topics {
        types.entry(&topic.name).or_default().insert(&topic.ros2_type);
    }
    for (name, types) in types.iter().filter(|(_, types)| types.len() > 1) {
        let types: Vec<_> = types.iter().copied().collect();
        notes.push(format!("{name}: messages of {} types: {}", types.len(), types.join(", ")));
    }
    for topic in &topics {
        let form = Form::of(topic);
        if form != Form::Ros2 {
            let (name, words, way_on) = (&topic.name, form.words(topic), form.way_on());
            let echo = if form == Form::Json { "; echo prints them" } else { "" };
            notes.push(format!(
                "{name}: {words}, not of ROS 2 in CDR{echo}; {OF_ANY_MCAP} accept them; {way_on}"
            ));
        }
    }
    Ok(notes)
}

#[derive(Default)]
struct Tally {
    is_ours: bool,
    packed: u64,
    /// Number of individually compressed messages that cannot be decompressed.
    damaged: u64,
    topics: BTreeMap<String, TopicTally>,
    run: BTreeMap<String, String>,
    attachments: Vec<AttachmentInfo>,
    clean_end: bool,
    restarts: u64,
    lives: Lives,
    process_restarts: BTreeMap<String, String>,
}

#[derive(Default)]
struct TopicTally {
    ros2_type: String,
    encoding: String,
    messages: u64,
    sequence: Sequence,
    facts: TopicFacts,
}

impl Tally {
    fn take(&mut self, part: Part) {
        match part {
            Part::Topic(topic) => {
                let tally = self.topics.entry(topic.name.clone()).or_default();
                tally.describe(&topic);
            }
            Part::Message(message) => {
                let is_ours = self.is_ours;
                self.damaged += u64::from(message.is_damaged());
                self.topics.entry(message.topic.name.clone()).or_default().take(&message, is_ours);
                if HEALTH.spec.is_topic(&message.topic.name)
                    && let Ok((health, _)) = message.typed::<Health>()
                {
                    self.lives.see(&health);
                }
            }
            Part::Metadata(name, facts) if name == RUN_METADATA => self.run = facts,
            Part::Metadata(name, facts) if name == RESTARTS_METADATA => self.process_restarts = facts,
            Part::Metadata(name, facts) if name == RECORDER_METADATA => {
                self.restarts = facts.get("restarts").and_then(|n| n.parse().ok()).unwrap_or(0);
            }
            Part::Metadata(..) => {}
            Part::Attachment(file) => {
                self.attachments.push(AttachmentInfo { name: file.name, bytes: file.data.len() as u64 });
            }
            Part::End { clean } => self.clean_end = clean,
        }
    }

    fn finish(self, recording: &Recording) -> Result<Info, RecordingError> {
        let (path, header) = (recording.path(), recording.header());
        let size = std::fs::metadata(path);
        let bytes = size.map_err(|source| RecordingError::File { path: path.to_owned(), source })?.len();
        let place = |name: &str| channels::all().position(|spec| spec.is_topic(name));
        let mut topics: Vec<_> = self.topics.into_iter().map(|(name, tally)| tally.finish(name)).collect();
        topics.sort_by_key(|topic| place(&topic.topic).unwrap_or(usize::MAX));
        let process_restarts =
            if self.process_restarts.is_empty() { self.lives.restarts() } else { self.process_restarts };
        Ok(Info {
            path: path.display().to_string(),
            bytes,
            profile: header.profile.clone(),
            library: header.library.clone(),
            notes: notes(recording, self.packed, self.damaged)?,
            clean_end: self.clean_end,
            restarts: self.restarts,
            process_restarts: process_restarts
                .into_iter()
                .filter_map(|(name, n)| Some((name, n.parse().ok()?)))
                .collect(),
            run: self.run,
            duration_s: duration_s(&topics),
            messages: topics.iter().map(|t| t.messages).sum(),
            missing: topics.iter().map(|t| t.missing).sum(),
            topics,
            attachments: self.attachments,
        })
    }
}

impl TopicTally {
    fn describe(&mut self, topic: &Topic) {
        self.ros2_type.clone_from(&topic.ros2_type);
        self.encoding.clone_from(&topic.encoding);
    }

    fn take(&mut self, message: &RawMessage, is_ours: bool) {
        self.messages += 1;
        if !is_ours && self.messages == 1 {
            // Other software may begin counting anywhere.
            self.sequence = Sequence::after(u64::from(message.sequence).saturating_sub(1));
        }
        self.facts.see_time(message.stamp_ns);
        let has_many_writers = has_many_writers(&message.topic.name);
        self.facts.see_number(&mut self.sequence, has_many_writers, message.sequence.into());
    }

    fn finish(self, topic: String) -> TopicInfo {
        let Self { ros2_type, encoding, messages, facts, .. } = self;
        let TopicFacts { times_ns, missing, gaps } = facts;
        let (first_s, last_s) = times_ns.map(|(first, last)| (seconds(first), seconds(last))).unzip();
        let span_s = first_s.zip(last_s).map_or(0.0, |(first, last)| last - first);
        let rate_hz = (span_s > 0.0).then(|| messages.saturating_sub(1) as f64 / span_s);
        TopicInfo { topic, ros2_type, encoding, messages, rate_hz, first_s, last_s, missing, gaps }
    }
}
