//! Runs a mission in a single process by calling the world and the stages of a navigator in turn.
//!
//! A rehearsal sends exactly the messages that the processes send in lockstep, byte for byte and channel by
//! channel (except for health), and an [`Onlooker`] sees them all. It does not need shared memory or threads,
//! and reads the clock only to measure how long the stages take. Note that a person's answer
//! ([`Onlooker::here`]) takes effect at the next instant, whereas separate processes may receive it at any
//! time. [`rerun`] executes one of the processes again on its inputs in a recording.

mod parts;
pub mod rerun;

use std::time::Duration;

use sketchnav_files::Disk;
use sketchnav_navigators::{UnknownNavigator, read_file};
use sketchnav_schemas::channels::{self, COMMAND, MISSION};
use sketchnav_schemas::codes::{Order, Process};
use sketchnav_schemas::message::{Header, Here, VelocityCommand};
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::SimError;
use sketchnav_stage::{Files, InProcess, Inputs, StageError};

pub use sketchnav_stage::Tap;

use parts::{Part, World};

/// The reason why a rehearsal cannot begin or continue.
#[derive(Debug, thiserror::Error)]
pub enum RehearsalError {
    /// The world, or the robot's start in it, is invalid.
    #[error(transparent)]
    World(#[from] SimError),
    /// The mission names an unknown navigator.
    #[error(transparent)]
    Navigator(#[from] UnknownNavigator),
    /// A stage failed because of its parameters, its drawing, or a message.
    #[error("{0}")]
    Stage(#[source] StageError),
}

/// Watches a mission. An onlooker can also set the robot's pose or end the mission; by default it does neither.
pub trait Onlooker: Tap {
    /// Returns true to end the mission at this point. Called after each instant.
    fn has_enough(&self) -> bool {
        false
    }

    /// Returns a person's answer to the question where the robot is, if there is one. Its position is in pixels (frame `Sketch`),
    /// its heading in radians. Called after each instant except the last.
    fn here(&mut self) -> Option<Here> {
        None
    }
}

/// Wall-clock time spent in each part of a mission.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Spent {
    /// Time spent in the simulation.
    pub world: Duration,
    /// Time spent reading a person's input.
    pub sketcher: Duration,
    /// Time spent in all steps of the localizer.
    pub localizer: Duration,
    /// Time spent in all steps of the planner.
    pub planner: Duration,
}

/// A mission in progress.
pub struct Rehearsal {
    kind: String,
    world: World,
    sketcher: Part,
    localizer: Part,
    planner: Part,
    supervisor: InProcess,
    /// Number of instants that the stages take for a step; 0 is lockstep.
    thinking_scans: u32,
}

impl Rehearsal {
    /// Creates a rehearsal and reads the files that the run's mission names.
    ///
    /// # Errors
    /// [`RehearsalError`], which names the file, the key or the position.
    pub fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Self::by(run, &read_file)
    }

    /// Creates a rehearsal with a drawing that is not in a file. `bytes` takes the place of the file that the mission names.
    ///
    /// # Errors
    /// Same errors as [`Rehearsal::new`].
    pub fn by_bytes(run: &RunConfig, bytes: &[u8]) -> Result<Self, RehearsalError> {
        Self::by(run, &|_| Ok(bytes.to_vec()))
    }

    /// Creates a rehearsal that reads the files named in the mission through `files`, except for those of the world, which are read
    /// from disk.
    ///
    /// # Errors
    /// Same errors as [`Rehearsal::new`].
    pub fn by(run: &RunConfig, files: &Files<'_>) -> Result<Self, RehearsalError> {
        let kind = run.mission.navigator_kind();
        let part = |process| {
            let none = || RehearsalError::Stage(format!("{process}: no stage of {kind:?}").into());
            Part::new(process, run, files)?.ok_or_else(none)
        };
        Ok(Self {
            kind: kind.to_owned(),
            world: World::new(run, &Disk)?,
            sketcher: part(Process::Sketcher)?,
            localizer: part(Process::Localizer)?,
            planner: part(Process::Planner)?,
            supervisor: InProcess::of_writer(Process::Supervisor, kind),
            thinking_scans: 0,
        })
    }

    /// Simulates real time on a slow machine, where the stages take `thinking_scans` instants for each step. In the meantime, the
    /// world continues with the previous command, and readings are not used. 0 is lockstep.
    #[must_use]
    pub fn thinking_for(self, thinking_scans: u32) -> Self {
        Self { thinking_scans, ..self }
    }

    /// Drives the mission to its end, or until the onlooker has seen enough. Returns the time spent in each part.
    ///
    /// # Errors
    /// [`RehearsalError::Stage`] if a stage cannot use the drawing or the tasks.
    pub fn run(mut self, onlooker: &mut impl Onlooker) -> Result<Spent, RehearsalError> {
        self.drive(onlooker).map_err(RehearsalError::Stage)?;
        let Self { world, sketcher, localizer, planner, .. } = &self;
        let [sketcher, localizer, planner] = [sketcher, localizer, planner].map(|part| part.spent);
        Ok(Spent { world: world.spent, sketcher, localizer, planner })
    }

    fn drive(&mut self, onlooker: &mut impl Onlooker) -> Result<(), StageError> {
        self.begin(onlooker)?;
        let mut thought_out = None;
        loop {
            self.step(onlooker)?;
            let newest = self.planner.memory.get(COMMAND.spec).map(|c| *c.typed::<VelocityCommand>());
            if newest.is_some_and(|command| command.last == 1) || onlooker.has_enough() {
                return Ok(());
            }
            if let Some(here) = onlooker.here() {
                self.give_pose(here, onlooker)?;
            }
            let command =
                if self.thinking_scans == 0 { newest } else { std::mem::replace(&mut thought_out, newest) };
            self.world.step(command.as_ref());
            for _ in 1..self.thinking_scans {
                self.world.observe(onlooker)?;
                self.world.step(None);
            }
        }
    }

    /// Passes the sketcher's messages on to the other stages and gives the order to start.
    fn begin(&mut self, tap: &mut impl Tap) -> Result<(), StageError> {
        let Self { sketcher, localizer, planner, supervisor, kind, .. } = self;
        for part in [&mut *sketcher, localizer, planner] {
            part.announce(Header { seq: 0, stamp_ns: 0, source_seq: 0 }, tap)?;
        }
        for spec in channels::written_by(Process::Sketcher, kind) {
            let Some(said) = sketcher.memory.get(spec) else { continue };
            for (process, part) in [(Process::Localizer, &mut *localizer), (Process::Planner, planner)] {
                if spec.readers.contains(&process) {
                    part.receive(spec, said, tap)?;
                }
            }
        }
        let order = parts::order(supervisor, 0, (Order::Start, None), tap)?;
        planner.receive(MISSION.spec, &order, tap)
    }

    /// Passes on the onlooker's answer to the question where the robot is. It takes effect at the next instant.
    fn give_pose(&mut self, here: Here, tap: &mut impl Tap) -> Result<(), StageError> {
        let Self { world, localizer, planner, supervisor, .. } = self;
        let order = parts::order(supervisor, world.stamp_ns(), (Order::Here, Some(here)), tap)?;
        localizer.receive(MISSION.spec, &order, tap)?;
        planner.receive(MISSION.spec, &order, tap)
    }

    /// Runs one instant, from the sensors to the command.
    fn step(&mut self, tap: &mut impl Tap) -> Result<(), StageError> {
        let Self { world, localizer, planner, kind, .. } = self;
        world.observe(tap)?;
        let instant = (world.tick(), world.stamp_ns());
        for (process, part) in [(Process::Localizer, &*localizer), (Process::Planner, planner)] {
            if !part.is_ready()? {
                return Err(format!("the {process} is not ready, although it has received everything").into());
            }
        }
        localizer.step(instant, &[&world.memory], tap)?;
        let situation = channels::trigger_of(Process::Planner, kind);
        let answer = situation.and_then(|spec| localizer.memory.newest(spec));
        if !answer.is_some_and(|answer| answer.is_fresh) {
            return Err(format!("the localizer did not answer tick {}", world.tick()).into());
        }
        planner.step(instant, &[&world.memory, &localizer.memory], tap)?;
        world.memory.end_instant();
        localizer.memory.end_instant();
        Ok(())
    }
}
