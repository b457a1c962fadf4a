//! Standard ROS 2 messages that recordings do not contain: the clock, diagnostics, and the text of orders.

use ros2_interfaces_jazzy_serde::{builtin_interfaces::msg::Time, std_msgs::msg::Header};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::time::NS_PER_S;

/// The message `rosgraph_msgs/msg/Clock`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Clock {
    /// Simulation time.
    pub clock: Time,
}

/// The message `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// Header with the time of the report.
    pub header: Header,
    /// One status per process.
    pub status: Vec<DiagnosticStatus>,
}

/// The message `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// Severity, the number of a [`crate::diagnostics::Level`].
    pub level: u8,
    /// The name of the process.
    pub name: String,
    /// A description.
    pub message: String,
    /// Identifier of the hardware, here the name of the system.
    pub hardware_id: String,
    /// Figures of the process.
    pub values: Vec<KeyValue>,
}

/// The message `diagnostic_msgs/msg/KeyValue`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// The name of the figure.
    pub key: String,
    /// The figure.
    pub value: String,
}

/// The message `std_msgs/msg/String`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Text {
    /// The text.
    pub data: String,
}

/// Converts a simulation time in nanoseconds into its ROS 2 form. Times beyond 2³¹ s are clamped to the last one.
pub fn time(stamp_ns: u64) -> Time {
    let sec = i32::try_from(stamp_ns / NS_PER_S).unwrap_or(i32::MAX);
    Time { sec, nanosec: (stamp_ns % NS_PER_S) as u32 }
}
