//! A process in a system.

use std::cell::{Cell, RefCell};
use std::rc::{Rc, Weak};
use std::time::Duration;

use iceoryx2::node::Node as SharedMemoryNode;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use sketchnav_schemas::channels::{self, Channel, ChannelSpec};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{Message, Tick};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::valid::Invalid;

use crate::bells::{Bells, sleep_until_changed};
use crate::half_made::Sweeper;
use crate::lock::Lock;
use crate::reader::{RawReader, Reader};
use crate::system::System;
use crate::writer::{RawWriter, Writer};
use crate::{Error, Result, limits, signals};

/// Why a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// Something may have arrived: look at every reader. (May be a false alarm.)
    Message,
    /// The time is over.
    Timeout,
    /// SIGTERM, SIGINT or SIGHUP asks the process to end; every later wait says so too.
    Terminate,
}

/// Wakes a [`Node`] that waits, from any thread of its process.
#[derive(Clone, Copy)]
pub struct Waker {
    bells: Bells,
    process: Process,
}

impl Waker {
    /// Ends the node's wait with [`Wake::Message`], or its next one where it is awake.
    pub fn wake(&self) {
        self.bells.ring(self.process);
    }
}

/// A process in a system: opens channels and waits for messages. One a process; for one thread.
pub struct Node {
    writers: RefCell<Vec<OwnWriter>>,
    inner: SharedMemoryNode<ipc::Service>,
    process: Process,
    system: Rc<System>,
    bells: Bells,
    seen_ring: Cell<u32>,
    seen_joined: Cell<u32>,
    counters: Rc<Counters>,
    /// Says that this process lives, and keeps a second one of its kind out.
    _presence: Option<Lock>,
    /// The supervisor's. It goes last: the rest may have to wait for what it takes away.
    sweeper: Option<Sweeper>,
}

/// What a process counts over all its readers.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) lost: Cell<u64>,
    pub(crate) refused: Cell<u64>,
    /// Channels and fields whose invalid messages were reported: each once, for there may be thousands.
    reported: RefCell<Vec<(&'static str, &'static str)>>,
}

/// Most channels and fields that are reported.
const MAX_REPORTED: usize = 64;

impl Counters {
    pub(crate) fn count_refused(&self) {
        self.refused.set(self.refused.get() + 1);
    }

    /// Counts an invalid message. The first one of its channel and field is reported with the reason.
    pub(crate) fn count_invalid(&self, channel: &'static str, seq: u64, why: &Invalid) {
        self.count_refused();
        let kind = (channel, why.field);
        let mut reported = self.reported.borrow_mut();
        if reported.len() < MAX_REPORTED && !reported.contains(&kind) {
            reported.push(kind);
            sketchnav_schemas::say!("rejected {channel} {seq}: {why}; others like it are only counted");
        }
    }
}

/// A writer of this node, which learns that a reader has come.
struct OwnWriter {
    port: Weak<dyn UpdateConnections>,
    /// The number of its last message.
    numbers: Rc<Cell<u64>>,
    spec: &'static ChannelSpec,
}

impl Node {
    /// Joins the system as `process`: the first thing a process does. From here on SIGTERM, SIGINT and
    /// SIGHUP end it through [`Node::wait`].
    ///
    /// # Errors
    /// [`Error::ProcessRunsAlready`] where the system has such a process; [`Error::FewFiles`].
    pub fn join(system: impl Into<Rc<System>>, process: Process) -> Result<Self> {
        let system = system.into();
        // An observer opens a few channels, and may get along with less.
        limits::provide_files()
            .or_else(|error| if process == Process::Observer { Ok(()) } else { Err(error) })?;
        // An observer comes when it likes, also while the system is being cleared: it is in before, and
        // asked to end, or it is late, and finds no system.
        let _guard = (process == Process::Observer).then(|| system.hold()).transpose()?;
        let bells = Bells::map(&system.bells())?;
        // Before others can see it: who is seen may be asked to end.
        signals::install(bells.word(process));
        let presence = system.enter(process)?;
        let sweeper = (process == Process::Supervisor).then(|| Sweeper::start(system.view())).transpose()?;
        let inner = shared_memory_node(&system, process).or_else(|error| {
            // What somebody has put in the way is named first.
            system.shared()?.check()?;
            Err(error)
        })?;
        // A link among the files is named before anything is opened.
        system.shared()?.check()?;
        system.shared()?.keep_others_out()?;
        Ok(Self {
            writers: RefCell::default(),
            inner,
            process,
            seen_ring: Cell::new(bells.rings(process)),
            seen_joined: Cell::new(bells.readers_joined(process)),
            system,
            bells,
            counters: Rc::default(),
            _presence: presence,
            sweeper,
        })
    }

