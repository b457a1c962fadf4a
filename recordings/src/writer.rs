//! Writes a recording, with each channel as a topic and each message in its ROS 2 form.
//!
//! The file is written once, from front to back and without seeking, so everything that was flushed remains
//! readable if the process is killed. The writer never decides when to flush, and never reads a clock. It
//! does not allocate for a message once each channel has had one, but the mcap crate allocates for every
//! chunk.
//!
//! A recording begins with the run as metadata `sketchnav`, its parameters as metadata `parameters`, and the resolved run and
//! mission as attachments `run.json` and `mission.toml`. The channels follow, and the file ends with this metadata:
//!
//! - `missing` and `refused`: how many messages of each topic are missing or were refused.
//! - `topics`: the times of each topic's messages and the gaps between them ([`TopicFacts`] as JSON).
//! - `restarts`: how often each process was restarted, and `recorder`: how often the recorder itself was.

use std::collections::BTreeMap;
use std::io::Write;

use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, records};
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, NAVIGATORS};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::{self, Spare};
use sketchnav_schemas::message::{Message, Odometry};
use sketchnav_schemas::ros2::Ros2Error;
use sketchnav_schemas::ros2::transforms::{self, TF, TF_STATIC};
use sketchnav_schemas::run::{Pace, RunConfig};

use crate::content::RawMessage;
use crate::error::RecordingError;
use crate::facts::Lives;
pub use crate::facts::TopicFacts;
use crate::records::Attachment;
use crate::sequence::{Seen, Sequence};

/// Maximum uncompressed size of a chunk, in bytes. A chunk that reaches it is closed.
pub(crate) const CHUNK_BYTES: u64 = 768 * 1024;
/// Bound on the size of a CDR form relative to the size of the largest message. The form can be larger because points gain a
/// third coordinate.
const CDR_GROWTH: usize = 2;
/// Name of the metadata that describes the run.
pub const RUN_METADATA: &str = "sketchnav";
/// Name of the metadata about each topic.
pub const TOPICS_METADATA: &str = "topics";
/// Name of the metadata that contains how often each process was restarted.
pub const RESTARTS_METADATA: &str = "restarts";
/// Name of the metadata that contains how often the recorder was restarted.
pub const RECORDER_METADATA: &str = "recorder";
/// Name of the attachment with the [`RunConfig`].
pub const RUN_ATTACHMENT: &str = "run.json";
/// Name of the attachment with the mission as it was run, with absolute paths.
pub const MISSION_ATTACHMENT: &str = "mission.toml";

/// The quality of service of latched topics, in the words of rosbag2.
const LATCHED_QOS: &str = "- history: keep_last
  depth: 1
  reliability: reliable
  durability: transient_local
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
";

/// Writes a recording to `W`.
pub struct Writer<W: Write> {
    mcap: Mcap<W>,
    topics: Vec<Topic>,
    /// The ROS 2 form of each topic's last message. The next message reuses its memory.
    forms: Vec<Spare>,
    transform_topic: u16,
    transform_form: transforms::Form,
    transform_facts: TopicFacts,
    transform_count: u32,
    message_count: u64,
    restarts: u32,
    lives: Lives,
    cdr: Vec<u8>,
    /// True if the last message of each latched channel is kept for the next file.
    keeps_latched: bool,
    begin_ns: u64,
}

/// The last message of a latched channel.
#[derive(Debug, Clone, Default)]
pub struct Latched {
    sequence: u32,
    cdr: Vec<u8>,
}

/// The state of a channel while it is recorded.
#[derive(Debug, Clone)]
pub struct Topic {
    /// The channel's row of the table.
    pub spec: &'static ChannelSpec,
    /// The sequence numbers. Unused if several processes write the channel, each with its own numbers.
    pub sequence: Sequence,
    /// The times of the messages, and the gaps between them.
    pub facts: TopicFacts,
    /// Number of messages in the file.
    pub messages: u64,
    /// Number of messages that could not be expressed in ROS 2.
    pub refused: u64,
    id: u16,
    latched: Option<Latched>,
}

impl<W: Write> Writer<W> {
    /// Begins the recording of `run`. The sink receives many small writes and should be buffered.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if `sink` fails, [`RecordingError::Run`] if the description of `run` cannot be written.
    pub fn create(sink: W, run: &RunConfig) -> Result<Self, RecordingError> {
        Self::create_with(sink, run, &[])
    }

