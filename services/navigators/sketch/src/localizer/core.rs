//! The localizer without its channels: messages in, messages out.
//!
//! It knows no channel and no clock; the same messages give the same estimates, to the bit.

use crate::localization::parameters::Parameters;
use crate::localization::{self, Estimate, LocalizationError, Localizer, Start};
use crate::sketch::{CellsError, SketchGrid};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{Process, Tracking};
use sketchnav_schemas::geometry::{Odom, Pose, wrap_angle};
use sketchnav_schemas::message::{
    LaserScan, MissionCommand, Odometry, Particles, PoseEstimate, PoseM, PosePx, SketchMap,
};
use sketchnav_schemas::mission::{Mission, MissionError, overlaid};
use sketchnav_schemas::robot::{Drive, Laser, Robot, RobotError};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::sketch_mission::SketchMission;

/// Simulation time between two samples of the particle set.
const PARTICLES_EVERY_NS: u64 = 1_000_000_000;

/// Why the localizer cannot work.
#[derive(Debug, thiserror::Error)]
pub enum CoreError {
    /// The mission's part for this navigator.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The mission's table of parameters has an unknown key or a wrong type.
    #[error("parameters.localizer: {0}")]
    Parameters(#[from] toml::de::Error),
    /// The robot lacks the laser or the odometry.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A parameter or the start cannot be.
    #[error(transparent)]
    Localization(#[from] LocalizationError),
    /// The sketch does not hold what it says.
    #[error(transparent)]
    Cells(#[from] CellsError),
}

/// The parameters that a mission gives the localizer, and the robot's laser; the robot has odometry, too.
///
/// # Errors
/// [`CoreError`] with the key of the mission, or of the robot file.
pub fn demanded(mission: &Mission, robot: &Robot) -> Result<(Parameters, Laser), CoreError> {
    let method = SketchMission::of(mission)?.method;
    let parameters = overlaid(&Parameters::of(method), mission.parameters.of(Process::Localizer))?;
    parameters.check().map_err(LocalizationError::from)?;
    robot.odometry()?;
    Ok((parameters, robot.laser()?.clone()))
}

/// Everything that changes from scan to scan: what a checkpoint holds. `F` is the filter's own state, or
/// a reference to it where it is only to be written.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State<F = localization::State> {
    filter: Option<F>,
    /// The odometry of the last scan, and what came of it.
    odometry: Option<[f64; 4]>,
    estimate: Option<Estimate>,
    particles_due_ns: u64,
    sketch_seq: u64,
}

impl State {
    /// The sketch that it belongs to; 0 where none had come.
    pub fn sketch_seq(&self) -> u64 {
        self.sketch_seq
    }
}

/// The localizer: waits for a sketch, then answers each instant with an estimate.
#[derive(Debug)]
pub struct Core {
    parameters: Parameters,
    laser: Laser,
    drive: Drive,
    seed: u64,
    localizer: Option<Localizer>,
    particles_due_ns: u64,
    /// The sketch that the filter belongs to; 0 before the first.
    sketch_seq: u64,
    /// The odometry of the last scan, and what came of it.
    odometry: Option<PoseM>,
    estimate: Option<Estimate>,
    /// Where the robot was, known better than where the drawing marks the start.
    start: Option<Start>,
    /// Where the drawing marks the start.
    marked: Option<Start>,
    /// Orders that were given up to this time are too old, nanoseconds.
    too_old_ns: Option<u64>,
}

impl Core {
    /// Reads the parameters out of the mission.
    ///
    /// # Errors
    /// [`CoreError`] with the key of the mission, or of the robot file.
    pub fn new(run: &RunConfig) -> Result<Self, CoreError> {
        let (parameters, laser) = demanded(&run.mission, &run.robot)?;
        let (drive, seed) = (run.robot.drive, run.seed);
        Ok(Self {
            parameters,
            laser,
            drive,
            seed,
            localizer: None,
            particles_due_ns: 0,
            sketch_seq: 0,
            odometry: None,
            estimate: None,
            start: None,
            marked: None,
            too_old_ns: None,
        })
    }

    /// Has the filter begin at the robot's place of an estimate, once a sketch comes, instead of at its start. It is
    /// for a localizer that knows nothing but its last message. An estimate that still waits for a sketch says
    /// nothing.
    pub fn begin_at(&mut self, last: &PoseEstimate) {
        if last.tracking == Tracking::Waiting.code() {
            return;
        }
        let variance = |i: usize| last.covariance[6 * i];
        let (spread_px, spread_rad) = (variance(0).max(variance(1)).sqrt(), variance(2).sqrt());
        self.start = Some(Start { pose: last.pose.pose(), spread_px, spread_rad });
        self.too_old_ns = Some(last.header.stamp_ns);
    }

    /// Begins anew where a person says that the robot is, by an order `here`. The place may be as far off as the mark of
    /// the start. A heading that is not given is the estimate's, or any where the robot is lost. It is ignored outside of
    /// the drawing, before there is one, and where it was given before the estimate that this localizer has begun at.
    pub fn on_order(&mut self, order: &MissionCommand) {
        let is_old = self.too_old_ns.is_some_and(|old_ns| order.header.stamp_ns <= old_ns);
        let Some(here) = order.here().filter(|_| !is_old) else { return };
        let (Some(localizer), Some(marked)) = (&mut self.localizer, self.marked) else { return };
        let known = self.estimate.filter(|estimate| estimate.tracking != Tracking::Lost);
        let heading = here.yaw_rad.or(known.map(|estimate| estimate.pose.yaw_rad));
        let yaw_rad = heading.unwrap_or(marked.pose.yaw_rad);
        // Before the first scan the heading is the one that is marked.
        let is_any = heading.is_none() && self.estimate.is_some();
        let spread_rad = if is_any { std::f64::consts::PI } else { marked.spread_rad };
        let pose = Pose::new(here.at.x, here.at.y, wrap_angle(yaw_rad));
        // Nobody is where there is no drawing.
        let _ = localizer.tell(Start { pose, spread_rad, ..marked });
    }

    /// Takes in a sketch, the first or another; `cells` are the bytes behind the message. The filter begins
    /// anew.
    ///
    /// # Errors
    /// [`CoreError::Cells`]; [`CoreError::Localization`] where the start is outside the sketch.
    pub fn on_sketch(&mut self, map: &SketchMap, cells: &[u8]) -> Result<(), CoreError> {
        let sketch = SketchGrid::of_map(map, cells)?;
        let marked = Start {
            pose: map.start.pose(),
            spread_px: map.start_spread_px,
            spread_rad: map.start_spread_rad,
        };
        let begin = |start| {
            let (mounting, drive, parameters) = ((&self.laser).into(), self.drive, self.parameters.clone());
            Localizer::new(&sketch, mounting, drive, parameters, start, self.seed)
        };
        // As unsure as at the start of the mission, at least: there is more to it than a covariance.
        let last = self.start.take().map(|last| Start {
            spread_px: last.spread_px.max(marked.spread_px),
            spread_rad: last.spread_rad.max(marked.spread_rad),
            ..last
        });
        self.localizer = Some(last.and_then(|last| begin(last).ok()).map_or_else(|| begin(marked), Ok)?);
        (self.sketch_seq, self.estimate, self.marked) = (map.header.seq, None, Some(marked));
        Ok(())
    }

    /// The whole changing state, for a checkpoint; nothing is copied.
    pub fn state(&self) -> State<&localization::State> {
        let filter = self.localizer.as_ref().map(Localizer::state);
        let odometry = self.odometry.map(|o| [o.x_m, o.y_m, o.orientation_z, o.orientation_w]);
        let (particles_due_ns, sketch_seq) = (self.particles_due_ns, self.sketch_seq);
        State { filter, odometry, estimate: self.estimate, particles_due_ns, sketch_seq }
    }

    /// Goes on from a checkpoint. Its sketch must have come again; where a newer one has come since, the
    /// filter begins anew in that.
    pub fn restore(&mut self, state: State) {
        let is_same = state.sketch_seq == self.sketch_seq;
        if let (Some(localizer), Some(filter)) = (&mut self.localizer, state.filter.filter(|_| is_same)) {
            localizer.restore(filter);
            self.estimate = state.estimate;
        }
        self.odometry = state.odometry.map(|[x_m, y_m, orientation_z, orientation_w]| PoseM {
            x_m,
            y_m,
            orientation_z,
            orientation_w,
        });
        self.particles_due_ns = state.particles_due_ns;
    }

    /// The number of the sketch that has come last; 0 before the first.
    pub fn sketch_seq(&self) -> u64 {
        self.sketch_seq
    }

    /// Whether a sketch has come.
    pub fn has_sketch(&self) -> bool {
        self.localizer.is_some()
    }

    /// Takes in what the sensors say now: a scan where there is a new one, and the odometry of its time. Without a new
    /// scan the last estimate still holds.
    pub fn step(&mut self, odometry: &Odometry, scan: Option<&LaserScan>) {
        match (scan, &mut self.localizer) {
            (Some(scan), Some(localizer)) => self.estimate = Some(localizer.step(&odometry.pose(), scan)),
            (None, Some(_)) if self.estimate.is_some() => return,
            _ => {}
        }
        self.odometry = Some(odometry.pose);
    }

    /// Whether a sample of the particles is due at this time: once a simulated second.
    pub fn particles_due(&self, stamp_ns: u64) -> bool {
        self.estimate.is_some() && stamp_ns >= self.particles_due_ns
    }

    /// Writes a sample of the particles, except for its header.
    pub fn write_particles(&mut self, stamp_ns: u64, out: &mut Particles) {
        if let Some(localizer) = &self.localizer {
            localizer.particles().sample(out);
        }
        self.particles_due_ns = stamp_ns + PARTICLES_EVERY_NS;
    }

    /// Writes the estimate, except for its header; before there is a sketch, that it waits for one.
    pub fn write_estimate(&self, out: &mut PoseEstimate) {
        out.odometry = self.odometry.unwrap_or_else(|| PoseM::new(&Pose::<Odom>::new(0.0, 0.0, 0.0)));
        out.tracking = Tracking::Waiting.code();
        out.pose = PosePx::new(&Pose::new(0.0, 0.0, 0.0));
        if let (Some(localizer), Some(estimate)) = (&self.localizer, &self.estimate) {
            write_estimate(estimate, out);
            out.particle_count = localizer.particles().len() as u32;
        }
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
