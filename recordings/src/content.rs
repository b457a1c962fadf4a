//! What a recording is made of: messages, and what describes them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use sketchnav_schemas::channels::{Channel, ChannelSpec};
use sketchnav_schemas::erased::Owned;
use sketchnav_schemas::ros2::Ros2;

use crate::directory::Topic;
use crate::error::RecordingError;
use crate::records::{Attachment, MessageHead};

/// A message as it lies in the file.
#[derive(Debug, Clone)]
pub struct RawMessage {
    /// Where it was sent.
    pub topic: Arc<Topic>,
    /// Its number on its channel.
    pub sequence: u32,
    /// Simulation time, nanoseconds; of `/health`, which several processes write, no earlier than of the one before.
    pub stamp_ns: u64,
    /// When it was sent, nanoseconds, where the file has that apart.
    pub publish_ns: u64,
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
    /// A file inside the file.
    Attachment(Attachment),
    /// The last part: whether the writer came to an end, or the file is cut off.
    End {
        /// Whether the writer came to an end.
        clean: bool,
    },
}

impl RawMessage {
    pub(crate) fn new(topic: &Arc<Topic>, head: MessageHead, data: &[u8]) -> Self {
        let MessageHead { sequence, log_ns: stamp_ns, publish_ns, .. } = head;
        Self { topic: Arc::clone(topic), sequence, stamp_ns, publish_ns, cdr: data.to_vec() }
    }

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

    /// The message by its bytes, as one of the channel `spec`.
    ///
    /// # Errors
    /// As [`RawMessage::typed`].
    pub fn decode(&self, spec: &ChannelSpec) -> Result<Owned, RecordingError> {
        let seq = self.sequence.into();
        let topic = || self.topic.name.clone();
        let decoded = spec.message.decode(&self.cdr, seq);
        decoded.map_err(|source| RecordingError::Message { topic: topic(), seq, source })
    }

    /// As [`RawMessage::typed`], by the channel that it is a message of.
    ///
    /// # Errors
    /// As [`RawMessage::typed`].
    pub fn read<T: Ros2>(&self, _channel: Channel<T>) -> Result<(T, Vec<u8>), RecordingError> {
        self.typed()
    }

    /// As [`RawMessage::typed`], of the recording at `path`, where the topic's type is `T`'s.
    ///
    /// # Errors
    /// As [`RawMessage::typed`]; [`RecordingError::Type`] where the topic's type is another one.
    pub fn typed_in<T: Ros2>(&self, path: &Path) -> Result<(T, Vec<u8>), RecordingError> {
        if self.topic.ros2_type == T::TYPE {
            return self.typed();
        }
        let (topic, found) = (self.topic.name.clone(), self.topic.ros2_type.clone());
        Err(RecordingError::Type { path: path.to_owned(), topic, expected: T::TYPE, found })
    }
}
