//! The names and bytes that ROS 2's rmw_zenoh uses in Zenoh: keys of topics, liveliness tokens of the graph,
//! and attachments of messages.
//!
//! Source: the design document of rmw_zenoh. In the parts of a token, slashes are replaced by `%`, and so are empty parts.

use crate::full_name;
use crate::participant::PublisherId;
use crate::topics::Delivery;

/// The prefix of the tokens of all nodes, publishers and subscriptions.
const GRAPH: &str = "@ros2_lv";
/// The kind of the tokens of publishers.
const PUBLISHER: &str = "MP";
/// The number of our node within its session.
const NODE_ID: u32 = 0;
/// The queue depth that rmw_zenoh omits from a token.
const DEPTH_LEFT_OUT: usize = 42;
/// Length of an attachment, in bytes: two numbers, the length of the identity, and the identity.
const ATTACHMENT_BYTES: usize = 8 + 8 + 1 + 16;

/// A ROS 2 node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// The ROS 2 domain.
    pub domain: u16,
    /// The id of the Zenoh session.
    pub session: String,
    /// The namespace, without slashes around it. Empty for none.
    pub namespace: String,
    /// Name of the node.
    pub name: String,
}

/// The role of an endpoint in its topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
}

/// A topic of a node, with its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Typed<'a> {
    /// Name of the topic within the node's namespace, without a leading slash.
    pub topic: &'a str,
    /// Name of the type, `package::msg::dds_::Type_`.
    pub type_name: &'a str,
    /// Hash of the type, `RIHS01_…`.
    pub type_hash: &'a str,
}

impl Node {
    /// Returns the key under which the messages of a topic are sent.
    pub fn key(&self, typed: &Typed<'_>) -> String {
        let (domain, topic) = (self.domain, self.full(typed.topic));
        format!("{domain}{topic}/{}/{}", typed.type_name, typed.type_hash)
    }

    /// Returns the token that announces the node.
    pub fn token(&self) -> String {
        self.part_of_graph(NODE_ID, "NN")
    }

    /// Returns the token of a publisher or subscription. `id` is its number in the session, which is 1 or more.
    pub fn token_of(&self, id: u32, end: End, typed: &Typed<'_>, delivery: Delivery) -> String {
        let end = match end {
            End::Publisher => PUBLISHER,
            End::Subscription => "MS",
        };
        let (begin, topic) = (self.part_of_graph(id, end), mangled(&self.full(typed.topic)));
        format!("{begin}/{topic}/{}/{}/{}", typed.type_name, typed.type_hash, quality(delivery))
    }

    fn part_of_graph(&self, id: u32, kind: &str) -> String {
        let Self { domain, session, namespace, name } = self;
        let namespace = mangled(&format!("/{namespace}"));
        format!("{GRAPH}/{domain}/{session}/{NODE_ID}/{id}/{kind}/%/{namespace}/{name}")
    }

    /// Returns the full name of a topic with its slashes, such as `/lab/scan`.
    pub fn full(&self, topic: &str) -> String {
        full_name(&self.namespace, topic)
    }
}

/// Returns the expression that the tokens of a domain match.
pub fn graph(domain: u16) -> String {
    format!("{GRAPH}/{domain}/**")
}

/// Returns the full name of the topic that a token belongs to, if the token announces a publisher of this type.
pub fn published(token: &str, type_name: &str) -> Option<String> {
    // The parts after the domain are session, node, endpoint, kind, enclave, namespace, name, topic, type.
    let mut parts = token.strip_prefix(GRAPH)?.split('/').skip(5);
    let (kind, topic, found) = (parts.next()?, parts.nth(3)?, parts.next()?);
    (kind == PUBLISHER && found == type_name).then(|| topic.replace('%', "/"))
}

fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

/// Returns the quality of service: reliability, durability, history and depth, deadline, lifespan, liveliness. Defaults are
/// omitted.
fn quality(delivery: Delivery) -> String {
    let (reliability, durability) = match delivery {
        Delivery::Sensor => ("2", ""),
        Delivery::Reliable { .. } => ("", ""),
        Delivery::Latched => ("", "1"),
    };
    let depth = Some(delivery.depth()).filter(|depth| *depth != DEPTH_LEFT_OUT);
    let depth = depth.map(|depth| depth.to_string()).unwrap_or_default();
    format!("{reliability}:{durability}:,{depth}:,:,:,,")
}

