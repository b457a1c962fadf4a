//! The writing end of a channel.

use std::cell::Cell;
use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::rc::{Rc, Weak};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::ipc;
use iceoryx2::sample_mut::SampleMut;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::{self, ALIGNMENT};
use sketchnav_schemas::message::{Header, Message};

use crate::allocations::loan_handle;
use crate::bells::Bells;
use crate::channels::{open, writer_error};
use crate::history::History;
use crate::node::Node;
use crate::trap::{Fate, Trap};
use crate::{Error, Result};

/// Maximum number of samples that a writer fills at the same time.
const MAX_LOANS: usize = 1;

type Port = Publisher<ipc::Service, [u64], u64>;
type Loaned = SampleMut<ipc::Service, [u64], u64>;

/// The writing end of a channel with any message type.
///
/// A writer stores its last messages for its successor, which sends them again for readers that have not received them. When the
/// successor computes a stored message again, it recognizes the number and does not send the message a second time. (A channel that
/// every process writes has no consistent numbers, so nothing is stored for it. A message with cells is too large to be stored. A
/// process that computes such a message again also sends it again, and readers drop it if they have it.)
pub struct RawWriter {
    port: Rc<Port>,
    spec: &'static ChannelSpec,
    bells: Bells,
    process: Process,
    last_seq: Rc<Cell<u64>>,
    history: Option<History>,
    /// Planned faults, if there are any.
    trap: Option<Box<Trap>>,
    /// A message to send after the next one.
    held: Option<Vec<u64>>,
}

