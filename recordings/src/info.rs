//! What is in a recording: topics, counts, rates, gaps, the run. Reads the file once.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::TABLE;

use crate::error::RecordingError;
use crate::reader::{Part, RawMessage, Recording};
use crate::sequence::{Gap, Seen, Sequence};
use crate::writer::{RECORDER_METADATA, RUN_METADATA, topic_name};

/// Most gaps of a topic that are listed one by one.
const MAX_GAPS: usize = 16;
const NS_PER_S: f64 = 1e9;

/// What is in a recording.
#[derive(Debug, Clone, Serialize)]
pub struct Info {
    /// The file.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// Whether its writer came to an end; if not, the file is cut off and what is there is whole.
    pub clean_end: bool,
    /// How often the recorder was killed and started again.
    pub restarts: u64,
    /// About the run: mission, robot, seed, pace, system, version.
    pub run: BTreeMap<String, String>,
    /// From the first message to the last, simulation time.
    pub duration_s: f64,
    /// Messages of all topics.
    pub messages: u64,
    /// Messages of all channels that their numbers show to be missing.
    pub missing: u64,
    /// The topics: those of the table of channels in its order, then the others by name.
    pub topics: Vec<TopicInfo>,
    /// The attachments.
    pub attachments: Vec<AttachmentInfo>,
}

/// What is in a topic.
#[derive(Debug, Clone, Serialize)]
pub struct TopicInfo {
    /// `/scan`.
    pub topic: String,
    /// `sensor_msgs/msg/LaserScan`.
    pub ros2_type: String,
    /// How many messages.
    pub messages: u64,
    /// Messages a second, from the first to the last; `None` where there are fewer than two times.
    pub rate_hz: Option<f64>,
    /// Simulation time of the first message.
    pub first_s: Option<f64>,
    /// Simulation time of the last message.
    pub last_s: Option<f64>,
    /// How many its numbers show to be missing; 0 where several processes write.
    pub missing: u64,
    /// The first gaps.
    pub gaps: Vec<Gap>,
}

/// A file inside the file.
#[derive(Debug, Clone, Serialize)]
pub struct AttachmentInfo {
    /// Its name.
    pub name: String,
    /// Its size.
    pub bytes: usize,
}

/// Tells what is in the recording at `path`.
///
/// # Errors
/// [`RecordingError::File`], or [`RecordingError::Damaged`].
pub fn info(path: &Path) -> Result<Info, RecordingError> {
    let recording = Recording::open(path)?;
    let size = std::fs::metadata(path);
    let bytes = size.map_err(|source| RecordingError::File { path: path.to_owned(), source })?.len();
    let mut tally = Tally::default();
    for part in recording.parts()? {
        tally.take(part?);
    }
    let (clean_end, restarts) = (tally.clean_end, tally.restarts);
    let run = std::mem::take(&mut tally.run);
    let attachments = std::mem::take(&mut tally.attachments);
    let topics = tally.into_topics();
    Ok(Info {
        path: path.display().to_string(),
        bytes,
        clean_end,
        restarts,
        run,
        duration_s: duration_s(&topics),
        messages: topics.iter().map(|t| t.messages).sum(),
        missing: topics.iter().map(|t| t.missing).sum(),
        topics,
        attachments,
    })
}

fn duration_s(topics: &[TopicInfo]) -> f64 {
    let first = topics.iter().filter_map(|t| t.first_s).reduce(f64::min);
    let last = topics.iter().filter_map(|t| t.last_s).reduce(f64::max);
    first.zip(last).map_or(0.0, |(first, last)| last - first)
}

#[derive(Default)]
struct Tally {
    topics: BTreeMap<String, TopicTally>,
    run: BTreeMap<String, String>,
    attachments: Vec<AttachmentInfo>,
    clean_end: bool,
    restarts: u64,
}

#[derive(Default)]
struct TopicTally {
    ros2_type: String,
    messages: u64,
    times_ns: Option<(u64, u64)>,
    sequence: Sequence,
    gaps: Vec<Gap>,
}

impl Tally {
    fn take(&mut self, part: Part) {
        match part {
            Part::Topic(topic) => {
                let tally = self.topics.entry(topic.name.clone()).or_default();
                tally.ros2_type.clone_from(&topic.ros2_type);
            }
            Part::Message(message) => {
                self.topics.entry(message.topic.name.clone()).or_default().take(&message);
            }
            Part::Metadata(name, facts) if name == RUN_METADATA => self.run = facts,
            Part::Metadata(name, facts) if name == RECORDER_METADATA => {
                self.restarts = facts.get("restarts").and_then(|n| n.parse().ok()).unwrap_or(0);
            }
            Part::Metadata(..) => {}
            Part::Attachment(name, data) => self.attachments.push(AttachmentInfo { name, bytes: data.len() }),
            Part::End { clean } => self.clean_end = clean,
        }
    }

    fn into_topics(self) -> Vec<TopicInfo> {
        let place = |name: &str| TABLE.iter().position(|spec| topic_name(spec.name) == name);
        let mut topics: Vec<_> = self.topics.into_iter().map(|(name, tally)| tally.finish(name)).collect();
        topics.sort_by_key(|topic| place(&topic.topic).unwrap_or(TABLE.len()));
        topics
    }
}

impl TopicTally {
    fn take(&mut self, message: &RawMessage) {
        self.messages += 1;
        let time = message.stamp_ns;
        self.times_ns = Some(self.times_ns.map_or((time, time), |(a, b)| (a.min(time), b.max(time))));
        let after_seq = self.sequence.last();
        if let Seen::New { missing: missing @ 1.. } = self.sequence.see(message.sequence.into())
            && self.gaps.len() < MAX_GAPS
        {
            self.gaps.push(Gap { after_seq, missing });
        }
    }

    fn finish(self, topic: String) -> TopicInfo {
        let many_write = |name: &str| TABLE.iter().any(|s| s.writer.is_none() && topic_name(s.name) == name);
        let (missing, gaps) =
            if many_write(&topic) { (0, Vec::new()) } else { (self.sequence.missing(), self.gaps) };
        let (first_s, last_s) =
            self.times_ns.map(|(a, b)| (a as f64 / NS_PER_S, b as f64 / NS_PER_S)).unzip();
        let span_s = first_s.zip(last_s).map_or(0.0, |(first, last)| last - first);
        let rate_hz = (span_s > 0.0).then(|| (self.messages - 1) as f64 / span_s);
        let (ros2_type, messages) = (self.ros2_type, self.messages);
        TopicInfo { topic, ros2_type, messages, rate_hz, first_s, last_s, missing, gaps }
    }
}
