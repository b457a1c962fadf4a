//! The pad is the page on which people draw a map and a path, send them, watch the robot and stop it
//! (Boniardi et al. 2016, section IV). A single process serves the page and connects it to the channels.
//!
//! ```text
//! page ⇄ HTTP, WebSocket ⇄ server (thread, tokio) ─calls→ bridge (thread, owns the node) ⇄ channels
//!                                                ←board─
//! ```
//! - [`protocol`]: the messages between page and server, and their limits.
//! - [`machine`]: which step is allowed. [`sessions`]: which page has the wheel, and whether it responds. [`guard`]: which requests
//!   are accepted, and how often. `doors`: which connections stay open. [`feed`]: what pages display. These are pure.
//! - [`together`]: the drawing in which several pages draw at once. It is pure, too.
//! - `learning`: what the robot has learned on drives from the page, by the run's recording.
//! - [`study`]: a user study on the page, including what its participants draw, measure and answer.
//! - `server`, `bridge`: the threads around them. The server never accesses channels, and the bridge never
//!   accesses sockets.
//!
//! The page does not compute anything about the robot, and the pad does not read the truth.

// `say!` prints, and escapes text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod board;
mod bridge;
mod doors;
mod draft;
pub mod feed;
pub mod guard;
mod learning;
pub mod machine;
mod metrics;
pub mod mission_file;
mod page;
pub mod protocol;
mod server;
pub mod sessions;
pub mod study;
pub mod together;
pub mod token;
mod walls;

use std::net::{IpAddr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use sketchnav_runtime::Node;
use sketchnav_stage::Navigator;
use tokio::sync::Notify;

use board::Caller;
use guard::{Guard, Token};
use study::{Folder, Sitting};
use token::TOKEN_VARIABLE;

/// The addresses at which the pad listens, and the requests that it accepts.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address to listen on.
    pub bind: IpAddr,
    /// Port to listen on.
    pub port: u16,
    /// Host names of the pad, without a port, in addition to its numeric address.
    pub hosts: Vec<String>,
    /// The token that every request must contain.
    pub token: Token,
    /// The folder for mission files.
    pub folder: PathBuf,
    /// The folder of a study, if the page is for its participants.
    pub study: Option<PathBuf>,
}

/// The reason why the pad cannot start.
#[derive(Debug, thiserror::Error)]
pub enum PadError {
    /// The token is unusable, so any user of this machine could drive.
    #[error("{TOKEN_VARIABLE} in the environment: {0}, found {1}")]
    Token(String, &'static str),
    /// The server cannot listen on the address.
    #[error("{address}: cannot listen there: {source}; choose another address: --port, --bind")]
    Address {
        /// The address.
        address: SocketAddr,
        /// The reason.
        source: std::io::Error,
    },
}

/// Runs the pad for a mission of `navigator` in `node`'s system until it is asked to end.
///
/// # Errors
/// [`PadError`], [`study::StudyError`], or the error of a channel that fails.
pub fn run(node: &Node, navigator: &Navigator, settings: Settings) -> anyhow::Result<()> {
    let Settings { bind, port, hosts, token, folder, study } = settings;
    let run = node.run_config()?;
    let study = study.map(|path| Folder::open(&path)).transpose()?.map(Sitting::new);
    token::keep(node.system(), &token)?;
    let address = SocketAddr::new(bind, port);
    let listener = TcpListener::bind(address).map_err(|source| PadError::Address { address, source })?;
    let waker = node.waker();
    let draws = run.pad.draws() && study.is_none();
    let (caller, calls) = Caller::new(draws, move || waker.wake());
    let end = Arc::new(Notify::new());
    let serving = {
        let (caller, end) = (caller.clone(), end.clone());
        let guard = Guard::new(listener.local_addr()?, hosts, token);
        let serve = move || server::serve(listener, guard, caller, end);
        std::thread::Builder::new().name("server".into()).spawn(serve).context("starting the server")?
    };
    let bridged = bridge::run(node, navigator, &run, (folder, study), caller, &calls);
    end.notify_one();
    match serving.join() {
        Ok(served) => bridged.and(served.context("serving the page")),
        Err(_) => bridged.and(Err(anyhow::anyhow!("the server's thread has panicked"))),
    }
}
