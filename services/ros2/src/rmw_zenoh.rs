//! The participant at a Zenoh router, compatible with nodes that use ROS 2's rmw_zenoh.
//!
//! The participant is either a client of a router or the router itself. Latched topics behave like an advanced publisher of
//! zenoh-ext.

mod names;
mod type_hash;

use std::sync::{Arc, Mutex, PoisonError};

use serde::de::DeserializeOwned;
use sketchnav_schemas::ros2::decode;
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::query::Queryable;
use zenoh::sample::Sample;
use zenoh::time::Timestamp;
use zenoh::{Config, Session, Wait};

use self::names::{End, Node, Typed};
use crate::participant::{PublisherId, Receiver, Sender, dds_type_name};
use crate::topics::{self, Delivery};
use crate::{BridgeError, Settings};

/// Maximum size, in bytes, of a message that is accepted or forwarded. There must be a limit, because any node may send anything.
const MAX_MESSAGE_BYTES: usize = 64 << 20;

/// A ROS 2 node.
pub struct Participant {
    session: Session,
    node: Node,
    /// The number of the most recently opened endpoint.
    endpoint: u32,
    _token: LivelinessToken,
}

/// An opened topic.
struct Opened {
    key: String,
    /// Announces the topic to other nodes.
    token: LivelinessToken,
    identity: [u8; 16],
}

impl Participant {
    /// Connects to `routers` as the node `name`. With endpoints in `listen`, the node is a router itself.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if no router can be reached, or if an endpoint cannot be listened on.
    pub fn join(
        settings: &Settings,
        routers: &[String],
        listen: &[String],
        name: &str,
    ) -> Result<Self, BridgeError> {
        let doing = match listen {
            [] => format!("joining the Zenoh router {}", routers.join(", ")),
            _ => format!("acting as a Zenoh router at {}", listen.join(", ")),
        };
        let failed = BridgeError::middleware(doing);
        let config = config(routers, listen).map_err(|error| failed(&error))?;
        let session = zenoh::open(config).wait().map_err(|error| failed(&plain(&error)))?;
        let node = Node {
            domain: settings.domain,
            session: session.zid().to_string(),
            namespace: settings.namespace.clone(),
            name: name.to_owned(),
        };
        let token =
            session.liveliness().declare_token(node.token()).wait().map_err(|error| failed(&error))?;
        Ok(Self { session, node, endpoint: 0, _token: token })
    }

    /// Opens a topic for publishing.
    ///
    /// # Errors
    /// [`BridgeError::Middleware`] if the topic cannot be opened, for example because its type has no definition.
    pub fn publisher(
        &mut self,
        name: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<impl Sender + 'static, BridgeError> {
        let failed = BridgeError::middleware(format!("publishing {}", self.full(name)));
        let opened = self.open(End::Publisher, name, kind, delivery).map_err(|cause| failed(&cause))?;
        let is_latched = delivery == Delivery::Latched;
        // A slow subscriber must not delay the others. Latched messages are rare and must arrive.
        let congestion = if is_latched { CongestionControl::Block } else { CongestionControl::Drop };
        let publisher = self.session.declare_publisher(opened.key.clone()).congestion_control(congestion);
        let publisher = publisher.wait().map_err(|error| failed(&error))?;
        let newest = is_latched.then(|| Newest::open(&self.session, &self.node.session, &opened.key));
        let newest = newest.transpose().map_err(|error| failed(&error))?;
        let (session, identity) = (self.session.clone(), opened.identity);
        Ok(Outgoing { session, publisher, identity, number: 0, newest, _token: opened.token })
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
        let opened = self.open(End::Subscription, name, kind, delivery).map_err(|cause| failed(&cause))?;
        let subscriber = self.session.declare_subscriber(opened.key).with(RingChannel::new(delivery.depth()));
        let subscriber = subscriber.wait().map_err(|error| failed(&error))?;
        Ok(Incoming { subscriber, _token: opened.token })
    }

    /// Returns the full names of the topics of a type that nodes publish.
    ///
    /// # Errors
    /// A text with the reason if the router cannot be queried.
    pub fn topics_of(&self, kind: &str) -> Result<Vec<String>, String> {
        let type_name = dds_type_name(kind);
        let replies = self.session.liveliness().get(names::graph(self.node.domain)).wait();
        let replies = replies.map_err(|error| plain(&error))?;
        let tokens = replies.into_iter().filter_map(|reply| reply.into_result().ok());
        Ok(tokens.filter_map(|token| names::published(token.key_expr().as_str(), &type_name)).collect())
    }

    /// Returns the full name of a topic.
    pub fn full(&self, name: &str) -> String {
        self.node.full(name)
    }