impl RawWriter {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let service = open(node, spec)?;
        let builder = service.publisher_builder().max_loaned_samples(MAX_LOANS);
        let port = builder.initial_max_slice_len(words(spec.message.size + spec.max_cells)).create();
        let port = port.map_err(|error| writer_error(node, spec, &service, error))?;
        let history = spec.writer.is_some().then(|| History::open(node, spec)).transpose()?;
        let (bells, process) = (node.bells(), node.process());
        let (trap, held) = (Trap::of(node, spec)?.map(Box::new), None);
        let (port, last_seq) = (Rc::new(port), Rc::default());
        let mut writer = Self { port, spec, bells, process, last_seq, history, trap, held };
        writer.send_kept()?;
        Ok(writer)
    }

    /// Returns the channel.
    pub fn spec(&self) -> &'static ChannelSpec {
        self.spec
    }

    /// Resends the messages that the last writer stored.
    fn send_kept(&mut self) -> Result<()> {
        let whole = |history: &&History| history.last_seq() > 0 && self.spec.max_cells == 0;
        let Some(history) = self.history.as_ref().filter(whole) else { return Ok(()) };
        let mut sent = Ok(());
        history.for_each_after(0, |message| {
            if sent.is_ok() {
                sent = self.send_copy(message);
            }
        });
        sent?;
        self.ring_readers();
        Ok(())
    }

    fn send_copy(&self, message: &[u64]) -> Result<()> {
        let mut sample = self.blank(0)?;
        sample.payload_mut()[..message.len()].copy_from_slice(message);
        sample.send().map(drop).map_err(self.failed())
    }

    /// Resumes with the number after `seq`, which is 0 at the beginning, or comes from a checkpoint.
    pub fn resume_after(&mut self, seq: u64) {
        self.last_seq.set(seq);
    }

    /// Returns a copy of the last message sent by this writer or an earlier one, or of its header if it has cells.
    pub fn last_sent(&self) -> Option<Vec<u64>> {
        self.history.as_ref().and_then(History::last)
    }

    /// Resumes after everything that has been sent so far. This is for a process that has lost the state that produced these
    /// messages.
    pub fn resume_after_history(&mut self) {
        self.last_seq.set(self.history.as_ref().map_or(0, History::last_seq));
    }

    pub(crate) fn port(&self) -> Weak<dyn UpdateConnections> {
        let weak: Weak<Port> = Rc::downgrade(&self.port);
        weak
    }

    pub(crate) fn numbers(&self) -> Rc<Cell<u64>> {
        Rc::clone(&self.last_seq)
    }

    /// Loans a message in shared memory, followed by `cells` bytes, to be filled and sent. It is all zero.
    ///
    /// # Errors
    /// - [`Error::SliceTooLong`] if the channel does not allow so many cells;
    /// - [`Error::SharedMemory`] if no memory is left.
    pub fn loan(&mut self, cells: usize) -> Result<RawLoan<'_>> {
        let ChannelSpec { name, max_cells, .. } = *self.spec;
        if cells > max_cells {
            return Err(Error::SliceTooLong { channel: name, max: max_cells, found: cells });
        }
        Ok(RawLoan { sample: self.blank(cells)?, cells, writer: self })
    }

    fn blank(&self, cells: usize) -> Result<Loaned> {
        let length = words(self.spec.message.size + cells);
        let loaned = loan_handle(|| self.port.loan_slice_uninit(length));
        let mut sample = loaned.map_err(self.failed())?;
        *sample.user_header_mut() = cells as u64;
        sample.payload_mut().fill(MaybeUninit::zeroed());
        // SAFETY: every word was just written.
        Ok(unsafe { sample.assume_init() })
    }

    /// Returns the number of the last message sent, or 0 before the first.
    pub fn last_seq(&self) -> u64 {
        self.last_seq.get()
    }

    /// Wakes the readers for messages that were sent quietly.
    pub fn ring_readers(&self) {
        self.spec.readers.iter().for_each(|&reader| self.bells.ring(reader));
    }

    /// Assigns a message its number. A sensor reading is its own cause, regardless of what a driver has written there.
    fn number(&self, header: &mut Header, seq: u64) {
        header.seq = seq;
        if self.spec.is_sensed() {
            header.source_seq = seq;
        }
    }

    /// Returns true if a predecessor has already sent the message.
    fn was_sent(&self, seq: u64) -> bool {
        self.spec.max_cells == 0 && self.history.as_ref().is_some_and(|history| seq <= history.last_seq())
    }

    fn publish(&mut self, mut sample: Loaned) -> Result<u64> {
        let seq = self.last_seq.get() + 1;
        self.last_seq.set(seq);
        if self.was_sent(seq) {
            return Ok(seq);
        }
        let header = erased::header_mut(bytemuck::cast_slice_mut(sample.payload_mut()));
        self.number(header, seq);
        let stamp_ns = header.stamp_ns;
        let fate = self.trap.as_mut().map_or(Ok(Fate::default()), |trap| trap.before(seq, stamp_ns))?;
        if let Some(history) = self.history.as_mut().filter(|history| seq > history.last_seq()) {
            history.keep(sample.payload());
        }
        if fate == Fate::default() && self.held.is_none() {
            sample.send().map_err(self.failed())?;
        } else {
            self.meet(fate, sample)?;
        }
        // A heartbeat is not progress.
        if self.spec.writer.is_some() {
            self.bells.note_progress(self.process);
        }
        self.trap.as_mut().map_or(Ok(()), |trap| trap.after(seq, stamp_ns))?;
        Ok(seq)
    }

    /// Sends a message according to the fault plan. A message that gets lost is still stored in the history.
    fn meet(&mut self, fate: Fate, sample: Loaned) -> Result<()> {
        let copy = (fate.is_doubled || fate.is_held).then(|| sample.payload().to_vec());
        if fate.is_dropped || fate.is_held {
            drop(sample);
        } else {
            sample.send().map_err(self.failed())?;
        }
        let before = self.held.take();
        let (now, later) = if fate.is_held { (None, copy) } else { (copy, None) };
        self.held = later;
        before.iter().chain(&now).try_for_each(|message| self.send_copy(message))
    }

    fn failed<E: std::fmt::Debug>(&self) -> impl FnOnce(E) -> Error {
        let name = self.spec.name;
        move |error| Error::shared_memory(format!("writing channel {name:?}"))(error)
    }
}

