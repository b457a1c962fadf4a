//! A stand-in for the pad's page that needs no browser but uses the same HTTP and WebSocket messages, over real
//! sockets.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Range;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use super::Running;

/// Maximum time that anything may take before it counts as hanging.
const LIMIT: Duration = Duration::from_secs(120);

/// The token of every pad in a test. It is passed to the pad in the environment of its [`Place`](super::Place).
pub const TOKEN: &str = "tokenoftests0123456789";

/// Ports of tests. They lie below those that Linux uses for outgoing connections (32768 and up), so no connection takes a port
/// after it was found to be free and before a server binds it.
const PORTS: Range<u16> = 20_000..32_000;

/// Returns a port that is not in use, and that no other test of this process gets.
pub fn free_port() -> u16 {
    static GIVEN: AtomicU16 = AtomicU16::new(0);
    // Processes that test at the same time begin at different ports.
    let first = std::process::id().wrapping_mul(7_919);
    loop {
        let given = u32::from(GIVEN.fetch_add(1, Ordering::Relaxed));
        let port = PORTS.start + (first.wrapping_add(given) % PORTS.len() as u32) as u16;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
}

/// Waits until a process listens on the port.
pub fn wait_for(running: &mut Running, port: u16) {
    let began = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        running.must_live();
        assert!(began.elapsed() < LIMIT, "nobody listens on port {port}");
        std::thread::sleep(crate::LOOK_AGAIN);
    }
}

/// The status and the body of an answer. The body is null if it is not JSON.
pub type Answer = (u16, Value);

/// Sends a request exactly as given, and returns the answer.
pub fn request(port: u16, head: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
    try_request(port, head, headers, body).unwrap_or_else(|| panic!("no answer to {head}"))
}

/// Like [`request`], but for a server that may die before it answers.
pub fn try_request(port: u16, head: &str, headers: &[(&str, &str)], body: &[u8]) -> Option<Answer> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let mut text = format!("{head} HTTP/1.1\r\nconnection: close\r\ncontent-length: {}\r\n", body.len());
    if !headers.iter().any(|(name, _)| *name == "host") {
        text += &format!("host: 127.0.0.1:{port}\r\n");
    }
    if !head.contains("token=") && !headers.iter().any(|(name, _)| *name == "x-sketchnav-token") {
        text += &format!("x-sketchnav-token: {TOKEN}\r\n");
    }
    headers.iter().for_each(|(name, value)| text += &format!("{name}: {value}\r\n"));
    stream.write_all((text + "\r\n").as_bytes()).ok()?;
    // A server that rejects the head closes the connection before it has read everything.
    let _ = stream.write_all(body);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    parsed(&String::from_utf8_lossy(&answer))
}

/// Returns the body of the answer to a GET request for a path.
pub fn body(port: u16, path: &str) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let head = format!("host: 127.0.0.1:{port}\r\nx-sketchnav-token: {TOKEN}\r\nconnection: close");
    write!(stream, "GET {path} HTTP/1.1\r\n{head}\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 200 "), "{answer}");
    body.to_owned()
}

/// Parses an answer, or returns `None` if it is invalid.
pub fn parsed(answer: &str) -> Option<Answer> {
    let status = answer.split(' ').nth(1)?.parse().ok()?;
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    Some((status, serde_json::from_str(body).unwrap_or_default()))
}

/// An open page.
pub struct Page {
    port: u16,
    socket: WebSocket<TcpStream>,
    /// The most recent greeting, which the page receives when it connects.
    pub hello: Value,
    /// The latest feed.
    pub feed: Value,
    /// The latest versions of the items of the shared drawing, by their ids.
    pub drawn: BTreeMap<String, Value>,
    /// The pages that are open.
    pub people: Value,
}

impl Page {
    /// Connects to the pad. With `session`, connects as the page that had that session.
    pub fn open(port: u16, session: Option<&str>) -> Self {
        Self::try_open(port, session).expect("a page that is let in")
    }

