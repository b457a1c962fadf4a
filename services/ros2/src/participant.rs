//! The participant: a ROS 2 node with its publishers and subscriptions, independent of the middleware.
//!
//! Messages are sent as the same CDR that a recording contains, by [`dds`](crate::dds) or
//! [`rmw_zenoh`](crate::rmw_zenoh). Each of these has its own cargo feature.

use std::collections::BTreeSet;

use serde::de::DeserializeOwned;

#[cfg(feature = "dds")]
use crate::dds;
#[cfg(feature = "zenoh")]
use crate::rmw_zenoh;
use crate::topics::Delivery;
use crate::{BridgeError, Middleware, Settings};

/// A ROS 2 node.
pub enum Participant {
    /// A node in a DDS domain.
    #[cfg(feature = "dds")]
    Dds(Box<dds::Participant>),
    /// A node at a Zenoh router.
    #[cfg(feature = "zenoh")]
    Zenoh(Box<rmw_zenoh::Participant>),
}

impl Participant {
    /// Joins the DDS domain, or connects to the Zenoh router, as the node of the system `name`.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the network or the router cannot be reached, or a socket cannot be opened.
    pub fn join(settings: &Settings, name: &str) -> Result<Self, BridgeError> {
        let node = node_name(name);
        match &settings.middleware {
            #[cfg(feature = "dds")]
            Middleware::Dds { interfaces } => {
                Ok(Self::Dds(Box::new(dds::Participant::join(settings, interfaces, &node)?)))
            }
            #[cfg(feature = "zenoh")]
            Middleware::Zenoh { routers, listen } => {
                Ok(Self::Zenoh(Box::new(rmw_zenoh::Participant::join(settings, routers, listen, &node)?)))
            }
        }
    }

    fn full(&self, name: &str) -> String {
        match self {
            #[cfg(feature = "dds")]
            Self::Dds(participant) => participant.full(name),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(participant) => participant.full(name),
        }
    }

    /// Opens a topic for publishing. A name without a leading slash is in the namespace of the settings, and the type has the
    /// form `package/msg/Type`.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the topic cannot be opened, for example because the name is not allowed in ROS 2.
    pub fn publisher(&mut self, name: &str, kind: &str, delivery: Delivery) -> Result<Outlet, BridgeError> {
        let sender: Box<dyn Sender> = match self {
            #[cfg(feature = "dds")]
            Self::Dds(participant) => Box::new(participant.publisher(name, kind, delivery)?),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(participant) => Box::new(participant.publisher(name, kind, delivery)?),
        };
        Ok(Outlet { name: self.full(name), sender, sent: 0, unsent: 0 })
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
    ) -> Result<Intake<F>, BridgeError> {
        let receiver: Box<dyn Receiver<F>> = match self {
            #[cfg(feature = "dds")]
            Self::Dds(participant) => Box::new(participant.subscription(name, kind, delivery)?),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(participant) => Box::new(participant.subscription(name, kind, delivery)?),
        };
        Ok(Intake { name: self.full(name), receiver })
    }

    /// Returns the full names of the topics of the type `package/msg/Type` that other nodes have announced, in order.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the router cannot be asked.
    pub fn topics_of(&self, kind: &str) -> Result<BTreeSet<String>, BridgeError> {
        match self {
            #[cfg(feature = "dds")]
            Self::Dds(participant) => Ok(participant.topics_of(kind).into_iter().collect()),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(participant) => {
                let failed = BridgeError::middleware(format!("looking for topics of type {kind}"));
                let found = participant.topics_of(kind).map_err(|cause| failed(&cause))?;
                Ok(found.into_iter().collect())
            }
        }
    }
}

/// Returns the node name for a system, in which only letters, digits and underscores are allowed.
fn node_name(system: &str) -> String {
    format!("sketchnav_{}", system.replace(|c: char| !c.is_ascii_alphanumeric(), "_"))
}

/// Returns the full name of the type `package/msg/Type` in DDS and Zenoh: `package::msg::dds_::Type_`.
pub fn dds_type_name(kind: &str) -> String {
    let (package, name) = kind.split_once("/msg/").unwrap_or(("", kind));
    format!("{package}::msg::dds_::{name}_")
}

/// Sends the messages of a topic.
pub trait Sender {
    /// Sends a message in CDR with its encapsulation header. Returns false if the queue was full.
    ///
    /// # Errors
    /// A text with the reason if messages can no longer be sent.
    fn send(&mut self, cdr: Vec<u8>) -> Result<bool, String>;
}

/// Identifies a publisher of a topic.
pub type PublisherId = [u8; 16];

/// Receives the messages of a topic.
pub trait Receiver<F> {
    /// Takes the next message from the queue, with its publisher.
    ///
    /// # Errors
    /// A text with the reason if the next one is not a message of the type.
    fn take(&mut self) -> Result<Option<(F, PublisherId)>, String>;
}

/// A topic that this node publishes.
pub struct Outlet {
    name: String,
    sender: Box<dyn Sender>,
    sent: u64,
    unsent: u64,
}

impl Outlet {
    /// Publishes a message in CDR with its encapsulation header. If the queue is full, it is dropped and counted.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if messages can no longer be sent.
    pub fn publish(&mut self, cdr: Vec<u8>) -> Result<(), BridgeError> {
        match self.sender.send(cdr) {
            Ok(true) => self.sent += 1,
            Ok(false) => self.unsent += 1,
            Err(cause) => return Err(BridgeError::middleware(format!("publishing {}", self.name))(&cause)),
        }
        Ok(())
    }

    /// Returns the number of messages that were sent, and the number of those that were dropped for lack of space.
    pub fn counts(&self) -> (u64, u64) {
        (self.sent, self.unsent)
    }
}

/// A topic that this node subscribes to.
pub struct Intake<F> {
    name: String,
    receiver: Box<dyn Receiver<F>>,
}

impl<F> Intake<F> {
    /// Takes the next message. Any node may send anything, so data that cannot be decoded as this type is reported on standard
    /// error.
    pub fn take(&mut self) -> Option<F> {
        self.take_with_publisher().map(|(form, _)| form)
    }

    /// Takes the next message as [`Intake::take`] does, with its publisher.
    pub fn take_with_publisher(&mut self) -> Option<(F, PublisherId)> {
        self.receiver.take().unwrap_or_else(|error| {
            sketchnav_schemas::say!("{}: {error}", self.name);
            None
        })
    }

    /// Returns the full name of the topic.
    pub fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_system_name_becomes_a_valid_ros_2_name() {
        for (system, name) in [("lab", "sketchnav_lab"), ("building-a-2", "sketchnav_building_a_2")] {
            assert_eq!(node_name(system), name);
        }
    }

    #[test]
    fn types_have_their_dds_names() {
        assert_eq!(dds_type_name("sensor_msgs/msg/LaserScan"), "sensor_msgs::msg::dds_::LaserScan_");
    }
}
