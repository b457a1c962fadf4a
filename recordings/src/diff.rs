//! Finds the first difference of two recordings.
//!
//! The messages of each channel are compared byte for byte, in the order of the channel. It does not matter how the channels
//! are interleaved. Health, faults and latency are left out because they depend on wall-clock time and chance, and transforms
//! because they are derived from the odometry. Both files are read side by side, and only the messages between the two
//! positions are kept in memory. [`Tolerances`] allow fields to differ slightly.

use std::collections::VecDeque;
use std::fmt;
use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::channels::{self, ChannelSpec, Role};
use sketchnav_schemas::time::seconds;

use crate::error::RecordingError;
use crate::reader::{Part, Parts, RawMessage, Recording};
use crate::writer::topic_name;

/// The first difference between two recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The channel.
    pub channel: &'static str,
    /// Sequence number of the message.
    pub seq: u64,
    /// Simulation time of the message, in seconds.
    pub stamp_s: f64,
    /// What differs.
    pub what: What,
}

/// The kind of a difference.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum What {
    /// The message is only in one of the recordings.
    OnlyIn(Side),
    /// A field differs.
    Field {
        /// Path of the field: `pose.x_px`, `ranges_m[3]`, `cells[17]`.
        field: String,
        /// Its value in the first recording.
        a: String,
        /// Its value in the second recording.
        b: String,
    },
    /// The bytes differ and are not messages of the channel's type.
    Bytes {
        /// Offset of the first byte that differs.
        offset: usize,
    },
}

/// One of the two recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} message {} at {:.3} s: ", self.channel, self.seq, self.stamp_s)?;
        match &self.what {
            What::OnlyIn(Side::A) => write!(f, "only in the first recording"),
            What::OnlyIn(Side::B) => write!(f, "only in the second recording"),
            What::Field { field, a, b } => write!(f, "{field} is {a} in the first, {b} in the second"),
            What::Bytes { offset } => write!(f, "byte {offset} differs"),
        }
    }
}

/// Returns the first difference of the recordings `a` and `b` by simulation time, or `None` if they are the same. Of several
/// differences at the same time, the one whose channel is first in the table of channels is returned.
///
/// # Errors
/// [`RecordingError`] if one of the recordings cannot be read.
pub fn diff(a: &Path, b: &Path) -> Result<Option<Difference>, RecordingError> {
    let (mut a, mut b) = (compared(a)?, compared(b)?);
    let compared = channels::all().filter(|spec| spec.is_recorded() && spec.role != Role::Report);
    let mut comparison = Comparison::of(compared, Tolerances::default());
    loop {
        let (from_a, from_b) = (a.next().transpose()?, b.next().transpose()?);
        if from_a.is_none() && from_b.is_none() {
            return Ok(comparison.finish());
        }
        for (side, message) in [(Side::A, from_a), (Side::B, from_b)] {
            if let Some(message) = message {
                comparison.take(side, message);
            }
        }
    }
}

fn compared(path: &Path) -> Result<impl Iterator<Item = Result<RawMessage, RecordingError>>, RecordingError> {
    let parts: Parts = Recording::open(path)?.parts()?;
    Ok(parts.filter_map(|part| match part {
        Ok(Part::Message(message)) => Some(Ok(message)),
        Ok(_) => None,
        Err(error) => Some(Err(error)),
    }))
}

/// The differences that are tolerated in the fields of messages.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tolerances(Vec<Tolerance>);

/// The difference that is tolerated in one field.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerance {
    /// The channel.
    pub channel: String,
    /// Path of the field, such as `pose.x_px`. `pose` stands for all fields in it, and `covariance` for all its entries.
    pub field: String,
    /// The largest tolerated difference.
    pub at_most: f64,
}

/// Parses channel, field and difference, as in `estimate.pose.x_px=0.5`.
impl std::str::FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (path, at_most) = text.split_once('=')?;
            let (channel, field) = path.trim().split_once('.')?;
            let at_most = at_most.trim().parse().ok().filter(|value: &f64| *value >= 0.0)?;
            let spec = channels::find(channel)?;
            Some((spec, Self { channel: channel.to_owned(), field: field.to_owned(), at_most }))
        };
        let (spec, tolerance) = parse().ok_or_else(|| {
            format!("expected CHANNEL.FIELD=NUMBER, such as estimate.pose.x_px=0.5, found {text:?}")
        })?;
        let layout = spec.message.layout();
        // The smallest number takes four bytes, so steps of four find every field.
        let mut leaves = (0..layout.size()).step_by(4).filter_map(|offset| layout.leaf_at(offset));
        let is_found = leaves.any(|leaf| tolerance.covers(&leaf.path));
        let known: Vec<_> = layout.fields.iter().map(|field| field.name).collect();
        let other = || {
            format!(
                "{channel} has no field {field}: expected one of {}",
                known.join(", "),
                channel = tolerance.channel,
                field = tolerance.field
            )
        };
        if is_found { Ok(tolerance) } else { Err(other()) }
    }
}

impl Tolerance {
    fn covers(&self, field: &str) -> bool {
        let rest = field.strip_prefix(self.field.as_str());
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    }
}

impl FromIterator<Tolerance> for Tolerances {
    fn from_iter<I: IntoIterator<Item = Tolerance>>(tolerances: I) -> Self {
        Self(tolerances.into_iter().collect())
    }
}

impl Tolerances {
    /// Returns true if this difference in a field is tolerated.
    fn forgive(&self, channel: &str, field: &str, a: Option<f64>, b: Option<f64>) -> bool {
        let own = self.0.iter().filter(|t| t.channel == channel && t.covers(field));
        let (Some(a), Some(b)) = (a, b) else { return false };
        own.map(|t| t.at_most).reduce(f64::max).is_some_and(|at_most| (a - b).abs() <= at_most)
    }
}

