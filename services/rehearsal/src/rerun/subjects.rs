//! The services as what they are to a recording: inputs in, outputs out.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use sketchnav_localizer::core::Core as LocalizerCore;
use sketchnav_planner::core::Core as PlannerCore;
use sketchnav_recordings::reader::RawMessage;
use sketchnav_schemas::channels::{
    COMMAND, CONTACT, ESTIMATE, ODOMETRY, PARTICLES, PLAN, ROUTE, SCAN, SKETCH, STATUS, TRUTH,
};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{
    Contact, GroundTruth, Header, LaserScan, MissionCommand, MissionStatus, Odometry, Particles, Plan,
    PoseEstimate, Route, SketchMap, VelocityCommand,
};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_sim::World as SimWorld;

use super::RerunError;
use crate::{Outbox, RehearsalError, Tap};

/// A service under examination.
pub(super) enum Subject {
    World(Box<World>),
    Sketcher(Box<RunConfig>),
    Localizer(Box<Localizer>),
    Planner(Box<Planner>),
}

impl Subject {
    pub(super) fn new(process: Process, run: &RunConfig) -> Result<Self, RerunError> {
        match process {
            Process::World => Ok(Self::World(Box::new(World::new(run)?))),
            Process::Sketcher => Ok(Self::Sketcher(Box::new(run.clone()))),
            Process::Localizer => Ok(Self::Localizer(Box::new(Localizer::new(run)?))),
            Process::Planner => Ok(Self::Planner(Box::new(Planner::new(run)?))),
            _ => Err(RerunError::Process { process }),
        }
    }

    /// Leaves the scans that are not among these without an answer; `None`: answers all.
    pub(super) fn answers(&mut self, scans: Option<BTreeSet<u64>>) {
        match self {
            Self::Localizer(localizer) => localizer.answered = scans,
            Self::Planner(planner) => planner.answered = scans,
            Self::World(_) | Self::Sketcher(_) => {}
        }
    }

    /// What it says before it hears anything.
    pub(super) fn begin(&mut self, tap: &mut impl Tap) -> Result<(), RerunError> {
        match self {
            Self::World(world) => world.observe(tap),
            Self::Sketcher(run) => sketch(run, tap)?,
            Self::Localizer(_) | Self::Planner(_) => {}
        }
        Ok(())
    }

    /// What it says to a message of another process; how long its core took.
    pub(super) fn hear(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        match self {
            Self::World(world) => world.hear(message, tap),
            Self::Sketcher(_) => Ok(Duration::ZERO),
            Self::Localizer(localizer) => localizer.hear(message, tap),
            Self::Planner(planner) => planner.hear(message, tap),
        }
    }
}

fn sketch(run: &RunConfig, tap: &mut impl Tap) -> Result<(), RehearsalError> {
    let (drawing, places) = sketchnav_sketcher::understand(run).map_err(RehearsalError::Sketch)?;
    let mut sketch = Outbox::<SketchMap>::new(SKETCH);
    sketchnav_sketcher::fill_sketch(&drawing, &places, &mut sketch.message);
    sketch.send(tap, &drawing.cells);
    let mut route = Outbox::<Route>::new(ROUTE);
    sketchnav_sketcher::fill_route(&places, &mut route.message);
    route.send(tap, &[]);
    Ok(())
}

pub(super) struct World {
    world: SimWorld,
    seq: u64,
    contact: Outbox<Contact>,
    truth: Outbox<GroundTruth>,
    odometry: Outbox<Odometry>,
    scan: Outbox<LaserScan>,
}

impl World {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Ok(Self {
            world: sketchnav_world::build(run)?,
            seq: 0,
            contact: Outbox::new(CONTACT),
            truth: Outbox::new(TRUTH),
            odometry: Outbox::new(ODOMETRY),
            scan: Outbox::new(SCAN),
        })
    }

    fn hear(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        if message.topic.name != "/command" {
            return Ok(Duration::ZERO);
        }
        let (command, _) = message.typed::<VelocityCommand>()?;
        let core = Instant::now();
        if command.last == 0 {
            self.world.step(Some(&command));
            self.observe(tap);
        }
        Ok(core.elapsed())
    }

    fn observe(&mut self, tap: &mut impl Tap) {
        self.seq += 1;
        let header = Header { seq: 0, stamp_ns: self.world.stamp_ns(), source_seq: self.seq };
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
}

