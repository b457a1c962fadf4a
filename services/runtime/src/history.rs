//! The last messages of a channel, stored so that its writer can send them again after a restart.
//!
//! In iceoryx2 0.10, a dead writer's samples and its history die with it. A writer therefore stores each message here before it
//! sends it, and the restarted writer sends the stored messages again. Readers recognize a message that they already have by its
//! number and drop it, while a reader that joins late finds a history. A kill at any time leaves at most one unreadable entry: the
//! one being written, whose message no reader has received yet.
//!
//! Readers of the channel never access this, with one exception: a recorder that was restarted, because the writer that could send
//! the missed messages again may have ended or died. Each entry also stores when its message was sent, by the monotonic clock. The
//! message itself contains nothing that would differ between two runs.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst, fence};

use nix::time::{ClockId, clock_gettime};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::erased;
use sketchnav_schemas::message::Header;

use crate::Result;
use crate::mapping::{Mapping, WORD};
use crate::node::Node;

/// Format version of the entries. Entries of another version are ignored.
const ENTRIES: u64 = 2;
/// Number of words before an entry's message: its number and its send time.
const BEFORE: usize = 2;

/// The stored messages of a channel, as many as the channel's history contains. Each is preceded by its number (0 if the entry is
/// empty) and its send time. For a message with cells, only the header is stored, since the restarted writer computes the message
/// again.
pub(crate) struct History {
    mapping: Mapping,
    capacity: u64,
    /// Number of words that are stored of each message.
    length: usize,
    last_seq: u64,
}

impl History {
    /// Opens the history stored by the channel's last writer.
    pub(crate) fn open(node: &Node, spec: &ChannelSpec) -> Result<Self> {
        // Another build's messages are never mistaken for this one's.
        let fingerprint = spec.message.fingerprint() ^ ENTRIES;
        let name = format!("history_{}_{:08x}", spec.name, fingerprint as u32);
        let length = if spec.max_cells > 0 { size_of::<Header>() } else { spec.message.size };
        Self::open_at(&node.system().shared_memory(&name)?, spec.history(), length)
    }

    fn open_at(path: &Path, capacity: usize, length: usize) -> Result<Self> {
        assert!(length.is_multiple_of(WORD), "a message is made of words");
        let length = length / WORD;
        let mapping = Mapping::open(path, capacity * (BEFORE + length))?;
        let mut history = Self { mapping, capacity: capacity as u64, length, last_seq: 0 };
        history.last_seq = history.newest();
        Ok(history)
    }

    /// Returns the number of the latest message in the file, including those that a running writer has stored since it was opened.
    fn newest(&self) -> u64 {
        (0..self.capacity).map(|i| self.number(i).load(SeqCst)).max().unwrap_or(0)
    }

    /// Returns the number of the latest message, or 0 if there is none.
    pub(crate) fn last_seq(&self) -> u64 {
        self.last_seq
    }

    /// Stores as many words of a message as fit into an entry. The message must already have its number.
    pub(crate) fn keep(&mut self, message: &[u64]) {
        let seq = erased::header(bytemuck::cast_slice(message)).seq;
        let index = self.index(seq);
        // The process may be killed between any two of these lines.
        self.number(index).store(0, SeqCst);
        fence(SeqCst);
        self.mapping.write(self.entry(index) + BEFORE, &message[..self.length]);
        self.word(index, 1).store(monotonic_ns(), SeqCst);
        fence(SeqCst);
        self.number(index).store(seq, SeqCst);
        self.last_seq = seq;
    }

    /// Calls `take` with a copy of each message after `seq`, oldest first. This is safe while the writer is running, because an
    /// entry that is being written is skipped.
    pub(crate) fn for_each_after(&self, seq: u64, mut take: impl FnMut(&[u64])) {
        let first = self.last_seq.saturating_sub(self.capacity).max(seq) + 1;
        let mut copy = vec![0; self.length];
        for seq in first..=self.last_seq {
            if self.read(seq, &mut copy) {
                take(&copy);
            }
        }
    }

    /// Returns a copy of the latest message, or of its header if it has cells.
    pub(crate) fn last(&self) -> Option<Vec<u64>> {
        let mut copy = vec![0; self.length];
        self.read(self.last_seq, &mut copy).then_some(copy)
    }

    /// Copies the message `seq`. Returns true if it was there both before and after copying.
    fn read(&self, seq: u64, into: &mut [u64]) -> bool {
        let index = self.index(seq);
        let is_there = || seq > 0 && self.number(index).load(SeqCst) == seq;
        if !is_there() {
            return false;
        }
        self.mapping.read(self.entry(index) + BEFORE, into);
        fence(SeqCst);
        is_there()
    }

    fn index(&self, seq: u64) -> u64 {
        seq.wrapping_sub(1) % self.capacity
    }

    fn number(&self, index: u64) -> &AtomicU64 {
        self.word(index, 0)
    }

    /// Returns the index of an entry's first word.
    fn entry(&self, index: u64) -> usize {
        index as usize * (BEFORE + self.length)
    }

