//! Shows a running system or a recording in Foxglove, Lichtblick, or any other viewer that
//! supports Foxglove's WebSocket protocol.
//!
//! ```text
//! channels ─reader─┐
//!                  ├─ topics (CDR, schema) ─ server (foxglove, threads of tokio) ⇄ viewers
//! recording ───────┘
//! ```
//! - [`live`] follows a system as an observer. A channel is open only while a viewer watches it.
//! - [`mod@file`] plays a recording. Its clock is [`playback`], which is pure, and which viewers can pause,
//!   seek and speed up.
//! - `topics` contains the topics that are shown: every channel in its recorded form and name, transforms, and the standard
//!   messages derived from ours (`sketchnav_navigators::derived`).
//! - `server` accepts the viewers' connections and handles their requests.
//!
//! The view does not write to any channel, and viewers can only choose what they see. The socket is bound to
//! loopback, because the protocol has no token. A viewer that is too slow loses the oldest messages.

// `say!` prints, and escapes characters that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod file;
pub mod live;
pub mod playback;
mod server;
mod topics;

pub use server::Port;

use std::net::SocketAddr;

use sketchnav_recordings::RecordingError;
use sketchnav_schemas::ros2::Ros2Error;

/// The reason why nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The address cannot be listened on.
    #[error("{address}: cannot listen there: {source}; choose another port with --port")]
    Address {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        source: std::io::Error,
    },
    /// The recording contains no messages.
    #[error("{path}: expected messages, found none")]
    Empty {
        /// The recording.
        path: String,
    },
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A static transform has no ROS 2 form.
    #[error("/tf_static: {0}")]
    Transform(#[from] Ros2Error),
    /// The system failed.
    #[error(transparent)]
    Runtime(#[from] sketchnav_runtime::Error),
    /// The server could not start.
    #[error("the server: {0}")]
    Server(String),
}

/// The result type of this crate.
pub type Result<T, E = ViewError> = std::result::Result<T, E>;
