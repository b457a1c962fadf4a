//! A mission in one process: the cores of world, sketcher, localizer and planner, called in turn.
//!
//! It sends, through a [`Tap`], the very messages that the processes send in lockstep, byte for byte
//! and channel by channel (health apart). No shared memory, no thread; the clock is looked at to tell how long
//! a core took, and nothing depends on it. [`rerun`] has one of the cores do once more what a recording says
//! that it did.

pub mod rerun;
mod voices;

use sketchnav_localizer::core::CoreError as LocalizerError;
use sketchnav_planner::core::PlannerError;
use sketchnav_schemas::channels::{Channel, MISSION};
use sketchnav_schemas::codes::Order;
use sketchnav_schemas::message::MissionCommand;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::SimError;
use sketchnav_sketcher::{Drawing, Places};

use voices::{LocalizerVoice, Outbox, PlannerVoice, WorldVoice};

/// Why a rehearsal cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum RehearsalError {
    /// The world or the robot's start in it.
    #[error(transparent)]
    World(#[from] SimError),
    /// The drawing or the places in it.
    #[error("{0:#}")]
    Sketch(anyhow::Error),
    /// The localizer's parameters or its start.
    #[error(transparent)]
    Localizer(#[from] LocalizerError),
    /// The planner's parameters.
    #[error(transparent)]
    Planner(#[from] PlannerError),
}

/// Sees every message as it is sent.
pub trait Tap {
    /// A message; `cells` is the slice behind it, empty where its channel has none.
    fn see<T: Ros2>(&mut self, channel: Channel<T>, message: &T, cells: &[u8]);

    /// Whether it has seen enough: asked after each step, `true` ends the rehearsal there.
    fn has_enough(&self) -> bool {
        false
    }
}

/// A mission under way.
pub struct Rehearsal {
    world: WorldVoice,
    localizer: LocalizerVoice,
    planner: PlannerVoice,
    understood: (Drawing, Places),
    /// Scan periods that the cores think about a step.
    thinking_scans: u32,
}

impl Rehearsal {
    /// Reads what the run's mission names.
    ///
    /// # Errors
    /// [`RehearsalError`] with the file, the key or the place.
    pub fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        let understood = sketchnav_sketcher::understand(run).map_err(RehearsalError::Sketch)?;
        Self::by(run, understood)
    }

    /// By a drawing that is in no file: `bytes` stand for the file that the mission names.
    ///
    /// # Errors
    /// As [`Rehearsal::new`].
    pub fn by_bytes(run: &RunConfig, bytes: &[u8]) -> Result<Self, RehearsalError> {
        let understood = sketchnav_sketcher::understand_bytes(run, bytes).map_err(RehearsalError::Sketch)?;
        Self::by(run, understood)
    }

    fn by(run: &RunConfig, understood: (Drawing, Places)) -> Result<Self, RehearsalError> {
        Ok(Self {
            world: WorldVoice::new(run)?,
            localizer: LocalizerVoice::new(run)?,
            planner: PlannerVoice::new(run)?,
            understood,
            thinking_scans: 0,
        })
    }

    /// As in real time on a slow machine: the cores need so many scan periods for a step, meanwhile the world
    /// goes on by the command before, and the scans of that time go by. 0 is lockstep.
    #[must_use]
    pub fn thinking_for(self, thinking_scans: u32) -> Self {
        Self { thinking_scans, ..self }
    }

    /// Drives the mission to its end, or until the tap has seen enough.
    ///
    /// # Errors
    /// [`RehearsalError`] where the sketch does not suit the services.
    pub fn run(mut self, tap: &mut impl Tap) -> Result<(), RehearsalError> {
        self.begin(tap)?;
        let mut thought_out = None;
        while !self.step(tap) && !tap.has_enough() {
            let newest = Some(*self.planner.command.message);
            let command =
                if self.thinking_scans == 0 { newest } else { std::mem::replace(&mut thought_out, newest) };
            self.world.step(command.as_ref());
            for _ in 1..self.thinking_scans {
                self.world.observe(tap);
                self.world.step(None);
            }
        }
        Ok(())
    }

    /// The sketch, the tasks, the order to start.
    fn begin(&mut self, tap: &mut impl Tap) -> Result<(), RehearsalError> {
        let (sketch, route) = voices::sketch(&self.understood, tap);
        let cells = &self.understood.0.cells;
        self.localizer.on_sketch(&sketch, cells)?;
        self.planner.take(|core| core.on_sketch(&sketch, cells))?;
        self.planner.take(|core| core.on_route(&route));
        let mut mission = Outbox::<MissionCommand>::new(MISSION);
        mission.message.order = Order::Start.code();
        mission.send(tap, &[]);
        self.planner.take(|core| core.on_order(&mission.message));
        Ok(())
    }

    /// One instant, from the sensors to the command; whether the mission is over.
    fn step(&mut self, tap: &mut impl Tap) -> bool {
        self.world.observe(tap);
        let (odometry, scan) = (&self.world.readings.odometry.message, &self.world.readings.scan.message);
        self.localizer.answer(odometry, scan, tap);
        self.planner.answer(&self.localizer.estimate.message, scan, odometry, tap)
    }
}
