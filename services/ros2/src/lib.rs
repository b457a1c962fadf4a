//! A bridge to ROS 2 on other hosts: an observer that publishes a running system's channels by DDS.
//!
//! Each topic carries, under the name and the type that a recording has, the very bytes that a recording holds.
//! `/clock`, `/tf`, `/tf_static` and `/diagnostics` come besides. Orders are taken from `/order` where the settings say so,
//! and go the way of `sketchnav send`: the supervisor gives them. [`drive`] is the other way round: a ROS 2 robot is the world.
//!
//! [`topics`], [`diagnostics`], [`orders`] and [`readings`] are pure. [`run`] writes no channel.

mod bridge;
pub mod diagnostics;
mod drive;
mod forms;
pub mod orders;
mod participant;
pub mod readings;
pub mod topics;

use std::fmt::Display;
use std::net::IpAddr;

pub use bridge::{ORDER_TOPIC, run};
pub use drive::drive;

/// How to take part in ROS 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The domain, 0 to 232.
    pub domain: u16,
    /// The addresses of the interfaces to use; without any, all.
    pub interfaces: Vec<IpAddr>,
    /// The namespace of all topics and the node, without slashes around it; empty for none.
    pub namespace: String,
    /// Whether orders are taken.
    pub takes_orders: bool,
}

impl Settings {
    /// The whole name of a topic.
    pub fn topic(&self, name: &str) -> String {
        let slash = if self.namespace.is_empty() { "" } else { "/" };
        format!("{slash}{}/{name}", self.namespace)
    }
}

/// What a bridge has done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Summary {
    /// Messages that were sent.
    pub sent: u64,
    /// Messages for which there was no room: a subscriber was too slow.
    pub unsent: u64,
    /// Messages that the bridge itself was too slow for.
    pub lost: u64,
}

/// What may go wrong.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// DDS says no.
    #[error("{doing}: {cause}")]
    Dds {
        /// What was to be done.
        doing: String,
        /// What DDS says.
        cause: String,
    },
    /// The system's channels.
    #[error(transparent)]
    Runtime(#[from] sketchnav_runtime::Error),
    /// A derived message that ROS 2 cannot say.
    #[error("a derived message: {0}")]
    Form(#[from] sketchnav_schemas::ros2::Ros2Error),
}

impl BridgeError {
    /// An error of DDS while `doing` something.
    fn dds(doing: String) -> impl Fn(&dyn Display) -> Self {
        move |cause| Self::Dds { doing: doing.clone(), cause: cause.to_string() }
    }
}
