//! Executes the core of one service again on the inputs in a recording.
//!
//! Inputs arrive in order of their timestamps, and those of the same instant in the order of a step. Since a process takes its
//! inputs by their timestamps, this is the order in which it saw them the first time.
//!
//! In real time, two things are not recorded and so cannot be repeated: which command had arrived by the time the world moved
//! on, and between which two estimates an order reached the planner.

mod subject;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use sketchnav_recordings::diff::{Comparison, Difference, Side, Tolerances};
use sketchnav_recordings::reader::{RawMessage, Selection, Topic};
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_recordings::writer::{Writer, topic_name};
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::{self, Channel, ChannelSpec, MISSION, ORDERS, Role};
use sketchnav_schemas::codes::{Order, Process};
use sketchnav_schemas::erased::{self, Spare};
use sketchnav_schemas::message::MissionCommand;
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_schemas::time::seconds;

use crate::{RehearsalError, Tap};
use subject::Subject;

/// The reason why a service cannot be executed again.
#[derive(Debug, thiserror::Error)]
pub enum RerunError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The service's files or parameters are unusable.
    #[error(transparent)]
    Core(#[from] RehearsalError),
    /// The process has no core to execute.
    #[error("{process}: expected world, sketcher, localizer or planner")]
    Process {
        /// The process.
        process: Process,
    },
    /// The process is the world, and the recording is in real time.
    #[error(
        "expected a recording in lockstep for the world, found one in real time: it does not say which command had \
         arrived by which step"
    )]
    RealTime,
    /// People took part in the run.
    #[error(
        "{process}: expected the sketcher, or a recording without people. In this run people took part, and the steps at \
         which their drawings and orders came are not recorded. Run the mission without them, as the page saved it, if \
         there was one, and execute that recording again"
    )]
    People {
        /// The process.
        process: Process,
    },
}

/// The result of executing a service again.
#[derive(Debug, Clone, PartialEq)]
pub struct Rerun {
    /// The first difference, if there is one. Side A is the recording.
    pub difference: Option<Difference>,
    /// Number of messages that agree with the recording.
    pub same: u64,
    /// Number of messages that the service sent this time.
    pub sent: u64,
    /// Number of messages of the service in the recording.
    pub recorded: u64,
    /// Simulated time that was executed, in seconds.
    pub simulated_s: f64,
    /// The messages that the service rejected as invalid.
    pub rejected: Rejections,
    /// Time spent in the core, excluding reading, encoding, comparing and writing.
    pub core: Duration,
    /// Durations of the core's steps.
    pub steps: StepTimes,
    /// Time that everything took, including reading, encoding, comparing and writing.
    pub wall: Duration,
}

/// The durations of a core's steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StepTimes {
    /// The number of steps.
    pub count: usize,
    /// The mean duration.
    pub mean: Duration,
    /// Duration that 99 % of the steps did not exceed.
    pub within_99: Duration,
    /// The longest duration.
    pub longest: Duration,
}

impl StepTimes {
    fn of(mut steps: Vec<Duration>) -> Self {
        steps.sort_unstable();
        let count = steps.len();
        let whole: Duration = steps.iter().sum();
        Self {
            count,
            mean: whole / count.max(1) as u32,
            within_99: steps.get((99 * count).div_ceil(100).saturating_sub(1)).copied().unwrap_or_default(),
            longest: steps.last().copied().unwrap_or_default(),
        }
    }
}

/// Returns the channels that `process` writes and the recorder records, except for its health.
pub fn outputs(process: Process, kind: &str) -> impl Iterator<Item = &'static ChannelSpec> {
    channels::written_by(process, kind).filter(|spec| spec.is_recorded())
}

/// Executes `process` of the recorded run again and compares the messages it sends with the recorded ones. The run need not
/// have the same parameters as the recording.
///
/// `copy` receives every message: the recorded ones of the other processes, and those that this process sends now.
///
/// # Errors
/// [`RerunError`] if the recording cannot be read, the process has no core, or the run cannot be repeated.
pub fn rerun<W: std::io::Write>(
    recording: &Recording,
    process: Process,
    recorded_run: &RecordedRun,
    tolerances: Tolerances,
    copy: Option<&mut Writer<W>>,
) -> Result<Rerun, RerunError> {
    let (began, run) = (Instant::now(), &recorded_run.run);
    if process == Process::World && run.pace != Pace::Lockstep {
        return Err(RerunError::RealTime);
    }
    // People who only watch may give orders, too. The sketcher does not depend on any order, and the localizer only on `here`.
    // Without a pad, a person may still give orders from the command line, in addition to the supervisor's order to start.
    let is_told = |order: &MissionCommand| order.here().is_some();
    let is_persons = |order: &MissionCommand| order.order != Order::Start.code();
    let depends_on_people = match process {
        Process::Localizer if has_order(recording, MISSION, is_told)? => true,
        Process::Planner if has_order(recording, MISSION, is_persons)? => true,
        Process::Localizer => run.pad.draws() || has_order(recording, ORDERS, is_told)?,
        Process::Sketcher => false,
        _ => run.pad.draws() || !run.pad.is_absent() && has_order(recording, ORDERS, |_| true)?,
    };
    if depends_on_people {
        return Err(RerunError::People { process });
    }
    let mut subject = Subject::new(process, recorded_run)?;
    let mut sent = Sent {
        comparison: Comparison::of(outputs(process, run.mission.navigator_kind()), tolerances),
        copy,
        topics: Vec::new(),
        sent: 0,
        failure: None,
    };
    subject.answers(answered(recording, process, run)?);
    subject.begin(&mut sent)?;
    let mut recorded = 0;
    for message in recording.timeline(Selection::default())? {
        let message = message?;
        if sent.comparison.is_about(&message.topic.name) {
            recorded += 1;
            sent.comparison.take(Side::A, message);
            continue;
        }
        subject.receive(&message, &mut sent)?;
        if let Some(copy) = &mut sent.copy {
            copy.write_raw(&message)?;
        }
        sent.failure.take().map_or(Ok(()), Err)?;
    }
    let core = subject.spent();
    let (rejected, steps) = subject.finish();
    let span = recording.index()?.span_ns().map_or(0, |(first, last)| last - first);
    Ok(Rerun {
        same: sent.comparison.same(),
        sent: sent.sent,
        recorded,
        difference: sent.comparison.finish(),
        simulated_s: seconds(span),
        core,
        steps: StepTimes::of(steps),
        rejected,
        wall: began.elapsed(),
    })
}

