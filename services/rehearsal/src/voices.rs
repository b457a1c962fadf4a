//! What each core says in its turn, and in which order: as its process says it, byte for byte.
//!
//! A voice holds a core and the places where its messages are made. [`crate::Rehearsal`] lets the voices hear
//! each other; [`crate::rerun`] lets one of them hear a recording.

use std::any::Any;
use std::convert::Infallible;
use std::time::{Duration, Instant};

use sketchnav_localizer::core::{Core as LocalizerCore, CoreError as LocalizerError};
use sketchnav_planner::core::{Core as PlannerCore, PlannerError};
use sketchnav_schemas::channels::{
    COMMAND, CONTACT, Channel, ESTIMATE, ODOMETRY, PARTICLES, PLAN, ROUTE, SCAN, SKETCH, SONAR, STATUS, TRUTH,
};
use sketchnav_schemas::message::{
    Contact, GroundTruth, Header, LaserScan, Message, MissionStatus, Odometry, Particles, Plan, PoseEstimate,
    Route, SketchMap, SonarScan, VelocityCommand,
};
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::{Floor, Senses, SimError, Simulation};
use sketchnav_sketcher::{Drawing, Places};

use crate::Tap;

/// Where a channel's messages are made, one after the other, in the same place.
pub(crate) struct Outbox<T> {
    channel: Channel<T>,
    pub(crate) message: Box<T>,
    pub(crate) last_seq: u64,
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

/// Adds what the work took to `spent`.
fn timed<T>(spent: &mut Duration, work: impl FnOnce() -> T) -> T {
    let began = Instant::now();
    let done = work();
    *spent += began.elapsed();
    done
}

/// The sketcher: the drawing and the tasks in it, once; the drawing's message and the tasks'.
pub(crate) fn sketch(
    (drawing, places): &(Drawing, Places),
    tap: &mut impl Tap,
) -> (Box<SketchMap>, Box<Route>) {
    let mut sketch = Outbox::<SketchMap>::new(SKETCH);
    sketchnav_sketcher::fill_sketch(drawing, places, &mut sketch.message);
    sketch.send(tap, &drawing.cells);
    let mut route = Outbox::<Route>::new(ROUTE);
    sketchnav_sketcher::fill_route(places, &mut route.message);
    route.send(tap, &[]);
    (sketch.message, route.message)
}

/// The world: one instant after the other.
pub(crate) struct WorldVoice {
    world: Floor,
    pub(crate) readings: Readings,
    /// How long the world took so far.
    pub(crate) spent: Duration,
}

/// Where the world's messages are made.
pub(crate) struct Readings {
    contact: Outbox<Contact>,
    truth: Outbox<GroundTruth>,
    sonar: Outbox<SonarScan>,
    pub(crate) odometry: Outbox<Odometry>,
    pub(crate) scan: Outbox<LaserScan>,
}

/// Shows the tap what the world says, and counts how long that takes.
struct Shown<'a, T> {
    readings: &'a mut Readings,
    tap: &'a mut T,
    spent: &'a mut Duration,
    source_seq: u64,
}

impl<S: Tap> Senses for Shown<'_, S> {
    type Error = Infallible;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Infallible> {
        let Readings { contact, truth, sonar, odometry, scan } = &mut *self.readings;
        let boxes: [&mut dyn Any; 5] = [contact, truth, sonar, odometry, scan];
        let place = boxes.into_iter().find_map(|place| place.downcast_mut::<Outbox<T>>());
        let Some(place) = place else { unreachable!("a world has no voice for {}", channel.spec.name) };
        *place.blank().header_mut() = Header { seq: 0, stamp_ns, source_seq: self.source_seq };
        timed(self.spent, || fill(&mut place.message));
        place.send(self.tap, &[]);
        Ok(())
    }
}

