//! The participant in a DDS domain.

use std::net::IpAddr;

use ros2_client::dds::rustdds::{DomainParticipantBuilder, Topic};
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, Subscription, WriteError,
};
use serde::de::DeserializeOwned;
use serde::ser::{Serialize, SerializeTuple, Serializer};
use sketchnav_schemas::ros2::ENCAPSULATION;

use crate::participant::{PublisherId, Receiver, Sender, dds_type_name};
use crate::topics::Delivery;
use crate::{BridgeError, Settings, full_name};

/// Prefix of ROS 2 topics in DDS.
const PREFIX: &str = "rt";

/// A ROS 2 node.
pub struct Participant {
    node: Node,
    /// The namespace, without slashes around it. Empty for none.
    namespace: String,
    /// Declared last so that it is dropped last, because the node needs it.
    context: Context,
}

impl Participant {
    /// Joins a domain as the node `name`. If `interfaces` is empty, all network interfaces of the host are used.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the sockets cannot be opened.
    pub fn join(settings: &Settings, interfaces: &[IpAddr], name: &str) -> Result<Self, BridgeError> {
        let failed = BridgeError::middleware(format!("joining domain {}", settings.domain));
        let mut builder = DomainParticipantBuilder::new(settings.domain);
        if !interfaces.is_empty() {
            builder = builder.with_only_networks(interfaces.iter().copied());
        }
        let participant = builder.build().map_err(|error| failed(&error))?;
        let context = Context::from_domain_participant(participant).map_err(|error| failed(&error))?;
        let namespace = settings.namespace.clone();
        let name = NodeName::new(&format!("/{namespace}"), name).map_err(|error| failed(&error))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(name, options).map_err(|error| failed(&error))?;
        Ok(Self { node, namespace, context })
    }

    /// Opens a topic for publishing.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the topic cannot be opened, for example because the name is not allowed in ROS 2.
    pub fn publisher(
        &mut self,
        name: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<impl Sender + 'static, BridgeError> {
        let failed = BridgeError::middleware(format!("publishing {}", self.full(name)));
        let qos = quality(delivery);
        let topic = self.topic(name, kind, &qos).map_err(|cause| failed(&cause))?;
        let publisher = self.node.create_publisher(&topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Outgoing(publisher))
    }

    /// Subscribes to a topic.
    ///
    /// # Errors
    /// Any error of [`Participant::publisher`].
    pub fn subscription<F: DeserializeOwned + 'static>(
        &mut self,
        name: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<impl Receiver<F> + 'static, BridgeError> {
        let failed = BridgeError::middleware(format!("subscribing to {}", self.full(name)));
        let qos = quality(delivery);
        let topic = self.topic(name, kind, &qos).map_err(|cause| failed(&cause))?;
        let subscription =
            self.node.create_subscription::<F>(&topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Incoming(subscription))
    }

    /// Returns the full names of the topics of a type that other nodes have announced.
    pub fn topics_of(&self, kind: &str) -> Vec<String> {
        let type_name = dds_type_name(kind);
        let of_type =
            self.context.discovered_topics().into_iter().filter(|topic| topic.type_name == type_name);
        of_type.filter_map(|topic| topic.name.strip_prefix(PREFIX).map(str::to_owned)).collect()
    }

    /// Returns the full name of a topic.
    pub fn full(&self, name: &str) -> String {
        full_name(&self.namespace, name)
    }

    fn topic(&self, name: &str, kind: &str, qos: &QosProfile) -> Result<Topic, String> {
        let name = Name::parse(&self.full(name)).map_err(|error| error.to_string())?;
        self.node.create_topic(&name, type_name(kind), qos).map_err(|error| error.to_string())
    }
}

/// Splits `package/msg/Type` into the type name that DDS needs.
fn type_name(kind: &str) -> MessageTypeName {
    let (package, name) = kind.split_once("/msg/").unwrap_or(("", kind));
    MessageTypeName::new(package, name)
}

fn quality(delivery: Delivery) -> QosProfile {
    // A slow subscriber must not delay the others.
    let reliable = Reliability::Reliable { when_full: WhenFull::Fail };
    let (reliability, durability) = match delivery {
        Delivery::Sensor => (Reliability::BestEffort, Durability::Volatile),
        Delivery::Reliable { .. } => (reliable, Durability::Volatile),
        Delivery::Latched => (reliable, Durability::TransientLocal),
    };
    QosProfile::subscription_default()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth: delivery.depth() })
}

struct Outgoing(Publisher<Cdr>);

impl Sender for Outgoing {
    fn send(&mut self, cdr: Vec<u8>) -> Result<bool, String> {
        match self.0.publish(Cdr(cdr)) {
            Ok(()) => Ok(true),
            Err(WriteError::WouldBlock { .. }) => Ok(false),
            Err(error) => Err(error.to_string()),
        }
    }
}

struct Incoming<F: 'static>(Subscription<F>);

impl<F: DeserializeOwned + 'static> Receiver<F> for Incoming<F> {
    fn take(&mut self) -> Result<Option<(F, PublisherId)>, String> {
        let taken = self.0.take().map_err(|error| error.to_string())?;
        Ok(taken.map(|(form, info)| (form, info.publisher_gid().to_bytes16())))
    }
}

/// A message in CDR. It is serialized as the bytes after the encapsulation header.
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

    /// The bytes that are sent must equal those in a recording, so serialization may not align them again or add a length.
    #[test]
    fn cdr_bytes_are_passed_through_unchanged() {
        let mut cdr = Vec::new();
        let form = (1u8, "a text".to_owned(), 2.5f64, vec![1u32, 2]);
        sketchnav_schemas::ros2::encode(&form, &mut cdr).unwrap();
        let mut again = Vec::new();
        sketchnav_schemas::ros2::encode(&Cdr(cdr.clone()), &mut again).unwrap();
        assert_eq!(again, cdr);
    }

    #[test]
    fn names_are_valid_in_ros_2() {
        for node in ["sketchnav_lab", "sketchnav_building_a_2", "sketchnav_7"] {
            NodeName::new("/", node).unwrap();
        }
        let kind = "sensor_msgs/msg/LaserScan";
        assert_eq!(type_name(kind).dds_msg_type(), dds_type_name(kind));
    }
}
