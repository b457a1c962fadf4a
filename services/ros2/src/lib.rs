//! A bridge to ROS 2 on other hosts: an observer that publishes a running system's channels by DDS or Zenoh.
//!
//! Each topic carries, under the name and the type that a recording has, the very bytes that a recording holds.
//! `/clock`, `/tf`, `/tf_static` and `/diagnostics` come besides. Orders are taken from `/order` where the settings say so,
//! and go the way of `sketchnav send`: the supervisor gives them. [`drive`] is the other way round: a ROS 2 robot is the world.
//!
//! [`topics`], [`diagnostics`], [`orders`] and [`readings`] are pure. [`run`] writes no channel.

// `say!` prints: it escapes what could steer a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[cfg(not(any(feature = "dds", feature = "zenoh")))]
compile_error!("sketchnav-ros2 wants one of the features dds and zenoh");

mod bridge;
#[cfg(feature = "dds")]
mod dds;
pub mod diagnostics;
mod drive;
mod forms;
pub mod orders;
mod participant;
pub mod readings;
#[cfg(feature = "zenoh")]
mod rmw_zenoh;
pub mod topics;

use std::fmt::Display;
#[cfg(feature = "dds")]
use std::net::IpAddr;

pub use bridge::{ORDER_TOPIC, run};
pub use drive::drive;

/// How to take part in ROS 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The domain, 0 to 232.
    pub domain: u16,
    /// What carries the messages.
    pub middleware: Middleware,
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

/// What carries the messages. Nodes hear each other only where it is the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Middleware {
    /// DDS, as rmw_fastrtps and rmw_cyclonedds have it.
    #[cfg(feature = "dds")]
    Dds {
        /// The addresses of the interfaces to use; without any, all.
        interfaces: Vec<IpAddr>,
    },
    /// Zenoh, as rmw_zenoh has it.
    #[cfg(feature = "zenoh")]
    Zenoh {
        /// The routers to connect to, as `tcp/localhost:7447`.
        routers: Vec<String>,
        /// Where to listen as a router; without any it is none.
        listen: Vec<String>,
    },
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
    /// DDS or Zenoh says no.
    #[error("{doing}: {cause}")]
    Middleware {
        /// What was to be done.
        doing: String,
        /// What it says.
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
    /// An error of what carries the messages, while `doing` something.
    fn middleware(doing: String) -> impl Fn(&dyn Display) -> Self {
        move |cause| Self::Middleware { doing: doing.clone(), cause: cause.to_string() }
    }
}
