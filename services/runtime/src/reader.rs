//! The reading end of a channel.

use std::marker::PhantomData;
use std::ops::Deref;
use std::rc::Rc;

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Message};

use crate::channels::subscribe;
use crate::history::History;
use crate::node::{Counters, Node};
use crate::{Error, Result};

/// Keeps track of which message numbers of a channel have arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tally {
    /// Number of the last message, or `None` if the first one may have any number.
    last: Option<u64>,
    lost: u64,
    /// With several writers, which number their messages independently, gaps in the numbers do not mean lost messages.
    many_writers: bool,
}

impl Tally {
    /// Starts counting. Numbers begin at 1, so a process of the mission has missed everything that was sent
    /// before it joined. An observer may join at any time, and the pad only shows the present, so for these
    /// two the first message may have any number. A restarted pad does not count the messages that its
    /// predecessor showed as lost.
    fn new(spec: &ChannelSpec, process: Process) -> Self {
        let comes_late = matches!(process, Process::Observer | Process::Pad);
        let last = (!comes_late).then_some(0);
        Self { last, lost: 0, many_writers: spec.writer.is_none() }
    }

    /// Returns the last number that arrived, or 0 before the first.
    fn position(&self) -> u64 {
        self.last.unwrap_or(0)
    }

    /// Counts a number. Returns true if it is new.
    fn accept(&mut self, seq: u64) -> bool {
        if self.many_writers {
            return true;
        }
        let last = self.last.unwrap_or(seq.saturating_sub(1));
        if seq <= last {
            return false;
        }
        self.lost += seq - last - 1;
        self.last = Some(seq);
        true
    }
}

/// The receiving side of a channel, for any message type.
pub struct RawReader {
    port: Subscriber<ipc::Service, [u64], u64>,
    spec: &'static ChannelSpec,
    tally: Tally,
    counters: Rc<Counters>,
}

impl RawReader {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let port = subscribe(node, spec)?;
        Ok(Self { port, spec, tally: Tally::new(spec, node.process()), counters: node.counters() })
    }

    /// Returns the channel.
    pub fn spec(&self) -> &'static ChannelSpec {
        self.spec
    }

    /// Returns the next message, if one has arrived. A message whose number has already arrived is dropped.
    ///
    /// # Errors
    /// [`Error::SharedMemory`] if iceoryx2 fails, or if more samples of the channel are held than allowed,
    /// which is eight, or two for messages with cells.
    pub fn receive(&mut self) -> Result<Option<RawSample>> {
        while let Some(sample) = self.port.receive().map_err(self.failed())? {
            // A writer of another build cannot connect, but one that does not belong to this project might.
            if size_of_val(sample.payload()) < self.spec.message.size {
                self.counters.count_refused();
                continue;
            }
            let sample = RawSample { sample, size: self.spec.message.size };
            if self.accept(sample.header().seq) {
                return Ok(Some(sample));
            }
        }
        Ok(None)
    }

    /// Returns the next valid message, if one has arrived. Invalid messages are rejected and counted.
    ///
    /// # Errors
    /// See [`RawReader::receive`].
    pub fn receive_valid(&mut self) -> Result<Option<RawSample>> {
        while let Some(sample) = self.receive()? {
            match self.spec.message.check(sample.message()) {
                Ok(()) => return Ok(Some(sample)),
                Err(why) => self.counters.count_invalid(self.spec.name, sample.header().seq, &why),
            }
        }
        Ok(None)
    }

    /// Counts a message. Returns true if it is new.
    fn accept(&mut self, seq: u64) -> bool {
        let before = self.tally.lost;
        let is_new = self.tally.accept(seq);
        self.counters.lost.set(self.counters.lost.get() + self.tally.lost - before);
        is_new
    }

    /// Returns the number of the last message that arrived. After a restart, the process must resume after
    /// it.
    pub fn position(&self) -> u64 {
        self.tally.position()
    }

    /// Resumes after the message `seq`, which has arrived according to a checkpoint. Earlier messages of the history are
    /// dropped.
    pub fn resume_after(&mut self, seq: u64) {
        self.tally.last = Some(seq);
    }

    /// Resumes with whichever message comes first. Messages before it count as seen rather than as lost.
    pub fn resume_anywhere(&mut self) {
        self.tally.last = None;
    }

    /// Calls `take` with each message of the channel's history that this reader has not received. A restarted
    /// reader needs this, since a dead writer does not send anything again. Messages with cells have no
    /// history.
    ///
    /// # Errors
    /// [`Error::File`] if the history is inaccessible.
    pub fn take_kept(&mut self, node: &Node, mut take: impl FnMut(&[u8])) -> Result<()> {
        if self.spec.writer.is_some() && self.spec.max_cells == 0 {
            History::open(node, self.spec)?.for_each_after(self.position(), |message| {
                let message = bytemuck::cast_slice(message);
                if self.accept(erased::header(message).seq) {
                    take(message);
                }
            });
        }
        Ok(())
    }

    /// Returns the number of missing messages, according to the numbers of those received.
    pub fn lost(&self) -> u64 {
        self.tally.lost
    }

    fn failed<E: std::fmt::Debug>(&self) -> impl FnOnce(E) -> Error {
        let name = self.spec.name;
        move |error| Error::shared_memory(format!("reading channel {name:?}"))(error)
    }
}