/// Returns the number of words needed for that many bytes.
fn words(bytes: usize) -> usize {
    bytes.div_ceil(ALIGNMENT)
}

/// A message in shared memory that has not been sent yet. If it is dropped, it is never sent.
pub struct RawLoan<'a> {
    sample: Loaned,
    cells: usize,
    writer: &'a mut RawWriter,
}

impl RawLoan<'_> {
    /// Returns the message and its cells.
    pub fn parts_mut(&mut self) -> (&mut [u8], &mut [u8]) {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(self.sample.payload_mut());
        let (message, tail) = bytes.split_at_mut(self.writer.spec.message.size);
        (message, &mut tail[..self.cells])
    }

    /// Numbers the message, sends it and wakes its readers. Returns the number.
    pub fn send(self) -> Result<u64> {
        let seq = self.writer.publish(self.sample)?;
        self.writer.ring_readers();
        Ok(seq)
    }

    /// Like [`RawLoan::send`], but does not wake the readers, because another message of the same step follows and wakes them.
    pub fn send_quietly(self) -> Result<u64> {
        self.writer.publish(self.sample)
    }
}

/// The writing end of a channel of messages of type `T`. See [`RawWriter`].
pub struct Writer<T> {
    raw: RawWriter,
    message: PhantomData<fn(T)>,
}

impl<T: Message> Writer<T> {
    pub(crate) fn new(raw: RawWriter) -> Self {
        Self { raw, message: PhantomData }
    }

    /// Like [`RawWriter::resume_after`].
    pub fn resume_after(&mut self, seq: u64) {
        self.raw.resume_after(seq);
    }

    /// Returns the last message sent by this writer or an earlier one, or `None` if messages have cells.
    pub fn last_sent(&self) -> Option<T> {
        let last = self.raw.last_sent().filter(|message| size_of_val(message.as_slice()) == size_of::<T>());
        last.map(|message| *bytemuck::from_bytes(bytemuck::cast_slice(&message)))
    }

    /// Like [`RawWriter::resume_after_history`].
    pub fn resume_after_history(&mut self) {
        self.raw.resume_after_history();
    }

    /// Loans a message in shared memory, all zero, to be filled and sent. The errors are those of [`RawWriter::loan`].
    pub fn loan(&mut self) -> Result<Loan<'_, T>> {
        self.loan_with(0)
    }

    /// Like [`Writer::loan`], but the message is followed by `cells` bytes.
    pub fn loan_with(&mut self, cells: usize) -> Result<Loan<'_, T>> {
        Ok(Loan { raw: self.raw.loan(cells)?, message: PhantomData })
    }

    /// Fills a message in shared memory and sends it. Returns its number.
    pub fn send(&mut self, fill: impl FnOnce(&mut T)) -> Result<u64> {
        let mut loan = self.loan()?;
        fill(&mut loan);
        loan.send()
    }

    /// Returns the number of the last message sent, or 0 before the first.
    pub fn last_seq(&self) -> u64 {
        self.raw.last_seq()
    }
}

/// A message in shared memory that has not been sent yet. If it is dropped, it is never sent.
pub struct Loan<'a, T> {
    raw: RawLoan<'a>,
    message: PhantomData<fn(T)>,
}

impl<T: Message> Loan<'_, T> {
    /// Returns the message and its cells.
    pub fn parts_mut(&mut self) -> (&mut T, &mut [u8]) {
        let (message, cells) = self.raw.parts_mut();
        (bytemuck::from_bytes_mut(message), cells)
    }

    /// Like [`RawLoan::send`].
    pub fn send(self) -> Result<u64> {
        self.raw.send()
    }

    /// Like [`RawLoan::send_quietly`].
    pub fn send_quietly(self) -> Result<u64> {
        self.raw.send_quietly()
    }
}

impl<T: Message> Deref for Loan<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        bytemuck::from_bytes(&bytemuck::cast_slice(self.raw.sample.payload())[..size_of::<T>()])
    }
}

impl<T: Message> DerefMut for Loan<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.parts_mut().0
    }
}
