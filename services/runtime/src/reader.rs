//! The reading end of a channel.

use std::ops::Deref;
use std::rc::Rc;

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Message;

use crate::channels::{open_fixed, open_sliced};
use crate::kept::Kept;
use crate::node::{Counters, Node};
use crate::wire::Wire;
use crate::{Error, Result};

/// What both kinds of readers have: which numbers have come.
struct Inbox {
    spec: &'static ChannelSpec,
    tally: Tally,
    counters: Rc<Counters>,
}

impl Inbox {
    fn new(node: &Node, spec: &'static ChannelSpec) -> Self {
        Self { spec, tally: Tally::new(spec, node.process()), counters: node.counters() }
    }

    /// Whether the message is new.
    fn accept(&mut self, message: &impl Message) -> bool {
        let before = self.tally.lost;
        let new = self.tally.accept(message.header().seq);
        self.counters.lost.set(self.counters.lost.get() + self.tally.lost - before);
        new
    }

    fn failed<E: std::fmt::Debug>(&self) -> impl FnOnce(E) -> Error {
        let name = self.spec.name;
        move |error| Error::shared_memory(format!("reading channel {name:?}"))(error)
    }
}

/// Which numbers of a channel have come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tally {
    /// The last number; `None` where the first one may be any.
    last: Option<u64>,
    lost: u64,
    /// Several writers, each with its own numbers: nothing can be told from them.
    many_writers: bool,
}

impl Tally {
    /// A channel begins with 1, and a process of the mission misses what came before it joined;
    /// an observer comes when it likes, and the pad shows what there is now: its successor has lost nothing of
    /// what was shown before.
    fn new(spec: &ChannelSpec, process: Process) -> Self {
        let comes_late = matches!(process, Process::Observer | Process::Pad);
        let last = (!comes_late).then_some(0);
        Self { last, lost: 0, many_writers: spec.writer.is_none() }
    }

    /// The last number that came; 0 before the first.
    fn position(&self) -> u64 {
        self.last.unwrap_or(0)
    }

    /// Counts the number; whether it is new.
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

/// The reading end of a channel of messages of type `T`.
pub struct Reader<T: Message> {
    port: Subscriber<ipc::Service, Wire<T>, ()>,
    inbox: Inbox,
}

impl<T: Message> Reader<T> {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let service = open_fixed::<T>(node, spec)?;
        let port = service.subscriber_builder().create();
        let port = port.map_err(Error::shared_memory(format!("reading channel {:?}", spec.name)))?;
        Ok(Self { port, inbox: Inbox::new(node, spec) })
    }

    /// The next message, where one has come. Messages whose number has come before are dropped.
    ///
    /// # Errors
    /// [`Error::SharedMemory`], also where more than eight samples of the channel are held.
    pub fn receive(&mut self) -> Result<Option<Sample<T>>> {
        while let Some(sample) = self.port.receive().map_err(self.inbox.failed())? {
            let sample = Sample { sample };
            if self.inbox.accept(&*sample) {
                return Ok(Some(sample));
            }
        }
        Ok(None)
    }

    /// The next valid message, where one has come; invalid ones are rejected and counted.
    ///
    /// # Errors
    /// As [`Reader::receive`].
    pub fn receive_valid(&mut self) -> Result<Option<Sample<T>>> {
        while let Some(sample) = self.receive()? {
            if sample.is_valid() {
                return Ok(Some(sample));
            }
            self.inbox.counters.count_refused();
        }
        Ok(None)
    }

    /// The number of the last message that came: where a successor is to go on.
    pub fn position(&self) -> u64 {
        self.inbox.tally.position()
    }

    /// Goes on after the message `seq`, which a checkpoint says has come: what the writer kept of
    /// earlier ones is dropped.
    pub fn resume_after(&mut self, seq: u64) {
        self.inbox.tally.last = Some(seq);
    }

