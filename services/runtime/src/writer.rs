//! The writing end of a channel.

use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::rc::{Rc, Weak};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::ipc;
use iceoryx2::sample_mut::SampleMut;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{Header, Message};

use crate::allocations::loan_handle;
use crate::bells::Bells;
use crate::channels::{open_fixed, open_sliced, writer_error};
use crate::kept::Kept;
use crate::node::Node;
use crate::wire::Wire;
use crate::{Error, Result};

/// Samples that a writer fills at the same time.
const MAX_LOANS: usize = 1;

/// What both kinds of writers have: the numbering and the readers to wake.
struct Outbox {
    spec: &'static ChannelSpec,
    bells: Bells,
    process: Process,
    last_seq: u64,
}

impl Outbox {
    fn new(node: &Node, spec: &'static ChannelSpec) -> Self {
        Self { spec, bells: node.bells(), process: node.process(), last_seq: 0 }
    }

    /// Gives a message its number. A sensor's reading is its own cause, whatever a driver has written there.
    fn number(&self, header: &mut Header) {
        header.seq = self.last_seq;
        if self.spec.is_sensed() {
            header.source_seq = self.last_seq;
        }
    }

    /// A sign of life is no progress.
    fn note_progress(&self) {
        if self.spec.writer.is_some() {
            self.bells.note_progress(self.process);
        }
    }

    fn ring_readers(&self) {
        self.spec.readers.iter().for_each(|&reader| self.bells.ring(reader));
    }

    fn failed<E: std::fmt::Debug>(&self) -> impl FnOnce(E) -> Error {
        let name = self.spec.name;
        move |error| Error::shared_memory(format!("writing channel {name:?}"))(error)
    }
}

/// The writing end of a channel of messages of type `T`.
///
/// It keeps a copy of its last messages for the process that goes on when this one dies. That one's
/// writer sends them again, for those who have not had them, and lets what it has kept pass: a message
/// that is computed anew, with a number that was given already, is not sent again. (A channel that
/// every process writes has no numbers to tell by, and nothing of it is kept.)
pub struct Writer<T: Message> {
    port: Rc<Publisher<ipc::Service, Wire<T>, ()>>,
    outbox: Outbox,
    kept: Option<Kept<T>>,
}

impl<T: Message> Writer<T> {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let service = open_fixed::<T>(node, spec)?;
        let port = service.publisher_builder().max_loaned_samples(MAX_LOANS).create();
        let port = port.map_err(|error| writer_error(node, spec, &service, error))?;
        let kept = spec.writer.is_some().then(|| Kept::open(node, spec)).transpose()?;
        let mut writer = Self { port: Rc::new(port), outbox: Outbox::new(node, spec), kept };
        writer.send_kept()?;
        Ok(writer)
    }

    /// Sends again what the last writer kept.
    fn send_kept(&mut self) -> Result<()> {
        let Some(kept) = self.kept.as_ref().filter(|kept| kept.last_seq() > 0) else { return Ok(()) };
        for message in kept.iter() {
            let loaned = loan_handle(|| self.port.loan_uninit()).map_err(self.outbox.failed())?;
            loaned.write_payload(Wire(*message)).send().map_err(self.outbox.failed())?;
        }
        self.outbox.ring_readers();
        Ok(())
    }

    /// Goes on with the number after `seq`: 0 at the beginning, or what a checkpoint says.
    pub fn resume_after(&mut self, seq: u64) {
        self.outbox.last_seq = seq;
    }

    /// The last message that this writer or one before it has sent.
    pub fn last_kept(&self) -> Option<&T> {
        self.kept.as_ref().and_then(Kept::last)
    }

    /// Goes on behind what was sent so far, by a process that does not know any more how it came to it.
    pub fn resume_behind_kept(&mut self) {
        self.outbox.last_seq = self.kept.as_ref().map_or(0, Kept::last_seq);
    }

    pub(crate) fn port(&self) -> Weak<dyn UpdateConnections> {
        let weak: Weak<Publisher<ipc::Service, Wire<T>, ()>> = Rc::downgrade(&self.port);
        weak
    }

    /// A message in shared memory, all zero, to be filled and sent.
    ///
    /// # Errors
    /// [`Error::SharedMemory`] where no memory is left.
    pub fn loan(&mut self) -> Result<Loan<'_, T>> {
        let mut sample = loan_handle(|| self.port.loan_uninit()).map_err(self.outbox.failed())?;
        let message: *mut Wire<T> = sample.payload_mut().as_mut_ptr();
        // SAFETY: the sample is ours alone until it is sent, and all zero is a message (`Pod`).
        let sample = unsafe {
            message.write_bytes(0, 1);
            sample.assume_init()
        };
        Ok(Loan { sample, outbox: &mut self.outbox, kept: &mut self.kept })
    }

    /// Fills a message in shared memory and sends it; its number.
    pub fn send(&mut self, fill: impl FnOnce(&mut T)) -> Result<u64> {
        let mut loan = self.loan()?;
        fill(&mut loan);
        loan.send()
    }

    /// The number of the last message sent; 0 before the first.
    pub fn last_seq(&self) -> u64 {
        self.outbox.last_seq
    }
}

