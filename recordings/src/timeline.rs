//! The messages of a recording in the order of their times.
//!
//! A recorder drains one channel after the other, so that in the file a scan may stand before the
//! odometry of its instant. Here each instant has the rhythm of a step: what touches, the truth, the
//! odometry, the scan, then what came of it. Keeps no more in memory than the chunks whose times overlap.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use std::path::Path;

use sketchnav_schemas::channels::{
    COMMAND, CONTACT, DRAWING, ESTIMATE, LATENCY, MISSION, ODOMETRY, ORDERS, PARTICLES, PLAN, ROUTE, SCAN,
    SKETCH, SONAR, STATUS, TRUTH, UNDERSTOOD,
};

use crate::error::RecordingError;
use crate::index::Index;
use crate::parts::{Selected, Selection};
use crate::reader::RawMessage;
use crate::records::ChunkEntry;

/// The order of an instant; what is not in it comes last, in the order of the file.
const RHYTHM: [&str; 17] = [
    DRAWING.spec.name,
    SKETCH.spec.name,
    ROUTE.spec.name,
    UNDERSTOOD.spec.name,
    MISSION.spec.name,
    ORDERS.spec.name,
    CONTACT.spec.name,
    TRUTH.spec.name,
    ODOMETRY.spec.name,
    SCAN.spec.name,
    SONAR.spec.name,
    PARTICLES.spec.name,
    ESTIMATE.spec.name,
    PLAN.spec.name,
    COMMAND.spec.name,
    STATUS.spec.name,
    LATENCY.spec.name,
];

/// What never changes comes before the rhythm.
fn rank(topic: &str) -> usize {
    let name = topic.strip_prefix('/').unwrap_or(topic);
    match RHYTHM.iter().position(|known| *known == name) {
        _ if name == "tf_static" => 0,
        Some(place) => 1 + place,
        None => 1 + RHYTHM.len(),
    }
}

/// Messages in the order of their times: see [`crate::Recording::timeline`].
pub struct Timeline {
    selected: Selected,
    /// Those not yet read, the earliest first.
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
    /// The heap's greatest is the earliest.
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

    /// How many bytes of the file were read so far.
    pub fn bytes_read(&self) -> u64 {
        self.selected.bytes_read()
    }

    /// Reads the chunks that may hold a message as early as the earliest that waits.
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

#[cfg(test)]
mod tests {
    use sketchnav_schemas::channels::{FAULTS, HEALTH, TABLE};

    use super::*;

    /// `rerun` and `replay` take the inputs of a core in this order: a channel that is not in it would come
    /// after everything that it is the cause of.
    #[test]
    fn every_recorded_channel_has_its_place_in_the_rhythm() {
        let told_of_others = [HEALTH.spec.name, FAULTS.spec.name];
        for spec in TABLE.iter().filter(|spec| spec.recorded) {
            let has_place = rank(&format!("/{}", spec.name)) <= RHYTHM.len();
            assert_eq!(has_place, !told_of_others.contains(&spec.name), "{}", spec.name);
        }
        assert!(rank("/tf_static") < rank("/sketch") && rank("/odometry") < rank("/scan"));
    }
}
