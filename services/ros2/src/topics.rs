//! The ROS 2 topics of a run: one for each recorded channel, and those derived from channels.
//!
//! A channel keeps the name and the type under which it is recorded, and its role determines its quality of service.

use sketchnav_schemas::channels::{self, ChannelSpec, Role};
use sketchnav_schemas::ros2::{definitions, transforms};
use sketchnav_schemas::run::RunConfig;

/// How messages of a topic are delivered. ROS 2 connects a subscriber only if it requests no more than this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Best effort, the profile of sensor data. A lost message is not sent again, because a newer reading
    /// follows.
    Sensor,
    /// Reliable. `depth` messages are kept for a slow subscriber before the oldest one is lost.
    Reliable {
        /// Length of the queue, in messages.
        depth: usize,
    },
    /// Reliable and transient local (latched). A late subscriber gets the latest message.
    Latched,
}

impl Delivery {
    /// Returns the length of the queue, in messages.
    pub fn depth(self) -> usize {
        match self {
            Self::Sensor => 5,
            Self::Reliable { depth } => depth,
            Self::Latched => 1,
        }
    }
}

/// The source of a topic's messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The messages of a channel.
    Channel(&'static ChannelSpec),
    /// The time of each tick.
    Clock,
    /// The robot's pose in its odometry frame.
    Transforms,
    /// The transform from the robot to its laser.
    Mount,
    /// Health and faults of all processes, once a second.
    Diagnostics,
}

/// A topic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Topic {
    /// Name, without a leading slash.
    pub name: &'static str,
    /// ROS 2 type, `package/msg/Type`.
    pub kind: &'static str,
    /// How the topic is delivered.
    pub delivery: Delivery,
    /// The source of the messages.
    pub source: Source,
}

/// Returns the topics of a run: the recorded channels of its kind of navigator, then the derived ones.
pub fn of_run(run: &RunConfig) -> Vec<Topic> {
    let recorded = channels::of_kind(run.mission.navigator_kind()).filter(|spec| spec.is_recorded());
    let mut topics: Vec<_> = recorded.map(of_channel).collect();
    let clock = Delivery::Reliable { depth: 1 };
    topics.push(derived("clock", "rosgraph_msgs/msg/Clock", clock, Source::Clock));
    topics.push(derived("tf", transforms::TYPE, Delivery::Reliable { depth: 100 }, Source::Transforms));
    if run.robot.laser.is_some() {
        topics.push(derived("tf_static", transforms::TYPE, Delivery::Latched, Source::Mount));
    }
    let diagnostics = "diagnostic_msgs/msg/DiagnosticArray";
    topics.push(derived("diagnostics", diagnostics, Delivery::Reliable { depth: 10 }, Source::Diagnostics));
    topics
}

/// Returns the `ros2msg` schema of `package/msg/Type`: its definition, followed by those of the types that it uses. Empty for
/// an unknown type.
pub fn schema(kind: &str) -> String {
    let channel = channels::all().find(|spec| spec.message.ros2 == kind);
    channel.map_or_else(|| definitions::schema(kind, &[]), |spec| spec.message.schema())
}

fn derived(name: &'static str, kind: &'static str, delivery: Delivery, source: Source) -> Topic {
    Topic { name, kind, delivery, source }
}

fn of_channel(spec: &'static ChannelSpec) -> Topic {
    Topic {
        name: spec.name,
        kind: spec.message.ros2,
        delivery: delivery_of(spec),
        source: Source::Channel(spec),
    }
}

/// Returns the kind of delivery of a channel's messages.
fn delivery_of(spec: &ChannelSpec) -> Delivery {
    match spec.role {
        _ if spec.is_latched() => Delivery::Latched,
        _ if spec.is_sensed() => Delivery::Sensor,
        Role::Request | Role::Reply | Role::Report => Delivery::Reliable { depth: 100 },
        _ => Delivery::Reliable { depth: 10 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_schemas::channels::{FAULTS, ODOMETRY, SCAN, TRUTH};
    use sketchnav_schemas::samples::example::{MAP, PLACE};

    #[test]
    fn a_role_determines_the_quality_of_service() {
        for sensed in [SCAN.spec, ODOMETRY.spec, TRUTH.spec] {
            assert_eq!(delivery_of(sensed), Delivery::Sensor, "{}", sensed.name);
        }
        assert_eq!(delivery_of(MAP.spec), Delivery::Latched);
        assert_eq!(delivery_of(PLACE.spec), Delivery::Reliable { depth: 10 });
        assert_eq!(delivery_of(FAULTS.spec), Delivery::Reliable { depth: 100 });
    }

    #[test]
    fn a_topic_has_the_name_and_the_type_of_its_recording() {
        let topic = of_channel(SCAN.spec);
        assert_eq!((topic.name, topic.kind), ("scan", "sensor_msgs/msg/LaserScan"));
    }
}
