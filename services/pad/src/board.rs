//! Connects the bridge and the server: the latest state for the pages, and calls to the bridge.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use axum::body::Bytes;
use serde_json::Value;
use tokio::sync::{oneshot, watch};

use crate::bridge::Looked;
use crate::protocol::{Hello, HereBody, PathRequest, Refusal, SketchRequest, SketchType, Step, WheelWish};
use crate::sessions::Plea;
use crate::study::sitting::Told;
use crate::together::{Change, Room};

/// Maximum number of calls that wait for the bridge.
const MAX_CALLS: usize = 256;

/// The result of a request, which is either the members of the response in addition to `ok`, or the reason
/// for the refusal.
pub type Answer = Result<Value, Refusal>;

/// A page's session, and the number by which other pages know it.
pub type Joined = (String, u32);

/// A call from the server to the bridge.
#[derive(Debug)]
pub enum Call {
    /// A page has connected.
    Join {
        /// The session that it had before.
        named: Option<String>,
        /// A new session, in case the page does not name one.
        fresh: String,
        /// Gets its session and its number.
        reply: oneshot::Sender<Result<Joined, Refusal>>,
    },
    /// A page asks whether it would be admitted.
    Seat {
        /// The session that it had before.
        named: Option<String>,
        /// Gets whether it would be.
        reply: oneshot::Sender<Result<(), Refusal>>,
    },
    /// Something has arrived from the session.
    Heard(String),
    /// A page makes a request.
    Ask {
        /// The page's session.
        session: String,
        /// The request.
        request: Request,
        /// Gets the answer.
        reply: oneshot::Sender<Answer>,
    },
    /// A monitoring system requests metrics.
    Metrics(oneshot::Sender<String>),
    /// The walls of the drawing with this number have been painted.
    Walls(u64, Vec<u8>),
    /// The rooms that the mission's goals describe have been found, each in words.
    Resolved(Vec<String>),
    /// The recording has been looked at.
    Looked(Box<Looked>),
}

/// A page's request.
#[derive(Debug)]
pub enum Request {
    /// Submits a sketch, which the page sent under this name.
    Sketch(SketchRequest, Option<String>),
    /// Submits a path in the same way.
    Path(PathRequest, Option<String>),
    /// Gives the robot an order.
    Order(Step),
    /// Sets the robot's position.
    Here(HereBody),
    /// Takes the wheel, asks for it or hands it over.
    Wheel(WheelWish),
    /// Sets another limit for the link, in seconds.
    Limit(f64),
    /// Saves a mission file under this name.
    Mission(String),
    /// Sends the study a message about its participant.
    Study(Told),
}

impl Request {
    /// The step that this order takes, if any.
    pub fn step(&self) -> Option<Step> {
        match self {
            Self::Sketch(..) => Some(Step::Sketch),
            Self::Path(..) => Some(Step::Path),
            Self::Order(step) => Some(*step),
            Self::Here(_) => Some(Step::Here),
            Self::Wheel(_) | Self::Limit(_) | Self::Mission(_) | Self::Study(_) => None,
        }
    }
}

/// What all pages see.
#[derive(Debug, Clone, Default)]
pub struct Picture {
    /// The JSON of the feed, without its braces.
    pub body: String,
    /// The session that has the wheel.
    pub driver: Option<String>,
    /// Whether the wheel can be taken.
    pub wheel: bool,
    /// The pages that ask for it.
    pub pleas: Vec<Plea>,
    /// What the driver may do.
    pub driver_may: Vec<Step>,
    /// What the others may do.
    pub watcher_may: Vec<Step>,
}

/// What a page receives when it connects, and again whenever it changes.
#[derive(Debug, Clone)]
pub struct Welcome {
    /// Everything except the session and whether it drives.
    pub hello: Hello,
    /// The session that has the wheel.
    pub driver: Option<String>,
}

/// An image that pages can fetch.
#[derive(Debug, Clone)]
pub struct Image {
    /// Its type.
    pub kind: SketchType,
    /// Its bytes.
    pub bytes: Bytes,
}

/// The data that the server should send to the pages, stored here by the bridge.
#[derive(Debug)]
pub struct Board {
    /// The latest feed.
    pub picture: watch::Sender<Arc<Picture>>,
    /// The latest hello.
    pub welcome: watch::Sender<Option<Arc<Welcome>>>,
    /// The walls.
    pub walls: Mutex<Option<Image>>,
    /// What was learned.
    pub learned: Mutex<Option<Image>>,
    /// The drawing, corrected by what was learned, as SVG.
    pub corrected: Mutex<Option<Bytes>>,
    /// The photo that was sent last.
    pub photo: Mutex<Option<Image>>,
    /// The floor of a study, as SVG.
    pub place: OnceLock<Bytes>,
    /// The drawing in which all pages draw, if they may.
    pub together: Option<Together>,
}

/// The drawing that is shared. The server changes it without the bridge, and tells the pages.
#[derive(Debug, Default)]
pub struct Together {
    room: Mutex<Room>,
    /// Changes with every change of the drawing, and with every change of the people.
    pub drawn: watch::Sender<()>,
    /// The same for the people.
    pub people: watch::Sender<()>,
}