    /// Like [`Writer::create`], but also stores these files in the recording, where a reader finds them before the first
    /// message.
    ///
    /// # Errors
    /// Same errors as [`Writer::create`].
    pub fn create_with(sink: W, run: &RunConfig, files: &[Attachment]) -> Result<Self, RecordingError> {
        Self::create_at(sink, run, files, 0)
    }

    /// Like [`Writer::create_with`], for a file that begins at this time of the run, in nanoseconds.
    ///
    /// # Errors
    /// Same errors as [`Writer::create`].
    pub fn create_at(
        sink: W,
        run: &RunConfig,
        files: &[Attachment],
        begin_ns: u64,
    ) -> Result<Self, RecordingError> {
        let mut mcap = begin(sink, "ros2")?;
        describe(&mut mcap, run)?;
        for Attachment { name, media_type, data } in files {
            attach(&mut mcap, name, media_type, data.clone())?;
        }
        let recorded = channels::of_kind(run.mission.navigator_kind()).filter(|spec| spec.is_recorded());
        let topics: Vec<_> = recorded.map(|spec| declare(&mut mcap, spec)).collect::<Result<_, _>>()?;
        let forms = topics.iter().map(|topic| topic.spec.message.spare()).collect();
        let largest = topics.iter().map(|topic| topic.spec.message.size).max().unwrap_or_default();
        let transform_topic = add_transforms(&mut mcap, run, begin_ns)?;
        let mut writer = Self {
            mcap,
            topics,
            forms,
            transform_topic,
            transform_form: transforms::Form::default(),
            transform_facts: TopicFacts::default(),
            transform_count: 0,
            lives: Lives::default(),
            message_count: 1, // of /tf_static
            restarts: 0,
            cdr: Vec::with_capacity(CDR_GROWTH * largest),
            keeps_latched: !run.split.is_never(),
            begin_ns,
        };
        writer.flush()?;
        Ok(writer)
    }

    /// Appends a message, with the slice that follows it if its channel has one. A message that was already written is left
    /// out.
    ///
    /// # Errors
    /// An error for which [`RecordingError::is_one_message`] is true if only the message is at fault, and
    /// [`RecordingError::Write`] if the sink fails, after which nothing more can be written.
    pub fn write<T: Message>(
        &mut self,
        channel: Channel<T>,
        message: &T,
        cells: &[u8],
    ) -> Result<Seen, RecordingError> {
        self.write_bytes(channel.spec, bytemuck::bytes_of(message), cells)
    }

    /// Like [`Writer::write`], for a message given as bytes.
    ///
    /// # Errors
    /// Same errors as [`Writer::write`].
    pub fn write_bytes(
        &mut self,
        spec: &'static ChannelSpec,
        message: &[u8],
        cells: &[u8],
    ) -> Result<Seen, RecordingError> {
        let (name, header) = (spec.name, *erased::header(message));
        let mut topics = self.topics.iter_mut().zip(&mut self.forms);
        let found = topics.find(|(topic, _)| topic.spec == spec);
        let (topic, form) = found.ok_or(RecordingError::NotRecorded { channel: name })?;
        // A refused message has arrived, so it must not count as missing as well.
        let seen = topic.see(header.seq);
        if seen == Seen::Again {
            return Ok(seen);
        }
        self.cdr.clear();
        if let Err(source) = spec.message.encode(message, cells, form, &mut self.cdr) {
            topic.refused += 1;
            return Err(RecordingError::Message { topic: topic_name(name), seq: header.seq, source });
        }
        topic.messages += 1;
        let log_ns = topic.log_ns(header.stamp_ns);
        topic.facts.see_time(log_ns);
        let id = topic.id;
        let sequence = header.seq as u32; // `encode` refuses larger ones
        if self.keeps_latched && spec.is_latched() {
            topic.latched = Some(Latched { sequence, cdr: self.cdr.clone() });
        }
        self.append(id, sequence, log_ns)?;
        if *spec == *channels::ODOMETRY.spec {
            self.write_transform(message)?;
        }
        if *spec == *channels::HEALTH.spec {
            self.lives.see(bytemuck::from_bytes(message));
        }
        Ok(seen)
    }

