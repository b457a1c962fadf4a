//! The localizer stage, which reports where the robot is in a drawing.
//!
//! The localizer responds to every tick with one estimate. Once per simulated second, it sends a sample of the particles before the
//! estimate. Instants wait for the sketch, unless people draw during the run. The filter starts over with each new sketch. On an
//! order `here`, it starts over at the position given by a person.

use crate::messages::{ESTIMATE, Origin, PARTICLES, Particles, PoseEstimate, SKETCH, SketchMap};
use crate::mission::SketchMission;
use serde::{Deserialize, Serialize};
use sketchnav_mapping::{KidnapDetector, Scan};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::codes::{Process, Tracking};
use sketchnav_schemas::geometry::{Odom, Pose, wrap_angle};
use sketchnav_schemas::message::{LaserScan, MissionCommand, Odometry, PoseM, PosePx};
use sketchnav_schemas::mission::{Mission, MissionError};
use sketchnav_schemas::robot::{Drive, Laser, Robot, RobotError};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Incoming, Instant, Outbox, Remains, Stage, StageError};

use crate::filter::parameters::Parameters;
use crate::filter::{self, Estimate, Filter, FilterError, Start};
use crate::learned::CELLS_PER_M;
use crate::reading::Settings;
use crate::sketch::{CellsError, SketchGrid};

/// Simulation time between two samples of the particle set, in nanoseconds.
const PARTICLES_EVERY_NS: u64 = 1_000_000_000;

/// An error that prevents the localizer from working.
#[derive(Debug, thiserror::Error)]
pub enum LocalizerError {
    /// The part of the mission for this navigator is invalid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The robot has no laser or no odometry.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A parameter or the start is invalid.
    #[error(transparent)]
    Localization(#[from] FilterError),
    /// The sketch's cells do not match its size.
    #[error(transparent)]
    Cells(#[from] CellsError),
}

/// Returns the localizer's parameters in a sketch of this origin, and the robot's laser. Also checks that the robot has
/// odometry.
///
/// # Errors
/// [`LocalizerError`], which names the key of the mission or of the robot file.
pub fn demanded(
    mission: &Mission,
    robot: &Robot,
    origin: Origin,
) -> Result<(Parameters, Laser), LocalizerError> {
    let parameters = parameters(mission, origin)?;
    robot.odometry()?;
    Ok((parameters, robot.laser()?.clone()))
}

/// Returns the localizer's parameters in a sketch of this origin.
fn parameters(mission: &Mission, origin: Origin) -> Result<Parameters, LocalizerError> {
    let usual = SketchMission::of(mission)?.usual(origin, Parameters::of, Parameters::learned);
    let parameters = mission.parameters.over(Process::Localizer, &usual)?;
    parameters.check().map_err(FilterError::from)?;
    Ok(parameters)
}

/// Everything that changes from scan to scan, which is what a checkpoint contains. `F` is the filter's own
/// state, or a reference to it when the state is only written. The same applies to `K`, the detector.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State<F = filter::State, K = KidnapDetector> {
    filter: Option<F>,
    /// The odometry of the last scan, as x and y in metres and the z and w of the orientation's quaternion.
    odometry: Option<[f64; 4]>,
    estimate: Option<Estimate>,
    particles_due_ns: u64,
    sketch_seq: u64,
    kidnapping: Option<K>,
}

/// The localizer of a run.
#[derive(Debug)]
pub struct Localizer {
    mission: Mission,
    laser: Laser,
    drive: Drive,
    seed: u64,
    waits_for_sketch: bool,
    filter: Option<Filter>,
    particles_due_ns: u64,
    /// Notices that somebody has carried the robot, unless the method is a published one.
    kidnapping: Option<KidnapDetector>,
    /// Number of the sketch that the filter belongs to, or 0 before the first sketch.
    sketch_seq: u64,
    /// The odometry of the last scan.
    odometry: Option<PoseM>,
    estimate: Option<Estimate>,
    /// Where the robot was, if a better estimate exists than the start marked in the drawing.
    start: Option<Start>,
    /// The start that the drawing marks.
    marked: Option<Start>,
    /// Whether the drawing marks the heading, too.
    knows_heading: bool,
    /// Orders given up to this time are ignored as too old. In nanoseconds.
    too_old_ns: Option<u64>,
}

/// Returns the start of a robot that may be anywhere in a sketch of this size, as uncertain as if a person had marked it.
fn as_if_marked(anywhere: Start, [width, height]: [usize; 2]) -> Start {
    let usual = Settings::default();
    Start {
        spread_px: usual.start_spread_share * (width as f64).hypot(height as f64),
        spread_rad: usual.start_spread_deg.to_radians(),
        ..anywhere
    }
}

impl Localizer {
    /// Creates the localizer of a run, with parameters from the mission.
    ///
    /// # Errors
    /// [`LocalizerError`], which names the key of the mission or of the robot file.
    pub fn new(run: &RunConfig) -> Result<Self, LocalizerError> {
        let origin = SketchMission::of(&run.mission)?.expected_origin();
        let (_, laser) = demanded(&run.mission, &run.robot, origin)?;
        let (drive, seed) = (run.robot.drive, run.seed);
        Ok(Self {
            mission: run.mission.clone(),
            laser,
            drive,
            seed,
            waits_for_sketch: !run.pad.draws(),
            filter: None,
            particles_due_ns: 0,
            kidnapping: None,
            sketch_seq: 0,
            odometry: None,
            estimate: None,
            start: None,
            marked: None,
            knows_heading: false,
            too_old_ns: None,
        })
    }

