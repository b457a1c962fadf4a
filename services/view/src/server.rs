//! The WebSocket server, which accepts viewers, receives their requests, and learns when the process is asked to end.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use foxglove::websocket::{
    Capability, ChannelView, Client, PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus,
    ServerListener,
};
use foxglove::{ChannelId, Context, SinkId, WebSocketServer, WebSocketServerHandle};
use tokio::runtime::{Builder, Runtime};

use crate::playback::{Playback, Request, State};
use crate::{Result, ViewError};

/// Maximum number of messages that wait for a viewer. If there are more, the viewer loses the oldest.
const BACKLOG: usize = 512;
/// Minimum interval between sending the time to viewers.
const TIME_EVERY: Duration = Duration::from_millis(50);
/// Maximum wait until viewers have been notified of the end.
const GOODBYE: Duration = Duration::from_millis(500);
/// Number of threads. One is enough for all viewers, since there is nothing to compute for them.
const THREADS: usize = 1;

/// A port that only this machine can reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Port(u16);

impl Port {
    /// Returns the port with the given number, or a free port if it is 0.
    ///
    /// # Errors
    /// [`ViewError::Address`] if the port is taken.
    pub fn free(number: u16) -> Result<Self> {
        let address = address(number);
        let bound = TcpListener::bind(address).and_then(|listener| listener.local_addr());
        Ok(Self(bound.map_err(|source| ViewError::Address { address, source })?.port()))
    }

    /// Returns the number of the port.
    pub fn number(self) -> u16 {
        self.0
    }

    /// Returns the address that viewers open.
    pub fn url(self) -> String {
        format!("ws://{}", address(self.0))
    }
}

