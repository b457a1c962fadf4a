//! Counts missing messages by the sequence numbers of a channel.

use serde::{Deserialize, Serialize};

/// Maximum number of gaps of a topic that are listed individually.
pub(crate) const MAX_GAPS: usize = 16;

/// Status of a message, as determined by its sequence number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// The message is new.
    New {
        /// Number of messages missing before it.
        missing: u64,
    },
    /// The number was seen before. A restarted writer repeats messages that it may already have sent.
    Again,
}

/// A gap in the sequence numbers of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gap {
    /// The last number before the gap, or 0 if the beginning is missing.
    pub after_seq: u64,
    /// Number of missing messages.
    pub missing: u64,
}

/// Follows the sequence numbers of a channel that is written by a single process: 1, 2, 3 …
#[derive(Debug, Clone, Default)]
pub struct Sequence {
    last: u64,
    missing: u64,
}

impl Sequence {
    /// Continues after the number `last`. Messages up to that number do not count as missing.
    pub fn after(last: u64) -> Self {
        Self { last, missing: 0 }
    }

    /// Processes the sequence number of the next message.
    pub fn see(&mut self, seq: u64) -> Seen {
        if seq <= self.last {
            return Seen::Again;
        }
        let missing = seq - self.last - 1;
        self.missing += missing;
        self.last = seq;
        Seen::New { missing }
    }

    /// Returns the largest number so far, or 0 if there was none.
    pub fn last(&self) -> u64 {
        self.last
    }

    /// Returns the number of sequence numbers below the largest that were never seen.
    pub fn missing(&self) -> u64 {
        self.missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_repetitions_are_counted() {
        let mut sequence = Sequence::default();
        assert_eq!(sequence.see(2), Seen::New { missing: 1 });
        assert_eq!(sequence.see(3), Seen::New { missing: 0 });
        assert_eq!(sequence.see(3), Seen::Again);
        assert_eq!(sequence.see(7), Seen::New { missing: 3 });
        assert_eq!((sequence.last(), sequence.missing()), (7, 4));
    }
}
