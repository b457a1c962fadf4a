//! The options of bridges to other software.

use std::net::IpAddr;

use clap::{Args, Subcommand};
use regex_lite::Regex;

use super::values::parse_pattern;

/// Highest domain of ROS 2: the ports of the next one would exceed 65535.
const MAX_DOMAIN: u16 = 232;

/// The software on the other side of the bridge.
#[derive(Debug, Subcommand)]
pub enum Other {
    /// ROS 2, over DDS or Zenoh. Each channel is published with the topic and type under which it is recorded, together
    /// with /clock, /tf, /tf_static and /diagnostics. Ends with the system. Needs a build with `--features ros2` for
    /// DDS, or `--features zenoh` for Zenoh.
    #[command(
        name = "ros2",
        after_help = "Exit codes: 0 the system has ended or Ctrl-C, 2 bad input (no such system, no such topic), 3 anything else.\nExample: sketchnav bridge ros2 --system lab --domain 7 --topics scan 'odo.*'\nExample, which lets any node in the domain give orders: sketchnav bridge ros2 --system lab --orders"
    )]
    Ros2 {
        #[command(flatten)]
        options: Ros2Options,
    },
}

/// The options of `bridge ros2`.
#[derive(Debug, Clone, Args)]
pub struct Ros2Options {
    /// The system's name; optional if only one is running.
    #[arg(long)]
    pub system: Option<String>,
    /// The middleware: `dds`, `zenoh` or the name of an RMW implementation such as rmw_zenoh_cpp. Default: that of
    /// RMW_IMPLEMENTATION, otherwise dds.
    #[arg(long, value_parser = parse_rmw)]
    pub rmw: Option<Rmw>,
    /// The ROS 2 domain, 0 to 232. Default: ROS_DOMAIN_ID, otherwise 0.
    #[arg(long, value_parser = parse_domain)]
    pub domain: Option<u16>,
    /// Only publish topics whose whole name matches one of these regular expressions. Default: all.
    #[arg(long, value_name = "REGEX", num_args = 1.., value_parser = TopicPattern::parse)]
    pub topics: Vec<TopicPattern>,
    /// With DDS: use only the network interface with this address, such as 127.0.0.1 (may be repeated). Default: all.
    #[arg(long = "interface", value_name = "ADDRESS")]
    pub interfaces: Vec<IpAddr>,
    /// With Zenoh: a router to connect to, such as tcp/192.168.1.2:7447 (may be repeated). Default: tcp/localhost:7447.
    #[arg(long = "router", value_name = "ENDPOINT", value_parser = parse_endpoint)]
    pub routers: Vec<String>,
    /// With Zenoh: act as a router that listens at this endpoint, such as tcp/localhost:7447 (may be repeated), and
    /// connect only to the routers given by --router.
    #[arg(long, value_name = "ENDPOINT", value_parser = parse_endpoint)]
    pub listen: Vec<String>,
    /// A namespace for all topics and the node, such as `robot_1`.
    #[arg(long, value_name = "NAME", default_value = "", value_parser = parse_namespace)]
    pub namespace: String,
    /// Accept orders such as `pause` from the topic /order (std_msgs/String). Any node in the domain can send them.
    #[arg(long)]
    pub orders: bool,
    /// Act as the world of a system that runs without one: a robot that publishes /scan and /odom is driven through
    /// /cmd_vel (geometry_msgs/Twist).
    #[arg(long, conflicts_with_all = ["topics", "orders"])]
    pub drive: bool,
    /// With --drive: the topic of the robot's laser scans. Default: scan. As in ROS 2, a name that begins with a slash is not put
    /// into the namespace.
    #[arg(long, value_name = "TOPIC", value_parser = parse_topic, requires = "drive")]
    pub scan: Option<String>,
    /// With --drive: the topic of the robot's odometry, such as odometry/filtered. Default: odom.
    #[arg(long, value_name = "TOPIC", value_parser = parse_topic, requires = "drive")]
    pub odom: Option<String>,
    /// With --drive: the topic of velocities for the robot. Default: cmd_vel.
    #[arg(long, value_name = "TOPIC", value_parser = parse_topic, requires = "drive")]
    pub cmd_vel: Option<String>,
}

/// A ROS 2 middleware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rmw {
    /// DDS.
    Dds,
    /// Zenoh.
    Zenoh,
}

/// Parses the name of a middleware or of an RMW implementation.
pub fn parse_rmw(text: &str) -> Result<Rmw, String> {
    match text {
        "dds" | "rmw_fastrtps_cpp" | "rmw_fastrtps_dynamic_cpp" | "rmw_cyclonedds_cpp" | "rmw_connextdds" => {
            Ok(Rmw::Dds)
        }
        "zenoh" | "rmw_zenoh_cpp" => Ok(Rmw::Zenoh),
        _ => {
            Err("expected dds, zenoh or the name of an RMW implementation, such as rmw_zenoh_cpp".to_owned())
        }
    }
}

/// Parses a Zenoh endpoint.
fn parse_endpoint(text: &str) -> Result<String, String> {
    let address = text.strip_prefix("tcp/").and_then(|address| address.rsplit_once(':'));
    let is_address = |(host, port): (&str, &str)| {
        let has_host = host.chars().all(|c| c.is_ascii_alphanumeric() || "._-:[]".contains(c));
        has_host && !host.is_empty() && port.parse::<u16>().is_ok()
    };
    let holds = address.is_some_and(is_address);
    let expected = || "expected an endpoint of Zenoh over TCP, such as tcp/192.168.1.2:7447".to_owned();
    if holds { Ok(text.to_owned()) } else { Err(expected()) }
}

