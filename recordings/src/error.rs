//! What can be wrong with a recording.

use std::path::PathBuf;

use sketchnav_schemas::ros2::Ros2Error;

use crate::records::Damage;

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
    /// The file is no MCAP file, or its bytes are damaged.
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
    /// A topic holds messages of another type.
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
    /// A message cannot be said in ROS 2, or what is recorded is not such a message.
    #[error("{topic}, message {seq}: {source}")]
    Message {
        /// The topic.
        topic: String,
        /// The message's number.
        seq: u64,
        /// What is wrong.
        source: Ros2Error,
    },
    /// The run's description cannot be written down.
    #[error("the run's {what}: {reason}")]
    Run {
        /// Which part of it.
        what: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The channel is not one of those that are recorded.
    #[error("channel {channel} is not recorded")]
    NotRecorded {
        /// The channel.
        channel: &'static str,
    },
    /// The file cannot be written: the disk is full, most likely.
    #[error("the recording cannot be written: {0}{why}", why = cause(.0))]
    Write(mcap::McapError),
}

/// What the system says, which the error itself keeps to its source: no space left, say.
fn cause(error: &mcap::McapError) -> String {
    std::error::Error::source(error).map_or(String::new(), |source| format!(": {source}"))
}

impl RecordingError {
    /// Whether a single message was refused, and the recording goes on.
    pub fn is_one_message(&self) -> bool {
        matches!(self, Self::Message { .. } | Self::NotRecorded { .. })
    }
}