    /// Appends a message of another recording. Transforms are left out, because they are derived from the
    /// odometry again. A message that cannot be decoded, and that readers therefore reject, is copied
    /// unchanged.
    ///
    /// # Errors
    /// Any error of [`Writer::write`], and an error if the topic is not a channel or the message does not
    /// have its channel's type.
    pub fn write_raw(&mut self, raw: &RawMessage) -> Result<(), RecordingError> {
        let topic = &raw.topic.name;
        if [TF, TF_STATIC].contains(&topic.as_str()) {
            return Ok(());
        }
        let unknown = || RecordingError::UnknownTopic { topic: topic.clone() };
        let spec = channels::of_topic(topic).ok_or_else(unknown)?;
        let is_of_its_type = raw.topic.ros2_type == spec.message.ros2 && !raw.is_damaged();
        match raw.decode(spec) {
            Ok(message) => self.write_bytes(spec, message.bytes(), message.cells()).map(drop),
            Err(error) if error.is_one_message() && is_of_its_type => self.write_undecoded(spec, raw),
            Err(error) => Err(error),
        }
    }

    fn write_undecoded(
        &mut self,
        spec: &'static ChannelSpec,
        raw: &RawMessage,
    ) -> Result<(), RecordingError> {
        let found = self.topics.iter_mut().find(|topic| topic.spec == spec);
        let topic = found.ok_or(RecordingError::NotRecorded { channel: spec.name })?;
        if topic.see(raw.sequence.into()) == Seen::Again {
            return Ok(());
        }
        topic.messages += 1;
        let log_ns = topic.log_ns(raw.stamp_ns);
        topic.facts.see_time(log_ns);
        let id = topic.id;
        self.cdr.clear();
        self.cdr.extend_from_slice(&raw.cdr);
        self.append(id, raw.sequence, log_ns)
    }

    fn append(&mut self, id: u16, sequence: u32, time_ns: u64) -> Result<(), RecordingError> {
        let header =
            records::MessageHeader { channel_id: id, sequence, log_time: time_ns, publish_time: time_ns };
        self.mcap.write_to_known_channel(&header, &self.cdr).map_err(RecordingError::Write)?;
        self.message_count += 1;
        Ok(())
    }

    fn write_transform(&mut self, odometry: &[u8]) -> Result<(), RecordingError> {
        let odometry: &Odometry = bytemuck::from_bytes(odometry);
        self.cdr.clear();
        let said = transforms::base_in_odom(odometry, &mut self.transform_form, &mut self.cdr);
        said.map_err(|source| transform_error(TF, source))?;
        self.transform_count += 1;
        self.transform_facts.see_time(odometry.header.stamp_ns);
        self.append(self.transform_topic, self.transform_count, odometry.header.stamp_ns)
    }

