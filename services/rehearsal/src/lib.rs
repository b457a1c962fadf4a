//! A mission in one process: the cores of world, sketcher, localizer and planner, called in turn.
//!
//! It sends, through a [`Tap`], the very messages that the processes send in lockstep, byte for byte
//! and channel by channel (health apart). No shared memory, no thread, no clock. [`rerun`] has one of the
//! cores do once more what a recording says that it did.

pub mod rerun;

use sketchnav_localizer::core::{Core as Localizer, CoreError as LocalizerError};
use sketchnav_planner::core::{Core as Planner, PlannerError};
use sketchnav_schemas::channels::{
    COMMAND, CONTACT, Channel, ESTIMATE, MISSION, ODOMETRY, PARTICLES, PLAN, ROUTE, SCAN, SKETCH, STATUS,
    TRUTH,
};
use sketchnav_schemas::codes::Order;
use sketchnav_schemas::message::{
    Contact, GroundTruth, Header, LaserScan, Message, MissionCommand, MissionStatus, Odometry, Particles,
    Plan, PoseEstimate, Route, SketchMap, VelocityCommand,
};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::{SimError, World};
use sketchnav_sketcher::{Drawing, Places};

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

/// Where a channel's messages are made, one after the other, in the same place.
pub(crate) struct Outbox<T> {
    channel: Channel<T>,
    pub(crate) message: Box<T>,
    last_seq: u64,
}

impl<T: Message> Outbox<T> {
    pub(crate) fn new(channel: Channel<T>) -> Self {
        Self { channel, message: bytemuck::zeroed_box(), last_seq: 0 }
    }

    /// The place, wiped.
    pub(crate) fn blank(&mut self) -> &mut T {
        *self.message = T::zeroed();
        &mut self.message
    }
}

impl<T: Ros2> Outbox<T> {
    /// Numbers what the place holds and shows it to the tap.
    pub(crate) fn send(&mut self, tap: &mut impl Tap, cells: &[u8]) {
        self.last_seq += 1;
        self.message.header_mut().seq = self.last_seq;
        tap.see(self.channel, &*self.message, cells);
    }
}

/// A mission under way.
pub struct Rehearsal {
    world: World,
    localizer: Localizer,
    planner: Planner,
    drawing: Drawing,
    places: Places,
    contact: Outbox<Contact>,
    truth: Outbox<GroundTruth>,
    odometry: Outbox<Odometry>,
    scan: Outbox<LaserScan>,
    particles: Outbox<Particles>,
    estimate: Outbox<PoseEstimate>,
    plan: Outbox<Plan>,
    command: Outbox<VelocityCommand>,
    status: Outbox<MissionStatus>,
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

    fn by(run: &RunConfig, (drawing, places): (Drawing, Places)) -> Result<Self, RehearsalError> {
        Ok(Self {
            world: sketchnav_world::build(run)?,
            localizer: Localizer::new(run)?,
            planner: Planner::new(run)?,
            drawing,
            places,
            contact: Outbox::new(CONTACT),
            truth: Outbox::new(TRUTH),
            odometry: Outbox::new(ODOMETRY),
            scan: Outbox::new(SCAN),
            particles: Outbox::new(PARTICLES),
            estimate: Outbox::new(ESTIMATE),
            plan: Outbox::new(PLAN),
            command: Outbox::new(COMMAND),
            status: Outbox::new(STATUS),
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
            let newest = Some(*self.command.message);
            let command =
                if self.thinking_scans == 0 { newest } else { std::mem::replace(&mut thought_out, newest) };
            self.world.step(command.as_ref());
            for _ in 1..self.thinking_scans {
                self.observe(tap);
                self.world.step(None);
            }
        }
        Ok(())
    }

    /// The sketch, the tasks, the order to start.
    fn begin(&mut self, tap: &mut impl Tap) -> Result<(), RehearsalError> {
        let mut sketch = Outbox::<SketchMap>::new(SKETCH);
        sketchnav_sketcher::fill_sketch(&self.drawing, &self.places, &mut sketch.message);
        let cells = &self.drawing.cells;
        sketch.send(tap, cells);
        self.localizer.on_sketch(&sketch.message, cells)?;
        self.planner.on_sketch(&sketch.message, cells)?;
        let mut route = Outbox::<Route>::new(ROUTE);
        sketchnav_sketcher::fill_route(&self.places, &mut route.message);
        route.send(tap, &[]);
        self.planner.on_route(&route.message);
        let mut mission = Outbox::<MissionCommand>::new(MISSION);
        mission.message.order = Order::Start.code();
        mission.send(tap, &[]);
        self.planner.on_order(&mission.message);
        Ok(())
    }

    /// One instant, from the sensors to the command; whether the mission is over.
    fn step(&mut self, tap: &mut impl Tap) -> bool {
        self.observe(tap);
        self.localize(tap);
        self.plan(tap)
    }

    fn observe(&mut self, tap: &mut impl Tap) {
        let source_seq = self.scan.last_seq + 1;
        let header = Header { seq: 0, stamp_ns: self.world.stamp_ns(), source_seq };
        for contact in self.world.contacts() {
            *self.contact.blank() = Contact { header, ..contact };
            self.contact.send(tap, &[]);
        }
        self.truth.blank().header = header;
        self.world.fill_truth(&mut self.truth.message);
        self.truth.send(tap, &[]);
        self.odometry.blank().header = header;
        self.world.fill_odometry(&mut self.odometry.message);
        self.odometry.send(tap, &[]);
        self.scan.blank().header = header;
        self.world.fill_scan(&mut self.scan.message);
        self.scan.send(tap, &[]);
    }

    fn localize(&mut self, tap: &mut impl Tap) {
        let due = self.localizer.particles_due(self.scan.message.header.stamp_ns);
        let estimate = self.estimate.blank();
        let particles = due.then(|| self.particles.blank());
        self.localizer.step(&self.odometry.message, &self.scan.message, estimate, particles);
        if due {
            self.particles.send(tap, &[]);
        }
        self.estimate.send(tap, &[]);
    }

    fn plan(&mut self, tap: &mut impl Tap) -> bool {
        let step = self.planner.step(&self.estimate.message, &self.scan.message, &self.odometry.message);
        if step.planned {
            self.planner.write_plan(self.plan.blank());
            self.plan.send(tap, &[]);
        }
        self.planner.write_command(self.command.blank());
        self.command.send(tap, &[]);
        self.planner.write_status(self.status.blank());
        self.status.send(tap, &[]);
        step.last
    }
}
