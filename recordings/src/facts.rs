//! Facts about a recording's topics and processes that are known without reading all messages again.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Health;

use crate::error::RecordingError;
use crate::sequence::{Gap, MAX_GAPS, Seen, Sequence};

/// Facts about a topic that are stored in the recording, so that not all messages have to be read.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TopicFacts {
    /// Times of the earliest and the latest message, in nanoseconds.
    pub times_ns: Option<(u64, u64)>,
    /// Number of missing messages according to the sequence numbers.
    pub missing: u64,
    /// The first gaps.
    pub gaps: Vec<Gap>,
}

impl TopicFacts {
    /// Takes the time of a message into account.
    pub(crate) fn see_time(&mut self, ns: u64) {
        self.times_ns = Some(self.times_ns.map_or((ns, ns), |(first, last)| (first.min(ns), last.max(ns))));
    }

    /// Processes the sequence number of a message, and counts what is missing before it. If several processes
    /// write the channel, each with its own numbers, the numbers mean nothing, and every message counts as
    /// new.
    pub(crate) fn see_number(&mut self, sequence: &mut Sequence, has_many_writers: bool, seq: u64) -> Seen {
        if has_many_writers {
            return Seen::New { missing: 0 };
        }
        let after_seq = sequence.last();
        let seen = sequence.see(seq);
        if let Seen::New { missing: missing @ 1.. } = seen {
            self.missing += missing;
            if self.gaps.len() < MAX_GAPS {
                self.gaps.push(Gap { after_seq, missing });
            }
        }
        seen
    }

    pub(crate) fn to_json(&self) -> Result<String, RecordingError> {
        let wrong =
            |error: serde_json::Error| RecordingError::Run { what: "topics", reason: error.to_string() };
        serde_json::to_string(self).map_err(wrong)
    }
}

/// Counts how often processes were restarted, by the process ids in their messages.
#[derive(Debug, Default)]
pub(crate) struct Lives([Option<(u32, u64)>; MAX_PROCESSES]);

/// Upper bound on the number of kinds of processes.
const MAX_PROCESSES: usize = 16;

impl Lives {
    pub(crate) fn see(&mut self, health: &Health) {
        let Some(life) = self.0.get_mut(health.process as usize) else { return };
        let is_next = life.is_some_and(|(pid, _)| pid != health.pid);
        *life = Some((health.pid, life.map_or(0, |(_, restarts)| restarts) + u64::from(is_next)));
    }

    /// Returns the restarts of each process that reported anything. Observers are left out, because they are not processes
    /// of the system.
    pub(crate) fn restarts(&self) -> BTreeMap<String, String> {
        let lives =
            self.0.iter().zip(0..).filter_map(|(life, code)| Some((Process::from_code(code)?, (*life)?)));
        let lives = lives.filter(|(process, _)| *process != Process::Observer);
        lives.map(|(process, (_, restarts))| (process.word().to_owned(), restarts.to_string())).collect()
    }
}