/// Parses a ROS 2 domain.
pub fn parse_domain(text: &str) -> Result<u16, String> {
    let domain = text.trim().parse().ok().filter(|domain| *domain <= MAX_DOMAIN);
    domain.ok_or_else(|| format!("expected a domain of ROS 2 from 0 to {MAX_DOMAIN}"))
}

/// Parses a ROS 2 namespace, which may be empty, and removes a leading slash.
fn parse_namespace(text: &str) -> Result<String, String> {
    let name = text.strip_prefix('/').unwrap_or(text);
    let holds = name.is_empty() || name.split('/').all(is_token);
    let expected = || "expected a namespace of ROS 2, such as robot_1 or fleet/robot_1".to_owned();
    if holds { Ok(name.to_owned()) } else { Err(expected()) }
}

/// Parses the name of a ROS 2 topic, which may begin with a slash.
fn parse_topic(text: &str) -> Result<String, String> {
    let holds = text.strip_prefix('/').unwrap_or(text).split('/').all(is_token);
    let expected = || "expected a topic of ROS 2, such as odometry/filtered or /robot_1/odom".to_owned();
    if holds { Ok(text.to_owned()) } else { Err(expected()) }
}

/// Returns true if ROS 2 allows this text between two slashes of a name.
fn is_token(token: &str) -> bool {
    token.starts_with(|c: char| c.is_ascii_alphabetic())
        && token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !token.contains("__")
}

/// A pattern that selects topics by their whole names.
#[derive(Debug, Clone)]
#[cfg_attr(
    not(any(feature = "ros2", feature = "zenoh")),
    allow(dead_code, reason = "the command line is the same in every build")
)]
pub struct TopicPattern {
    /// The pattern as it was given.
    pub text: String,
    regex: Regex,
}

impl TopicPattern {
    /// Parses a pattern. The leading slash of all ROS 2 topics may be omitted.
    fn parse(text: &str) -> Result<Self, String> {
        let regex = parse_pattern(text.strip_prefix('/').unwrap_or(text))?;
        Ok(Self { text: text.to_owned(), regex })
    }

    /// Returns true if the pattern matches `topic`, which has no leading slash.
    #[cfg(any(feature = "ros2", feature = "zenoh", test))]
    pub fn is_match(&self, topic: &str) -> bool {
        self.regex.is_match(topic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_has_ports() {
        assert_eq!((parse_domain("0"), parse_domain("232")), (Ok(0), Ok(232)));
        for wrong in ["233", "-1", "1.5", "", "lab", "99999999"] {
            assert!(parse_domain(wrong).unwrap_err().contains("from 0 to 232"), "{wrong}");
        }
    }

    #[test]
    fn middlewares_have_their_ros_2_names() {
        for (text, rmw) in
            [("dds", Rmw::Dds), ("rmw_cyclonedds_cpp", Rmw::Dds), ("rmw_zenoh_cpp", Rmw::Zenoh)]
        {
            assert_eq!(parse_rmw(text), Ok(rmw));
        }
        assert!(parse_rmw("rmw_email_cpp").unwrap_err().contains("expected dds, zenoh or"));
    }

    #[test]
    fn an_endpoint_has_a_host_and_a_port() {
        for text in ["tcp/localhost:7447", "tcp/[::1]:7447", "tcp/10.0.0.2:0"] {
            assert_eq!(parse_endpoint(text).as_deref(), Ok(text));
        }
        for wrong in ["localhost:7447", "udp/a:1", "tcp/a", "tcp/:7447", "tcp/a:b", "tcp/a:70000", "tcp/\":1"]
        {
            assert!(parse_endpoint(wrong).unwrap_err().contains("expected an endpoint"), "{wrong}");
        }
    }

    #[test]
    fn a_namespace_is_valid_in_ros_2() {
        for (text, name) in [("", ""), ("/lab", "lab"), ("fleet/robot_1", "fleet/robot_1")] {
            assert_eq!(parse_namespace(text).as_deref(), Ok(name));
        }
        for wrong in ["1", "a//b", "a/", "a b", "~a", "a__b", "_a", "ä"] {
            assert!(parse_namespace(wrong).unwrap_err().contains("expected a namespace"), "{wrong}");
        }
    }

    #[test]
    fn a_robots_topic_is_valid_in_ros_2() {
        for text in ["scan", "odometry/filtered", "/robot_1/odom"] {
            assert_eq!(parse_topic(text).as_deref(), Ok(text));
        }
        for wrong in ["", "/", "scan/", "a//b", "2scan", "a b"] {
            assert!(parse_topic(wrong).unwrap_err().contains("expected a topic"), "{wrong}");
        }
    }

    #[test]
    fn a_topic_is_named_with_or_without_its_slash() {
        for text in ["/scan", "scan", "sc.*|tf"] {
            assert!(TopicPattern::parse(text).unwrap().is_match("scan"), "{text}");
        }
        assert!(!TopicPattern::parse("/scan").unwrap().is_match("scanner"));
        assert!(TopicPattern::parse("(").unwrap_err().contains("expected a regular expression"));
    }
}
