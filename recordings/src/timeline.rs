//! The messages of a recording in order of time.
//!
//! A recorder drains one channel after another, so in the file, a scan may precede the odometry of the same
//! instant. Here, the messages of each instant are in the order of the table of channels: the readings, the
//! tick, and then the messages that follow from it. Only the chunks whose times overlap are kept in memory.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use std::path::Path;

use sketchnav_schemas::channels;
use sketchnav_schemas::ros2::transforms::TF_STATIC;

use crate::content::RawMessage;
use crate::error::RecordingError;
use crate::index::Index;
use crate::records::ChunkEntry;
use crate::selection::{Selected, Selection};

/// Returns the rank of a topic within an instant. Transforms that never change come first. Topics that are not part of an
/// instant come last, in the order of the file.
fn rank(topic: &str) -> usize {
    if topic == TF_STATIC { 0 } else { 1 + channels::place_of(topic) }
}

/// An iterator over messages in order of time. See [`crate::Recording::timeline`].
pub struct Timeline {
    selected: Selected,
    /// The chunks that have not been read yet, the earliest first.
    chunks: VecDeque<ChunkEntry>,
    waiting: BinaryHeap<Waiting>,
    taken: u64,
    is_over: bool,
}

struct Waiting {
    key: (u64, usize, u64),
    message: RawMessage,
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl Eq for Waiting {}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiting {
    /// Reverses the order, since the heap's greatest element must be the earliest message.
    fn cmp(&self, other: &Self) -> Ordering {
        other.key.cmp(&self.key)
    }
}

impl Timeline {
    pub(crate) fn of(path: &Path, index: &Index, selection: Selection) -> Result<Self, RecordingError> {
        let mut chunks = selection.chunks(index);
        chunks.sort_by_key(|chunk| (chunk.first_ns, chunk.at));
        let selected = Selected::of(path, index, selection)?;
        let (waiting, chunks) = (BinaryHeap::new(), chunks.into());
        Ok(Self { selected, chunks, waiting, taken: 0, is_over: false })
    }

    /// Returns the number of bytes of the file that have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.selected.bytes_read()
    }

    /// Reads all chunks that may contain a message as early as the earliest one waiting.
    fn read_ahead(&mut self) -> Result<(), RecordingError> {
        let Self { selected, chunks, waiting, taken, .. } = self;
        loop {
            let earliest = waiting.peek().map(|first| first.key.0);
            let due = chunks.front().is_some_and(|chunk| earliest.is_none_or(|ns| chunk.first_ns <= ns));
            let Some(chunk) = due.then(|| chunks.pop_front()).flatten() else { return Ok(()) };
            selected.of_chunk(chunk, |message| {
                *taken += 1;
                let key = (message.stamp_ns, rank(&message.topic.name), *taken);
                waiting.push(Waiting { key, message });
            })?;
        }
    }
}

impl Iterator for Timeline {
    type Item = Result<RawMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        match self.read_ahead() {
            Ok(()) => self.waiting.pop().map(|first| Ok(first.message)),
            Err(error) => {
                self.is_over = true;
                Some(Err(error))
            }
        }
    }
}