/// The messages of a channel that wait for the same message on the other side, and the first difference on the channel.
struct Lane {
    spec: &'static ChannelSpec,
    topic: String,
    waiting: [VecDeque<RawMessage>; 2],
    difference: Option<(u64, Difference)>,
    compared: u64,
}

/// Compares two streams of messages as they arrive.
pub struct Comparison {
    lanes: Vec<Lane>,
    tolerances: Tolerances,
}

impl Comparison {
    /// Creates a comparison of these channels.
    pub fn of(channels: impl IntoIterator<Item = &'static ChannelSpec>, tolerances: Tolerances) -> Self {
        let lane = |spec: &'static ChannelSpec| Lane {
            spec,
            topic: topic_name(spec.name),
            waiting: Default::default(),
            difference: None,
            compared: 0,
        };
        Self { lanes: channels.into_iter().map(lane).collect(), tolerances }
    }

    /// Returns true if messages of the topic are compared.
    pub fn is_about(&self, topic: &str) -> bool {
        self.lanes.iter().any(|lane| lane.topic == topic)
    }

    /// Takes the next message of one side.
    pub fn take(&mut self, side: Side, message: RawMessage) {
        let lane = self.lanes.iter_mut().find(|lane| lane.topic == message.topic.name);
        if let Some(lane) = lane.filter(|lane| lane.difference.is_none()) {
            lane.waiting[side as usize].push_back(message);
            lane.compare(&self.tolerances);
        }
    }

    /// Returns the number of messages that were found to be the same on both sides.
    pub fn same(&self) -> u64 {
        self.lanes.iter().map(|lane| lane.compared).sum()
    }

    /// Returns the earliest difference.
    pub fn finish(mut self) -> Option<Difference> {
        self.lanes.iter_mut().for_each(Lane::finish);
        let differences = self.lanes.into_iter().filter_map(|lane| lane.difference);
        differences.min_by_key(|(stamp_ns, _)| *stamp_ns).map(|(_, difference)| difference)
    }
}

impl Lane {
    fn compare(&mut self, tolerances: &Tolerances) {
        let [a, b] = &mut self.waiting;
        if a.is_empty() || b.is_empty() {
            return;
        }
        let (Some(a), Some(b)) = (a.pop_front(), b.pop_front()) else { return };
        match a.sequence.cmp(&b.sequence) {
            std::cmp::Ordering::Less => self.part(&a, What::OnlyIn(Side::A)),
            std::cmp::Ordering::Greater => self.part(&b, What::OnlyIn(Side::B)),
            std::cmp::Ordering::Equal if a.cdr != b.cdr => match explain(self.spec, &a, &b, tolerances) {
                None => self.compared += 1,
                Some(what) => self.part(&a, what),
            },
            std::cmp::Ordering::Equal => self.compared += 1,
        }
    }

    /// Reports a message that is still waiting, since it has no counterpart.
    fn finish(&mut self) {
        let [a, b] = &mut self.waiting;
        let rest = (a.pop_front().map(|m| (m, Side::A))).or(b.pop_front().map(|m| (m, Side::B)));
        if let (None, Some((message, side))) = (&self.difference, rest) {
            self.part(&message, What::OnlyIn(side));
        }
    }

    fn part(&mut self, message: &RawMessage, what: What) {
        let (channel, seq) = (self.spec.name, message.sequence.into());
        let stamp_s = seconds(message.stamp_ns);
        self.difference = Some((message.stamp_ns, Difference { channel, seq, stamp_s, what }));
        self.waiting = Default::default();
    }
}

/// Returns the difference between two messages with the same number, or `None` if all differences are tolerated.
fn explain(spec: &ChannelSpec, a: &RawMessage, b: &RawMessage, tolerances: &Tolerances) -> Option<What> {
    let offset = a.cdr.iter().zip(&b.cdr).position(|(a, b)| a != b);
    let bytes = What::Bytes { offset: offset.unwrap_or(a.cdr.len().min(b.cdr.len())) };
    field(spec, a, b, tolerances).unwrap_or(Some(bytes))
}

/// Returns the field that differs, or `Some(None)` if all differences are tolerated. Returns `None` if these are not messages
/// of the channel.
fn field(
    spec: &ChannelSpec,
    a: &RawMessage,
    b: &RawMessage,
    tolerances: &Tolerances,
) -> Option<Option<What>> {
    let (of_a, of_b) = (a.decode(spec).ok()?, b.decode(spec).ok()?);
    let (a, b) = (of_a.bytes(), of_b.bytes());
    let layout = spec.message.layout();
    let different = layout
        .differences(a, b)
        .find(|leaf| !tolerances.forgive(spec.name, &leaf.path, leaf.number(a), leaf.number(b)));
    if let Some(leaf) = different {
        return Some(Some(What::Field { a: leaf.show(a), b: leaf.show(b), field: leaf.path }));
    }
    Some(different_cells(of_a.cells(), of_b.cells()))
}

/// Returns the first difference in the cells that follow a message. If one slice begins with the other, their lengths differ.
fn different_cells(a: &[u8], b: &[u8]) -> Option<What> {
    let field = |field: String, a: usize, b: usize| What::Field { field, a: a.to_string(), b: b.to_string() };
    match a.iter().zip(b).position(|(a, b)| a != b) {
        Some(i) => Some(field(format!("cells[{i}]"), a[i].into(), b[i].into())),
        None => (a.len() != b.len()).then(|| field("length of cells".to_owned(), a.len(), b.len())),
    }
}
