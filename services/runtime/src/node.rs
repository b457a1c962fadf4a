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

/// The reason why a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// A message may have arrived, so check every reader. (This may be a false alarm.)
    Message,
    /// The timeout has passed.
    Timeout,
    /// A SIGTERM, SIGINT or SIGHUP has asked the process to end. Every later wait reports this, too.
    Terminate,
}

/// Wakes a waiting [`Node`] from any thread of its process.
#[derive(Clone, Copy)]
pub struct Waker {
    bells: Bells,
    process: Process,
}

impl Waker {
    /// Ends the node's wait with [`Wake::Message`], or the next wait if the node is awake.
    pub fn wake(&self) {
        self.bells.ring(self.process);
    }
}

/// A process in a system. It opens channels and waits for messages. Each process has a single node, for use
/// by one thread.
pub struct Node {
    writers: RefCell<Vec<OwnWriter>>,
    inner: SharedMemoryNode<ipc::Service>,
    process: Process,
    system: Rc<System>,
    bells: Bells,
    seen_ring: Cell<u32>,
    seen_joined: Cell<u32>,
    counters: Rc<Counters>,
    /// Shows that this process is alive, and keeps out a second one of its kind.
    _presence: Option<Lock>,
    /// Sweeper of the supervisor, or of a process that may outlive it. It is dropped last, because the other fields may have to
    /// wait for files that it removes.
    sweeper: Option<Sweeper>,
}

/// Counts of a process across all its readers.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) lost: Cell<u64>,
    pub(crate) refused: Cell<u64>,
    /// Channels and fields of which an invalid message has been reported. Each pair is only reported once, since there may be
    /// thousands of messages.
    reported: RefCell<Vec<(&'static str, &'static str)>>,
}

/// Maximum number of pairs of channel and field that are reported.
const MAX_REPORTED: usize = 64;

impl Counters {
    pub(crate) fn count_refused(&self) {
        self.refused.set(self.refused.get() + 1);
    }

    /// Counts an invalid message. The first one of each channel and field is reported with its fault.
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

/// A writer of this node, which is notified when a reader joins.
struct OwnWriter {
    port: Weak<dyn UpdateConnections>,
    /// Number of the writer's last message.
    numbers: Rc<Cell<u64>>,
    spec: &'static ChannelSpec,
}

impl Node {
    /// Joins the system as `process`. A process must do this before anything else. From now on, SIGTERM, SIGINT and SIGHUP end
    /// it through [`Node::wait`].
    ///
    /// # Errors
    /// - [`Error::ProcessRunsAlready`] if the system already has this process.
    /// - [`Error::FewFiles`] if this process may not open enough files.
    pub fn join(system: impl Into<Rc<System>>, process: Process) -> Result<Self> {
        let system = system.into();
        // An observer opens only a few channels, and may get by with fewer files.
        limits::provide_files()
            .or_else(|error| if process == Process::Observer { Ok(()) } else { Err(error) })?;
        // An observer may join at any time, even while the system is being cleared. It either joins before that and is asked to
        // end, or finds no system.
        let _guard = (process == Process::Observer).then(|| system.hold()).transpose()?;
        let bells = Bells::map(&system.bells())?;
        // This must happen before other processes can see this one, because then it may be asked to end.
        signals::install(bells.word(process));
        let presence = system.enter(process)?;
        let sweeper = match process {
            Process::Supervisor => Some(Sweeper::of_supervisor(system.view())?),
            Process::Recorder | Process::Observer => Some(Sweeper::of_survivor(system.view())?),
            _ => None,
        };
        let inner = shared_memory_node(&system, process).or_else(|error| {
            // If a foreign file is the cause, the error should name it.
            system.shared()?.check()?;
            Err(error)
        })?;
        // A link among the files must be reported before any file is opened.
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

    /// Returns the system.
    pub fn system(&self) -> &System {
        &self.system
    }

    pub(crate) fn system_handle(&self) -> Rc<System> {
        Rc::clone(&self.system)
    }

    /// Returns the process that this node represents.
    pub fn process(&self) -> Process {
        self.process
    }

    /// Returns the run that the supervisor gave to every process.
    pub fn run_config(&self) -> Result<RunConfig> {
        self.system.run_config()
    }

    /// Opens a channel for writing.
    ///
    /// # Errors
    /// - [`Error::Forbidden`] if the process may not write the channel.
    /// - [`Error::SecondWriter`] if the channel already has a writer.
    /// - [`Error::Mismatch`] if another build has created the channel with a different message.
    pub fn writer<T: Message>(&self, channel: Channel<T>) -> Result<Writer<T>> {
        Ok(Writer::new(self.raw_writer(channel.spec)?))
    }

    /// Opens a channel for writing, for any message type. The errors are those of [`Node::writer`].
    pub fn raw_writer(&self, spec: &'static ChannelSpec) -> Result<RawWriter> {
        self.check_write(spec)?;
        let writer = RawWriter::open(self, spec)?;
        let (port, numbers) = (writer.port(), writer.numbers());
        self.writers.borrow_mut().push(OwnWriter { port, numbers, spec });
        self.system.shared()?.reserve_small()?;
        Ok(writer)
    }

    /// Opens a channel for reading. Messages of its history are received first.
    ///
    /// # Errors
    /// - [`Error::Forbidden`] if the process may not read the channel (such as `truth` for a navigator).
    /// - [`Error::Mismatch`] if another build has created the channel with a different message.
    pub fn reader<T: Message>(&self, channel: Channel<T>) -> Result<Reader<T>> {
        Ok(Reader::new(self.raw_reader(channel.spec)?))
    }

    /// Opens a channel for reading, for any message type. The errors are those of [`Node::reader`].
    pub fn raw_reader(&self, spec: &'static ChannelSpec) -> Result<RawReader> {
        self.check_read(spec)?;
        let reader = RawReader::open(self, spec)?;
        self.announce_reader(spec);
        self.system.shared()?.reserve_small()?;
        Ok(reader)
    }

    /// Records in a tick the latest message of each sensor that this node writes. The tick must be the last message of an instant,
    /// sent after this call, since its readers wait for the messages that it refers to.
    pub fn name_readings(&self, tick: &mut Tick) {
        for (newest, sensor) in tick.newest.iter_mut().zip(channels::sensors()) {
            let writers = self.writers.borrow();
            let own = writers.iter().find(|writer| writer.spec == sensor && writer.port.strong_count() > 0);
            *newest = own.map_or(0, |writer| writer.numbers.get());
        }
    }

    /// Sleeps until a message arrives on a channel that this process reads, `timeout` has passed, or the process is asked to end.
    /// If a message has arrived since the last wait, it returns immediately.
    ///
    /// Messages do not wake the recorder and observers, which must check their channels every few
    /// milliseconds.
    pub fn wait(&self, timeout: Duration) -> Wake {
        // A request from before this line is already in `seen_ring`. A later one rings the bell again.
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
                // This serves readers that do not use the bells.
                self.refresh_writers();
                Wake::Timeout
            }
        }
    }