    /// The system.
    pub fn system(&self) -> &System {
        &self.system
    }

    pub(crate) fn system_handle(&self) -> Rc<System> {
        Rc::clone(&self.system)
    }

    /// Which process this is.
    pub fn process(&self) -> Process {
        self.process
    }

    /// What the supervisor gave every process.
    pub fn run_config(&self) -> Result<RunConfig> {
        self.system.run_config()
    }

    /// Opens a channel to write it.
    ///
    /// # Errors
    /// [`Error::Forbidden`], [`Error::SecondWriter`], [`Error::Mismatch`].
    pub fn writer<T: Message>(&self, channel: Channel<T>) -> Result<Writer<T>> {
        Ok(Writer::new(self.raw_writer(channel.spec)?))
    }

    /// Opens a channel to write it, whatever its message is. Errors as [`Node::writer`].
    pub fn raw_writer(&self, spec: &'static ChannelSpec) -> Result<RawWriter> {
        self.check_write(spec)?;
        let writer = RawWriter::open(self, spec)?;
        let (port, numbers) = (writer.port(), writer.numbers());
        self.writers.borrow_mut().push(OwnWriter { port, numbers, spec });
        self.system.shared()?.reserve_small()?;
        Ok(writer)
    }

    /// Opens a channel to read it. What its writer kept comes first.
    ///
    /// # Errors
    /// [`Error::Forbidden`] (`truth` for a navigator), [`Error::Mismatch`].
    pub fn reader<T: Message>(&self, channel: Channel<T>) -> Result<Reader<T>> {
        Ok(Reader::new(self.raw_reader(channel.spec)?))
    }

    /// Opens a channel to read it, whatever its message is. Errors as [`Node::reader`].
    pub fn raw_reader(&self, spec: &'static ChannelSpec) -> Result<RawReader> {
        self.check_read(spec)?;
        let reader = RawReader::open(self, spec)?;
        self.announce_reader(spec);
        self.system.shared()?.reserve_small()?;
        Ok(reader)
    }

    /// Names in a tick the newest message of each sensor that this node has a writer of. A tick is sent last in an
    /// instant, with this done before: its readers wait for these messages.
    pub fn name_readings(&self, tick: &mut Tick) {
        for (newest, sensor) in tick.newest.iter_mut().zip(channels::sensors()) {
            let writers = self.writers.borrow();
            let own = writers.iter().find(|writer| writer.spec == sensor && writer.port.strong_count() > 0);
            *newest = own.map_or(0, |writer| writer.numbers.get());
        }
    }

    /// Sleeps until a message comes on a channel that this process reads, until the time is over, or until the process
    /// is to end. A message that came since the last wait ends it at once.
    ///
    /// The recorder and observers are not woken by messages; they wait a few milliseconds and look.
    pub fn wait(&self, timeout: Duration) -> Wake {
        // A request from before is in `seen_ring` already; a later one rings the bell again.
        if signals::end_requested() {
            return Wake::Terminate;
        }
        self.serve_new_readers();
        self.bells.beat(self.process);
        let rung = self.bells.wait(self.process, self.seen_ring.get(), timeout);
        if signals::end_requested() {
            return Wake::Terminate;
        }
        match rung {
            Some(ring) => {
                self.seen_ring.set(ring);
                Wake::Message
            }
            None => {
                // A reader that does not know the bells is served here.
                self.refresh_writers();
                Wake::Timeout
            }
        }
    }

    /// Sleeps until the time is over or the process is to end, whatever messages come.
    pub fn nap(&self, timeout: Duration) -> Wake {
        self.serve_new_readers();
        self.bells.beat(self.process);
        if sleep_until_changed(signals::word(), 0, timeout) { Wake::Terminate } else { Wake::Timeout }
    }

    /// Ends this node's wait from another thread of the process.
    pub fn waker(&self) -> Waker {
        Waker { bells: self.bells, process: self.process }
    }

    /// Whether SIGTERM, SIGINT or SIGHUP has asked the process to end.
    pub fn end_requested(&self) -> bool {
        signals::end_requested()
    }

    /// How many such signals have come: who sends a second one does not want to wait.
    pub fn end_requests(&self) -> u32 {
        signals::requests()
    }

    /// Messages that all readers of this process have lost so far.
    pub fn lost_messages(&self) -> u64 {
        self.counters.lost.get()
    }