    fn open(&mut self, end: End, name: &str, kind: &str, delivery: Delivery) -> Result<Opened, String> {
        let type_hash =
            type_hash::of_schema(kind, &topics::schema(kind)).map_err(|error| error.to_string())?;
        let type_name = dds_type_name(kind);
        let typed = Typed { topic: name, type_name: &type_name, type_hash: &type_hash };
        self.endpoint += 1;
        let token = self.node.token_of(self.endpoint, end, &typed, delivery);
        let identity = names::identity(&token);
        let token = self.session.liveliness().declare_token(token).wait();
        let token = token.map_err(|error| error.to_string())?;
        Ok(Opened { key: self.node.key(&typed), token, identity })
    }
}

/// Returns the configuration of the session. A client needs a router right away, while a router waits for
/// others. As in rmw_zenoh, multicast is not used to find them.
fn config(routers: &[String], listen: &[String]) -> zenoh::Result<Config> {
    let mut config = Config::default();
    let mode = if listen.is_empty() { "client" } else { "router" };
    config.insert_json5("mode", &format!("{mode:?}"))?;
    config.insert_json5("connect/endpoints", &format!("{routers:?}"))?;
    config.insert_json5("listen/endpoints", &format!("{listen:?}"))?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    config.insert_json5("timestamping/enabled", "true")?;
    config.insert_json5("transport/link/rx/max_message_size", &MAX_MESSAGE_BYTES.to_string())?;
    Ok(config)
}

/// Returns the text of a Zenoh error, without its source line.
fn plain(error: &zenoh::Error) -> String {
    let text = error.to_string();
    text.split(" at /").next().unwrap_or(&text).trim_end().to_owned()
}

struct Outgoing {
    session: Session,
    publisher: zenoh::pubsub::Publisher<'static>,
    identity: [u8; 16],
    /// The sequence number of the last message.
    number: i64,
    newest: Option<Newest>,
    _token: LivelinessToken,
}

impl Sender for Outgoing {
    /// Always reports that the message was accepted, because Zenoh does not report the messages that it drops on a congested link.
    fn send(&mut self, cdr: Vec<u8>) -> Result<bool, String> {
        self.number += 1;
        let stamp = self.session.new_timestamp();
        let sent_ns = stamp.get_time().to_duration().as_nanos();
        let sent_ns = i64::try_from(sent_ns).unwrap_or(i64::MAX);
        let attachment = names::attachment(self.number, sent_ns, self.identity);
        let message = Message { cdr: cdr.into(), attachment, stamp };
        if let Some(newest) = &self.newest {
            newest.set(message.clone());
        }
        let put = self.publisher.put(message.cdr).attachment(&attachment[..]).timestamp(stamp);
        put.wait().map_err(|error| error.to_string())?;
        Ok(true)
    }
}

/// A message as it was sent, with its attachment and timestamp.
#[derive(Clone)]
struct Message {
    cdr: zenoh::bytes::ZBytes,
    attachment: [u8; 33],
    stamp: Timestamp,
}

/// The latest message of a latched topic, which late subscribers query.
struct Newest {
    message: Arc<Mutex<Option<Message>>>,
    _answers: Queryable<()>,
    /// Notifies subscribers that joined earlier that there is something to query.
    _token: LivelinessToken,
}

impl Newest {
    fn open(session: &Session, id: &str, key: &str) -> zenoh::Result<Self> {
        let message = Arc::new(Mutex::new(None::<Message>));
        let (asked, key) = (names::latched(key, id), key.to_owned());
        let answers = session.declare_queryable(asked.clone()).callback({
            let message = message.clone();
            move |query| {
                let newest = message.lock().unwrap_or_else(PoisonError::into_inner).clone();
                let Some(newest) = newest else { return };
                let reply = query.reply(&key, newest.cdr).attachment(&newest.attachment[..]);
                if let Err(error) = reply.timestamp(newest.stamp).wait() {
                    sketchnav_schemas::say!("/{key}: a late subscriber: {error}");
                }
            }
        });
        let answers = answers.wait()?;
        let token = session.liveliness().declare_token(asked).wait()?;
        Ok(Self { message, _answers: answers, _token: token })
    }

    fn set(&self, message: Message) {
        *self.message.lock().unwrap_or_else(PoisonError::into_inner) = Some(message);
    }
}

struct Incoming {
    subscriber: Subscriber<RingChannelHandler<Sample>>,
    _token: LivelinessToken,
}

impl<F: DeserializeOwned> Receiver<F> for Incoming {
    fn take(&mut self) -> Result<Option<(F, PublisherId)>, String> {
        let Some(sample) = self.subscriber.try_recv().map_err(|error| error.to_string())? else {
            return Ok(None);
        };
        let form = decode(&sample.payload().to_bytes()).map_err(|error| error.to_string())?;
        let attachment = sample.attachment().map(|attachment| attachment.to_bytes());
        Ok(Some((form, attachment.map_or([0; 16], |attachment| names::publisher_of(&attachment)))))
    }
}