    /// Hands `take` what the channel's writer, or one before it, has kept and this reader has not had. For
    /// a reader that goes on after its predecessor's death: a dead writer sends nothing again.
    ///
    /// # Errors
    /// [`Error::File`] where what was kept cannot be reached.
    pub fn take_kept(&mut self, node: &Node, mut take: impl FnMut(&T)) -> Result<()> {
        if self.inbox.spec.writer.is_some() {
            for message in Kept::<T>::open(node, self.inbox.spec)?.copy_after(self.position()) {
                if self.inbox.accept(&message) {
                    take(&message);
                }
            }
        }
        Ok(())
    }

    /// Messages that the numbers show to be missing.
    pub fn lost(&self) -> u64 {
        self.inbox.tally.lost
    }
}

/// A message in shared memory. Held, it keeps its place; a reader holds at most eight.
pub struct Sample<T: Message> {
    sample: iceoryx2::sample::Sample<ipc::Service, Wire<T>, ()>,
}

impl<T: Message> Deref for Sample<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.sample.payload().0
    }
}

/// The reading end of a channel of messages of type `T`, each with a slice of bytes behind it.
pub struct SliceReader<T: Message> {
    port: Subscriber<ipc::Service, [u8], Wire<T>>,
    inbox: Inbox,
}

impl<T: Message> SliceReader<T> {
    pub(crate) fn open(node: &Node, spec: &'static ChannelSpec) -> Result<Self> {
        let service = open_sliced::<T>(node, spec)?;
        let port = service.subscriber_builder().create();
        let port = port.map_err(Error::shared_memory(format!("reading channel {:?}", spec.name)))?;
        Ok(Self { port, inbox: Inbox::new(node, spec) })
    }

    /// As [`Reader::receive`]; at most two samples may be held.
    pub fn receive(&mut self) -> Result<Option<SliceSample<T>>> {
        while let Some(sample) = self.port.receive().map_err(self.inbox.failed())? {
            let sample = SliceSample { sample };
            if self.inbox.accept(sample.message()) {
                return Ok(Some(sample));
            }
        }
        Ok(None)
    }

    /// As [`Reader::position`].
    pub fn position(&self) -> u64 {
        self.inbox.tally.position()
    }

    /// As [`Reader::resume_after`].
    pub fn resume_after(&mut self, seq: u64) {
        self.inbox.tally.last = Some(seq);
    }

    /// Messages that the numbers show to be missing.
    pub fn lost(&self) -> u64 {
        self.inbox.tally.lost
    }
}

/// A message with a slice in shared memory. Held, it keeps its place; a reader holds at most two.
pub struct SliceSample<T: Message> {
    sample: iceoryx2::sample::Sample<ipc::Service, [u8], Wire<T>>,
}

impl<T: Message> SliceSample<T> {
    /// The message.
    pub fn message(&self) -> &T {
        &self.sample.user_header().0
    }

    /// The bytes behind it.
    pub fn bytes(&self) -> &[u8] {
        self.sample.payload()
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
    fn what_has_come_is_dropped_and_what_is_missing_counted() {
        let tally = Tally::new(SCAN.spec, Process::Planner);
        assert_eq!(accepted(tally, &[1, 2, 2, 1, 3, 6, 7]), (vec![1, 2, 3, 6, 7], 2));
        assert_eq!(accepted(tally, &[4]), (vec![4], 3));
    }

    #[test]
    fn an_observer_misses_nothing_before_it_came() {
        let tally = Tally::new(SCAN.spec, Process::Observer);
        assert_eq!(accepted(tally, &[40, 41, 43]), (vec![40, 41, 43], 1));
    }

    /// A pad that was killed in the middle of a mission had its successor report all that had been sent until then,
    /// 1675 messages, as lost.
    #[test]
    fn a_pad_that_was_started_again_has_lost_nothing_of_what_was_shown_before() {
        let tally = Tally::new(SCAN.spec, Process::Pad);
        assert_eq!(accepted(tally, &[400, 401, 403]), (vec![400, 401, 403], 1));
    }

    #[test]
    fn many_writers_count_for_themselves() {
        let tally = Tally::new(HEALTH.spec, Process::Recorder);
        assert_eq!(accepted(tally, &[1, 1, 2, 9]), (vec![1, 1, 2, 9], 0));
    }
}