    /// Counts a message that the process refused as malformed.
    pub fn count_refused(&self) {
        self.counters.count_refused();
    }

    /// Counts an invalid message; the first one of its channel and field is reported in the process's log.
    pub(crate) fn count_invalid(&self, channel: &'static str, seq: u64, why: &Invalid) {
        self.counters.count_invalid(channel, seq, why);
    }

    /// Clears what dead processes of the system left in shared memory: their samples, their places
    /// as writer or reader. For the supervisor, after it has waited for a dead child.
    pub fn clear_dead(&self, timeout: Duration) {
        self.inner.blocking_cleanup_dead_nodes(timeout);
    }

    /// Whether all files of the system in shared memory are this user's. For the supervisor, which looks again and again.
    ///
    /// # Errors
    /// [`Error::ForeignFile`], once.
    pub fn check_shared_memory(&self) -> Result<()> {
        self.sweeper.as_ref().and_then(Sweeper::complaint).map_or(Ok(()), Err)
    }

    /// Counts something that this process has done and none before it: who restarts a process that dies
    /// looks whether it gets anywhere. Every new message counts by itself.
    pub fn note_progress(&self) {
        self.bells.note_progress(self.process);
    }

    /// How much `process` and those before it have done; counts on over restarts.
    pub fn progress(&self, process: Process) -> u32 {
        self.bells.progress(process)
    }

    /// A number that changes as long as `process` does anything. A process looks up from its work at least every
    /// quarter of a second, unless a step of it takes longer.
    pub fn signs_of_life(&self, process: Process) -> u32 {
        self.bells.signs_of_life(process)
    }

    pub(crate) fn inner(&self) -> &SharedMemoryNode<ipc::Service> {
        &self.inner
    }

    pub(crate) fn bells(&self) -> Bells {
        self.bells
    }

    pub(crate) fn counters(&self) -> Rc<Counters> {
        self.counters.clone()
    }

    fn check_read(&self, spec: &'static ChannelSpec) -> Result<()> {
        if spec.may_read(self.process) {
            return Ok(());
        }
        let mut allowed: Vec<_> = spec.readers.iter().map(|process| process.word()).collect();
        allowed.extend([Process::Recorder.word(), Process::Observer.word()]);
        Err(self.forbidden("read", spec, allowed.join(", ")))
    }

    fn check_write(&self, spec: &'static ChannelSpec) -> Result<()> {
        if spec.may_write(self.process) {
            return Ok(());
        }
        Err(self.forbidden("write", spec, spec.writer.map_or("all", Process::word).into()))
    }

    fn forbidden(&self, verb: &'static str, spec: &'static ChannelSpec, allowed: String) -> Error {
        Error::Forbidden { process: self.process, verb, channel: spec.name, allowed }
    }

    fn announce_reader(&self, spec: &ChannelSpec) {
        if let Some(writer) = spec.writer {
            self.bells.announce_reader(writer);
        }
    }

    /// Hands the history to readers that have come: iceoryx2 does so on the next send alone.
    fn serve_new_readers(&self) {
        let joined = self.bells.readers_joined(self.process);
        if self.seen_joined.replace(joined) != joined {
            self.refresh_writers();
            for writer in self.writers.borrow().iter() {
                writer.spec.readers.iter().for_each(|&reader| self.bells.ring(reader));
            }
        }
    }

    fn refresh_writers(&self) {
        for port in self.writers.borrow().iter().filter_map(|writer| writer.port.upgrade()) {
            // What cannot be connected now is tried again on the next send, which reports it.
            let _ = port.update_connections();
        }
    }
}

/// The system's settings become iceoryx2's global ones, which its clean-up of dead nodes reads.
fn shared_memory_node(system: &System, process: Process) -> Result<SharedMemoryNode<ipc::Service>> {
    set_log_level_from_env_or(LogLevel::Fatal);
    let path = system.iceoryx2_config();
    let doing = || format!("{}: setting up shared memory", path.display());
    let file = FilePath::new(path.as_os_str().as_encoded_bytes()).map_err(Error::shared_memory(doing()))?;
    Config::setup_global_config_from_file(&file).map_err(Error::shared_memory(doing()))?;
    let config = Config::from_file(&file).map_err(Error::shared_memory(doing()))?;
    let name = process.word().try_into().map_err(Error::shared_memory(doing()))?;
    NodeBuilder::new()
        .name(&name)
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .map_err(Error::shared_memory(doing()))
}
