//! The participant in a DDS domain: a ROS 2 node with its publishers and subscriptions.
//!
//! Messages arrive here as the CDR that a recording holds, and leave as these bytes.

use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, Subscription, WriteError,
};
use serde::de::DeserializeOwned;
use serde::ser::{Serialize, SerializeTuple, Serializer};
use sketchnav_schemas::ros2::ENCAPSULATION;

use crate::topics::Delivery;
use crate::{BridgeError, Settings};

/// A ROS 2 node.
pub struct Participant {
    node: Node,
    /// With a slash before it; the slash alone where there is none.
    namespace: String,
    /// Goes last: the node lives in it.
    _context: Context,
}

impl Participant {
    /// Joins a domain as the node of the system `name`. Without interfaces all of the host's are used.
    ///
    /// # Errors
    /// [`BridgeError::Dds`] where its sockets cannot be opened.
    pub fn join(settings: &Settings, name: &str) -> Result<Self, BridgeError> {
        let failed = BridgeError::dds(format!("joining domain {}", settings.domain));
        let mut builder = DomainParticipantBuilder::new(settings.domain);
        if !settings.interfaces.is_empty() {
            builder = builder.with_only_networks(settings.interfaces.iter().copied());
        }
        let participant = builder.build().map_err(|error| failed(&error))?;
        let context = Context::from_domain_participant(participant).map_err(|error| failed(&error))?;
        let namespace = format!("/{}", settings.namespace);
        let name = NodeName::new(&namespace, &node_name(name)).map_err(|error| failed(&error))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(name, options).map_err(|error| failed(&error))?;
        Ok(Self { node, namespace, _context: context })
    }

    /// Opens a topic to publish it.
    ///
    /// # Errors
    /// [`BridgeError::Dds`], where ROS 2 knows no such name too.
    pub fn publisher(&mut self, name: &str, kind: &str, delivery: Delivery) -> Result<Outlet, BridgeError> {
        let failed = BridgeError::dds(format!("publishing /{name}"));
        let qos = quality(delivery);
        let topic = self
            .node
            .create_topic(&self.topic_name(name)?, type_name(kind), &qos)
            .map_err(|error| failed(&error))?;
        let publisher = self.node.create_publisher(&topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Outlet { name: name.to_owned(), publisher, sent: 0, unsent: 0 })
    }

    /// Opens a topic to hear it.
    ///
    /// # Errors
    /// As [`Participant::publisher`].
    pub fn subscription<F: DeserializeOwned + 'static>(
        &mut self,
        name: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<Subscription<F>, BridgeError> {
        let failed = BridgeError::dds(format!("subscribing to /{name}"));
        let qos = quality(delivery);
        let topic = self
            .node
            .create_topic(&self.topic_name(name)?, type_name(kind), &qos)
            .map_err(|error| failed(&error))?;
        self.node.create_subscription(&topic, Some(qos)).map_err(|error| failed(&error))
    }
}

impl Participant {
    fn topic_name(&self, name: &str) -> Result<Name, BridgeError> {
        let failed = BridgeError::dds(format!("the topic {name}"));
        Name::new(&self.namespace, name).map_err(|error| failed(&error))
    }
}

/// A system's name as that of a node: letters, digits and underscores.
fn node_name(system: &str) -> String {
    format!("sketchnav_{}", system.replace(|c: char| !c.is_ascii_alphanumeric(), "_"))
}

/// `package/msg/Type`.
fn type_name(kind: &str) -> MessageTypeName {
    let (package, name) = kind.split_once("/msg/").unwrap_or(("", kind));
    MessageTypeName::new(package, name)
}

fn quality(delivery: Delivery) -> QosProfile {
    // A slow subscriber must not stop the others.
    let reliable = Reliability::Reliable { when_full: WhenFull::Fail };
    let (reliability, durability, depth) = match delivery {
        Delivery::Sensor => (Reliability::BestEffort, Durability::Volatile, 5),
        Delivery::Reliable { depth } => (reliable, Durability::Volatile, depth),
        Delivery::Latched => (reliable, Durability::TransientLocal, 1),
    };
    QosProfile::subscription_default()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
}

/// A topic that is published.
pub struct Outlet {
    name: String,
    publisher: Publisher<Cdr>,
    sent: u64,
    unsent: u64,
}

impl Outlet {
    /// Publishes a message in CDR with its encapsulation. One for which there is no room is counted as not sent.
    ///
    /// # Errors
    /// [`BridgeError::Dds`] where nothing can be sent any more.
    pub fn publish(&mut self, cdr: Vec<u8>) -> Result<(), BridgeError> {
        match self.publisher.publish(Cdr(cdr)) {
            Ok(()) => self.sent += 1,
            Err(WriteError::WouldBlock { .. }) => self.unsent += 1,
            Err(error) => return Err(BridgeError::dds(format!("publishing /{}", self.name))(&error)),
        }
        Ok(())
    }

    /// Messages that were sent, and those for which there was no room.
    pub fn counts(&self) -> (u64, u64) {
        (self.sent, self.unsent)
    }
}

/// A message in CDR. Its serialization is what stands behind the encapsulation header, byte for byte.
struct Cdr(Vec<u8>);

impl Serialize for Cdr {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let body = self.0.get(ENCAPSULATION.len()..).unwrap_or_default();
        let mut bytes = serializer.serialize_tuple(body.len())?;
        body.iter().try_for_each(|byte| bytes.serialize_element(byte))?;
        bytes.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What goes out must be what a recording holds: nothing is aligned or counted a second time.
    #[test]
    fn bytes_of_cdr_are_serialized_as_they_are() {
        let mut cdr = Vec::new();
        let form = (1u8, "a text".to_owned(), 2.5f64, vec![1u32, 2]);
        sketchnav_schemas::ros2::encode(&form, &mut cdr).unwrap();
        let mut again = Vec::new();
        sketchnav_schemas::ros2::encode(&Cdr(cdr.clone()), &mut again).unwrap();
        assert_eq!(again, cdr);
    }

    #[test]
    fn any_system_gives_a_name_that_ros_2_takes() {
        for system in ["lab", "building-a-2", "7"] {
            NodeName::new("/", &node_name(system)).unwrap();
        }
    }

    #[test]
    fn types_are_named_as_dds_has_them() {
        let name = type_name("sensor_msgs/msg/LaserScan").dds_msg_type();
        assert_eq!(name, "sensor_msgs::msg::dds_::LaserScan_");
    }
}
