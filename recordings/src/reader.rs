//! Reads a recording from front to back, one message in memory at a time.
//!
//! A recording that a kill cut off is read up to the cut: a chunk counts wholly or not at all, its
//! checksum is verified before its first message is given. Never loads a file as a whole, and refuses
//! records longer than any that the writer makes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;

use crate::error::RecordingError;
use crate::writer::{RUN_ATTACHMENT, topic_name};

/// Longest record, and longest chunk in either form, that is read into memory.
const MAX_RECORD_BYTES: usize = 64 << 20;

/// A recording on disk.
#[derive(Debug, Clone)]
pub struct Recording {
    path: PathBuf,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    attachments: BTreeMap<String, Vec<u8>>,
}

/// A topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// `/scan`.
    pub name: String,
    /// `sensor_msgs/msg/LaserScan`; empty where the file does not say.
    pub ros2_type: String,
    /// What else the file says about it.
    pub metadata: BTreeMap<String, String>,
}

/// A message as it lies in the file.
#[derive(Debug, Clone)]
pub struct RawMessage {
    /// Where it was sent.
    pub topic: Arc<Topic>,
    /// Its number on its channel.
    pub sequence: u32,
    /// Simulation time, nanoseconds.
    pub stamp_ns: u64,
    /// Its CDR.
    pub cdr: Vec<u8>,
}

/// What a recording is made of.
#[derive(Debug, Clone)]
pub enum Part {
    /// A topic, before its first message.
    Topic(Arc<Topic>),
    /// A message.
    Message(RawMessage),
    /// Facts under a name.
    Metadata(String, BTreeMap<String, String>),
    /// A file inside the file: name and content.
    Attachment(String, Vec<u8>),
    /// The last part: whether the writer came to an end, or the file is cut off.
    End {
        /// Whether the writer came to an end.
        clean: bool,
    },
}

impl Recording {
    /// Opens a recording and reads what describes it, up to the first message.
    ///
    /// # Errors
    /// [`RecordingError::File`], or [`RecordingError::Damaged`] where it is no recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut recording =
            Self { path: path.to_owned(), metadata: BTreeMap::new(), attachments: BTreeMap::new() };
        for part in recording.parts()? {
            match part? {
                Part::Metadata(name, facts) => drop(recording.metadata.insert(name, facts)),
                Part::Attachment(name, data) => drop(recording.attachments.insert(name, data)),
                Part::Topic(_) => {}
                Part::Message(_) | Part::End { .. } => break,
            }
        }
        Ok(recording)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A fact of the metadata `name`, of those that stand before the first message.
    pub fn fact(&self, name: &str, key: &str) -> Option<&str> {
        Some(self.metadata.get(name)?.get(key)?.as_str())
    }

    /// The attachments: name and content.
    pub fn attachments(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.attachments
    }

    /// The run that was recorded: mission, robot, seed, pace.
    ///
    /// # Errors
    /// [`RecordingError::Run`] where the attachment is missing or is not one of this version.
    pub fn run(&self) -> Result<RunConfig, RecordingError> {
        let wrong = |reason| RecordingError::Run { what: RUN_ATTACHMENT, reason };
        let json = self.attachments.get(RUN_ATTACHMENT).ok_or_else(|| wrong("is not in the file".into()))?;
        serde_json::from_slice(json).map_err(|error| wrong(error.to_string()))
    }

    /// Everything in the file, in its order, and an [`Part::End`].
    ///
    /// # Errors
    /// [`RecordingError::File`]; the iterator's last item is an error where the file is damaged.
    pub fn parts(&self) -> Result<Parts, RecordingError> {
        Parts::open(&self.path)
    }

    /// The messages of a channel in the order of the file, with the slices behind them. None where the
    /// file does not have the channel.
    ///
    /// # Errors
    /// [`RecordingError::File`]; an item is an error where the topic's type is not `T`'s, a message is
    /// none, or the file is damaged.
    pub fn channel<T: Ros2>(&self, channel: Channel<T>) -> Result<Messages<T>, RecordingError> {
        let mut parts = self.parts()?;
        parts.only = Some(topic_name(channel.spec.name));
        Ok(Messages { parts, message: PhantomData })
    }
}

/// The messages of a channel: see [`Recording::channel`].
pub struct Messages<T> {
    parts: Parts,
    message: PhantomData<fn() -> T>,
}

impl<T: Ros2> Iterator for Messages<T> {
    type Item = Result<(T, Vec<u8>), RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.parts.next()? {
                Err(error) => return Some(Err(error)),
                Ok(Part::Message(raw)) => return Some(raw.typed_in::<T>(&self.parts.path)),
                Ok(_) => {}
            }
        }
    }
}

impl RawMessage {
    /// The message as a `T`, and the slice behind it.
    ///
    /// # Errors
    /// [`RecordingError::Message`] where it is no `T`.
    pub fn typed<T: Ros2>(&self) -> Result<(T, Vec<u8>), RecordingError> {
        let seq = self.sequence.into();
        T::from_cdr(&self.cdr, seq).map_err(|source| RecordingError::Message {
            topic: self.topic.name.clone(),
            seq,
            source,
        })
    }

