//! The pad: the page on which people draw a map and a path, send them, watch the robot and stop it (Boniardi et al.
//! 2016, IV). One process serves the page and connects it with the channels.
//!
//! ```text
//! page ⇄ HTTP, WebSocket ⇄ server (thread, tokio) ─calls→ bridge (thread, owns the node) ⇄ channels
//!                                                ←board─
//! ```
//! - [`protocol`]: what page and server say, and what of it is bounded;
//! - [`machine`]: which step is allowed. [`sessions`]: who has the wheel, and whether they can be heard. [`guard`]:
//!   who may ask, and how often. `doors`: which connections stay. [`feed`]: what there is to see. These are pure;
//! - `server`, `bridge`: the threads around them. The server never touches a channel, the bridge never a socket.
//!
//! The page computes nothing of the robot's, and nothing here reads the truth.

mod board;
mod bridge;
mod doors;
pub mod feed;
pub mod guard;
pub mod machine;
mod metrics;
pub mod mission_file;
mod page;
pub mod protocol;
mod server;
pub mod sessions;
mod walls;

use std::net::{IpAddr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use sketchnav_runtime::Node;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::sketch_mission::KIND;
use tokio::sync::Notify;

use board::Caller;
use guard::Guard;

/// The environment's variable that holds the token: a command line is everybody's to read.
pub const TOKEN_VARIABLE: &str = "SKETCHNAV_PAD_TOKEN";

/// Where the pad serves, and for whom.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address to listen on.
    pub bind: IpAddr,
    /// Port to listen on.
    pub port: u16,
    /// Host names, without a port, by which people call the pad beside its address in numbers.
    pub hosts: Vec<String>,
    /// What a request has to know; required on an address that is not loopback.
    pub token: Option<String>,
    /// Where mission files are written.
    pub folder: PathBuf,
}

/// What the pad cannot begin with.
#[derive(Debug, thiserror::Error)]
pub enum PadError {
    /// The mission's navigator has no drawing.
    #[error(
        "navigator.kind: expected a mission of kind {KIND:?}, since people draw on the page; found kind \
         {0:?}. To watch it: sketchnav run MISSION --pad"
    )]
    Kind(String),
    /// The page could be reached from outside.
    #[error("{0}: expected a token for an address that is not loopback, found none")]
    NoToken(IpAddr),
    /// The server cannot listen on the address.
    #[error("{address}: cannot listen there: {source}; choose another address: --port, --bind")]
    Address {
        /// Which.
        address: SocketAddr,
        /// Why not.
        source: std::io::Error,
    },
}

/// Checks that the mission goes by what people draw.
///
/// # Errors
/// [`PadError::Kind`].
pub fn check_kind(mission: &Mission) -> Result<(), PadError> {
    let kind = mission.navigator_kind();
    if kind == KIND { Ok(()) } else { Err(PadError::Kind(kind.to_owned())) }
}

/// Runs the pad in `node`'s system until it is asked to end.
///
/// # Errors
/// [`PadError`]; a channel that fails.
pub fn run(node: &Node, settings: Settings) -> anyhow::Result<()> {
    let Settings { bind, port, hosts, token, folder } = settings;
    let run = node.run_config()?;
    if run.pad.draws() {
        check_kind(&run.mission)?;
    }
    if !bind.is_loopback() && token.is_none() {
        return Err(PadError::NoToken(bind).into());
    }
    let address = SocketAddr::new(bind, port);
    let listener = TcpListener::bind(address).map_err(|source| PadError::Address { address, source })?;
    let (caller, calls) = Caller::new(node.waker());
    let end = Arc::new(Notify::new());
    let serving = {
        let (caller, end) = (caller.clone(), end.clone());
        let guard = Guard::new(listener.local_addr()?, hosts, token);
        let serve = move || server::serve(listener, guard, caller, end);
        std::thread::Builder::new().name("server".into()).spawn(serve).context("starting the server")?
    };
    let bridged = bridge::run(node, &run, folder, caller, &calls);
    end.notify_one();
    match serving.join() {
        Ok(served) => bridged.and(served.context("serving the page")),
        Err(_) => bridged.and(Err(anyhow::anyhow!("the server's thread has panicked"))),
    }
}
