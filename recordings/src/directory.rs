//! The schemas and topics that a recording declares, by their numbers in the file.

use std::collections::BTreeMap;
use std::sync::Arc;

use sketchnav_schemas::channels::Channel;

use crate::records::{ChannelRecord, FileHeader, Schema};

/// A topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Name, such as `/scan`.
    pub name: String,
    /// ROS 2 type, such as `sensor_msgs/msg/LaserScan`. Empty if the file does not state it.
    pub ros2_type: String,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: String,
    /// The schema of the messages.
    pub schema: Arc<Schema>,
    /// Metadata of the topic.
    pub metadata: BTreeMap<String, String>,
}

impl Topic {
    /// Returns true if this is the topic of `channel`.
    pub fn is<T>(&self, channel: Channel<T>) -> bool {
        channel.spec.is_topic(&self.name)
    }

    /// Returns true if the messages are in CDR.
    pub fn is_cdr(&self) -> bool {
        self.encoding == "cdr"
    }

    /// Returns true if a late reader should receive the last message again.
    pub fn is_latched(&self) -> bool {
        let said = self.metadata.get("offered_qos_profiles");
        said.is_some_and(|profile| profile.contains("transient_local") || profile.contains("durability: 1"))
    }
}

/// The schemas and topics by number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Directory {
    schemas: BTreeMap<u16, Arc<Schema>>,
    topics: BTreeMap<u16, Arc<Topic>>,
    /// The file's header, once it has been read.
    pub(crate) header: FileHeader,
}

impl Directory {
    pub(crate) fn add_schema(&mut self, id: u16, schema: Schema) {
        self.schemas.entry(id).or_insert_with(|| Arc::new(schema));
    }

    /// Adds a topic and returns it, or returns `None` if its number is already known.
    pub(crate) fn add_channel(&mut self, channel: ChannelRecord) -> Option<Arc<Topic>> {
        if self.topics.contains_key(&channel.id) {
            return None;
        }
        let schema = self.schemas.get(&channel.schema).cloned().unwrap_or_default();
        let ChannelRecord { id, topic: name, encoding, metadata, .. } = channel;
        let topic = Arc::new(Topic { name, ros2_type: schema.name.clone(), encoding, schema, metadata });
        self.topics.insert(id, Arc::clone(&topic));
        Some(topic)
    }

    pub(crate) fn topic(&self, id: u16) -> Option<&Arc<Topic>> {
        self.topics.get(&id)
    }

    /// Returns the topics, in the order of their numbers.
    pub(crate) fn topics(&self) -> impl Iterator<Item = (u16, &Arc<Topic>)> {
        self.topics.iter().map(|(&id, topic)| (id, topic))
    }
}
