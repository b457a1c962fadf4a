//! Plays, pauses, steps and seeks, and waits for live processes.

use std::iter::Peekable;
use std::ops::Range;
use std::time::{Duration, Instant};

use anyhow::bail;
use indicatif::{ProgressBar, ProgressStyle};
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::{RawMessage, Selection, Timeline};
use sketchnav_recordings::writer::topic_name;
use sketchnav_runtime::{Node, RawReader, System, Wake};
use sketchnav_schemas::channels::{self, LOCKSTEP_WINDOW, MISSION, Role, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::{nanoseconds, seconds};
use sketchnav_supervisor::Supervisor;

use super::clock::Clock;
use super::keys::{Keys, Wish};
use super::plan::Plan;
use super::ports::{Ports, Shift};
use crate::output::say;
use crate::recordings::args::{Rate, ReplayOptions};

/// Longest time to sleep before checking the keys and the readers again.
const NAP: Duration = Duration::from_millis(20);
/// Time to sleep while waiting for an answer, which usually comes soon.
const SHORT_NAP: Duration = Duration::from_micros(200);
/// Maximum time that a live process may take to start or to answer.
const PATIENCE: Duration = Duration::from_secs(30);

/// How playback ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The end of the recording was reached.
    Played,
    /// A signal ended it.
    Interrupted,
}

/// Plays a recording.
pub struct Player<'a> {
    recording: &'a Recording,
    options: &'a ReplayOptions,
    ports: Ports,
    answers: Option<Answers>,
    keys: Keys,
    clock: Clock,
    bar: ProgressBar,
    plan: &'a Plan,
    shift: Shift,
    /// The number of the last tick that was played.
    tick: u64,
    /// The latest timestamp that was sent, in nanoseconds.
    sent_ns: u64,
}

/// How playback continues after an instant.
enum Turn {
    Next,
    Seek(u64),
    End(End),
}

impl<'a> Player<'a> {
    pub fn new(
        recording: &'a Recording,
        run: &RunConfig,
        options: &'a ReplayOptions,
        plan: &'a Plan,
        supervisor: &Supervisor,
    ) -> anyhow::Result<Self> {
        let ports = Ports::open(&run.system, plan, &options.live, supervisor)?;
        let waits = options.rate == Rate::Max && !options.live.is_empty();
        let answers = waits
            .then(|| Answers::open(&run.system, run.mission.navigator_kind(), &options.live))
            .transpose()?;
        Ok(Self {
            recording,
            options,
            ports,
            answers,
            keys: Keys::new(),
            clock: Clock::new(options.rate, options.paused),
            bar: bar(&plan.times_ns),
            plan,
            shift: Shift::default(),
            tick: 0,
            sent_ns: 0,
        })
    }

    /// Plays until the end or an error. In either case, lists the messages that were not played and those
    /// that every reader rejected.
    pub fn play(&mut self, supervisor: &mut Supervisor) -> anyhow::Result<End> {
        let end = self.play_all(supervisor);
        self.bar.finish_and_clear();
        self.ports.not_played().list().iter().for_each(|message| say!("notice: not played: {message}"));
        self.ports
            .invalid()
            .list()
            .iter()
            .for_each(|message| say!("notice: rejected by every reader: {message}"));
        end
    }

    fn play_all(&mut self, supervisor: &mut Supervisor) -> anyhow::Result<End> {
        let mut from_ns = self.plan.times_ns.start;
        if self.wait_for_lives(supervisor)? == Wake::Terminate {
            return Ok(End::Interrupted);
        }
        loop {
            let end = match self.play_from(from_ns, supervisor)? {
                Turn::Seek(to_ns) => {
                    from_ns = to_ns;
                    continue;
                }
                Turn::End(end) => end,
                Turn::Next if self.options.again => {
                    from_ns = self.plan.times_ns.start;
                    continue;
                }
                Turn::Next => End::Played,
            };
            self.wait_for_answers(self.tick, supervisor)?;
            return Ok(end);
        }
    }