    /// Starts over at the position given by a person, on an order `here`. The position is as uncertain as the mark of the start. If
    /// the order gives no heading, the estimated heading is used, or any heading if the robot is lost. The order is ignored if the
    /// position is outside the drawing, if there is no drawing yet, or if the order was given before the estimate from which this
    /// localizer started.
    fn on_order(&mut self, order: &MissionCommand) {
        let is_old = self.too_old_ns.is_some_and(|old_ns| order.header.stamp_ns <= old_ns);
        let Some(here) = order.here().filter(|_| !is_old) else { return };
        let (Some(filter), Some(marked)) = (&mut self.filter, self.marked) else { return };
        let is_known = |estimate: &Estimate| estimate.tracking != Tracking::Lost && !filter.is_unplaced();
        let known = self.estimate.filter(is_known);
        let heading = here.yaw_rad.or(known.map(|estimate| estimate.pose.yaw_rad));
        let yaw_rad = heading.unwrap_or(marked.pose.yaw_rad);
        // Before the first scan, the heading is the marked one, if there is a mark.
        let is_any = heading.is_none() && (self.estimate.is_some() || !self.knows_heading);
        let spread_rad = if is_any { std::f64::consts::PI } else { marked.spread_rad };
        let pose = Pose::new(here.at.x, here.at.y, wrap_angle(yaw_rad));
        // A place outside the drawing is ignored.
        let _ = filter.tell(Start { pose, spread_rad, ..marked });
    }

    /// Starts the filter in a sketch, which is the first or replaces another. `cells` are the bytes that follow the message.
    ///
    /// # Errors
    /// [`LocalizerError::Cells`] if the cells do not match the size of the sketch, and [`LocalizerError::Localization`] if the
    /// start is outside the sketch.
    fn on_sketch(&mut self, map: &SketchMap, cells: &[u8]) -> Result<(), LocalizerError> {
        let sketch = SketchGrid::of_map(map, cells)?;
        let marked = map.start();
        let mut parameters = parameters(&self.mission, map.origin())?;
        if map.is_learned() {
            // The scale is known.
            parameters.building_size_m = filter::extent_px(&sketch) / CELLS_PER_M as f32;
        }
        let begin = |start| {
            let mounting = (&self.laser).into();
            Filter::new(&sketch, mounting, self.drive, parameters.clone(), start, self.seed)
        };
        // The start is at least as uncertain as a mark, since the covariance does not cover everything.
        let size = [sketch.width(), sketch.height()];
        let mark = if marked.is_anywhere(size) { as_if_marked(marked, size) } else { marked };
        self.knows_heading = !marked.has_any_heading();
        let last = self.start.take().map(|last| Start {
            spread_px: last.spread_px.max(mark.spread_px),
            spread_rad: last.spread_rad.max(mark.spread_rad),
            ..last
        });
        self.filter = Some(last.and_then(|last| begin(last).ok()).map_or_else(|| begin(marked), Ok)?);
        (self.sketch_seq, self.estimate, self.marked) = (map.header.seq, None, Some(mark));
        let method = SketchMission::of(&self.mission)?.method_in(map.origin());
        self.kidnapping = method.is_ours().then(KidnapDetector::default);
        Ok(())
    }