pub(super) struct Localizer {
    core: LocalizerCore,
    answered: Option<BTreeSet<u64>>,
    odometry: Option<Odometry>,
    particles: Outbox<Particles>,
    estimate: Outbox<PoseEstimate>,
}

impl Localizer {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Ok(Self {
            core: LocalizerCore::new(run)?,
            answered: None,
            odometry: None,
            particles: Outbox::new(PARTICLES),
            estimate: Outbox::new(ESTIMATE),
        })
    }

    fn hear(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        match message.topic.name.as_str() {
            "/sketch" => {
                let (map, cells) = message.typed::<SketchMap>()?;
                let core = Instant::now();
                self.core.on_sketch(&map, &cells).map_err(RehearsalError::from)?;
                return Ok(core.elapsed());
            }
            "/odometry" => self.odometry = Some(message.typed()?.0),
            "/scan" => return self.answer(&message.typed()?.0, tap),
            _ => {}
        }
        Ok(Duration::ZERO)
    }

    fn answer(&mut self, scan: &LaserScan, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        let Some(odometry) = &self.odometry else { return Ok(Duration::ZERO) };
        if self.answered.as_ref().is_some_and(|scans| !scans.contains(&scan.header.seq)) {
            return Ok(Duration::ZERO);
        }
        let core = Instant::now();
        let due = self.core.particles_due(scan.header.stamp_ns);
        let estimate = self.estimate.blank();
        let particles = due.then(|| self.particles.blank());
        self.core.step(odometry, scan, estimate, particles);
        let spent = core.elapsed();
        if due {
            self.particles.send(tap, &[]);
        }
        self.estimate.send(tap, &[]);
        Ok(spent)
    }
}

pub(super) struct Planner {
    core: PlannerCore,
    answered: Option<BTreeSet<u64>>,
    pace: Pace,
    scan: Option<Box<LaserScan>>,
    odometry: Option<Odometry>,
    plan: Outbox<Plan>,
    command: Outbox<VelocityCommand>,
    status: Outbox<MissionStatus>,
}

impl Planner {
    fn new(run: &RunConfig) -> Result<Self, RehearsalError> {
        Ok(Self {
            core: PlannerCore::new(run)?,
            answered: None,
            pace: run.pace,
            scan: None,
            odometry: None,
            plan: Outbox::new(PLAN),
            command: Outbox::new(COMMAND),
            status: Outbox::new(STATUS),
        })
    }

    fn hear(&mut self, message: &RawMessage, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        let core = Instant::now();
        match message.topic.name.as_str() {
            "/sketch" => {
                let (map, cells) = message.typed::<SketchMap>()?;
                self.core.on_sketch(&map, &cells).map_err(RehearsalError::from)?;
            }
            "/route" => self.core.on_route(&message.typed::<Route>()?.0),
            "/mission" => self.core.on_order(&message.typed::<MissionCommand>()?.0),
            "/odometry" => self.odometry = Some(message.typed()?.0),
            "/scan" => self.scan = Some(Box::new(message.typed()?.0)),
            "/estimate" => return self.answer(&message.typed()?.0, tap),
            _ => return Ok(Duration::ZERO),
        }
        Ok(core.elapsed())
    }

    fn answer(&mut self, estimate: &PoseEstimate, tap: &mut impl Tap) -> Result<Duration, RerunError> {
        let seq = estimate.header.source_seq;
        let is_left_out = self.answered.as_ref().is_some_and(|scans| !scans.contains(&seq));
        let waits = is_left_out || (self.pace == Pace::Lockstep && !self.core.is_ready());
        let (Some(scan), Some(odometry), false) = (&self.scan, &self.odometry, waits) else {
            return Ok(Duration::ZERO);
        };
        let core = Instant::now();
        if self.core.step(estimate, scan, odometry).planned {
            self.core.write_plan(self.plan.blank());
            self.plan.send(tap, &[]);
        }
        self.core.write_command(self.command.blank());
        self.command.send(tap, &[]);
        self.core.write_status(self.status.blank());
        self.status.send(tap, &[]);
        Ok(core.elapsed())
    }
}