    /// Waits for the first message of each live process, which receives everything from then on. Without this, a
    /// process could join after a short recording is over and receive nothing.
    fn wait_for_lives(&mut self, supervisor: &mut Supervisor) -> anyhow::Result<Wake> {
        let since = Instant::now();
        loop {
            supervisor.poll(Duration::ZERO)?;
            let Some(silent) =
                self.options.live.iter().find(|process| supervisor.health(**process).is_none())
            else {
                return Ok(self.ports.nap(Duration::ZERO));
            };
            if since.elapsed() > PATIENCE {
                bail!("expected a message of the {silent} within {} s, found none", PATIENCE.as_secs());
            }
            if self.ports.nap(NAP) == Wake::Terminate {
                return Ok(Wake::Terminate);
            }
        }
    }

    fn play_from(&mut self, from_ns: u64, supervisor: &mut Supervisor) -> anyhow::Result<Turn> {
        let selection = self.plan.selection().between(from_ns..self.plan.times_ns.end);
        let mut timeline = self.recording.timeline(selection)?.peekable();
        self.begin_at(from_ns, &mut timeline, supervisor)?;
        let mut instant_ns = None;
        while let Some(message) = timeline.next().transpose()? {
            if instant_ns.replace(message.stamp_ns) != Some(message.stamp_ns) {
                // However fast messages are played, check once per instant whether to end, and serve late readers.
                supervisor.poll(Duration::ZERO)?;
                if self.ports.nap(Duration::ZERO) == Wake::Terminate {
                    return Ok(Turn::End(End::Interrupted));
                }
                let since_ns = message.stamp_ns.saturating_sub(self.plan.times_ns.start);
                self.bar.set_position(since_ns / 1_000_000);
            }
            if message.topic.is(TICK) {
                // A world in lockstep waits for the command before it continues, and so does the player.
                self.wait_for_answers(self.tick, supervisor)?;
            }
            match self.wait_until_due(&message, supervisor)? {
                Turn::Next => {}
                turn => return Ok(turn),
            }
            self.send(&message, supervisor)?;
        }
        Ok(Turn::Next)
    }

    fn send(&mut self, message: &RawMessage, supervisor: &Supervisor) -> anyhow::Result<()> {
        self.ports.play(message, self.shift, supervisor)?;
        self.sent_ns = self.sent_ns.max(message.stamp_ns + self.shift.ns);
        if message.topic.is(TICK) {
            self.tick = u64::from(message.sequence) + self.shift.ticks;
        }
        Ok(())
    }

    /// Prepares playing from `from_ns`. After a jump back, timestamps and ticks keep increasing, and latched messages are sent
    /// again.
    fn begin_at(
        &mut self,
        from_ns: u64,
        timeline: &mut Peekable<Timeline>,
        supervisor: &Supervisor,
    ) -> anyhow::Result<()> {
        if self.sent_ns > 0 && from_ns + self.shift.ns <= self.sent_ns {
            self.shift.ns = self.sent_ns + 1 - from_ns;
        }
        let first = self.first_tick(from_ns)?;
        if let Some(first) = first.filter(|first| first + self.shift.ticks <= self.tick) {
            self.shift.ticks = self.tick + 1 - first;
        }
        self.clock.restart();
        let at_ns = match timeline.peek() {
            Some(Ok(first)) => first.stamp_ns,
            _ => from_ns,
        };
        // If playing starts in the middle, no process has received the earlier orders yet.
        let orders = if self.sent_ns == 0 { self.orders(from_ns)? } else { Vec::new() };
        for earlier in self.recording.latched_before(from_ns)?.into_iter().chain(orders) {
            self.ports.play(&RawMessage { stamp_ns: at_ns, ..earlier }, self.shift, supervisor)?;
        }
        Ok(())
    }

    fn first_tick(&self, from_ns: u64) -> anyhow::Result<Option<u64>> {
        let selection = Selection::of_topics([topic_name(TICK.spec.name)]).between(from_ns..u64::MAX);
        let first = self.recording.select(selection)?.next().transpose()?;
        Ok(first.map(|tick| tick.sequence.into()))
    }

    fn orders(&self, before_ns: u64) -> anyhow::Result<Vec<RawMessage>> {
        let Some(topic) = self.plan.topic_of(MISSION.spec) else { return Ok(Vec::new()) };
        let selection = Selection::of_topics([topic]).between(0..before_ns);
        Ok(self.recording.select(selection)?.collect::<Result<_, _>>()?)
    }

