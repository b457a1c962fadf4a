//! The parts of a recording: messages, and what describes them.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use sketchnav_schemas::channels::{Channel, ChannelSpec};
use sketchnav_schemas::erased::Owned;
use sketchnav_schemas::ros2::{Ros2, Ros2Error};

use crate::directory::Topic;
use crate::error::RecordingError;
use crate::records::{Attachment, MAX_RECORD_BYTES, MessageHead};

/// A message as stored in the file.
#[derive(Debug, Clone)]
pub struct RawMessage {
    /// The topic on which it was sent.
    pub topic: Arc<Topic>,
    /// Sequence number of the message on its channel.
    pub sequence: u32,
    /// Simulation time, in nanoseconds. On `/health`, which several processes write, it is never earlier than that of the
    /// previous message.
    pub stamp_ns: u64,
    /// Send time of the message, in nanoseconds, if the file stores it separately.
    pub publish_ns: u64,
    /// The message in CDR, decompressed if rosbag2 compressed it individually, unless that fails (see
    /// [`RawMessage::is_damaged`]).
    pub cdr: Vec<u8>,
}

/// The first bytes of data packed by zstd. CDR begins with a zero, so the two cannot be confused.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Returns true if rosbag2 compressed the message individually (`compression_mode: MESSAGE`).
pub(crate) fn is_packed(data: &[u8]) -> bool {
    data.starts_with(&ZSTD_MAGIC)
}

/// Unpacks a message that was compressed individually. Returns `None` if it was not, or if it cannot be unpacked.
fn unpacked(data: &[u8]) -> Option<Vec<u8>> {
    if !is_packed(data) {
        return None;
    }
    let mut cdr = Vec::new();
    let decoder = zstd::stream::read::Decoder::with_buffer(data).ok()?;
    decoder.take(MAX_RECORD_BYTES as u64 + 1).read_to_end(&mut cdr).ok()?;
    (cdr.len() <= MAX_RECORD_BYTES).then_some(cdr)
}

/// A part of a recording, in the order of the file.
#[derive(Debug, Clone)]
pub enum Part {
    /// A topic, before its first message.
    Topic(Arc<Topic>),
    /// A message.
    Message(RawMessage),
    /// Metadata: key-value pairs under a name.
    Metadata(String, BTreeMap<String, String>),
    /// A file embedded in the recording.
    Attachment(Attachment),
    /// The last part.
    End {
        /// True if the writer finished, false if the file is cut off.
        clean: bool,
    },
}

impl RawMessage {
    pub(crate) fn new(topic: &Arc<Topic>, head: MessageHead, data: &[u8]) -> Self {
        let MessageHead { sequence, log_ns: stamp_ns, publish_ns, .. } = head;
        let unpacked = topic.is_cdr().then(|| unpacked(data)).flatten();
        let cdr = unpacked.unwrap_or_else(|| data.to_vec());
        Self { topic: Arc::clone(topic), sequence, stamp_ns, publish_ns, cdr }
    }

    /// Returns true if rosbag2 compressed the message individually but it cannot be decompressed, so that its
    /// content is unknown.
    pub fn is_damaged(&self) -> bool {
        self.topic.is_cdr() && is_packed(&self.cdr)
    }

    /// Decodes the message as a `T` and the slice that follows it.
    ///
    /// # Errors
    /// [`RecordingError::Message`] if it is not a `T`.
    pub fn typed<T: Ros2>(&self) -> Result<(T, Vec<u8>), RecordingError> {
        self.decode_by(T::from_cdr)
    }

    /// Decodes a message with `decode`. If the values are only off by rounding errors, decodes the exact message instead.
    fn decode_by<M>(&self, decode: impl Fn(&[u8], u64) -> Result<M, Ros2Error>) -> Result<M, RecordingError> {
        let seq = self.sequence.into();
        let decoded = match decode(&self.cdr, seq) {
            Err(Ros2Error::Rounded { exact, .. }) => decode(&exact, seq),
            decoded => decoded,
        };
        let topic = || self.topic.name.clone();
        decoded.map_err(|source| RecordingError::Message { topic: topic(), seq, source })
    }

    /// Decodes the message as the type of the channel `spec`.
    ///
    /// # Errors
    /// Same errors as [`RawMessage::typed`].
    pub fn decode(&self, spec: &ChannelSpec) -> Result<Owned, RecordingError> {
        self.decode_by(|cdr, seq| spec.message.decode(cdr, seq))
    }

    /// Like [`RawMessage::typed`], but takes the type from the channel.
    ///
    /// # Errors
    /// Same errors as [`RawMessage::typed`].
    pub fn read<T: Ros2>(&self, _channel: Channel<T>) -> Result<(T, Vec<u8>), RecordingError> {
        self.typed()
    }

    /// Like [`RawMessage::typed`], but first checks that the topic's type is that of `T`. `path` is the recording, for
    /// errors.
    ///
    /// # Errors
    /// Any error of [`RawMessage::typed`], and [`RecordingError::Type`] if the topic has another type.
    pub fn typed_in<T: Ros2>(&self, path: &Path) -> Result<(T, Vec<u8>), RecordingError> {
        self.must_be(T::TYPE, path)?;
        self.typed()
    }

    /// Like [`RawMessage::decode`], but first checks that the topic's type is that of the channel. `path` is the recording,
    /// for errors.
    ///
    /// # Errors
    /// Same errors as [`RawMessage::typed_in`].
    pub fn decode_in(&self, spec: &ChannelSpec, path: &Path) -> Result<Owned, RecordingError> {
        self.must_be(spec.message.ros2, path)?;
        self.decode(spec)
    }

    fn must_be(&self, expected: &'static str, path: &Path) -> Result<(), RecordingError> {
        if self.topic.ros2_type == expected {
            return Ok(());
        }
        let (topic, found) = (self.topic.name.clone(), self.topic.ros2_type.clone());
        Err(RecordingError::Type { path: path.to_owned(), topic, expected, found })
    }
}
