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

use crate::participant::{Receiver, Sender};
use crate::topics::Delivery;
use crate::{BridgeError, Settings};

/// A ROS 2 node.
pub struct Participant {
    node: Node,
    /// The namespace with a leading slash, or only the slash if there is none.
    namespace: String,
    /// Declared last, and therefore dropped last, because the node needs it.
    _context: Context,
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
        let namespace = format!("/{}", settings.namespace);
        let name = NodeName::new(&namespace, name).map_err(|error| failed(&error))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(name, options).map_err(|error| failed(&error))?;
        Ok(Self { node, namespace, _context: context })
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
        let failed = BridgeError::middleware(format!("publishing /{name}"));
        let qos = quality(delivery);
        let topic = self.topic(name, kind, &qos).map_err(|cause| failed(&cause))?;
        let publisher = self.node.create_publisher(&topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Outgoing(publisher))
    }

    /// Subscribes to a topic.
    ///
    /// # Errors
    /// As [`Participant::publisher`].
    pub fn subscription<F: DeserializeOwned + 'static>(
        &mut self,
        name: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<impl Receiver<F> + 'static, BridgeError> {
        let failed = BridgeError::middleware(format!("subscribing to /{name}"));
        let qos = quality(delivery);
        let topic = self.topic(name, kind, &qos).map_err(|cause| failed(&cause))?;
        let subscription =
            self.node.create_subscription::<F>(&topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Incoming(subscription))
    }

    fn topic(&self, name: &str, kind: &str, qos: &QosProfile) -> Result<Topic, String> {
        let name = Name::new(&self.namespace, name).map_err(|error| error.to_string())?;
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
    fn take(&mut self) -> Result<Option<F>, String> {
        let taken = self.0.take().map_err(|error| error.to_string())?;
        Ok(taken.map(|(form, _)| form))
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
    use crate::participant::dds_type_name;

    /// The sent bytes must be those of a recording, so nothing may be aligned or counted a second time.
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
