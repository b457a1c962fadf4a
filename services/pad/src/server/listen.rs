//! The listener, which accepts connections, gives each a time limit for its request, and limits how long it
//! stays open.
//!
//! Each connection carries one request and is closed after the response. Both the head and the rest of the request must arrive
//! within time limits. A WebSocket has its own limits from then on. A connection that is closed before its head has arrived
//! receives the reason (408, 431, 503).

use std::io::{Cursor, ErrorKind};
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWriteExt, join};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::time::{sleep, timeout};

use crate::doors::Doors;

/// Maximum time for the head of a request to arrive.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Maximum length of a head, in bytes.
const MAX_HEAD: usize = 16 * 1024;
/// Maximum time of a request from its head to the end of its response, including the body and the sketcher.
const DONE_WITHIN: Duration = Duration::from_secs(180);
/// Maximum time for sending the final response.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// Delay before the next attempt if the system is out of connections.
const PAUSE: Duration = Duration::from_millis(200);

/// The connections whose session is not known yet.
type Lobby = Arc<Mutex<Doors<oneshot::Sender<()>>>>;

/// A connection's place among them, until its session is known.
pub(super) struct Place {
    lobby: Lobby,
    id: u64,
}

impl Place {
    /// Registers a connection. The bell rings when it must be closed in favour of another.
    fn enter(lobby: &Lobby, from: IpAddr) -> (Arc<Self>, oneshot::Receiver<()>) {
        let (sender, bell) = oneshot::channel();
        let (id, goes) = lobby.lock().unwrap_or_else(PoisonError::into_inner).enter(from, sender);
        if let Some(goes) = goes {
            // A connection that has just ended by itself does not receive it.
            let _ = goes.send(());
        }
        (Arc::new(Self { lobby: lobby.clone(), id }), bell)
    }

    /// Removes the connection, because its session is known. The bell no longer rings.
    pub(super) fn leave(&self) {
        self.lobby.lock().unwrap_or_else(PoisonError::into_inner).leave(self.id);
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.leave();
    }
}

/// Accepts and serves connections.
pub(super) async fn listen(listener: TcpListener, router: Router) -> std::io::Error {
    let lobby = Lobby::default();
    loop {
        match listener.accept().await {
            Ok((stream, from)) => drop(tokio::spawn(attend(stream, from, lobby.clone(), router.clone()))),
            // A connection that ended before it was accepted does not affect the next ones.
            Err(error) if is_about_one_connection(error.kind()) => {}
            // The system may be out of connections until some end.
            Err(error) if error.raw_os_error().is_some() => sleep(PAUSE).await,
            Err(error) => return error,
        }
    }
}

fn is_about_one_connection(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::ConnectionRefused | ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset)
}

async fn attend(stream: TcpStream, from: SocketAddr, lobby: Lobby, router: Router) {
    let (place, mut bell) = Place::enter(&lobby, from.ip());
    // Small answers are sent without delay.
    let _ = stream.set_nodelay(true);
    let (mut reader, mut writer) = stream.into_split();
    let told = tokio::select! {
        told = timeout(HEAD_WITHIN, head(&mut reader)) => told.unwrap_or(Err(Dismissal::Late)),
        _ = rings(&mut bell) => Err(Dismissal::Crowd),
    };
    let head = match told {
        Ok(head) => head,
        Err(dismissal) => {
            // A client that does not read the answer either is cut off.
            let _ = timeout(LAST_WORDS, writer.write_all(dismissal.text().as_bytes())).await;
            return;
        }
    };
    let io = TokioIo::new(join(Cursor::new(head).chain(reader), writer));
    let service = TowerToHyperService::new(router.layer(Extension(place)));
    let serving = http1::Builder::new().serve_connection(io, service).with_upgrades();
    tokio::select! {
        // In any case, the connection has ended.
        _ = serving => {}
        _ = sleep(DONE_WITHIN) => {}
        _ = rings(&mut bell) => {}
    }
}

/// Waits until the bell rings, or forever if it was removed.
async fn rings(bell: &mut oneshot::Receiver<()>) {
    if bell.await.is_err() {
        std::future::pending().await
    }
}

