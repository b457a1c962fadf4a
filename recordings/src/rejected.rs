//! Counts the invalid messages of a recording by the reason why they are invalid. Readers reject such messages, so they have
//! no effect on localization or driving.

use serde::Serialize;
use sketchnav_schemas::channels::{ChannelSpec, Role};
use sketchnav_schemas::ros2::{PLANAR, Ros2Error};
use sketchnav_schemas::time::seconds;
use sketchnav_schemas::valid::Invalid;

use crate::error::RecordingError;
use crate::reader::RawMessage;

/// The reason for messages that are not of their topic's type.
const UNREADABLE: &str = "expected a message of the topic's type";
/// The reason for messages that are damaged. See [`RawMessage::is_damaged`].
pub(crate) const DAMAGED: &str = "expected a message that zstd can unpack, found a damaged one";

/// Messages of a topic with the same fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejected {
    /// The topic.
    pub topic: String,
    /// The reason: what is wrong, and what was expected.
    pub why: String,
    /// The value found in the first of these messages.
    pub found: Option<f64>,
    /// Number of these messages.
    pub messages: u64,
    /// Time of the first of these messages, in seconds.
    pub first_s: f64,
    /// Sequence number of the first of these messages.
    pub first: u64,
}

impl std::fmt::Display for Rejected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { topic, why, found, messages, first_s, first } = self;
        let noun = if *messages == 1 { "message" } else { "messages" };
        write!(f, "{messages} {noun} of {topic}: {why}")?;
        found.map_or(Ok(()), |found| write!(f, ", found {found}"))?;
        write!(f, " (the first is number {first}, at {first_s:.3} s)")
    }
}

/// Counts rejected messages.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Rejections(Vec<Rejected>);

impl Rejections {
    /// Returns the counts by topic and reason, in order of first occurrence.
    pub fn list(&self) -> &[Rejected] {
        &self.0
    }

    /// Returns true if nothing was rejected.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the total number of rejected messages.
    pub fn messages(&self) -> u64 {
        self.0.iter().map(|one| one.messages).sum()
    }

    /// Counts a message that was rejected.
    pub fn count(&mut self, raw: &RawMessage, invalid: &Invalid) {
        let why = format!("{}: expected {}", invalid.field, invalid.expected);
        self.add(raw, why, Some(invalid.found));
    }

    /// Counts a message that could not be decoded.
    pub fn count_undecoded(&mut self, raw: &RawMessage, error: &RecordingError) {
        match error {
            RecordingError::Message { source: Ros2Error::NotZero { offset, found, .. }, .. } => {
                self.add(raw, format!("byte {offset}: expected {PLANAR}"), Some(*found));
            }
            _ => self.add(raw, UNREADABLE.to_owned(), None),
        }
    }

    /// Counts a message that is damaged.
    pub fn count_damaged(&mut self, raw: &RawMessage) {
        self.add(raw, DAMAGED.to_owned(), None);
    }

    /// Adds the counts of `others`.
    pub fn extend(&mut self, others: &Self) {
        for other in &others.0 {
            match self.0.iter_mut().find(|one| one.topic == other.topic && one.why == other.why) {
                Some(one) => one.messages += other.messages,
                None => self.0.push(other.clone()),
            }
        }
    }

    /// Counts the message if it is invalid. Only the messages that processes act upon are checked: sensor readings, ticks,
    /// and the replies to ticks.
    pub fn look_at(&mut self, raw: &RawMessage, spec: &ChannelSpec) {
        if !is_acted_upon(spec) || raw.topic.ros2_type != spec.message.ros2 {
            return;
        }
        match raw.decode(spec) {
            Ok(message) => self.check(raw, spec, message.bytes()),
            Err(error) => self.count_undecoded(raw, &error),
        }
    }

