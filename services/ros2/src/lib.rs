//! A bridge to ROS 2 on other hosts: an observer that publishes the channels of a running system over DDS or Zenoh.
//!
//! Each topic has the name and the type under which it is recorded, and its messages are exactly the bytes
//! that a recording contains. `/clock`, `/tf`, `/tf_static` and `/diagnostics` are published in addition. If
//! the settings allow it, orders are accepted on `/order` and handled like those of `sketchnav send`, that
//! is, by the supervisor. [`drive`] works in the other direction and lets a ROS 2 robot replace the simulated
//! world.
//!
//! [`topics`], [`diagnostics`], [`orders`] and [`readings`] are pure. [`run`] does not write to any channel.

// `say!` prints, and escapes characters that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[cfg(not(any(feature = "dds", feature = "zenoh")))]
compile_error!("sketchnav-ros2 needs one of the features dds and zenoh");

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

/// Settings of the ROS 2 node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The ROS 2 domain, 0 to 232.
    pub domain: u16,
    /// The middleware that carries the messages.
    pub middleware: Middleware,
    /// The namespace of all topics and of the node, without slashes around it. Empty for none.
    pub namespace: String,
    /// True if orders are accepted.
    pub takes_orders: bool,
}

impl Settings {
    /// Returns the full name of a topic, below the namespace unless the name begins with a slash.
    pub fn topic(&self, name: &str) -> String {
        full_name(&self.namespace, name)
    }
}

/// Returns the full name of a topic in a namespace, which has no slashes around it. A name that begins with a slash is full
/// already.
fn full_name(namespace: &str, topic: &str) -> String {
    match (topic.starts_with('/'), namespace.is_empty()) {
        (true, _) => topic.to_owned(),
        (false, true) => format!("/{topic}"),
        (false, false) => format!("/{namespace}/{topic}"),
    }
}

/// The names of a robot's topics. Those without a leading slash are in the namespace of the [`Settings`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotTopics {
    /// Scans, `sensor_msgs/msg/LaserScan`.
    pub scan: String,
    /// Odometry, `nav_msgs/msg/Odometry`.
    pub odom: String,
    /// Velocities for the robot, `geometry_msgs/msg/Twist`.
    pub cmd_vel: String,
}

/// The middleware that carries the messages. Only nodes that use the same middleware can communicate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Middleware {
    /// DDS, compatible with rmw_fastrtps and rmw_cyclonedds.
    #[cfg(feature = "dds")]
    Dds {
        /// The addresses of the network interfaces to use. Empty for all of them.
        interfaces: Vec<IpAddr>,
    },
    /// Zenoh, compatible with rmw_zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh {
        /// The routers to connect to, such as `tcp/localhost:7447`.
        routers: Vec<String>,
        /// The endpoints to listen on as a router. Empty for a client.
        listen: Vec<String>,
    },
}

/// Statistics of a bridge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Summary {
    /// Number of messages that were sent.
    pub sent: u64,
    /// Number of messages that were dropped because a subscriber was too slow.
    pub unsent: u64,
    /// Number of messages that were lost because the bridge itself was too slow.
    pub lost: u64,
}

/// Why a bridge failed.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// DDS or Zenoh reported an error.
    #[error("{doing}: {cause}")]
    Middleware {
        /// The operation that failed.
        doing: String,
        /// The middleware's error.
        cause: String,
    },
    /// The system's channels failed.
    #[error(transparent)]
    Runtime(#[from] sketchnav_runtime::Error),
    /// The driver failed.
    #[error(transparent)]
    Driver(#[from] sketchnav_driver::DriverError),
    /// A derived message has no ROS 2 form.
    #[error("a derived message: {0}")]
    Form(#[from] sketchnav_schemas::ros2::Ros2Error),
}

impl BridgeError {
    /// Wraps an error of the middleware that occurred while `doing` something.
    fn middleware(doing: String) -> impl Fn(&dyn Display) -> Self {
        move |cause| Self::Middleware { doing: doing.clone(), cause: cause.to_string() }
    }
}
