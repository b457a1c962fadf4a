//! What can be wrong with a recording.

use std::path::PathBuf;

use sketchnav_schemas::ros2::Ros2Error;

use crate::dynamic::DynamicError;
use crate::foreign::{Foreign, OF_ANY_MCAP, OF_ROS2};
use crate::records::Damage;
use crate::writer::LIBRARY;

/// What can be wrong with a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not an MCAP file, or its bytes are damaged.
    #[error("{path}: expected an MCAP recording, found damage after {messages} messages: {source}",
        path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// How many messages were read before.
        messages: u64,
        /// What is wrong.
        source: Damage,
    },
    /// The file is something other than an MCAP file.
    #[error("{path}: expected an MCAP recording, found {found}", path = path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: Foreign,
    },
    /// The recording was not written by this project.
    #[error(
        "{path}: expected a recording of sketchnav, found one without {missing}{by}; recordings of other software are supported by \
         {OF_ROS2}",
        path = path.display(),
        by = written_by(library)
    )]
    NotOurs {
        /// The file.
        path: PathBuf,
        /// What it lacks.
        missing: &'static str,
        /// What wrote it.
        library: String,
    },
    /// The messages of a topic are in a form that is not read here.
    #[error("{topic}: expected messages of ROS 2 in CDR, found {found}; {OF_ANY_MCAP} accept them; {way_on}")]
    Form {
        /// The topic.
        topic: String,
        /// What they are.
        found: String,
        /// What would convert them to ROS 2 messages.
        way_on: &'static str,
    },
    /// A message does not fit the schema that the file has for it.
    #[error("{topic}, message at {stamp_ns} ns: {source}")]
    Dynamic {
        /// The topic.
        topic: String,
        /// Its time.
        stamp_ns: u64,
        /// What is wrong.
        source: DynamicError,
    },
    /// A topic has messages of another type.
    #[error("{path}: topic {topic}: expected {expected}, found {found}", path = path.display())]
    Type {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The ROS 2 type of the channel's messages.
        expected: &'static str,
        /// The ROS 2 type in the file.
        found: String,
    },
    /// A message cannot be expressed in ROS 2, or what is recorded is not such a message.
    #[error("{topic}, message {seq}: {source}")]
    Message {
        /// The topic.
        topic: String,
        /// The message's number.
        seq: u64,
        /// What is wrong.
        source: Ros2Error,
    },
    /// The run's description cannot be written.
    #[error("the run's {what}: {reason}")]
    Run {
        /// Which part of it.
        what: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A file of the run is not in its recording.
    #[error(
        "{recording}: expected the file {name} inside the recording, found none (run.json calls it {called:?}); nothing \
         outside of a recording is read",
        recording = recording.display(), name = name.display()
    )]
    NotInside {
        /// The recording.
        recording: PathBuf,
        /// What the file is called inside.
        name: PathBuf,
        /// The path in `run.json`.
        called: String,
    },
    /// The channel is not one that is recorded.
    #[error("channel {channel} is not recorded")]
    NotRecorded {
        /// The channel.
        channel: &'static str,
    },
    /// The topic of a message to be written is not a channel of this program.
    #[error(
        "topic {topic}: expected one of this program's channels; was it written by a program with another navigator?"
    )]
    UnknownTopic {
        /// The topic.
        topic: String,
    },
    /// The file cannot be written: the disk is full, most likely.
    #[error("the recording cannot be written: {0}{why}", why = cause(.0))]
    Write(mcap::McapError),
}

/// What the system says (no space left, say), which the error itself has only as its source.
fn cause(error: &mcap::McapError) -> String {
    std::error::Error::source(error).map_or(String::new(), |source| format!(": {source}"))
}

fn written_by(library: &str) -> String {
    // A copy of ours of what others wrote says nothing of them.
    if library.is_empty() || library.starts_with(LIBRARY) {
        String::new()
    } else {
        format!(" (written by {library})")
    }
}

impl RecordingError {
    /// Whether only a single message was refused and the recording continues.
    pub fn is_one_message(&self) -> bool {
        match self {
            Self::Dynamic { source, .. } => source.is_one_message(),
            _ => matches!(self, Self::Message { .. } | Self::NotRecorded { .. }),
        }
    }
}
