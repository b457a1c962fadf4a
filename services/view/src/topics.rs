//! The topics that are shown, with their schemas, in the same form as in recordings.

use std::sync::Arc;

use foxglove::{ChannelBuilder, ChannelId, Context, PartialMetadata, RawChannel, Schema, SinkId};
use sketchnav_schemas::ros2::derived::Derived;
use sketchnav_schemas::ros2::transforms;

use crate::{Result, ViewError};

/// The encoding of a topic's messages, and the language of its schema, as in recordings.
const ENCODING: &str = "cdr";
const SCHEMA_ENCODING: &str = "ros2msg";

/// The announcement of a topic.
pub struct Announced<'a> {
    /// Name, such as `/scan`.
    pub topic: &'a str,
    /// ROS 2 type, such as `sensor_msgs/msg/LaserScan`.
    pub kind: &'a str,
    /// The schema.
    pub schema: String,
    /// True if a late viewer gets the last message.
    pub is_latched: bool,
}

/// A topic that viewers can watch.
pub struct Topic {
    channel: Arc<RawChannel>,
    /// The last message with its time in nanoseconds, if the topic is latched.
    last: Option<(u64, Vec<u8>)>,
    is_latched: bool,
}

impl Topic {
    /// Announces a topic in the encoding of our own recordings.
    pub fn new(context: &Arc<Context>, announced: Announced<'_>) -> Result<Self> {
        let Announced { topic, kind, schema, is_latched } = announced;
        let schema = Schema::new(kind, SCHEMA_ENCODING, schema.into_bytes());
        Self::foreign(context, topic, ENCODING, Some(schema), is_latched)
    }

    /// Announces a topic that is derived from a channel.
    pub fn derived(context: &Arc<Context>, derived: &Derived) -> Result<Self> {
        let (kind, schema, is_latched) = (derived.ros2, derived.schema(), derived.of.is_latched());
        Self::new(context, Announced { topic: derived.topic, kind, schema, is_latched })
    }

    /// Announces `/tf` or `/tf_static`.
    pub fn transforms(context: &Arc<Context>, topic: &str, is_latched: bool) -> Result<Self> {
        Self::new(
            context,
            Announced { topic, kind: transforms::TYPE, schema: transforms::schema(), is_latched },
        )
    }

    /// Announces a topic in any encoding.
    pub fn foreign(
        context: &Arc<Context>,
        topic: &str,
        encoding: &str,
        schema: Option<Schema>,
        is_latched: bool,
    ) -> Result<Self> {
        let builder = ChannelBuilder::new(topic).context(context).message_encoding(encoding).schema(schema);
        let channel = builder.build_raw().map_err(|error| ViewError::Server(format!("{topic}: {error}")))?;
        Ok(Self { channel, last: None, is_latched })
    }

    /// Returns true if a viewer watches the topic.
    pub fn is_watched(&self) -> bool {
        self.channel.has_sinks()
    }

    /// Returns true if the topic has the given id.
    pub fn is(&self, id: ChannelId) -> bool {
        self.channel.id() == id
    }

    /// Returns true if the topic's last message is stored.
    pub fn is_latched(&self) -> bool {
        self.is_latched
    }

    /// Shows a message. If the topic is latched, the message is stored for late viewers.
    pub fn show(&mut self, stamp_ns: u64, cdr: &[u8]) {
        self.channel.log_with_meta(cdr, PartialMetadata::with_log_time(stamp_ns));
        if self.is_latched {
            self.last = Some((stamp_ns, cdr.to_vec()));
        }
    }

    /// Shows the last message to a late viewer.
    pub fn show_last(&self, sink: SinkId) {
        if let Some((stamp_ns, cdr)) = &self.last {
            let meta = PartialMetadata::with_log_time(*stamp_ns);
            self.channel.log_with_meta_to_sink(cdr, meta, Some(sink));
        }
    }

    /// Forgets the last message.
    pub fn forget(&mut self) {
        self.last = None;
    }
}