fn address(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

/// An event for the thread that shows messages.
#[derive(Debug)]
pub enum Event {
    /// A viewer watches a topic from now on.
    Subscribed(ChannelId, SinkId),
    /// Playback continues at another time, in nanoseconds.
    Sought(u64),
    /// Something else has changed: which topics are watched, or the state of playback.
    Changed,
    /// A signal asks the process to end.
    End,
}

/// The clock of a recording, shared with the viewers that set it.
pub type SharedPlayback = Arc<std::sync::Mutex<Playback>>;

/// Locks the clock. Poisoning can be ignored, because no thread panics while holding the lock.
pub fn locked(playback: &SharedPlayback) -> std::sync::MutexGuard<'_, Playback> {
    playback.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A running server. Dropping it ends it.
pub struct Server {
    handle: Option<WebSocketServerHandle>,
    runtime: Runtime,
    context: Arc<Context>,
    events: Receiver<Event>,
    sender: Sender<Event>,
    /// The last time that was sent to viewers, in nanoseconds, and when it was sent.
    sent_time: (u64, Option<Instant>),
}

/// Description of the served system or recording, which is sent to viewers.
pub struct Served {
    /// Display name.
    pub name: String,
    /// For a recording: the times of its first and last message in nanoseconds, and its clock.
    pub playback: Option<((u64, u64), SharedPlayback)>,
}

impl Server {
    /// Starts listening. Topics are then added to [`Server::context`].
    ///
    /// # Errors
    /// [`ViewError::Address`] if the port cannot be listened on, [`ViewError::Server`] if the server cannot start.
    pub fn start(port: Port, served: Served) -> Result<Self> {
        let runtime = Builder::new_multi_thread().worker_threads(THREADS).enable_all().build();
        let runtime = runtime.map_err(|error| ViewError::Server(error.to_string()))?;
        let context = Context::new();
        let (sender, events) = channel();
        let playback = served.playback.as_ref().map(|(_, playback)| Arc::clone(playback));
        let mut server = WebSocketServer::new()
            .name(served.name)
            .bind(Ipv4Addr::LOCALHOST.to_string(), port.number())
            .context(&context)
            .capabilities([Capability::Time])
            .message_backlog_size(BACKLOG)
            .listener(Arc::new(Listener { sender: sender.clone(), playback }))
            .tokio_runtime(runtime.handle());
        if let Some(((first_ns, last_ns), _)) = served.playback {
            server = server.playback_time_range(first_ns, last_ns);
        }
        let handle = server.start_blocking().map_err(|error| match error {
            foxglove::FoxgloveError::Bind(source) => {
                ViewError::Address { address: address(port.number()), source }
            }
            error => ViewError::Server(error.to_string()),
        })?;
        Ok(Self { handle: Some(handle), runtime, context, events, sender, sent_time: (0, None) })
    }

    /// Returns the context for new topics.
    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// From now on, reports SIGINT and SIGTERM as [`Event::End`].
    ///
    /// # Errors
    /// [`ViewError::Server`] if the kernel refuses to report signals.
    pub fn handle_signals(&self) -> Result<()> {
        use tokio::signal::unix::{SignalKind, signal};
        let _inside = self.runtime.enter();
        for kind in [SignalKind::interrupt(), SignalKind::terminate()] {
            let mut signals = signal(kind).map_err(|error| ViewError::Server(error.to_string()))?;
            let sender = self.sender.clone();
            self.runtime.spawn(async move {
                while signals.recv().await.is_some() {
                    let _ = sender.send(Event::End);
                }
            });
        }
        Ok(())
    }

    /// Returns the next event, if there is one.
    pub fn next_event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }

    /// Waits at most `timeout` for the next event.
    pub fn wait_for_event(&self, timeout: Duration) -> Option<Event> {
        self.events.recv_timeout(timeout).ok()
    }

    /// Sends the time to viewers if it has changed and none was sent just now. A viewer that cannot keep up is
    /// disconnected, so the time does not accompany every message.
    pub fn send_time(&mut self, stamp_ns: u64) {
        let (last_ns, since) = self.sent_time;
        let is_due = since.is_none_or(|since| since.elapsed() >= TIME_EVERY);
        if let (true, true, Some(handle)) = (stamp_ns != last_ns, is_due, &self.handle) {
            handle.broadcast_time(stamp_ns);
            self.sent_time = (stamp_ns, Some(Instant::now()));
        }
    }

    /// Sends the state of playback to viewers.
    pub fn send_playback(&self, playback: &SharedPlayback, did_seek: bool) {
        if let Some(handle) = &self.handle {
            handle.broadcast_playback_state(playback_state(&locked(playback), did_seek));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(handle) = self.handle.take() {
            let ending = handle.stop();
            // Do not wait for viewers that do not respond.
            let _ = self.runtime.block_on(async { tokio::time::timeout(GOODBYE, ending.wait()).await });
        }
    }
}

fn playback_state(playback: &Playback, did_seek: bool) -> PlaybackState {
    PlaybackState {
        status: match playback.state() {
            State::Playing => PlaybackStatus::Playing,
            State::Paused => PlaybackStatus::Paused,
            State::Ended => PlaybackStatus::Ended,
        },
        current_time: playback.at_ns(Instant::now()),
        playback_speed: playback.rate() as f32,
        did_seek,
        request_id: None,
    }
}

/// Receives viewers' requests on the server's thread.
struct Listener {
    sender: Sender<Event>,
    playback: Option<SharedPlayback>,
}

impl Listener {
    /// Sends an event. A missing receiver is no error, since the server is then about to end.
    fn say(&self, event: Event) {
        let _ = self.sender.send(event);
    }
}

impl ServerListener for Listener {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        if let Some(sink) = client.sink_id() {
            self.say(Event::Subscribed(channel.id(), sink));
        }
    }

    fn on_unsubscribe(&self, _: Client, _: ChannelView) {
        self.say(Event::Changed);
    }

    fn on_client_connect(&self) {
        self.say(Event::Changed);
    }

    fn on_client_disconnect(&self) {
        self.say(Event::Changed);
    }

    fn on_playback_control_request(&self, asked: PlaybackControlRequest) -> Option<PlaybackState> {
        let mut playback = locked(self.playback.as_ref()?);
        let plays = asked.playback_command == PlaybackCommand::Play;
        let request = Request { plays, rate: asked.playback_speed.into(), seek_ns: asked.seek_time };
        let target = playback.ask(request, Instant::now());
        self.say(target.map_or(Event::Changed, Event::Sought));
        Some(playback_state(&playback, target.is_some()))
    }
}