/// The reason why a connection is closed before its request is complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dismissal {
    /// The request takes too long.
    Late,
    /// The head is too long.
    Long,
    /// Its place is needed for other connections.
    Crowd,
    /// It has ended by itself.
    Gone,
}

impl Dismissal {
    /// The complete HTTP response.
    fn text(self) -> String {
        let (status, words) = match self {
            Self::Late => {
                ("408 Request Timeout", format!("expected the head of a request within {HEAD_WITHIN:?}"))
            }
            Self::Long => (
                "431 Request Header Fields Too Large",
                format!("expected at most {MAX_HEAD} bytes as the head of a request, found more"),
            ),
            Self::Crowd => (
                "503 Service Unavailable",
                "too many idle connections; try again and send a request at once".to_owned(),
            ),
            Self::Gone => return String::new(),
        };
        let body = json!({ "error": words }).to_string();
        format!(
            "HTTP/1.1 {status}\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\
             cache-control: no-store\r\nconnection: close\r\n\r\n{body}",
            body.len()
        )
    }
}

/// Returns the bytes received up to the end of the head, and any bytes after it.
async fn head(reader: &mut (impl AsyncRead + Unpin)) -> Result<Vec<u8>, Dismissal> {
    let mut come = Vec::with_capacity(1024);
    loop {
        let before = come.len();
        match reader.read_buf(&mut come).await {
            Ok(0) | Err(_) => return Err(Dismissal::Gone),
            Ok(_) => {}
        }
        let end = head_end(&come, before);
        if end.unwrap_or(come.len()) > MAX_HEAD {
            return Err(Dismissal::Long);
        }
        if end.is_some() {
            return Ok(come);
        }
    }
}

/// The end of the head, if it has arrived; the part before `searched` does not contain it.
fn head_end(come: &[u8], searched: usize) -> Option<usize> {
    let from = searched.saturating_sub(3);
    come[from..].windows(4).position(|four| four == b"\r\n\r\n").map(|at| from + at + 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_dismissed_is_told_why() {
        for (dismissal, status) in
            [(Dismissal::Late, "408"), (Dismissal::Long, "431"), (Dismissal::Crowd, "503")]
        {
            let text = dismissal.text();
            let (head, body) = text.split_once("\r\n\r\n").unwrap();
            assert_eq!(head.split(' ').nth(1), Some(status));
            assert!(head.contains(&format!("content-length: {}", body.len())));
            let said: serde_json::Value = serde_json::from_str(body).unwrap();
            assert!(said["error"].as_str().is_some_and(|words| words.len() > 10), "{body}");
        }
    }

    #[test]
    fn a_head_ends_with_an_empty_line() {
        assert_eq!(head_end(b"GET / HTTP/1.1\r\nhost: x\r\n\r\n{}", 0), Some(27));
        assert_eq!(head_end(b"GET / HTTP/1.1\r\nhost: x\r\n\r\n{}", 26), Some(27));
        assert!(head_end(b"GET / HTTP/1.1\r\nhost: x\r\n\r", 0).is_none() && head_end(b"", 0).is_none());
    }

    /// The length was once only checked before the end had arrived, so a head of 20 kB whose end came with the last read was
    /// accepted.
    #[test]
    fn a_head_is_too_long_also_when_all_of_it_has_come() {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let read = |length: usize, body: usize| {
            let mut text = b"GET / HTTP/1.1\r\nx: ".to_vec();
            text.resize(length - 4, b'a');
            text.extend(b"\r\n\r\n");
            text.resize(length + body, b'b');
            runtime.block_on(head(&mut text.as_slice())).map(|come| come.len() >= length)
        };
        for (length, body, expected) in [
            (MAX_HEAD, 0, Ok(true)),
            (MAX_HEAD, 100_000, Ok(true)),
            (MAX_HEAD + 1, 0, Err(Dismissal::Long)),
            (20_000, 0, Err(Dismissal::Long)),
            (20_000, 100_000, Err(Dismissal::Long)),
            (1_000_000, 0, Err(Dismissal::Long)),
        ] {
            assert_eq!(read(length, body), expected, "{length} {body}");
        }
    }
}