/// A message of any type in shared memory. It occupies a sample of the reader until it is dropped.
pub struct RawSample {
    sample: iceoryx2::sample::Sample<ipc::Service, [u64], u64>,
    size: usize,
}

impl RawSample {
    /// Returns the bytes of the message.
    pub fn message(&self) -> &[u8] {
        &self.bytes()[..self.size]
    }

    /// Returns the cells that follow the message.
    pub fn cells(&self) -> &[u8] {
        let tail = &self.bytes()[self.size..];
        let length = usize::try_from(*self.sample.user_header()).unwrap_or(usize::MAX);
        &tail[..length.min(tail.len())]
    }

    /// Returns the header of the message.
    pub fn header(&self) -> &Header {
        erased::header(self.bytes())
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.sample.payload())
    }
}

/// The receiving side of a channel of messages of type `T`. See [`RawReader`].
pub struct Reader<T> {
    raw: RawReader,
    message: PhantomData<fn() -> T>,
}

impl<T: Message> Reader<T> {
    pub(crate) fn new(raw: RawReader) -> Self {
        Self { raw, message: PhantomData }
    }

    /// Like [`RawReader::receive`].
    pub fn receive(&mut self) -> Result<Option<Sample<T>>> {
        Ok(self.raw.receive()?.map(Sample::new))
    }

    /// Like [`RawReader::receive_valid`].
    pub fn receive_valid(&mut self) -> Result<Option<Sample<T>>> {
        Ok(self.raw.receive_valid()?.map(Sample::new))
    }

    /// Like [`RawReader::position`].
    pub fn position(&self) -> u64 {
        self.raw.position()
    }

    /// Like [`RawReader::resume_after`].
    pub fn resume_after(&mut self, seq: u64) {
        self.raw.resume_after(seq);
    }

    /// Like [`RawReader::take_kept`].
    pub fn take_kept(&mut self, node: &Node, mut take: impl FnMut(&T)) -> Result<()> {
        self.raw.take_kept(node, |message| take(bytemuck::from_bytes(message)))
    }

    /// Returns the number of missing messages, according to the numbers of those received.
    pub fn lost(&self) -> u64 {
        self.raw.lost()
    }
}

/// A message in shared memory. It occupies a sample of the reader until it is dropped.
pub struct Sample<T> {
    raw: RawSample,
    message: PhantomData<T>,
}

impl<T: Message> Sample<T> {
    fn new(raw: RawSample) -> Self {
        Self { raw, message: PhantomData }
    }

    /// Returns the cells that follow the message.
    pub fn cells(&self) -> &[u8] {
        self.raw.cells()
    }
}

impl<T: Message> Deref for Sample<T> {
    type Target = T;
    fn deref(&self) -> &T {
        bytemuck::from_bytes(self.raw.message())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_schemas::channels::{HEALTH, SCAN};

    fn accepted(mut tally: Tally, numbers: &[u64]) -> (Vec<u64>, u64) {
        let new = numbers.iter().copied().filter(|&seq| tally.accept(seq)).collect();
        (new, tally.lost)
    }

    #[test]
    fn repetitions_are_dropped_and_gaps_counted() {
        let tally = Tally::new(SCAN.spec, Process::Planner);
        assert_eq!(accepted(tally, &[1, 2, 2, 1, 3, 6, 7]), (vec![1, 2, 3, 6, 7], 2));
        assert_eq!(accepted(tally, &[4]), (vec![4], 3));
    }

    #[test]
    fn messages_before_an_observer_joined_do_not_count_as_lost() {
        let tally = Tally::new(SCAN.spec, Process::Observer);
        assert_eq!(accepted(tally, &[40, 41, 43]), (vec![40, 41, 43], 1));
    }

    /// Regression test: when a pad was killed in the middle of a mission, its successor reported all 1675 earlier messages as lost.
    #[test]
    fn a_restarted_pad_does_not_count_earlier_messages_as_lost() {
        let tally = Tally::new(SCAN.spec, Process::Pad);
        assert_eq!(accepted(tally, &[400, 401, 403]), (vec![400, 401, 403], 1));
    }

    #[test]
    fn each_of_several_writers_has_its_own_count() {
        let tally = Tally::new(HEALTH.spec, Process::Recorder);
        assert_eq!(accepted(tally, &[1, 1, 2, 9]), (vec![1, 1, 2, 9], 0));
    }
}
