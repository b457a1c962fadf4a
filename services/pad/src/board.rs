//! What the bridge has for the server, and the server for the bridge: the newest of everything, and calls.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;
use serde_json::Value;
use tokio::sync::{oneshot, watch};

use crate::protocol::{Hello, HereBody, PathRequest, Refusal, SketchRequest, SketchType, Step};

/// Calls that wait for the bridge.
const MAX_CALLS: usize = 256;

/// What a request comes to: what the answer has beside `ok`.
pub type Answer = Result<Value, Refusal>;

/// Something that the server wants of the bridge.
#[derive(Debug)]
pub enum Call {
    /// A page has connected; its session, new or the one that it names.
    Join {
        /// The session that it had.
        named: Option<String>,
        /// One that it may have.
        fresh: String,
        /// Its session.
        reply: oneshot::Sender<Result<String, Refusal>>,
    },
    /// A page asks whether it would be let in.
    Seat {
        /// The session that it had.
        named: Option<String>,
        /// Whether it would.
        reply: oneshot::Sender<Result<(), Refusal>>,
    },
    /// Something has come from the session.
    Heard(String),
    /// A page wants something.
    Ask {
        /// Who.
        session: String,
        /// What.
        request: Request,
        /// What came of it.
        reply: oneshot::Sender<Answer>,
    },
    /// A monitor asks for the figures of the system.
    Metrics(oneshot::Sender<String>),
    /// The walls of the drawing with this number were painted.
    Walls(u64, Vec<u8>),
}

/// What a page wants.
#[derive(Debug)]
pub enum Request {
    /// A sketch is to be taken over; with the page's own name for the sending.
    Sketch(SketchRequest, Option<String>),
    /// A path, likewise.
    Path(PathRequest, Option<String>),
    /// The robot is to do something.
    Order(Step),
    /// The robot is somewhere.
    Here(HereBody),
    /// The wheel.
    Wheel,
    /// Another limit for the link, seconds.
    Limit(f64),
    /// A mission file of this name.
    Mission(String),
}

/// What every page sees.
#[derive(Debug, Clone, Default)]
pub struct Picture {
    /// The feed's JSON without its braces.
    pub body: String,
    /// Who has the wheel.
    pub driver: Option<String>,
    /// Whether the wheel can be taken.
    pub wheel: bool,
    /// What who drives may do.
    pub driver_may: Vec<Step>,
    /// What the others may do.
    pub watcher_may: Vec<Step>,
}

/// What a page gets when it comes, and again when that changes.
#[derive(Debug, Clone)]
pub struct Welcome {
    /// But for the session and who drives.
    pub hello: Hello,
    /// Who has the wheel.
    pub driver: Option<String>,
}

/// A picture that can be fetched.
#[derive(Debug, Clone)]
pub struct Image {
    /// Its type.
    pub kind: SketchType,
    /// Its bytes.
    pub bytes: Bytes,
}

/// Where the bridge puts what the server gives to the pages.
#[derive(Debug)]
pub struct Board {
    /// The newest feed.
    pub picture: watch::Sender<Arc<Picture>>,
    /// The newest hello.
    pub welcome: watch::Sender<Option<Arc<Welcome>>>,
    /// The walls.
    pub walls: Mutex<Option<Image>>,
    /// The photo that was sent last.
    pub photo: Mutex<Option<Image>>,
}

impl Default for Board {
    fn default() -> Self {
        Self {
            picture: watch::Sender::default(),
            welcome: watch::Sender::new(None),
            walls: Mutex::default(),
            photo: Mutex::default(),
        }
    }
}

impl Board {
    /// Who has the wheel.
    pub fn driver(&self) -> Option<String> {
        self.welcome.borrow().as_ref()?.driver.clone()
    }

    /// Whether the session has it.
    pub fn drives(&self, session: &str) -> bool {
        self.driver().as_deref() == Some(session)
    }
}

/// What a lock holds. A thread that panicked with it left it whole, since it is replaced in one piece.
pub fn image(place: &Mutex<Option<Image>>) -> Option<Image> {
    place.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Puts a picture in its place.
pub fn put_image(place: &Mutex<Option<Image>>, image: Option<Image>) {
    *place.lock().unwrap_or_else(PoisonError::into_inner) = image;
}

/// The server's end of the bridge: for every thread.
#[derive(Clone)]
pub struct Caller {
    calls: SyncSender<Call>,
    leaves: Leaves,
    aborts: Aborts,
    /// Wakes the bridge.
    wake: Arc<dyn Fn() + Send + Sync>,
    /// What there is to see.
    pub board: Arc<Board>,
}

/// The bridge's end.
pub struct Calls {
    calls: Receiver<Call>,
    leaves: Leaves,
    aborts: Aborts,
}

/// Sessions of connections that have ended: as few as there were connections, so that none is ever lost.
type Leaves = Arc<Mutex<Vec<String>>>;

/// Those who want to hear what became of their abort; `None` where nobody wants the robot to stop.
type Aborts = Arc<Mutex<Option<Vec<oneshot::Sender<Answer>>>>>;

impl Caller {
    /// Both ends.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> (Self, Calls) {
        let (sender, calls) = sync_channel(MAX_CALLS);
        let (leaves, aborts, board) = (Leaves::default(), Aborts::default(), Arc::default());
        let wake = Arc::new(wake);
        let caller = Self { calls: sender, leaves: leaves.clone(), aborts: aborts.clone(), wake, board };
        (caller, Calls { calls, leaves, aborts })
    }

    /// Calls the bridge.
    ///
    /// # Errors
    /// [`Refusal::TooOften`] where too many wait already, [`Refusal::Absent`] where it has ended.
    pub fn call(&self, call: Call) -> Result<(), Refusal> {
        self.calls.try_send(call).map_err(|error| match error {
            TrySendError::Full(_) => Refusal::TooOften,
            TrySendError::Disconnected(_) => Refusal::ending(),
        })?;
        (self.wake)();
        Ok(())
    }

    /// A connection of the session has ended.
    pub fn leave(&self, session: String) {
        self.leaves.lock().unwrap_or_else(PoisonError::into_inner).push(session);
        (self.wake)();
    }

    /// Stops the robot, ahead of all that waits; what becomes of it is for who wants to hear it.
    pub fn abort(&self) -> oneshot::Receiver<Answer> {
        let (reply, answer) = oneshot::channel();
        let mut aborts = self.aborts.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = aborts.get_or_insert_default();
        // Who has gone, or has said it over a WebSocket, waits for nothing.
        waiting.retain(|reply| !reply.is_closed());
        waiting.push(reply);
        drop(aborts);
        (self.wake)();
        answer
    }

    /// Asks the bridge and waits for its answer.
    ///
    /// # Errors
    /// As the bridge says, or as [`Caller::call`].
    pub async fn ask(&self, session: String, request: Request) -> Answer {
        let (reply, answer) = oneshot::channel();
        self.call(Call::Ask { session, request, reply })?;
        answer.await.unwrap_or_else(|_| Err(Refusal::ending()))
    }
}

impl Calls {
    /// Who wants the robot to stop; `None` where nobody does.
    pub fn take_aborts(&self) -> Option<Vec<oneshot::Sender<Answer>>> {
        self.aborts.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// The sessions of connections that have ended since the last time.
    pub fn take_leaves(&self) -> Vec<String> {
        std::mem::take(&mut *self.leaves.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The calls that wait; those that come while they are answered are left for the next time.
    pub fn waiting(&self) -> impl Iterator<Item = Call> {
        self.calls.try_iter().take(MAX_CALLS)
    }
}