    /// Closes the chunk and flushes the sink, so that everything written so far survives a kill.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.mcap.flush().map_err(RecordingError::Write)
    }

    /// Returns the number of messages written so far, including transforms.
    pub fn message_count(&self) -> u64 {
        self.message_count
    }

    /// Continues after the messages of an earlier part. `positions` are the last sequence numbers of the channels in the
    /// order of [`Writer::topics`], or 0 for a channel without messages.
    pub fn resume_after(&mut self, positions: impl IntoIterator<Item = u64>) {
        for (topic, last) in self.topics.iter_mut().zip(positions) {
            topic.sequence = Sequence::after(last);
        }
    }

    /// Takes the last message of each latched channel, in the order of [`Writer::topics`]. They are kept only if the run
    /// has several files.
    pub fn take_latched(&mut self) -> Vec<Option<Latched>> {
        self.topics.iter_mut().map(|topic| topic.latched.take()).collect()
    }

    /// Begins with the messages that were latched in the previous file, at the time `log_ns`, as a late
    /// reader would receive them.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails.
    pub fn repeat(&mut self, latched: Vec<Option<Latched>>, log_ns: u64) -> Result<(), RecordingError> {
        for (index, last) in latched.into_iter().enumerate() {
            let (Some(topic), Some(last)) = (self.topics.get_mut(index), last) else { continue };
            topic.messages += 1;
            topic.facts.see_time(log_ns);
            self.cdr.clear();
            self.cdr.extend_from_slice(&last.cdr);
            let (id, sequence) = (topic.id, last.sequence);
            topic.latched = Some(last);
            self.append(id, sequence, log_ns)?;
        }
        Ok(())
    }

    /// Records the number of times that the recorder of this recording was killed and restarted.
    pub fn survived(&mut self, restarts: u32) {
        self.restarts = restarts;
    }

    /// Returns the channels, in the order of the table.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Ends the recording with its index and returns the flushed sink.
    ///
    /// # Errors
    /// [`RecordingError::Write`] if the sink fails. Everything that was flushed before stays readable.
    pub fn finish(mut self) -> Result<W, RecordingError> {
        let missing = self.topics.iter().map(|t| (topic_name(t.spec.name), t.sequence.missing().to_string()));
        let refused = self.topics.iter().map(|t| (topic_name(t.spec.name), t.refused.to_string()));
        for (name, metadata) in [("missing", missing.collect()), ("refused", refused.collect())] {
            write_metadata(&mut self.mcap, name, metadata)?;
        }
        let topics = self.topic_facts()?;
        write_metadata(&mut self.mcap, TOPICS_METADATA, topics)?;
        write_metadata(&mut self.mcap, RESTARTS_METADATA, self.lives.restarts())?;
        if self.restarts > 0 {
            let facts = BTreeMap::from([("restarts".to_owned(), self.restarts.to_string())]);
            write_metadata(&mut self.mcap, RECORDER_METADATA, facts)?;
        }
        self.mcap.finish().map_err(RecordingError::Write)?;
        let mut sink = self.mcap.into_inner().into_inner();
        sink.flush().map_err(|error| RecordingError::Write(error.into()))?;
        Ok(sink)
    }
}

impl<W: Write> Writer<W> {
    fn topic_facts(&self) -> Result<BTreeMap<String, String>, RecordingError> {
        let still = TopicFacts { times_ns: Some((self.begin_ns, self.begin_ns)), ..TopicFacts::default() };
        let transforms = [(TF_STATIC.into(), &still), (TF.into(), &self.transform_facts)];
        let of_topic = |topic: &'_ Topic| (topic_name(topic.spec.name), topic.facts.to_json());
        let facts = self.topics.iter().map(of_topic);
        let facts = facts.chain(transforms.map(|(name, facts)| (name, facts.to_json())));
        facts.map(|(name, json)| Ok((name, json?))).collect()
    }
}

impl Topic {
    fn see(&mut self, seq: u64) -> Seen {
        self.facts.see_number(&mut self.sequence, self.spec.writer.is_none(), seq)
    }

    /// Returns the time at which a message with this timestamp is logged. Messages of several processes may arrive out of
    /// order, but readers of a file rely on the times of a topic never going back.
    fn log_ns(&self, stamp_ns: u64) -> u64 {
        match (self.spec.writer, self.facts.times_ns) {
            (None, Some((_, last_ns))) => stamp_ns.max(last_ns),
            _ => stamp_ns,
        }
    }
}

/// Prefix of the library name in all files that this project writes.
pub(crate) const LIBRARY: &str = "sketchnav";