/// A message in shared memory that nobody reads yet. Dropped, it was never there.
pub struct Loan<'a, T: Message> {
    sample: SampleMut<ipc::Service, Wire<T>, ()>,
    outbox: &'a mut Outbox,
    kept: &'a mut Option<Kept<T>>,
}

impl<T: Message> Loan<'_, T> {
    /// Numbers the message, sends it and wakes its readers; the number.
    pub fn send(self) -> Result<u64> {
        let (outbox, seq) = self.publish()?;
        outbox.ring_readers();
        Ok(seq)
    }

    /// As [`Loan::send`], and lets the readers sleep: another message of the same step follows, which
    /// wakes them.
    pub fn send_quietly(self) -> Result<u64> {
        Ok(self.publish()?.1)
    }
}

impl<'a, T: Message> Loan<'a, T> {
    fn publish(mut self) -> Result<(&'a mut Outbox, u64)> {
        let seq = self.outbox.last_seq + 1;
        self.outbox.last_seq = seq;
        if self.kept.as_ref().is_some_and(|kept| seq <= kept.last_seq()) {
            return Ok((self.outbox, seq));
        }
        self.outbox.number(self.sample.payload_mut().0.header_mut());
        if let Some(kept) = self.kept {
            kept.keep(&self.sample.payload().0);
        }
        self.sample.send().map_err(self.outbox.failed())?;
        self.outbox.note_progress();
        Ok((self.outbox, seq))
    }
}

impl<T: Message> Deref for Loan<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.sample.payload().0
    }
}

impl<T: Message> DerefMut for Loan<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.sample.payload_mut().0
    }
}

/// The writing end of a channel of messages of type `T`, each with a slice of bytes behind it.
pub struct SliceWriter<T: Message> {
    port: Rc<Publisher<ipc::Service, [u8], Wire<T>>>,
    outbox: Outbox,
}

impl<T: Message> SliceWriter<T> {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let service = open_sliced::<T>(node, spec)?;
        let builder = service.publisher_builder().max_loaned_samples(MAX_LOANS);
        let port = builder.initial_max_slice_len(spec.max_slice_bytes).create();
        let port = port.map_err(|error| writer_error(node, spec, &service, error))?;
        Ok(Self { port: Rc::new(port), outbox: Outbox::new(node, spec) })
    }

    pub(crate) fn port(&self) -> Weak<dyn UpdateConnections> {
        let weak: Weak<Publisher<ipc::Service, [u8], Wire<T>>> = Rc::downgrade(&self.port);
        weak
    }

    /// A message with `length` bytes behind it in shared memory, all zero, to be filled and sent.
    ///
    /// # Errors
    /// [`Error::SliceTooLong`]; [`Error::SharedMemory`] where no memory is left.
    pub fn loan(&mut self, length: usize) -> Result<SliceLoan<'_, T>> {
        let spec = self.outbox.spec;
        if length > spec.max_slice_bytes {
            return Err(Error::SliceTooLong { channel: spec.name, max: spec.max_slice_bytes, found: length });
        }
        let loaned = loan_handle(|| self.port.loan_slice_uninit(length));
        let mut sample = loaned.map_err(self.outbox.failed())?;
        sample.payload_mut().fill(MaybeUninit::zeroed());
        // SAFETY: every byte was just written.
        let sample = unsafe { sample.assume_init() };
        Ok(SliceLoan { sample, outbox: &mut self.outbox })
    }

    /// Goes on with the number after `seq`: 0 at the beginning, or what a checkpoint says. A message that is sent
    /// once more has to be given its number again.
    pub fn resume_after(&mut self, seq: u64) {
        self.outbox.last_seq = seq;
    }

    /// The number of the last message sent; 0 before the first.
    pub fn last_seq(&self) -> u64 {
        self.outbox.last_seq
    }
}

/// A message with a slice in shared memory that nobody reads yet. Dropped, it was never there.
pub struct SliceLoan<'a, T: Message> {
    sample: SampleMut<ipc::Service, [u8], Wire<T>>,
    outbox: &'a mut Outbox,
}

impl<T: Message> SliceLoan<'_, T> {
    /// The message.
    pub fn message_mut(&mut self) -> &mut T {
        &mut self.sample.user_header_mut().0
    }

    /// The bytes behind it.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        self.sample.payload_mut()
    }

    /// Numbers the message, sends it and wakes its readers; the number.
    pub fn send(mut self) -> Result<u64> {
        let seq = self.outbox.last_seq + 1;
        self.message_mut().header_mut().seq = seq;
        self.sample.send().map_err(self.outbox.failed())?;
        self.outbox.last_seq = seq;
        self.outbox.note_progress();
        self.outbox.ring_readers();
        Ok(seq)
    }
}