/// Returns the identity of a publisher, which is derived from its token.
pub fn identity(token: &str) -> [u8; 16] {
    twox_hash::XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// Returns the attachment of a message, which consists of its number, from 1, its send time in nanoseconds since 1970, and its
/// publisher's identity.
pub fn attachment(number: i64, sent_ns: i64, identity: [u8; 16]) -> [u8; ATTACHMENT_BYTES] {
    let mut bytes = [0; ATTACHMENT_BYTES];
    bytes[..8].copy_from_slice(&number.to_le_bytes());
    bytes[8..16].copy_from_slice(&sent_ns.to_le_bytes());
    bytes[16] = identity.len() as u8;
    bytes[17..].copy_from_slice(&identity);
    bytes
}

/// Returns the identity of the publisher in an attachment, or zeros if there is none.
pub fn publisher_of(attachment: &[u8]) -> PublisherId {
    attachment.get(17..).and_then(|identity| identity.try_into().ok()).unwrap_or_default()
}

/// Returns the query key for the latest message of a latched topic. The same text is the token that announces it.
///
/// Source: the advanced publisher of zenoh-ext, which rmw_zenoh uses. It distinguishes messages by their timestamps.
pub fn latched(key: &str, session: &str) -> String {
    format!("{key}/@adv/pub/{session}/uhlc/_")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCAN: Typed<'static> =
        Typed { topic: "scan", type_name: "sensor_msgs::msg::dds_::LaserScan_", type_hash: "RIHS01_0" };

    fn node(namespace: &str) -> Node {
        let [session, namespace, name] = ["a1b2", namespace, "sketchnav_lab"].map(str::to_owned);
        Node { domain: 7, session, namespace, name }
    }

    #[test]
    fn a_key_has_domain_topic_type_and_hash() {
        assert_eq!(node("").key(&SCAN), "7/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_0");
        assert_eq!(
            node("fleet/lab").key(&SCAN),
            "7/fleet/lab/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_0"
        );
    }

    #[test]
    fn tokens_say_who_publishes_what_and_how() {
        assert_eq!(node("").token(), "@ros2_lv/7/a1b2/0/0/NN/%/%/sketchnav_lab");
        assert_eq!(node("fleet/lab").token(), "@ros2_lv/7/a1b2/0/0/NN/%/%fleet%lab/sketchnav_lab");
        assert_eq!(
            node("").token_of(1, End::Publisher, &SCAN, Delivery::Sensor),
            "@ros2_lv/7/a1b2/0/1/MP/%/%/sketchnav_lab/%scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_0/2::,5:,:,:,,"
        );
        assert_eq!(
            node("lab").token_of(12, End::Subscription, &SCAN, Delivery::Latched),
            "@ros2_lv/7/a1b2/0/12/MS/%/%lab/sketchnav_lab/%lab%scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_0/:1:,1:,:,:,,"
        );
    }

    #[test]
    fn a_token_of_a_publisher_names_its_topic() {
        let token = |end, topic| node("lab").token_of(3, end, &Typed { topic, ..SCAN }, Delivery::Sensor);
        let found = |token: &str| published(token, SCAN.type_name);
        assert_eq!(found(&token(End::Publisher, "front/scan")), Some("/lab/front/scan".to_owned()));
        assert_eq!(found(&token(End::Publisher, "/scan")), Some("/scan".to_owned()));
        assert_eq!(found(&token(End::Subscription, "scan")), None);
        assert_eq!(published(&token(End::Publisher, "scan"), "nav_msgs::msg::dds_::Odometry_"), None);
        assert_eq!(found(&node("lab").token()), None);
        assert_eq!(found("@ros2_lv/7"), None);
    }

    #[test]
    fn default_qualities_of_service_are_omitted() {
        assert_eq!(quality(Delivery::Reliable { depth: 10 }), "::,10:,:,:,,");
        assert_eq!(quality(Delivery::Reliable { depth: 42 }), "::,:,:,:,,");
    }

    /// The hashes were computed with the reference, the Python package `xxhash`. rmw_zenoh puts the lower half first.
    #[test]
    fn an_identity_is_the_hash_of_the_token() {
        let hex = |token: &str| identity(token).map(|byte| format!("{byte:02x}")).concat();
        assert_eq!(hex(""), "7f498d4624c30160d8984701d306aa99");
        let token = node("").token_of(1, End::Publisher, &SCAN, Delivery::Sensor);
        assert_eq!(hex(&token), "ed0cbecb897701fa350664b508734456");
        assert_eq!(hex(&"x".repeat(300)), "5435c87d60b4d1a57abcd72aea375212");
    }

    #[test]
    fn an_attachment_is_number_time_and_identity() {
        let bytes = attachment(1, 0x0203, [9; 16]);
        let expected = [&[1, 0, 0, 0, 0, 0, 0, 0, 3, 2, 0, 0, 0, 0, 0, 0, 16][..], &[9; 16]].concat();
        assert_eq!(bytes[..], expected);
        assert_eq!(publisher_of(&bytes), [9; 16]);
        assert_eq!(publisher_of(&bytes[..20]), [0; 16]);
    }

    #[test]
    fn a_latched_topic_is_queried_at_the_advanced_publisher() {
        assert_eq!(latched("7/sketch/T_/RIHS01_0", "a1b2"), "7/sketch/T_/RIHS01_0/@adv/pub/a1b2/uhlc/_");
    }
}