    /// Waits until a message is due, and handles keys in the meantime.
    fn wait_until_due(&mut self, message: &RawMessage, supervisor: &mut Supervisor) -> anyhow::Result<Turn> {
        loop {
            match self.keys.next() {
                Some(Wish::Pause) => self.clock.toggle_pause(),
                Some(Wish::Step) => self.clock.step(message.stamp_ns),
                Some(Wish::Seek(s)) => return Ok(Turn::Seek(self.target(message.stamp_ns, s))),
                Some(Wish::Rate(factor)) => self.clock.change_rate(factor),
                Some(Wish::Quit) => return Ok(Turn::End(End::Played)),
                None => {}
            }
            self.show_progress(message.stamp_ns);
            let nap = match self.clock.until(message.stamp_ns) {
                Some(Duration::ZERO) => return Ok(Turn::Next),
                until => until.unwrap_or(NAP).min(NAP),
            };
            supervisor.poll(Duration::ZERO)?;
            if self.ports.nap(nap) == Wake::Terminate {
                return Ok(Turn::End(End::Interrupted));
            }
        }
    }

    fn target(&self, now_ns: u64, by_s: f64) -> u64 {
        let Range { start, end } = self.plan.times_ns;
        nanoseconds(seconds(now_ns) + by_s).clamp(start, end - 1)
    }

    fn show_progress(&self, stamp_ns: u64) {
        if !self.bar.is_hidden() {
            let (now, last) = (seconds(stamp_ns), seconds(self.plan.times_ns.end));
            self.bar.set_message(format!("{now:.1} of {last:.1} s  {}", self.clock.words()));
        }
    }

    /// Waits until the live processes have answered a tick.
    fn wait_for_answers(&mut self, tick: u64, supervisor: &mut Supervisor) -> anyhow::Result<()> {
        let Some(answers) = &mut self.answers else { return Ok(()) };
        let since = Instant::now();
        while !answers.has_come(tick)? {
            supervisor.poll(Duration::ZERO)?;
            if since.elapsed() > PATIENCE {
                bail!(
                    "no answer to tick {tick} within {} s from {}",
                    PATIENCE.as_secs(),
                    answers.missing(tick)
                );
            }
            if self.ports.nap(SHORT_NAP) == Wake::Terminate {
                bail!("interrupted");
            }
        }
        Ok(())
    }
}

fn bar(times_ns: &Range<u64>) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40.cyan/dim} {msg}");
    let bar = ProgressBar::new((times_ns.end - times_ns.start) / 1_000_000);
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// The channels on which live processes answer ticks.
struct Answers {
    answers: Vec<Answer>,
    _node: Node,
}

struct Answer {
    process: Process,
    reader: RawReader,
    /// The latest tick that the process has responded to.
    newest: u64,
    /// Maximum lag of the process, in ticks.
    window: u64,
}

impl Answers {
    fn open(system: &str, kind: &str, live: &[Process]) -> anyhow::Result<Self> {
        let node = Node::join(System::open(system)?, Process::Observer)?;
        let mut answers = Vec::new();
        for &process in live {
            let (spec, window) = match process {
                Process::World => continue,
                Process::Recorder => (channels::of_role(Role::Safe, kind), LOCKSTEP_WINDOW),
                _ => (channels::last_word_of(process, kind), 0),
            };
            if let Some(spec) = spec {
                answers.push(Answer { process, reader: node.raw_reader(spec)?, newest: 0, window });
            }
        }
        Ok(Self { answers, _node: node })
    }

    /// Returns true if all live processes have answered the tick.
    fn has_come(&mut self, tick: u64) -> anyhow::Result<bool> {
        for answer in &mut self.answers {
            while let Some(message) = answer.reader.receive()? {
                answer.newest = message.header().source_seq;
            }
        }
        Ok(self.late(tick).next().is_none())
    }

    fn late(&self, tick: u64) -> impl Iterator<Item = Process> {
        let late = self.answers.iter().filter(move |answer| answer.newest + answer.window < tick);
        late.map(|answer| answer.process)
    }

    fn missing(&self, tick: u64) -> String {
        channels::words(self.late(tick))
    }
}
