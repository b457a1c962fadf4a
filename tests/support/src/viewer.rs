//! A viewer for tests, which implements Foxglove's WebSocket protocol (`foxglove.sdk.v1`) at the level of bytes.
//! Sources: the protocol's specification, github.com/foxglove/ws-protocol, docs/spec.md, and for playback the SDK's own
//! client.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::page::read_whole;
use super::{Place, Running};

/// Maximum time to wait for the next message from a server.
const LIMIT: Duration = Duration::from_secs(60);

/// A viewer that watches every topic.
pub struct Viewer {
    socket: WebSocket<TcpStream>,
    /// The server's description of itself.
    pub info: Value,
    /// The channels that the server announced, by topic.
    pub topics: BTreeMap<String, Value>,
    by_subscription: BTreeMap<u32, String>,
}

/// A message received from a server.
#[derive(Debug)]
pub enum Came {
    /// A recorded or live message: its topic, its time in nanoseconds, and its content.
    Message(String, u64, Vec<u8>),
    /// The state of playback.
    Playback {
        /// 0 while playing, 1 if paused, 3 at the end.
        status: u8,
        /// The position, in nanoseconds.
        at_ns: u64,
        /// Whether playback jumped to another position.
        did_seek: bool,
        /// The name of the request that this message answers.
        request: String,
    },
    /// The current time, in nanoseconds.
    Time(u64),
}

/// Starts a view and returns the link that it prints.
pub fn view(place: &Place, arguments: &str) -> (Running, String) {
    let mut child = place.command(&format!("view {arguments} --port 0")).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
    let link = lines.find_map(|line| Some(line[line.find("ws://")?..].trim().to_owned()));
    let running = Running::of(child);
    let Some(link) = link else { panic!("no link: {}", running.end()) };
    (running, link)
}

impl Viewer {
    /// Connects, waits until this many topics are announced, and subscribes to all of them.
    pub fn of_all(link: &str, topics: usize) -> Self {
        let mut viewer = Self::connect(link);
        while viewer.topics.len() < topics {
            let Message::Text(text) = viewer.read() else { continue };
            viewer.take(serde_json::from_str(&text).unwrap());
        }
        let ids: Vec<_> =
            viewer.topics.iter().map(|(topic, said)| (topic.clone(), said["id"].clone())).collect();
        viewer.by_subscription = (1..).zip(ids.iter().map(|(topic, _)| topic.clone())).collect();
        let wishes = (1..)
            .zip(&ids)
            .map(|(id, (_, channel)): (u32, _)| serde_json::json!({ "id": id, "channelId": channel }));
        let wishes: Vec<_> = wishes.collect();
        viewer.say(serde_json::json!({ "op": "subscribe", "subscriptions": wishes }).to_string().into());
        viewer
    }

    fn connect(link: &str) -> Self {
        let address = link.strip_prefix("ws://").unwrap();
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        let mut request = link.into_client_request().unwrap();
        request.headers_mut().insert("Sec-WebSocket-Protocol", "foxglove.sdk.v1".parse().unwrap());
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        Self { socket, info: Value::Null, topics: BTreeMap::new(), by_subscription: BTreeMap::new() }
    }

    fn read(&mut self) -> Message {
        read_whole(&mut self.socket).unwrap()
    }

    fn say(&mut self, message: Message) {
        self.socket.send(message).unwrap();
    }

    fn take(&mut self, said: Value) {
        match said["op"].as_str() {
            Some("serverInfo") => self.info = said,
            Some("advertise") => {
                for channel in said["channels"].as_array().unwrap() {
                    self.topics.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
                }
            }
            _ => {}
        }
    }

    /// Reads the next message, or returns `None` if the server is gone.
    pub fn try_next(&mut self) -> Option<()> {
        read_whole(&mut self.socket).ok().map(drop)
    }

    /// Waits for the next message.
    pub fn wait(&mut self) -> Came {
        loop {
            match self.read() {
                Message::Text(text) => self.take(serde_json::from_str(&text).unwrap()),
                Message::Binary(bytes) => return self.parse(&bytes),
                _ => {}
            }
        }
    }

    fn parse(&self, bytes: &[u8]) -> Came {
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        match bytes[0] {
            1 => {
                let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
                Came::Message(self.by_subscription[&subscription].clone(), number(5), bytes[13..].to_vec())
            }
            2 => Came::Time(number(1)),
            5 => Came::Playback {
                status: bytes[1],
                at_ns: number(2),
                did_seek: bytes[14] != 0,
                request: String::from_utf8(bytes[19..].to_vec()).unwrap(),
            },
            other => panic!("opcode {other}"),
        }
    }

    /// Asks the server to play or pause at a rate, from a given time or from the current position.
    pub fn ask(&mut self, plays: bool, rate: f32, seek_ns: Option<u64>, name: &str) {
        let mut bytes = vec![3, u8::from(!plays)];
        bytes.extend(rate.to_le_bytes());
        bytes.push(seek_ns.is_some().into());
        bytes.extend(seek_ns.unwrap_or(0).to_le_bytes());
        bytes.extend((name.len() as u32).to_le_bytes());
        bytes.extend(name.as_bytes());
        self.say(Message::Binary(bytes.into()));
    }
}