    /// Like [`Page::open`], but for a server that may die in the meantime.
    pub fn try_open(port: u16, session: Option<&str>) -> Result<Self, Box<dyn Error>> {
        let stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(LIMIT))?;
        let session = session.map_or_else(String::new, |session| format!("&session={session}"));
        let url = format!("ws://127.0.0.1:{port}/ws?token={TOKEN}{session}");
        let (socket, _) = tungstenite::client(url, stream)?;
        let (hello, feed, people) = (Value::Null, Value::Null, Value::Null);
        let mut page = Self { port, socket, hello, feed, drawn: BTreeMap::new(), people };
        while page.hello.is_null() {
            page.try_read()?;
        }
        Ok(page)
    }

    /// Returns the page's session.
    pub fn session(&self) -> String {
        self.hello["session"].as_str().unwrap().to_owned()
    }

    /// Reads the next message from the pad.
    pub fn read(&mut self) {
        self.try_read().expect("a word of the pad within the limit");
    }

    fn try_read(&mut self) -> tungstenite::Result<()> {
        let Message::Text(text) = read_whole(&mut self.socket)? else { return Ok(()) };
        let said: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
        if let Some(hello) = said.get("hello") {
            self.hello = hello.clone();
        }
        for entry in said["drawn"]["entries"].as_array().into_iter().flatten() {
            self.drawn.insert(entry["id"].as_str().unwrap_or_default().to_owned(), entry.clone());
        }
        if let Some(people) = said.get("people") {
            self.people = people.clone();
        }
        if let Some(feed) = said.get("feed") {
            self.feed = feed.clone();
            let seen = json!({ "seen": feed["n"] }).to_string();
            self.socket.send(Message::Text(seen.into()))?;
        }
        Ok(())
    }

    /// Sends a message.
    pub fn say(&mut self, word: &Value) {
        self.socket.send(Message::Text(word.to_string().into())).unwrap();
    }

    /// Reads feeds until one satisfies `is_so`.
    pub fn until(&mut self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            self.read();
            if is_so(&self.feed) {
                return self.feed.clone();
            }
            assert!(began.elapsed() < LIMIT, "waited {LIMIT:?} for {what}; the last feed: {}", self.feed);
        }
    }

    /// Reads messages up to the next feed and acknowledges it, as a page that is alive does all the time. Other messages
    /// are not acknowledged.
    pub fn respond(&mut self) {
        let last = self.feed["n"].clone();
        self.until_it("the next feed", |page| page.feed["n"] != last);
    }

    /// Reads messages until this page satisfies `is_so`.
    pub fn until_it(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let began = Instant::now();
        while !is_so(self) {
            self.read();
            assert!(began.elapsed() < LIMIT, "waited {LIMIT:?} for {what}");
        }
    }

    /// Reads feeds until the pad is in this state.
    pub fn until_state(&mut self, state: &str) -> Value {
        self.until(state, |feed| feed["state"] == state)
    }

    /// Reads feeds until this step is allowed.
    pub fn until_allowed(&mut self, step: &str) {
        self.until(step, |feed| feed["allowed"].as_array().is_some_and(|all| all.iter().any(|s| s == step)));
    }

    /// Sends a request as the page does.
    pub fn post(&self, path: &str, body: &[u8]) -> Answer {
        self.post_as(path, "application/json", body)
    }

    /// Like [`Page::post`], but with the given content type.
    pub fn post_as(&self, path: &str, content_type: &str, body: &[u8]) -> Answer {
        let session = self.session();
        let headers = [("x-sketchnav-session", session.as_str()), ("content-type", content_type)];
        request(self.port, &format!("POST {path}"), &headers, body)
    }

    /// Sends a drawing under a name to a server that may die before it answers.
    pub fn send(&self, path: &str, body: &[u8], name: &str) -> Option<Answer> {
        let session = self.session();
        let headers = [
            ("x-sketchnav-session", session.as_str()),
            ("x-sketchnav-sending", name),
            ("content-type", "application/json"),
        ];
        try_request(self.port, &format!("POST {path}"), &headers, body)
    }

    /// Sends a request that must succeed.
    pub fn must(&self, path: &str, body: &Value) -> Value {
        let (status, answer) = self.post(path, body.to_string().as_bytes());
        assert_eq!(status, 200, "{path}: {answer}");
        answer
    }

    /// Sends an order.
    pub fn order(&self, order: &str) -> Answer {
        self.post("/api/order", json!({ "order": order }).to_string().as_bytes())
    }

    /// Disappears without closing the connection.
    pub fn vanish(self) {
        drop(self.socket);
    }
}

/// Reads a message. A read with a time limit is not resumed automatically after a signal, so it is retried here.
pub(crate) fn read_whole<S: Read + Write>(socket: &mut WebSocket<S>) -> tungstenite::Result<Message> {
    loop {
        match socket.read() {
            Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}