    /// Returns a word of an entry, which consists of the number, the time, and the message. The message begins with the three
    /// words of its header.
    fn word(&self, index: u64, word: usize) -> &AtomicU64 {
        &self.mapping.words()[self.entry(index) + word]
    }
}

/// Returns the monotonic time since boot, common to all processes, in nanoseconds, or 0 if there is no such clock.
fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::CLOCK_MONOTONIC);
    now.map_or(0, |now| now.tv_sec() as u64 * 1_000_000_000 + now.tv_nsec() as u64)
}

/// Send times of a channel's messages, as far back as its history goes. They can be read while the writer is running.
pub struct SendTimes(History);

/// A message that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sent {
    /// The message's number, time and cause.
    pub header: Header,
    /// Send time of the message, in nanoseconds of the clock that all processes of the machine share.
    pub at_ns: u64,
}

impl SendTimes {
    /// Opens the history of a channel of `node`'s system that has one writer.
    ///
    /// # Errors
    /// [`crate::Error`] if shared memory fails.
    pub fn open(node: &Node, spec: &ChannelSpec) -> Result<Self> {
        Ok(Self(History::open(node, spec)?))
    }

    /// Returns the number of the latest message, or 0 before the first.
    pub fn newest(&self) -> u64 {
        self.0.newest()
    }

    /// Returns the message `seq`, or `None` if it is no longer stored or has not been sent yet.
    pub fn of(&self, seq: u64) -> Option<Sent> {
        let index = self.0.index(seq);
        let is_there = || seq > 0 && self.0.number(index).load(SeqCst) == seq;
        if !is_there() {
            return None;
        }
        let [at_ns, _, stamp_ns, source_seq] = [1, 2, 3, 4].map(|word| self.0.word(index, word).load(SeqCst));
        fence(SeqCst);
        is_there().then_some(Sent { header: Header { seq, stamp_ns, source_seq }, at_ns })
    }

    /// Returns the latest message caused by the tick `source_seq`.
    pub fn caused_by(&self, source_seq: u64) -> Option<Sent> {
        let newest = self.newest();
        let oldest = newest.saturating_sub(self.0.capacity) + 1;
        let sent = (oldest..=newest).rev().filter_map(|seq| self.of(seq));
        let mut sent = sent.skip_while(|sent| sent.header.source_seq > source_seq);
        sent.next().filter(|sent| sent.header.source_seq == source_seq)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::VelocityCommand;

    fn open(path: &Path) -> Result<History> {
        History::open_at(path, 4, size_of::<VelocityCommand>())
    }

    fn command(seq: u64) -> VelocityCommand {
        let mut command = VelocityCommand::zeroed();
        (command.header.seq, command.header.stamp_ns) = (seq, 100 * seq);
        command
    }

    fn words(command: VelocityCommand) -> Vec<u64> {
        bytemuck::cast_slice(&[command]).to_vec()
    }

    fn numbers(history: &History) -> Vec<u64> {
        let mut numbers = Vec::new();
        history.for_each_after(0, |message| {
            let header = erased::header(bytemuck::cast_slice(message));
            assert_eq!(header.stamp_ns, 100 * header.seq);
            numbers.push(header.seq);
        });
        numbers
    }

    #[test]
    fn a_successor_finds_the_last_messages() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history");
        for (first, last, found) in [(1, 2, 1..=2), (3, 4, 1..=4), (5, 9, 6..=9)] {
            let mut history = open(&path).unwrap();
            assert_eq!(history.last_seq(), first - 1);
            (first..=last).for_each(|seq| history.keep(&words(command(seq))));
            assert_eq!(numbers(&open(&path).unwrap()), found.collect::<Vec<_>>());
        }
    }

    #[test]
    fn observers_see_when_each_message_was_sent() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history");
        let times = SendTimes(open(&path).unwrap());
        assert_eq!((times.newest(), times.of(0), times.of(1), times.caused_by(0)), (0, None, None, None));
        let mut history = open(&path).unwrap();
        let before = monotonic_ns();
        for seq in 1..=6 {
            let mut command = command(seq);
            command.header.source_seq = 10 * seq;
            history.keep(&words(command));
        }
        assert_eq!((times.newest(), times.of(2), times.of(7)), (6, None, None));
        let sent: Vec<_> = (3..=6).map(|seq| times.of(seq).unwrap()).collect();
        assert!(before <= sent[0].at_ns && sent.is_sorted_by_key(|sent| sent.at_ns), "{sent:?}");
        assert_eq!(sent[2].header, Header { seq: 5, stamp_ns: 500, source_seq: 50 });
        assert_eq!((times.caused_by(50), times.caused_by(55)), (Some(sent[2]), None));
    }

    /// After a kill between the lines of `keep`, the oldest message has been removed, and the new one is not there yet.
    #[test]
    fn a_half_written_entry_is_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history");
        let mut history = open(&path).unwrap();
        (1..=6).for_each(|seq| history.keep(&words(command(seq))));
        history.number(history.index(7)).store(0, SeqCst);
        let successor = open(&path).unwrap();
        assert_eq!((successor.last_seq(), numbers(&successor)), (6, vec![4, 5, 6]));
    }
}