    fn typed_in<T: Ros2>(&self, path: &Path) -> Result<(T, Vec<u8>), RecordingError> {
        if self.topic.ros2_type == T::TYPE {
            return self.typed();
        }
        let (topic, found) = (self.topic.name.clone(), self.topic.ros2_type.clone());
        Err(RecordingError::Type { path: path.to_owned(), topic, expected: T::TYPE, found })
    }
}

/// Everything in a recording: see [`Recording::parts`].
pub struct Parts {
    path: PathBuf,
    file: BufReader<File>,
    reader: LinearReader,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Arc<Topic>>,
    only: Option<String>,
    messages: u64,
    has_begun: bool,
    has_footer: bool,
    is_over: bool,
}

impl Parts {
    fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = File::open(path);
        let file = file.map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        Ok(Self {
            path: path.to_owned(),
            file: BufReader::new(file),
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            only: None,
            messages: 0,
            has_begun: false,
            has_footer: false,
            is_over: false,
        })
    }

    fn damaged(&self, source: McapError) -> RecordingError {
        RecordingError::Damaged { path: self.path.clone(), messages: self.messages, source }
    }

    /// Gives the reader `wanted` more bytes of the file, or tells it that there are none.
    fn feed(&mut self, wanted: usize) -> Result<(), RecordingError> {
        let read = self.file.read(self.reader.insert(wanted.min(MAX_RECORD_BYTES)));
        let read = read.map_err(|source| RecordingError::File { path: self.path.clone(), source })?;
        self.reader.notify_read(read);
        Ok(())
    }

    /// The end, of whatever kind: a file that stops in the middle is cut off, not damaged.
    fn end(&mut self, error: Option<McapError>) -> Result<Part, RecordingError> {
        self.is_over = true;
        match error {
            None => Ok(Part::End { clean: self.has_footer }),
            Some(McapError::UnexpectedEof) if self.has_begun => Ok(Part::End { clean: false }),
            Some(error) => Err(self.damaged(error)),
        }
    }

    fn step(&mut self) -> Result<Option<Part>, RecordingError> {
        let (opcode, data) = match self.reader.next_event() {
            None => return self.end(None).map(Some),
            Some(Err(error)) => return self.end(Some(error)).map(Some),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => return self.feed(wanted).map(|()| None),
            Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
        };
        self.has_begun = true;
        if opcode == mcap::records::op::ATTACHMENT && !has_whole_attachment(data) {
            return Err(self.damaged(McapError::UnexpectedEof));
        }
        let record = match mcap::parse_record(opcode, data) {
            Ok(record) => record,
            Err(error) => return Err(self.damaged(error)),
        };
        let taken = take(record, &mut self.schemas, &mut self.topics, self.only.as_deref());
        if matches!(taken, Taken::Footer) {
            self.has_footer = true;
        }
        match taken {
            Taken::Part(part) => {
                self.messages += u64::from(matches!(part, Part::Message(_)));
                Ok(Some(part))
            }
            Taken::Nothing | Taken::Footer => Ok(None),
            Taken::Stray(sequence, channel) => {
                Err(self.damaged(McapError::UnknownChannel(sequence, channel)))
            }
        }
    }
}

/// Whether an attachment is long enough for its own lengths: the library's parser relies on it.
fn has_whole_attachment(data: &[u8]) -> bool {
    let text_end = |start: usize| {
        let length = data.get(start..start + 4)?.try_into().ok()?;
        Some(start + 4 + u32::from_le_bytes(length) as usize)
    };
    let (two_times, length, checksum) = (16, 8, 4);
    let header_end = text_end(two_times).and_then(text_end);
    header_end.is_some_and(|end| end + length + checksum <= data.len())
}

enum Taken {
    Part(Part),
    Footer,
    Nothing,
    Stray(u32, u16),
}

fn take(
    record: Record<'_>,
    schemas: &mut BTreeMap<u16, String>,
    topics: &mut BTreeMap<u16, Arc<Topic>>,
    only: Option<&str>,
) -> Taken {
    match record {
        Record::Schema { header, .. } => {
            schemas.insert(header.id, header.name);
            Taken::Nothing
        }
        Record::Channel(channel) if !topics.contains_key(&channel.id) => {
            let ros2_type = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            let topic = Arc::new(Topic { name: channel.topic, ros2_type, metadata: channel.metadata });
            topics.insert(channel.id, Arc::clone(&topic));
            Taken::Part(Part::Topic(topic))
        }
        Record::Message { header, data } => match topics.get(&header.channel_id) {
            None => Taken::Stray(header.sequence, header.channel_id),
            Some(topic) if only.is_some_and(|name| name != topic.name) => Taken::Nothing,
            Some(topic) => Taken::Part(Part::Message(RawMessage {
                topic: Arc::clone(topic),
                sequence: header.sequence,
                stamp_ns: header.log_time,
                cdr: data.into_owned(),
            })),
        },
        Record::Metadata(metadata) => Taken::Part(Part::Metadata(metadata.name, metadata.metadata)),
        Record::Attachment { header, data, .. } => {
            Taken::Part(Part::Attachment(header.name, data.into_owned()))
        }
        Record::Footer(_) => Taken::Footer,
        _ => Taken::Nothing,
    }
}

impl Iterator for Parts {
    type Item = Result<Part, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.is_over {
            match self.step() {
                Ok(None) => {}
                Ok(Some(part)) => return Some(Ok(part)),
                Err(error) => {
                    self.is_over = true;
                    return Some(Err(error));
                }
            }
        }
        None
    }
}