    /// Sleeps until `timeout` has passed or the process is asked to end. Messages do not wake it.
    pub fn nap(&self, timeout: Duration) -> Wake {
        self.serve_new_readers();
        self.bells.beat(self.process);
        if sleep_until_changed(signals::word(), 0, timeout) { Wake::Terminate } else { Wake::Timeout }
    }

    /// Returns a handle that ends this node's wait from another thread of the process.
    pub fn waker(&self) -> Waker {
        Waker { bells: self.bells, process: self.process }
    }

    /// Returns true if a SIGTERM, SIGINT or SIGHUP has asked the process to end.
    pub fn end_requested(&self) -> bool {
        signals::end_requested()
    }

    /// Returns the number of signals that have asked the process to end. A second one means that the sender does not want to wait.
    pub fn end_requests(&self) -> u32 {
        signals::requests()
    }

    /// Returns the number of messages that the readers of this process have lost so far.
    pub fn lost_messages(&self) -> u64 {
        self.counters.lost.get()
    }

    /// Counts a message that the process rejected as malformed.
    pub fn count_refused(&self) {
        self.counters.count_refused();
    }

    /// Counts an invalid message. The first one of each channel and field is reported in the process's log.
    pub(crate) fn count_invalid(&self, channel: &'static str, seq: u64, why: &Invalid) {
        self.counters.count_invalid(channel, seq, why);
    }

    /// Frees the samples that dead processes of the system left in shared memory, and their slots as writers and readers. The
    /// supervisor calls this after it has waited for a dead child.
    pub fn clear_dead(&self, timeout: Duration) {
        self.inner.blocking_cleanup_dead_nodes(timeout);
    }

    /// Checks that all files of the system in shared memory belong to this user. The supervisor calls this repeatedly.
    ///
    /// # Errors
    /// [`Error::ForeignFile`] for the first foreign file, returned once.
    pub fn check_shared_memory(&self) -> Result<()> {
        self.sweeper.as_ref().and_then(Sweeper::complaint).map_or(Ok(()), Err)
    }

    /// Counts a unit of new work. A process that keeps dying is only restarted if it does new work in between. New messages are
    /// counted automatically.
    pub fn note_progress(&self) {
        self.bells.note_progress(self.process);
    }

    /// Returns the amount of new work that `process` has done, across all restarts.
    pub fn progress(&self, process: Process) -> u32 {
        self.bells.progress(process)
    }

    /// Returns a number that changes whenever `process` does anything. A process gives a heartbeat at least every quarter of a
    /// second, unless one of its steps takes longer.
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

    /// Sends the history to readers that have joined. iceoryx2 itself would do so only on the next send.
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
            // Anything that cannot be connected now is tried again on the next send, which reports the error.
            let _ = port.update_connections();
        }
    }
}

/// Creates the node of iceoryx2. The system's settings also become iceoryx2's global ones, since its clean-up of dead nodes
/// reads those.
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