impl Together {
    /// The room. A thread that panics while holding the lock would leave it intact: changes are made after all checks.
    pub fn room(&self) -> MutexGuard<'_, Room> {
        self.room.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a page's changes and tells all pages.
    ///
    /// # Errors
    /// Those of [`Room::make`].
    pub fn draw(&self, change: Change) -> Result<(), Refusal> {
        self.room().make(change)?;
        self.drawn.send_replace(());
        Ok(())
    }

    /// Changes what pages know of each other.
    pub fn meet(&self, change: impl FnOnce(&mut Room)) {
        change(&mut self.room());
        self.people.send_replace(());
    }
}

impl Board {
    /// An empty board of a pad on which people draw together, or not.
    pub fn new(together: bool) -> Self {
        Self {
            picture: watch::Sender::default(),
            welcome: watch::Sender::new(None),
            walls: Mutex::default(),
            learned: Mutex::default(),
            corrected: Mutex::default(),
            photo: Mutex::default(),
            place: OnceLock::new(),
            together: together.then(Together::default),
        }
    }

    /// The session that has the wheel.
    pub fn driver(&self) -> Option<String> {
        self.welcome.borrow().as_ref()?.driver.clone()
    }

    /// Returns true if the session has the wheel.
    pub fn drives(&self, session: &str) -> bool {
        self.driver().as_deref() == Some(session)
    }
}

/// Returns a copy of the image. Even if a thread panicked while holding the lock, the image is intact,
/// because it is always replaced as a whole.
pub fn image<T: Clone>(place: &Mutex<Option<T>>) -> Option<T> {
    place.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Replaces an image.
pub fn put_image<T>(place: &Mutex<Option<T>>, image: Option<T>) {
    *place.lock().unwrap_or_else(PoisonError::into_inner) = image;
}

/// The server's handle to the bridge, which any thread can use.
#[derive(Clone)]
pub struct Caller {
    calls: SyncSender<Call>,
    leaves: Leaves,
    aborts: Aborts,
    /// Wakes the bridge.
    wake: Arc<dyn Fn() + Send + Sync>,
    /// What pages can see.
    pub board: Arc<Board>,
}

/// The bridge's end.
pub struct Calls {
    calls: Receiver<Call>,
    leaves: Leaves,
    aborts: Aborts,
}

/// Sessions of connections that have ended. There are no more of them than connections, so they are never dropped.
type Leaves = Arc<Mutex<Vec<String>>>;

/// Channel for the result of an abort, or `None` if no abort was requested.
type Aborts = Arc<Mutex<Option<Vec<oneshot::Sender<Answer>>>>>;

impl Caller {
    /// Creates both ends, for a pad on which people draw together, or not.
    pub fn new(together: bool, wake: impl Fn() + Send + Sync + 'static) -> (Self, Calls) {
        let (sender, calls) = sync_channel(MAX_CALLS);
        let (leaves, aborts, board) = (Leaves::default(), Aborts::default(), Arc::new(Board::new(together)));
        let wake = Arc::new(wake);
        let caller = Self { calls: sender, leaves: leaves.clone(), aborts: aborts.clone(), wake, board };
        (caller, Calls { calls, leaves, aborts })
    }

    /// Calls the bridge.
    ///
    /// # Errors
    /// [`Refusal::TooOften`] if too many calls are already waiting, and [`Refusal::Absent`] if the bridge has
    /// ended.
    pub fn call(&self, call: Call) -> Result<(), Refusal> {
        self.calls.try_send(call).map_err(|error| match error {
            TrySendError::Full(_) => Refusal::TooOften,
            TrySendError::Disconnected(_) => Refusal::ending(),
        })?;
        (self.wake)();
        Ok(())
    }

    /// Records that a connection of the session has ended.
    pub fn leave(&self, session: String) {
        self.leaves.lock().unwrap_or_else(PoisonError::into_inner).push(session);
        (self.wake)();
    }

    /// Stops the robot, ahead of all waiting calls. The result may be received or ignored.
    pub fn abort(&self) -> oneshot::Receiver<Answer> {
        let (reply, answer) = oneshot::channel();
        let mut aborts = self.aborts.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = aborts.get_or_insert_default();
        // A sender that has disconnected, or that used a WebSocket, does not wait for a result.
        waiting.retain(|reply| !reply.is_closed());
        waiting.push(reply);
        drop(aborts);
        (self.wake)();
        answer
    }

    /// Calls the bridge and waits for its response.
    ///
    /// # Errors
    /// The refusal of the bridge, or any error of [`Caller::call`].
    pub async fn ask(&self, session: String, request: Request) -> Answer {
        let (reply, answer) = oneshot::channel();
        self.call(Call::Ask { session, request, reply })?;
        answer.await.unwrap_or_else(|_| Err(Refusal::ending()))
    }
}

impl Calls {
    /// Returns the channels for the result of an abort, or `None` if no abort was requested.
    pub fn take_aborts(&self) -> Option<Vec<oneshot::Sender<Answer>>> {
        self.aborts.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Returns the sessions of connections that have ended since the last call.
    pub fn take_leaves(&self) -> Vec<String> {
        std::mem::take(&mut *self.leaves.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Returns the waiting calls. Calls that arrive in the meantime are left for the next time.
    pub fn waiting(&self) -> impl Iterator<Item = Call> {
        self.calls.try_iter().take(MAX_CALLS)
    }
}