    /// Processes a new scan, if there is one, and the odometry of the same time. Without a new scan, the last estimate remains
    /// valid.
    fn observe(&mut self, odometry: &Odometry, scan: Option<&LaserScan>) {
        match (scan, &mut self.filter) {
            (Some(scan), Some(filter)) => {
                let (robot, seen) = (odometry.pose(), Scan::of_message(scan, self.laser.mount()));
                if self.kidnapping.as_mut().is_some_and(|detector| detector.observe(robot, &seen)) {
                    filter.begin_elsewhere(&robot);
                }
                self.estimate = Some(filter.step(&robot, scan));
            }
            (None, Some(_)) if self.estimate.is_some() => return,
            _ => {}
        }
        self.odometry = Some(odometry.pose);
    }

    fn write_particles(&self, out: &mut Particles) {
        if let Some(filter) = &self.filter {
            filter.particles().sample(out);
        }
    }

    /// Writes the estimate. Before there is a sketch, the estimate reports that the localizer is waiting for one.
    fn write_estimate(&self, out: &mut PoseEstimate) {
        out.odometry = self.odometry.unwrap_or_else(|| PoseM::new(&Pose::<Odom>::new(0.0, 0.0, 0.0)));
        out.tracking = Tracking::Waiting.code();
        out.pose = PosePx::new(&Pose::new(0.0, 0.0, 0.0));
        if let (Some(filter), Some(estimate)) = (&self.filter, &self.estimate) {
            write_estimate(estimate, out);
            out.particle_count = if filter.is_unplaced() { 0 } else { filter.particles().len() as u32 };
        }
    }
}

impl Stage for Localizer {
    const FORM: &'static str = "sketch localizer 10";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        if let Some(sketch) = message.on(SKETCH)? {
            self.on_sketch(sketch, message.cells())?;
        } else if let Some(order) = message.order()? {
            self.on_order(order);
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.filter.is_some() || !self.waits_for_sketch
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(odometry) = instant.newest(ODOMETRY)? else { return Ok(()) };
        self.observe(odometry, instant.fresh(SCAN)?);
        let has_particles = self.filter.as_ref().is_some_and(|filter| !filter.is_unplaced());
        if self.estimate.is_some() && has_particles && instant.stamp_ns >= self.particles_due_ns {
            out.send(PARTICLES, |particles| self.write_particles(particles))?;
            self.particles_due_ns = instant.stamp_ns + PARTICLES_EVERY_NS;
        }
        out.send(ESTIMATE, |estimate| self.write_estimate(estimate))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        let filter = self.filter.as_ref().map(Filter::state);
        let odometry = self.odometry.map(|o| [o.x_m, o.y_m, o.orientation_z, o.orientation_w]);
        let (particles_due_ns, sketch_seq) = (self.particles_due_ns, self.sketch_seq);
        let kidnapping = self.kidnapping.as_ref();
        State { filter, odometry, estimate: self.estimate, particles_due_ns, sketch_seq, kidnapping }
    }

    /// If a newer sketch than that of the state has arrived, the filter starts over in the newer one.
    fn restore(&mut self, state: State) -> Result<(), StageError> {
        let is_same = state.sketch_seq == self.sketch_seq;
        if let (Some(filter), Some(before)) = (&mut self.filter, state.filter.filter(|_| is_same)) {
            filter.restore(before);
            (self.estimate, self.kidnapping) = (state.estimate, state.kidnapping);
        }
        self.odometry = state.odometry.map(|[x_m, y_m, orientation_z, orientation_w]| PoseM {
            x_m,
            y_m,
            orientation_z,
            orientation_w,
        });
        self.particles_due_ns = state.particles_due_ns;
        Ok(())
    }

    /// Once a sketch arrives, the filter starts at the robot's pose in the last estimate instead of at the
    /// marked start. The estimate is not used if it was still waiting for a sketch, or if the robot might have been anywhere.
    fn recover(&mut self, remains: &dyn Remains) {
        let is_known = |last: &PoseEstimate| last.tracking != Tracking::Waiting.code() && last.is_placed();
        let Some(last) = remains.of(ESTIMATE).filter(is_known) else { return };
        let variance = |i: usize| last.covariance[6 * i];
        let (spread_px, spread_rad) = (variance(0).max(variance(1)).sqrt(), variance(2).sqrt());
        self.start = Some(Start { pose: last.pose.pose(), spread_px, spread_rad });
        self.too_old_ns = Some(last.header.stamp_ns);
    }
}

fn write_estimate(estimate: &Estimate, out: &mut PoseEstimate) {
    out.pose = PosePx::new(&estimate.pose);
    out.scale_a_pxpm = estimate.scale_a_pxpm;
    out.scale_b_pxpm = estimate.scale_b_pxpm;
    out.covariance = estimate.covariance;
    out.effective_sample_size = estimate.effective_sample_size;
    out.fit = estimate.fit;
    out.tracking = estimate.tracking.code();
}