/// Begins a file in the form that ROS 2 uses, in chunks and without seeking.
pub(crate) fn begin<W: Write>(sink: W, profile: &str) -> Result<Mcap<W>, RecordingError> {
    let options = WriteOptions::new()
        .profile(profile)
        .library(concat!("sketchnav ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true);
    options.create(NoSeek::new(sink)).map_err(RecordingError::Write)
}

/// Returns the topic of a channel, which is its name with a leading slash.
pub fn topic_name(channel: &str) -> String {
    format!("/{channel}")
}

pub(crate) type Mcap<W> = mcap::Writer<NoSeek<W>>;

fn describe<W: Write>(mcap: &mut Mcap<W>, run: &RunConfig) -> Result<(), RecordingError> {
    let pace = match run.pace {
        Pace::Lockstep => "lockstep".to_owned(),
        Pace::RealTime { speed } => format!("real time × {speed}"),
    };
    let facts = [
        ("mission", run.mission.name.clone()),
        ("robot", run.robot.name.clone()),
        ("method", run.method.clone()),
        ("seed", run.seed.to_string()),
        ("pace", pace),
        ("system", run.system.clone()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    write_metadata(mcap, RUN_METADATA, facts.map(|(key, value)| (key.to_owned(), value)).into())?;
    write_metadata(mcap, "parameters", parameters(run)?)?;
    // Where files are read from matters only to the running system.
    let run = &RunConfig { files_of: None, ..run.clone() };
    let json = serde_json::to_vec_pretty(run)
        .map_err(|error| RecordingError::Run { what: "configuration", reason: error.to_string() })?;
    attach(mcap, RUN_ATTACHMENT, "application/json", json)?;
    let mission = to_toml("mission", &run.mission)?;
    attach(mcap, MISSION_ATTACHMENT, "application/toml", mission.into_bytes())
}

fn parameters(run: &RunConfig) -> Result<BTreeMap<String, String>, RecordingError> {
    let given = &run.mission.parameters;
    let table = |process: Process| Ok((process.word().to_owned(), to_toml("parameters", given.of(process))?));
    NAVIGATORS.into_iter().map(table).collect()
}

fn to_toml(what: &'static str, value: &impl serde::Serialize) -> Result<String, RecordingError> {
    toml::to_string(value).map_err(|error| RecordingError::Run { what, reason: error.to_string() })
}

fn write_metadata<W: Write>(
    mcap: &mut Mcap<W>,
    name: &str,
    metadata: BTreeMap<String, String>,
) -> Result<(), RecordingError> {
    mcap.write_metadata(&records::Metadata { name: name.to_owned(), metadata }).map_err(RecordingError::Write)
}

fn attach<W: Write>(
    mcap: &mut Mcap<W>,
    name: &str,
    media_type: &str,
    data: Vec<u8>,
) -> Result<(), RecordingError> {
    let (name, media_type) = (name.to_owned(), media_type.to_owned());
    mcap.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data: data.into() })
        .map_err(RecordingError::Write)
}

/// Declares the topic of a channel, so that readers can find it before the first message.
fn declare<W: Write>(mcap: &mut Mcap<W>, spec: &'static ChannelSpec) -> Result<Topic, RecordingError> {
    let mut metadata = BTreeMap::from([("layout".to_owned(), spec.message.type_name())]);
    if spec.is_latched() {
        metadata.insert("offered_qos_profiles".to_owned(), LATCHED_QOS.to_owned());
    }
    let schema = spec.message.schema();
    let id = add_topic(mcap, &topic_name(spec.name), (spec.message.ros2, &schema), &metadata)?;
    let (sequence, facts) = (Sequence::default(), TopicFacts::default());
    Ok(Topic { spec, sequence, facts, messages: 0, refused: 0, id, latched: None })
}

fn add_topic<W: Write>(
    mcap: &mut Mcap<W>,
    topic: &str,
    (ros2_type, text): (&str, &str),
    metadata: &BTreeMap<String, String>,
) -> Result<u16, RecordingError> {
    let schema = mcap.add_schema(ros2_type, "ros2msg", text.as_bytes()).map_err(RecordingError::Write)?;
    mcap.add_channel(schema, topic, "cdr", metadata).map_err(RecordingError::Write)
}

/// Declares `/tf`, writes the only message of `/tf_static` if the robot has a laser, and returns the id of `/tf`.
fn add_transforms<W: Write>(
    mcap: &mut Mcap<W>,
    run: &RunConfig,
    begin_ns: u64,
) -> Result<u16, RecordingError> {
    let text = transforms::schema();
    let schema = (transforms::TYPE, text.as_str());
    if let Some(laser) = &run.robot.laser {
        let latched = BTreeMap::from([("offered_qos_profiles".to_owned(), LATCHED_QOS.to_owned())]);
        let id = add_topic(mcap, TF_STATIC, schema, &latched)?;
        let mut cdr = Vec::new();
        let said = transforms::laser_in_base(laser, &mut cdr);
        said.map_err(|source| transform_error(TF_STATIC, source))?;
        let header = records::MessageHeader {
            channel_id: id,
            sequence: 1,
            log_time: begin_ns,
            publish_time: begin_ns,
        };
        mcap.write_to_known_channel(&header, &cdr).map_err(RecordingError::Write)?;
    }
    add_topic(mcap, TF, schema, &BTreeMap::new())
}

fn transform_error(topic: &str, source: Ros2Error) -> RecordingError {
    RecordingError::Message { topic: topic.to_owned(), seq: 0, source }
}