    /// Like [`Rejections::look_at`], but for a message that has already been decoded.
    pub fn check(&mut self, raw: &RawMessage, spec: &ChannelSpec, message: &[u8]) {
        if let (true, Err(invalid)) = (is_acted_upon(spec), spec.message.check(message)) {
            self.count(raw, &invalid);
        }
    }

    fn add(&mut self, raw: &RawMessage, why: String, found: Option<f64>) {
        let topic = &raw.topic.name;
        match self.0.iter_mut().find(|one| one.topic == *topic && one.why == why) {
            Some(one) => one.messages += 1,
            None => self.0.push(Rejected {
                topic: topic.clone(),
                why,
                found,
                messages: 1,
                first_s: seconds(raw.stamp_ns),
                first: raw.sequence.into(),
            }),
        }
    }
}

fn is_acted_upon(spec: &ChannelSpec) -> bool {
    matches!(spec.role, Role::Sensor | Role::Tick | Role::Situation | Role::Command)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytemuck::Zeroable;
    use sketchnav_schemas::channels::ODOMETRY;
    use sketchnav_schemas::message::{Header, Odometry};
    use sketchnav_schemas::ros2::Ros2;

    use super::*;
    use crate::reader::Topic;

    fn odometry(seq: u64, length: f64) -> RawMessage {
        let stamp_ns = seq * 100_000_000;
        let mut message =
            Odometry { header: Header { seq, stamp_ns, source_seq: seq }, ..Odometry::zeroed() };
        message.pose.orientation_w = length;
        let mut cdr = Vec::new();
        message.to_cdr(&[], &mut cdr).unwrap();
        let topic = Arc::new(Topic {
            name: "/odometry".to_owned(),
            ros2_type: ODOMETRY.spec.message.ros2.to_owned(),
            encoding: "cdr".to_owned(),
            schema: Arc::default(),
            metadata: Default::default(),
        });
        RawMessage { topic, sequence: seq as u32, stamp_ns, publish_ns: stamp_ns, cdr }
    }

    /// Returns the message with this x and y in its orientation, whose w is 1.
    fn tilted(mut raw: RawMessage, [x, y]: [f64; 2]) -> RawMessage {
        let w = raw.cdr.windows(8).position(|bytes| bytes == 1.0_f64.to_le_bytes()).unwrap();
        raw.cdr[w - 24..w - 16].copy_from_slice(&x.to_le_bytes());
        raw.cdr[w - 16..w - 8].copy_from_slice(&y.to_le_bytes());
        raw
    }

    /// Regression test: a driver sent quaternions of length 0.5. There were no estimates, and no reason was given. For tilted
    /// quaternions the given reason was that the messages are not odometry.
    #[test]
    fn invalid_messages_are_counted_with_their_reason() {
        let mut rejections = Rejections::default();
        for (seq, length) in [(1, 1.0), (2, 0.5), (3, 0.25), (4, f64::NAN)] {
            rejections.look_at(&odometry(seq, length), ODOMETRY.spec);
        }
        let mut cut = odometry(5, 1.0);
        cut.cdr.truncate(10);
        rejections.look_at(&cut, ODOMETRY.spec);
        rejections.look_at(&tilted(odometry(6, 1.0), [0.25, 0.25]), ODOMETRY.spec);
        rejections.look_at(&tilted(odometry(7, 1.0), [-0.0, 1e-17]), ODOMETRY.spec);
        let words: Vec<_> = rejections.list().iter().map(Rejected::to_string).collect();
        let expected = [
            "3 messages of /odometry: pose: expected an orientation of length 1, found 0.5 (the first is number 2, at 0.200 s)",
            "1 message of /odometry: expected a message of the topic's type (the first is number 5, at 0.500 s)",
            "1 message of /odometry: byte 68: expected 0, as in a planar pose without tilt or covariance, found 0.25 (the first is number 6, at 0.600 s)",
        ];
        assert_eq!((words, rejections.messages()), (expected.map(str::to_owned).into(), 5));
    }
}
