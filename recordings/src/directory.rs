//! What a recording declares: schemas and topics, by their numbers in the file.

use std::collections::BTreeMap;
use std::sync::Arc;

use sketchnav_schemas::channels::Channel;

use crate::records::{ChannelRecord, FileHeader, Schema};

/// A topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// `/scan`.
    pub name: String,
    /// `sensor_msgs/msg/LaserScan`; empty if the file does not say.
    pub ros2_type: String,
    /// `cdr`: how its messages are encoded.
    pub encoding: String,
    /// The form of its messages.
    pub schema: Arc<Schema>,
    /// What else the file says about it.
    pub metadata: BTreeMap<String, String>,
}

impl Topic {
    /// Whether it is the topic of that channel.
    pub fn is<T>(&self, channel: Channel<T>) -> bool {
        channel.spec.is_topic(&self.name)
    }

    /// Whether its messages are in CDR.
    pub fn is_cdr(&self) -> bool {
        self.encoding == "cdr"
    }

    /// Whether a late reader is to be given its last message again.
    pub fn is_latched(&self) -> bool {
        let said = self.metadata.get("offered_qos_profiles");
        said.is_some_and(|profile| profile.contains("transient_local") || profile.contains("durability: 1"))
    }
}

/// Schemas and topics by number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Directory {
    schemas: BTreeMap<u16, Arc<Schema>>,
    topics: BTreeMap<u16, Arc<Topic>>,
    /// What the file says about itself, once that has been read.
    pub(crate) header: FileHeader,
}

impl Directory {
    pub(crate) fn add_schema(&mut self, id: u16, schema: Schema) {
        self.schemas.entry(id).or_insert_with(|| Arc::new(schema));
    }

    /// The topic, if it is new.
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

    /// The topics, in the order of their numbers.
    pub(crate) fn topics(&self) -> impl Iterator<Item = (u16, &Arc<Topic>)> {
        self.topics.iter().map(|(&id, topic)| (id, topic))
    }
}
