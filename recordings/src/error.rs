//! The errors of reading and writing recordings.

use std::path::PathBuf;

use sketchnav_schemas::ros2::Ros2Error;

use crate::dynamic::DynamicError;
use crate::foreign::{Foreign, OF_ANY_MCAP, OF_ROS2};
use crate::records::Damage;
use crate::writer::LIBRARY;

/// An error in reading or writing a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is not an MCAP file, or its bytes are damaged.
    #[error("{path}: expected an MCAP recording, found damage after {messages} messages: {source}",
        path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Number of messages that were read before the damage.
        messages: u64,
        /// The damage.
        source: Damage,
    },
    /// The file is something other than an MCAP file.
    #[error("{path}: expected an MCAP recording, found {found}", path = path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Description of the file.
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
        /// The missing part.
        missing: &'static str,
        /// The library that wrote the recording.
        library: String,
    },
    /// The messages of a topic are in an unsupported form.
    #[error("{topic}: expected ROS 2 messages in CDR, found {found}; {OF_ANY_MCAP} accept them; {way_on}")]
    Form {
        /// The topic.
        topic: String,
        /// The form of the messages.
        found: String,
        /// What can convert the messages into ROS 2 messages.
        way_on: &'static str,
    },
    /// A message does not match the schema that the file contains for its topic.
    #[error("{topic}, message at {stamp_ns} ns: {source}")]
    Dynamic {
        /// The topic.
        topic: String,
        /// Time of the message, in nanoseconds.
        stamp_ns: u64,
        /// The reason.
        source: DynamicError,
    },
    /// The messages of a topic have another type than expected.
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
    /// A message cannot be expressed in ROS 2, or a recorded message is not of the expected type.
    #[error("{topic}, message {seq}: {source}")]
    Message {
        /// The topic.
        topic: String,
        /// Sequence number of the message.
        seq: u64,
        /// The reason.
        source: Ros2Error,
    },
    /// The description of a run cannot be read or written.
    #[error("the run's {what}: {reason}")]
    Run {
        /// The part of the description.
        what: &'static str,
        /// The reason.
        reason: String,
    },
    /// A file of the run is not in its recording.
    #[error(
        "{recording}: expected the file {name} inside the recording, found none (run.json calls it {called:?}); nothing \
         outside a recording is read",
        recording = recording.display(), name = name.display()
    )]
    NotInside {
        /// The recording.
        recording: PathBuf,
        /// The name of the file inside the recording.
        name: PathBuf,
        /// The path in `run.json`.
        called: String,
    },
    /// The channel is not recorded.
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
    /// The recording cannot be written, most likely because the disk is full.
    #[error("the recording cannot be written: {0}{why}", why = cause(.0))]
    Write(mcap::McapError),
}

/// Returns the system's message, such as "no space left". The error itself contains it only as its source.
fn cause(error: &mcap::McapError) -> String {
    std::error::Error::source(error).map_or(String::new(), |source| format!(": {source}"))
}

fn written_by(library: &str) -> String {
    // If the file is our copy of other software's recording, its library names us and not that software.
    if library.is_empty() || library.starts_with(LIBRARY) {
        String::new()
    } else {
        format!(" (written by {library})")
    }
}

impl RecordingError {
    /// Returns true if only a single message was refused and the recording continues.
    pub fn is_one_message(&self) -> bool {
        match self {
            Self::Dynamic { source, .. } => source.is_one_message(),
            _ => matches!(self, Self::Message { .. } | Self::NotRecorded { .. }),
        }
    }
}
