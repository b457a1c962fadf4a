//! The last messages of a channel, kept for its writer's successor.
//!
//! A dead writer's samples and its history go with it (iceoryx2 0.10). So a writer notes each message
//! here before it sends it, and its successor sends again what is here: whoever has had a message drops
//! it by its number, whoever has not gets it, and a reader that comes late finds a history. A kill at
//! any moment leaves at most the entry unreadable that was being written, whose message nobody has.
//!
//! Readers of the channel never look here, but for the recorder that goes on after its predecessor's
//! death: whoever could send it again what it has missed may be dead too, or have ended.

use std::marker::PhantomData;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst, fence};

use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::message::{Message, fingerprint};

use crate::Result;
use crate::mapping::Mapping;
use crate::node::Node;
use crate::wire::type_name;

/// Length of an entry's number, bytes.
const NUMBER: usize = size_of::<u64>();

/// As many messages as the channel's history holds, each behind its number; 0 where an entry is empty.
pub(crate) struct Kept<T> {
    mapping: Mapping,
    capacity: u64,
    last_seq: u64,
    message: PhantomData<T>,
}

impl<T: Message> Kept<T> {
    /// Opens what the channel's last writer kept.
    pub(crate) fn open(node: &Node, spec: &ChannelSpec) -> Result<Self> {
        // Another build's messages are never taken for this one's.
        let name = format!("kept_{}_{:08x}", spec.name, fingerprint(type_name::<T>()) as u32);
        Self::open_at(&node.system().shared_memory(&name), spec.history.max(1))
    }

    fn open_at(path: &Path, capacity: usize) -> Result<Self> {
        const { assert!(size_of::<T>().is_multiple_of(NUMBER), "entries stay aligned") };
        let mapping = Mapping::open(path, capacity * Self::ENTRY)?;
        let mut kept = Self { mapping, capacity: capacity as u64, last_seq: 0, message: PhantomData };
        kept.last_seq = (0..kept.capacity).map(|i| kept.number(i).load(SeqCst)).max().unwrap_or(0);
        Ok(kept)
    }

    const ENTRY: usize = NUMBER + size_of::<T>();

    /// The number of the newest message; 0 where there is none.
    pub(crate) fn last_seq(&self) -> u64 {
        self.last_seq
    }

    /// Notes a message that has its number.
    pub(crate) fn keep(&mut self, message: &T) {
        let seq = message.header().seq;
        let index = self.index(seq);
        // The process may be killed between any two of these lines.
        self.number(index).store(0, SeqCst);
        fence(SeqCst);
        let begin = index as usize * Self::ENTRY + NUMBER;
        self.mapping.bytes_mut()[begin..begin + size_of::<T>()].copy_from_slice(bytemuck::bytes_of(message));
        fence(SeqCst);
        self.number(index).store(seq, SeqCst);
        self.last_seq = seq;
    }

    /// The messages, oldest first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        let first = self.last_seq.saturating_sub(self.capacity) + 1;
        (first..=self.last_seq).filter_map(|seq| self.get(seq))
    }

    /// Copies the messages after `seq`, oldest first, while their writer may be at work: what it writes
    /// at the same moment is left out.
    pub(crate) fn copy_after(&self, seq: u64) -> Vec<T> {
        let first = self.last_seq.saturating_sub(self.capacity).max(seq) + 1;
        let copy = |seq| {
            let message = *self.get(seq)?;
            fence(SeqCst);
            self.get(seq).map(|_| message)
        };
        (first..=self.last_seq).filter_map(copy).collect()
    }

    /// The newest message.
    pub(crate) fn last(&self) -> Option<&T> {
        self.get(self.last_seq)
    }

    fn get(&self, seq: u64) -> Option<&T> {
        let index = self.index(seq);
        if seq == 0 || self.number(index).load(SeqCst) != seq {
            return None;
        }
        let begin = index as usize * Self::ENTRY + NUMBER;
        Some(bytemuck::from_bytes(&self.mapping.bytes()[begin..begin + size_of::<T>()]))
    }

    fn index(&self, seq: u64) -> u64 {
        seq.wrapping_sub(1) % self.capacity
    }

    fn number(&self, index: u64) -> &AtomicU64 {
        self.mapping.number(index as usize * Self::ENTRY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::message::VelocityCommand;

    fn command(seq: u64) -> VelocityCommand {
        let mut command = VelocityCommand::zeroed();
        (command.header.seq, command.header.stamp_ns) = (seq, 100 * seq);
        command
    }

    fn numbers(kept: &Kept<VelocityCommand>) -> Vec<u64> {
        kept.iter()
            .inspect(|m| assert_eq!(m.header.stamp_ns, 100 * m.header.seq))
            .map(|m| m.header.seq)
            .collect()
    }

    #[test]
    fn a_successor_finds_the_last_messages() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept");
        for (first, last, found) in [(1, 2, 1..=2), (3, 4, 1..=4), (5, 9, 6..=9)] {
            let mut kept = Kept::open_at(&path, 4).unwrap();
            assert_eq!(kept.last_seq(), first - 1);
            (first..=last).for_each(|seq| kept.keep(&command(seq)));
            assert_eq!(numbers(&Kept::open_at(&path, 4).unwrap()), found.collect::<Vec<_>>());
        }
    }

    /// Killed between the lines of `keep`: the oldest message is gone, the new one not there.
    #[test]
    fn a_message_that_was_being_noted_is_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept");
        let mut kept = Kept::open_at(&path, 4).unwrap();
        (1..=6).for_each(|seq| kept.keep(&command(seq)));
        kept.number(kept.index(7)).store(0, SeqCst);
        let successor = Kept::<VelocityCommand>::open_at(&path, 4).unwrap();
        assert_eq!((successor.last_seq(), numbers(&successor)), (6, vec![4, 5, 6]));
    }
}