/// Returns true if the recording has an order for which `is_such` is true.
fn has_order(
    recording: &Recording,
    channel: Channel<MissionCommand>,
    is_such: impl Fn(&MissionCommand) -> bool,
) -> Result<bool, RecordingError> {
    for order in recording.channel(channel)? {
        if is_such(&order?.0) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Returns the ticks that the recorded process responded to, or `None` if it responded to all of them. In real time, a process may
/// miss the first ticks or skip some.
fn answered(
    recording: &Recording,
    process: Process,
    run: &RunConfig,
) -> Result<Option<BTreeSet<u64>>, RecordingError> {
    let last_word = channels::last_word_of(process, run.mission.navigator_kind());
    let Some(spec) = last_word.filter(|spec| run.pace != Pace::Lockstep && spec.role != Role::Tick) else {
        return Ok(None);
    };
    let ticks: Result<BTreeSet<u64>, _> =
        recording.headers(spec)?.map(|header| Ok(header?.source_seq)).collect();
    // A log that has not been localized yet has no answers, so every tick is answered.
    Ok(Some(ticks?).filter(|ticks| !ticks.is_empty()))
}

/// Receives the messages that the core sends.
struct Sent<'a, W: std::io::Write> {
    comparison: Comparison,
    copy: Option<&'a mut Writer<W>>,
    topics: Vec<SentTopic>,
    sent: u64,
    failure: Option<RecordingError>,
}

/// A topic of the sent messages, with a buffer for their ROS 2 form.
struct SentTopic {
    spec: &'static ChannelSpec,
    topic: Arc<Topic>,
    spare: Spare,
}

impl SentTopic {
    fn new(spec: &'static ChannelSpec) -> Self {
        let topic = Topic {
            name: topic_name(spec.name),
            ros2_type: spec.message.ros2.to_owned(),
            encoding: "cdr".to_owned(),
            schema: Arc::default(),
            metadata: Default::default(),
        };
        Self { spec, topic: Arc::new(topic), spare: spec.message.spare() }
    }

    /// Returns the topic of a channel, adding it to `topics` if it is missing.
    fn of<'a>(topics: &'a mut Vec<Self>, spec: &'static ChannelSpec) -> &'a mut Self {
        let index = topics.iter().position(|topic| topic.spec == spec).unwrap_or_else(|| {
            topics.push(Self::new(spec));
            topics.len() - 1
        });
        &mut topics[index]
    }
}

impl<W: std::io::Write> Sent<'_, W> {
    fn take(
        &mut self,
        spec: &'static ChannelSpec,
        message: &[u8],
        cells: &[u8],
    ) -> Result<(), RecordingError> {
        let (SentTopic { topic, spare, .. }, header) =
            (SentTopic::of(&mut self.topics, spec), erased::header(message));
        let mut cdr = Vec::new();
        let said = spec.message.encode(message, cells, spare, &mut cdr);
        said.map_err(|source| RecordingError::Message {
            topic: topic.name.clone(),
            seq: header.seq,
            source,
        })?;
        let topic = Arc::clone(topic);
        let (sequence, stamp_ns) = (header.seq as u32, header.stamp_ns); // `encode` refuses larger ones
        self.comparison.take(Side::B, RawMessage { topic, sequence, stamp_ns, publish_ns: stamp_ns, cdr });
        match &mut self.copy {
            Some(copy) => copy.write_bytes(spec, message, cells).map(drop),
            None => Ok(()),
        }
    }
}

impl<W: std::io::Write> Tap for Sent<'_, W> {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        self.sent += 1;
        if let Err(error) = self.take(spec, message, cells) {
            self.failure.get_or_insert(error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_of_a_hundred_steps_is_above_the_99th_percentile() {
        let steps = StepTimes::of((1..=100).rev().map(Duration::from_millis).collect());
        let [mean, within_99, longest] = [50_500, 99_000, 100_000].map(Duration::from_micros);
        assert_eq!(steps, StepTimes { count: 100, mean, within_99, longest });
        assert_eq!(StepTimes::of(Vec::new()), StepTimes::default());
    }
}