impl WorldVoice {
    pub(crate) fn new(run: &RunConfig) -> Result<Self, SimError> {
        let readings = Readings {
            contact: Outbox::new(CONTACT),
            truth: Outbox::new(TRUTH),
            sonar: Outbox::new(SONAR),
            odometry: Outbox::new(ODOMETRY),
            scan: Outbox::new(SCAN),
        };
        Ok(Self { world: sketchnav_world::build(run)?, readings, spent: Duration::ZERO })
    }

    /// Goes on to the next instant, by a command or by the one before.
    pub(crate) fn step(&mut self, command: Option<&VelocityCommand>) {
        timed(&mut self.spent, || self.world.step(command));
    }

    /// What the instant has: touches, the truth, the odometry, what the other sensors read.
    pub(crate) fn observe(&mut self, tap: &mut impl Tap) {
        let Self { world, readings, spent } = self;
        let source_seq = readings.scan.last_seq + 1;
        let Ok(()) = world.sense(&mut Shown { readings, tap, spent, source_seq });
    }
}

/// The localizer: an estimate to each scan, now and then with a sample of the particles.
pub(crate) struct LocalizerVoice {
    core: LocalizerCore,
    particles: Outbox<Particles>,
    pub(crate) estimate: Outbox<PoseEstimate>,
    /// How long the core took so far.
    pub(crate) spent: Duration,
}

impl LocalizerVoice {
    pub(crate) fn new(run: &RunConfig) -> Result<Self, LocalizerError> {
        Ok(Self {
            core: LocalizerCore::new(run)?,
            particles: Outbox::new(PARTICLES),
            estimate: Outbox::new(ESTIMATE),
            spent: Duration::ZERO,
        })
    }

    pub(crate) fn on_sketch(&mut self, map: &SketchMap, cells: &[u8]) -> Result<(), LocalizerError> {
        timed(&mut self.spent, || self.core.on_sketch(map, cells))
    }

    pub(crate) fn answer(&mut self, odometry: &Odometry, scan: &LaserScan, tap: &mut impl Tap) {
        let Self { core, particles, estimate, spent } = self;
        let due = core.particles_due(scan.header.stamp_ns);
        let (blank, sample) = (estimate.blank(), due.then(|| particles.blank()));
        timed(spent, || core.step(odometry, scan, blank, sample));
        if due {
            particles.send(tap, &[]);
        }
        estimate.send(tap, &[]);
    }
}

/// The planner: a command and how the mission stands to each estimate, now and then a plan.
pub(crate) struct PlannerVoice {
    core: PlannerCore,
    plan: Outbox<Plan>,
    pub(crate) command: Outbox<VelocityCommand>,
    status: Outbox<MissionStatus>,
    /// How long the core took so far.
    pub(crate) spent: Duration,
}

impl PlannerVoice {
    pub(crate) fn new(run: &RunConfig) -> Result<Self, PlannerError> {
        Ok(Self {
            core: PlannerCore::new(run)?,
            plan: Outbox::new(PLAN),
            command: Outbox::new(COMMAND),
            status: Outbox::new(STATUS),
            spent: Duration::ZERO,
        })
    }

    /// Has the core take what it does not answer: the drawing, the tasks, an order.
    pub(crate) fn take<T>(&mut self, take: impl FnOnce(&mut PlannerCore) -> T) -> T {
        timed(&mut self.spent, || take(&mut self.core))
    }

    pub(crate) fn is_ready(&self) -> bool {
        self.core.is_ready()
    }

    /// Whether that was the last command of the mission.
    pub(crate) fn answer(
        &mut self,
        estimate: &PoseEstimate,
        scan: &LaserScan,
        odometry: &Odometry,
        tap: &mut impl Tap,
    ) -> bool {
        let Self { core, plan, command, status, spent } = self;
        let step = timed(spent, || {
            let step = core.step(estimate, scan, odometry);
            if step.planned {
                core.write_plan(plan.blank());
            }
            core.write_command(command.blank());
            core.write_status(status.blank());
            step
        });
        if step.planned {
            plan.send(tap, &[]);
        }
        command.send(tap, &[]);
        status.send(tap, &[]);
        step.last
    }
}
