//! A process that is executed again, with recorded messages as its inputs.

use std::collections::BTreeSet;
use std::time::Duration;

use sketchnav_navigators::read_from;
use sketchnav_recordings::reader::RawMessage;
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::channels::{self, COMMAND, ChannelSpec, Role};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased;
use sketchnav_schemas::message::Header;
use sketchnav_stage::{InProcess, StageError, Tap};

use super::RerunError;
use crate::RehearsalError;
use crate::parts::{Part, World};

/// The process that is executed again. For the world, this includes the durations of its steps.
pub(super) enum Subject {
    World(Box<World>, Vec<Duration>),
    Stage(Box<Staged>),
}

/// A process that hosts a stage.
pub(super) struct Staged {
    part: Part,
    /// The latest message of each channel that the process reads.
    inputs: InProcess,
    /// The channel whose messages trigger a step.
    trigger: Option<&'static ChannelSpec>,
    reads: Vec<&'static ChannelSpec>,
    /// The ticks to answer, or `None` to answer all of them.
    answered: Option<BTreeSet<u64>>,
    rejections: Rejections,
    /// The duration of each step.
    steps: Vec<Duration>,
}

impl Subject {
    pub(super) fn new(process: Process, recorded: &RecordedRun) -> Result<Self, RerunError> {
        let RecordedRun { run, files } = recorded;
        if process == Process::World {
            return Ok(Self::World(Box::new(World::new(run, files)?), Vec::new()));
        }
        let part = Part::new(process, run, &read_from(files))?.ok_or(RerunError::Process { process })?;
        let kind = run.mission.navigator_kind();
        Ok(Self::Stage(Box::new(Staged {
            part,
            inputs: InProcess::of_reader(process, kind),
            trigger: channels::trigger_of(process, kind),
            reads: channels::read_by(process, kind).collect(),
            answered: None,
            rejections: Rejections::default(),
            steps: Vec::new(),
        })))
    }

    /// Answers only these ticks. `None` answers all of them.
    pub(super) fn answers(&mut self, ticks: Option<BTreeSet<u64>>) {
        if let Self::Stage(staged) = self {
            staged.answered = ticks;
        }
    }

    /// Sends the messages that the process sends before it has received any.
    pub(super) fn begin(&mut self, tap: &mut impl Tap) -> Result<(), RerunError> {
        let said = match self {
            Self::World(world, _) => world.observe(tap),
            Self::Stage(staged) => staged.part.announce(Header { seq: 0, stamp_ns: 0, source_seq: 0 }, tap),
        };
        Ok(said.map_err(RehearsalError::Stage)?)
    }

    /// Receives a message of another process, and sends whatever follows from it.
    pub(super) fn receive(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        match self {
            Self::World(world, steps) => {
                let before = world.spent;
                receive_command(world, message, tap)?;
                steps.extend(Some(world.spent - before).filter(|step| !step.is_zero()));
                Ok(())
            }
            Self::Stage(staged) => staged.receive(message, tap),
        }
    }

    /// Returns the invalid messages among the inputs, and the duration of each step. For the world, which receives only
    /// commands, no invalid messages are counted.
    pub(super) fn finish(self) -> (Rejections, Vec<Duration>) {
        match self {
            Self::World(_, steps) => (Rejections::default(), steps),
            Self::Stage(staged) => (staged.rejections, staged.steps),
        }
    }

    /// Returns the time that the process has taken so far, excluding reading, encoding, comparing and writing.
    pub(super) fn spent(&self) -> Duration {
        match self {
            Self::World(world, _) => world.spent,
            Self::Stage(staged) => staged.part.spent,
        }
    }
}

fn receive_command(world: &mut World, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
    if raw.topic.is(COMMAND) {
        let (command, _) = raw.read(COMMAND)?;
        if command.last == 0 {
            world.step(Some(&command));
            world.observe(tap).map_err(RehearsalError::Stage)?;
        }
    }
    Ok(())
}

impl Staged {
    fn receive(&mut self, raw: &RawMessage, tap: &mut impl Tap) -> Result<(), RerunError> {
        let Some(spec) = self.reads.iter().copied().find(|spec| spec.is_topic(&raw.topic.name)) else {
            return Ok(());
        };
        let message = match raw.decode(spec) {
            Err(error) if error.is_one_message() => {
                // The process did not receive it, either.
                self.rejections.count_undecoded(raw, &error);
                return Ok(());
            }
            decoded => decoded?,
        };
        if let Err(why) = spec.message.check(message.bytes()) {
            // The process rejected it, too.
            self.rejections.count(raw, &why);
            return Ok(());
        }
        let taken = match spec.role {
            Role::Instruction | Role::Request => self.part.receive(spec, &message, tap),
            _ => {
                let cause = *erased::header(message.bytes());
                self.inputs.keep(spec, message);
                if self.trigger == Some(spec) { self.answer(spec, cause, tap) } else { Ok(()) }
            }
        };
        Ok(taken.map_err(RehearsalError::Stage)?)
    }

    fn answer(&mut self, spec: &ChannelSpec, cause: Header, tap: &mut impl Tap) -> Result<(), StageError> {
        let tick = if spec.role == Role::Tick { cause.seq } else { cause.source_seq };
        let is_left_out = self.answered.as_ref().is_some_and(|ticks| !ticks.contains(&tick));
        if self.part.is_ready()? && !is_left_out {
            let before = self.part.spent;
            self.part.step((tick, cause.stamp_ns), &self.inputs, tap)?;
            self.steps.push(self.part.spent - before);
            self.inputs.end_instant();
        }
        Ok(())
    }
}
