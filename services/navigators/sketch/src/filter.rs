//! Monte Carlo localization in a sketch, which estimates the pose and two local scales at once (Boniardi et al. 2015, III-A).
//!
//! The state of a particle is (x, y, θ, a, b): a pose in the drawing, in pixels, and the scales at that pose along and across the
//! walls' direction, in pixels per metre. An update propagates the particles by the scaled odometry (equation 6), weighs them by
//! the scan (equations 7 and 8, or the beam model), and resamples them. Between updates, the estimate is dead-reckoned through its
//! scales.
//!
//! The filter has no access to clocks, files or the ground truth, and does not allocate after [`Filter::new`]. Equal inputs result
//! in equal bits.

pub mod adaptive;
pub mod beam_model;
pub mod beams;
mod bits;
pub mod confidence;
pub mod doors;
pub mod field;
pub mod grid;
mod half_turn;
pub mod lanes;
pub mod metric;
pub mod mode;
pub mod motion;
pub mod outline;
pub mod parameters;
pub mod particles;
mod placing;
pub mod range_code;
pub mod range_table;
pub mod scales;
pub mod search;
pub mod sight;
pub mod start;
mod sweep;
pub mod weighing;
pub mod workers;

use fearless_simd::Level;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::geometry::{Odom, Pose, Sketch, wrap_angle};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::robot::Drive;
use sketchnav_schemas::seed;

use crate::sketch::SketchGrid;
use adaptive::SampleSize;
use beam_model::{BeamModel, Room, learned};
use beams::{Beams, Mounting};
use confidence::Confidence;
use field::Field;
use grid::Grid;
use half_turn::HalfTurn;
use metric::ScaleFrame;
use mode::{Kernel, Mode, find_mode};
use motion::{Motion, Proportions, Terrain, perturb, propagate};
use outline::enclosed;
use parameters::{Likelihood, ParameterError, Parameters};
use particles::{ParticleSet, Resampler};
use placing::Placing;
use range_table::{RANGE_TABLE_CELLS, RangeTable};
use scales::{ScaledPose, least_squares};
use search::Search;
pub use start::{Start, extent_px};
use start::{believed, first_anisotropy};
use weighing::{BeamModelOfScan, FieldOfScan, weigh};
use workers::Workers;

/// Amount by which the fit of a scan without valid beams falls below the limit at which the robot counts as lost.
const BLIND: f32 = 1.0;

/// The filter's estimate of the robot's pose in the drawing after a scan.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// Pose at the mode of the particles. It is never a mean over several modes.
    pub pose: Pose<Sketch>,
    /// Local scale along the wall direction, in pixels per metre.
    pub scale_a_pxpm: f64,
    /// Local scale across the wall direction, in pixels per metre.
    pub scale_b_pxpm: f64,
    /// Covariance of (x px, y px, yaw rad, a px/m, b px/m) around the mode, in row-major order.
    pub covariance: [f64; 25],
    /// Kish's effective sample size of the last update, before resampling.
    pub effective_sample_size: f64,
    /// Mean log likelihood of a beam at the estimate, by the beam model.
    pub fit: f64,
    /// Confidence in the estimate.
    pub tracking: Tracking,
}

/// An error that prevents localization.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilterError {
    /// A parameter is invalid.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The start is outside the drawing.
    #[error("start: expected a place inside the drawing of {width} × {height} px, found ({x:.1}, {y:.1})")]
    StartOutside {
        /// Position of the start along x, in pixels.
        x: f64,
        /// Position of the start along y, upwards, in pixels.
        y: f64,
        /// Width of the drawing, in pixels.
        width: usize,
        /// Height of the drawing, in pixels.
        height: usize,
    },
}

/// All mutable state of the filter, as stored in checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    particles: ParticleSet,
    rng: Pcg64Mcg,
    proportions: Proportions,
    /// Typical error of the drawing's ranges, as |ln(measured / expected)|.
    drawing_error: f32,
    started: bool,
    /// Odometry at the last update, as (x m, y m, yaw rad).
    updated_at: [f64; 3],
    /// Odometry at the last scan.
    odometry: [f64; 3],
    travelled_m: f64,
    turned_rad: f64,
    /// The mode at the last update.
    mode: ScaledPose,
    /// The heaviest particle of the last update.
    best: ScaledPose,
    covariance: Vec<f64>,
    effective_sample_size: f64,
    confidence: Confidence,
    /// The start stated by a person, which takes effect with the next scan.
    told: Option<Start>,
    /// The state of the search over the whole map.
    search: Option<search::State>,
    placing: Placing,
    /// Whether somebody has carried the robot since it was last marked.
    is_kidnapped: bool,
    /// Yaw by the odometry when the filter started, in radians.
    started_yaw_rad: f64,
}

/// The localization filter, with the prepared drawing, its state and its working memory.
#[derive(Debug, Clone)]
pub struct Filter {
    parameters: Parameters,
    mounting: Mounting,
    drive: Drive,
    start: Start,
    /// Width and height of the drawing, in pixels.
    size_px: [usize; 2],
    grid: Grid,
    frame: ScaleFrame,
    scale_guess_pxpm: f32,
    beam_model: BeamModel,
    room: Room,
    weigher: Weigher,
    level: Level,
    workers: Workers,
    beams: Beams,
    resampler: Resampler,
    sample_size: SampleSize,
    search: Option<Search>,
    half_turn: Option<HalfTurn>,
    state: State,
}

impl Filter {
    /// Creates a filter and prepares the drawing for it. The first scan starts the filter.
    ///
    /// # Errors
    /// [`FilterError`] if a parameter is invalid or the start is outside the drawing.
    pub fn new(
        sketch: &SketchGrid,
        mounting: Mounting,
        drive: Drive,
        parameters: Parameters,
        start: Start,
        mission_seed: u64,
    ) -> Result<Self, FilterError> {
        parameters.check()?;
        let size_px = [sketch.width(), sketch.height()];
        let placing = Placing::of(&start, size_px, &parameters);
        let (most, room) = (placing.most_particles(&parameters), Placing::room(&parameters));
        start.check_within(size_px)?;
        let scale_guess_pxpm = extent_px(sketch) / parameters.building_size_m;
        let door_px = parameters.door_width_m * scale_guess_pxpm;
        let widened = (door_px > 0.0).then(|| doors::widened(sketch, door_px)).flatten();
        let sketch = widened.as_ref().unwrap_or(sketch);
        let gap_px = parameters.outline_gap_m * scale_guess_pxpm;
        let enclosed = (gap_px > 0.0).then(|| enclosed(sketch, start.pose.position(), gap_px)).flatten();
        let sketch = enclosed.as_ref().unwrap_or(sketch);
        let grid = Grid::new(sketch, parameters.grid_cells);
        let mut filter = Self {
            mounting,
            drive,
            start,
            size_px,
            frame: ScaleFrame::new(sketch.wall_direction_rad()),
            scale_guess_pxpm,
            beam_model: BeamModel::new(&parameters),
            room: Room::new(parameters.beams),
            weigher: Weigher::new(sketch, &grid, &parameters, scale_guess_pxpm),
            level: Level::new(),
            workers: Workers::default(),
            beams: Beams::with_capacity(parameters.beams),
            resampler: Resampler::new(room),
            sample_size: SampleSize::new(parameters.particles),
            search: None,
            half_turn: HalfTurn::of(&grid).filter(|_| !parameters.searches),
            state: State {
                search: parameters.searches.then(|| match start.is_anywhere(size_px) {
                    true => search::State::anywhere(&start.pose),
                    false => search::State::certain(),
                }),
                placing,
                ..State::new(&parameters, mission_seed, most)
            },
            grid,
            parameters,
        };
        filter.state.particles.reserve(room);
        if let (true, Weigher::Beam(table)) = (filter.parameters.searches, &filter.weigher) {
            let map = search::Map { sketch, grid: &filter.grid, table, scale_pxpm: scale_guess_pxpm };
            filter.search = Some(Search::new(&map, mounting, &filter.parameters));
        }
        Ok(filter)
    }

    /// Lends threads to the filter, which speed up updates without changing their results.
    pub fn set_workers(&mut self, workers: Workers) {
        self.workers = workers;
    }

    /// Processes a scan with the odometry at the same time, and returns the estimated pose of the robot.
    pub fn step(&mut self, odometry: &Pose<Odom>, scan: &LaserScan) -> Estimate {
        self.beams.select(scan, &self.mounting, self.parameters.beams);
        self.beam_model.read(&self.beams, self.state.drawing_error);
        if self.state.told.is_some() {
            // Nothing that was estimated without a start is of use.
            self.state.started &= !self.is_unplaced();
            (self.state.placing, self.state.is_kidnapped) = (Placing::Marked, false);
        }
        match (self.state.started, self.state.told.take()) {
            (false, told) => {
                if let Some(told) = told {
                    self.start = told;
                    self.state.search.iter_mut().for_each(search::State::settle);
                }
                // An update is due at once, also for a robot that was told its place while it stood still.
                (self.state.travelled_m, self.state.turned_rad) = (0.0, 0.0);
                (self.state.confidence, self.state.started_yaw_rad) =
                    (Confidence::default(), odometry.yaw_rad);
                self.begin(odometry);
            }
            (true, Some(told)) => {
                self.begin_anew_at(&told, odometry);
                self.state.search.iter_mut().for_each(search::State::settle);
            }
            (true, None) => {}
        }
        self.state.travel(odometry);
        if !self.search(odometry, scan) {
            return self.guess();
        }
        if self.is_due() {
            self.update();
        }
        self.scatter_if_lost(odometry);
        if self.is_unplaced() { self.guess() } else { self.estimate() }
    }

    /// Places the robot at a pose stated by a person. At the next scan, all particles are redrawn around it.
    ///
    /// # Errors
    /// [`FilterError::StartOutside`] if the place is outside the drawing, in which case the filter does not
    /// change.
    pub fn tell(&mut self, told: Start) -> Result<(), FilterError> {
        told.check_within(self.size_px)?;
        self.state.told = Some(told);
        Ok(())
    }

    /// Returns the particles.
    pub fn particles(&self) -> &ParticleSet {
        &self.state.particles
    }

    /// Returns the state to store in a checkpoint.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Resumes from a checkpoint of a filter with the same drawing and parameters.
    pub fn restore(&mut self, state: State) {
        if state.started {
            self.weigher.suit(&self.grid, &self.parameters, &state.proportions);
        }
        self.state = state;
        self.state.particles.reserve(Placing::room(&self.parameters));
        self.state.search.iter_mut().for_each(search::State::reserve);
    }

    fn is_due(&self) -> bool {
        let (p, s) = (&self.parameters, &self.state);
        let fresh = s.confidence.tracking() == Tracking::Waiting;
        fresh || s.travelled_m >= p.update_distance_m || s.turned_rad >= p.update_turn_rad
    }

    /// Performs one update of the Bayes filter (equation 4).
    fn update(&mut self) {
        let best = self.dead_reckoned(self.state.best);
        let last = self.state.last_mode().map(|mode| self.dead_reckoned(mode));
        let motion = self.state.take_motion();
        if motion.distance_m > 0.0 || motion.turned_rad > 0.0 {
            self.propagate(&motion);
        }
        self.reweight(&best);
        self.state.particles.normalize();
        self.state.best = self.state.particles.best();
        let share = self.locate(last);
        self.resample();
        self.place_if_agreed(share, last, motion.distance_m);
    }

    /// Propagates the particles by the motion (equation 6).
    fn propagate(&mut self, motion: &Motion) {
        let State { particles, rng, proportions, .. } = &mut self.state;
        let terrain = Terrain { grid: &self.grid, frame: &self.frame, proportions: *proportions };
        propagate(particles, motion, self.drive, &terrain, &self.parameters, rng);
    }

    /// Weighs the particles by the scan, according to equation (7) or the beam model. `best` is the predicted pose of the best
    /// particle.
    fn reweight(&mut self, best: &ScaledPose) {
        let per_beam = self.independent_beams() / (self.beams.len() as f32).max(1.0);
        let Self { beams, frame, beam_model, weigher, level, workers, state, .. } = self;
        let set = &mut state.particles;
        match weigher {
            Weigher::Beam(table) => {
                let model = BeamModelOfScan { beam_model, table, beams };
                weigh(set, &model, frame, per_beam, *level, workers);
            }
            Weigher::Field(field) => {
                weigh(set, &FieldOfScan { field, beams }, frame, per_beam, *level, workers);
                if self.parameters.field_scale_width > 0.0 {
                    self.reweight_scales(best);
                }
            }
        }
    }

    /// Returns the effective number of independent beams of the scan.
    fn independent_beams(&self) -> f32 {
        let independent = self.state.placing.independent_beams(&self.parameters);
        (independent * self.beam_model.exactness()).min(self.beams.len() as f32)
    }

    /// Applies the Laplace terms of equation (7) on the virtual scales, which are ray-traced from the predicted pose of the best
    /// particle.
    fn reweight_scales(&mut self, best: &ScaledPose) {
        let p = &self.parameters;
        let found = least_squares(&self.grid, &self.frame, &self.beams, best, p.scales);
        let widths = self.state.proportions.mean_ln_scales.map(|ln| p.field_scale_width * ln.exp());
        let set = &mut self.state.particles;
        for i in 0..set.len() {
            set.log_weight[i] += found.log_likelihood([set.ln_a[i], set.ln_b[i]], widths);
        }
    }

    /// Finds the mode and judges the confidence in it. `last` is the robot's current pose according to the last estimate. Returns
    /// the share of the weight near the mode.
    fn locate(&mut self, last: Option<ScaledPose>) -> f64 {
        let p = &self.parameters;
        let kernel = Kernel {
            radius_px: p.mode_radius_m * self.state.proportions.mean_scale_pxpm(),
            radius_rad: p.mode_radius_rad,
        };
        let mode = find_mode(&self.state.particles, &kernel, last.as_ref(), p.mode_hysteresis);
        let fit = self.fit(&mode.pose);
        if let Some(seen) = self.beam_model.error(&mut self.room) {
            self.state.drawing_error = learned(self.state.drawing_error, seen);
        }
        self.state.set_mode(&mode);
        self.state.effective_sample_size = self.state.particles.effective_sample_size();
        self.state.confidence.update(fit, mode.share, &self.parameters);
        mode.share
    }

    fn resample(&mut self) {
        let p = &self.parameters;
        let State { particles, rng, confidence, proportions, effective_sample_size, placing, .. } =
            &mut self.state;
        if *effective_sample_size >= p.resample_below * particles.len() as f64 {
            return;
        }
        self.resampler.resample(particles, rng.random());
        let is_anywhere = matches!(placing, Placing::Anywhere(_));
        if !is_anywhere && (1..p.particles).contains(&p.least_particles) {
            let wanted = self.sample_size.wanted(particles, proportions.mean_scale_pxpm(), p);
            self.resampler.resample_to(particles, wanted, rng.random());
        }
        let terrain = Terrain { grid: &self.grid, frame: &self.frame, proportions: *proportions };
        let share = p.perturbed_share + p.perturbed_share_lost * confidence.decline();
        if share > 0.0 {
            perturb(particles, share, &terrain, p, rng);
        }
        if is_anywhere {
            self.scatter_some();
        }
    }

    /// Returns the mean log likelihood of a beam at a pose, by the beam model. A scan without any valid beam fits nowhere, so a
    /// robot without readings eventually counts as lost, however well it was localized before.
    fn fit(&mut self, pose: &ScaledPose) -> f32 {
        if self.beams.is_empty() {
            return self.parameters.lost_below - BLIND;
        }
        let metric = self.frame.px_from_base(pose.yaw_rad, pose.a_pxpm, pose.b_pxpm);
        let place = [pose.x_px, pose.y_px];
        let sum = self.beam_model.log_likelihood(&self.grid, &self.beams, place, &metric, &mut self.room);
        sum / self.beams.len() as f32
    }

    /// Returns the mode of the last update, dead-reckoned to now.
    fn estimate(&mut self) -> Estimate {
        let pose = self.dead_reckoned(self.state.mode);
        let fit = self.fit(&pose);
        let s = &self.state;
        let mut covariance = [0.0; 25];
        covariance.copy_from_slice(&s.covariance);
        Estimate {
            pose: Pose::new(pose.x_px.into(), pose.y_px.into(), wrap_angle(pose.yaw_rad.into())),
            scale_a_pxpm: pose.a_pxpm.into(),
            scale_b_pxpm: pose.b_pxpm.into(),
            covariance,
            effective_sample_size: s.effective_sample_size,
            fit: fit.into(),
            tracking: s.confidence.tracking(),
        }
    }

    /// Moves a pose of the last update by the odometry since then.
    fn dead_reckoned(&self, from: ScaledPose) -> ScaledPose {
        let motion = self.state.motion();
        let metric = self.frame.px_from_base(from.yaw_rad, from.a_pxpm, from.b_pxpm);
        let step = metric.apply(motion.forward_m, motion.left_m);
        ScaledPose {
            x_px: from.x_px + step[0],
            y_px: from.y_px + step[1],
            yaw_rad: metric::wrap(from.yaw_rad + motion.turn_rad),
            ..from
        }
    }

    /// Draws the first particles around the start marked by the person and the scales suggested by the first scan. Later, the
    /// scales are pulled back to the drawing's mean. Noise of the motion model is added once (Boniardi et al. 2015, IV: "sampled
    /// according to the state model").
    fn begin(&mut self, odometry: &Pose<Odom>) {
        let (p, start) = (&self.parameters, &self.start_at(odometry.yaw_rad));
        let first = start.scaled_pose(&self.grid, &self.frame, &self.beams, self.scale_guess_pxpm, p);
        let is_unknown = start.has_any_heading() || start.is_anywhere(self.size_px);
        let best = match is_unknown && self.search.is_none() {
            // The first scan says nothing about the scales if it is not known where it looks.
            true => ScaledPose { a_pxpm: self.scale_guess_pxpm, b_pxpm: self.scale_guess_pxpm, ..first },
            false => believed(&first, p),
        };
        let proportions = Proportions {
            mean_ln_scales: start.mean_ln_scales(&best, self.scale_guess_pxpm, p),
            first_anisotropy: first_anisotropy(&first, p),
        };
        self.weigher.suit(&self.grid, p, &proportions);
        (self.state.best, self.state.proportions) = (best, proportions);
        let State { particles, rng, placing, .. } = &mut self.state;
        particles.make_anew(placing.most_particles(p));
        let terrain = Terrain { grid: &self.grid, frame: &self.frame, proportions };
        start.scatter(
            particles,
            0..placing.most_particles(p),
            [best.a_pxpm.ln(), best.b_pxpm.ln()],
            &terrain,
            p,
            rng,
        );
        self.propagate(&Motion::default());
        let at = [odometry.x, odometry.y, odometry.yaw_rad];
        (self.state.odometry, self.state.updated_at, self.state.started) = (at, at, true);
    }

    /// Redraws all particles around a pose stated by a person, as at the start. The drawing's mean scales do not change. The scales
    /// of the particles are those suggested by this scan if the heading is known, and the mean scales otherwise.
    fn begin_anew_at(&mut self, told: &Start, odometry: &Pose<Odom>) {
        let p = &self.parameters;
        let [a_pxpm, b_pxpm] = self.state.proportions.mean_ln_scales.map(f32::exp);
        let seen = told.scaled_pose(&self.grid, &self.frame, &self.beams, self.scale_guess_pxpm, p);
        let best = match told.has_any_heading() {
            true => ScaledPose { a_pxpm, b_pxpm, ..seen },
            false => believed(&seen, p),
        };
        let State { particles, rng, proportions, placing, .. } = &mut self.state;
        let count = placing.most_particles(p);
        particles.make_anew(count);
        let terrain = Terrain { grid: &self.grid, frame: &self.frame, proportions: *proportions };
        told.scatter(particles, 0..count, [best.a_pxpm.ln(), best.b_pxpm.ln()], &terrain, p, rng);
        self.propagate(&Motion::default());
        let at = [odometry.x, odometry.y, odometry.yaw_rad];
        (self.state.odometry, self.state.updated_at, self.state.best) = (at, at, best);
        (self.state.travelled_m, self.state.turned_rad) = (0.0, 0.0);
        self.state.confidence = Confidence::default();
    }
}

impl State {
    fn new(parameters: &Parameters, mission_seed: u64, particles: usize) -> Self {
        Self {
            particles: ParticleSet::new(particles),
            rng: seed::stream(mission_seed, "localizer"),
            proportions: Proportions::default(),
            drawing_error: parameters.hit_width,
            started: false,
            started_yaw_rad: 0.0,
            updated_at: [0.0; 3],
            odometry: [0.0; 3],
            travelled_m: 0.0,
            turned_rad: 0.0,
            mode: ScaledPose::default(),
            best: ScaledPose::default(),
            covariance: vec![0.0; 25],
            effective_sample_size: 0.0,
            confidence: Confidence::default(),
            told: None,
            search: None,
            placing: Placing::Marked,
            is_kidnapped: false,
        }
    }

    fn travel(&mut self, odometry: &Pose<Odom>) {
        let [x, y, yaw] = self.odometry;
        self.travelled_m += (odometry.x - x).hypot(odometry.y - y);
        self.turned_rad += wrap_angle(odometry.yaw_rad - yaw).abs();
        self.odometry = [odometry.x, odometry.y, odometry.yaw_rad];
    }

    /// Returns the motion since the last update.
    fn motion(&self) -> Motion {
        let pose = |[x, y, yaw]: [f64; 3]| Pose::<Odom>::new(x, y, yaw);
        let step = pose(self.updated_at).motion_to(&pose(self.odometry));
        Motion {
            forward_m: step.x as f32,
            left_m: step.y as f32,
            turn_rad: step.yaw_rad as f32,
            distance_m: self.travelled_m as f32,
            turned_rad: self.turned_rad as f32,
        }
    }

    fn take_motion(&mut self) -> Motion {
        let motion = self.motion();
        (self.updated_at, self.travelled_m, self.turned_rad) = (self.odometry, 0.0, 0.0);
        motion
    }

    fn last_mode(&self) -> Option<ScaledPose> {
        (self.confidence.tracking() != Tracking::Waiting).then_some(self.mode)
    }

    fn set_mode(&mut self, mode: &Mode) {
        self.mode = mode.pose;
        self.covariance.copy_from_slice(&mode.covariance);
    }
}

/// The representation of the drawing for weighing scans.
#[derive(Debug, Clone)]
enum Weigher {
    /// The beam model's table of ranges.
    Beam(RangeTable),
    /// The likelihood field.
    Field(Field),
}

impl Weigher {
    fn new(sketch: &SketchGrid, grid: &Grid, p: &Parameters, scale_guess_pxpm: f32) -> Self {
        match p.likelihood {
            Likelihood::Field => Self::Field(Field::new(grid, p, scale_guess_pxpm)),
            Likelihood::Beam if p.grid_cells <= RANGE_TABLE_CELLS => Self::Beam(RangeTable::new(grid)),
            Likelihood::Beam => Self::Beam(RangeTable::new(&Grid::new(sketch, RANGE_TABLE_CELLS))),
        }
    }

    /// Adapts to the drawing's scale, which affects the field because the width of its kernel is in metres.
    fn suit(&mut self, grid: &Grid, p: &Parameters, proportions: &Proportions) {
        if let Self::Field(field) = self {
            *field = Field::new(grid, p, proportions.mean_scale_pxpm());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_schemas::codes::{FREE, WALL};

    /// Draws a building of 500 px, and hence 20 px/m, with two rooms and a door of 8 px. The usual width of a door would be 14 px.
    fn two_rooms() -> SketchGrid {
        let is_wall = |x: usize, y: usize| {
            let outline = !(3..497).contains(&x) || !(3..297).contains(&y);
            outline || (149..152).contains(&y) && !(246..254).contains(&x)
        };
        let cell = |i: usize| if is_wall(i % 500, i / 500) { WALL } else { FREE };
        SketchGrid::new(500, 300, &(0..500 * 300).map(cell).collect::<Vec<u8>>(), 0.0).unwrap()
    }

    /// Returns the width, in pixels, of the door in the drawing as the filter sees it.
    fn door_px(parameters: Parameters) -> usize {
        let start = Start { pose: Pose::new(100.0, 100.0, 0.0), spread_px: 0.0, spread_rad: 0.0 };
        let drive = Drive::Omnidirectional;
        let localizer = Filter::new(&two_rooms(), Mounting::default(), drive, parameters, start, 1).unwrap();
        (220..280).filter(|&x| !localizer.grid.is_wall(x as f32 + 0.5, 150.5)).count()
    }

    /// Regression test: the hysteresis of the estimate applied at the pose of the last update. Since the turn between two updates
    /// (0.35 rad) is as wide as the kernel, the estimate could switch between two equal rivals whenever the robot turned.
    #[test]
    fn a_turn_does_not_change_the_robots_mind() {
        let parameters =
            Parameters { particles: 100, likelihood: Likelihood::Field, ..Parameters::default() };
        let start = Start { pose: Pose::new(100.0, 100.0, 0.0), spread_px: 0.0, spread_rad: 0.0 };
        let drive = Drive::Omnidirectional;
        let mut localizer =
            Filter::new(&two_rooms(), Mounting::default(), drive, parameters, start, 1).unwrap();
        let mut scan = LaserScan { beam_count: 4, range_max_m: 5.6, ..bytemuck::Zeroable::zeroed() };
        scan.ranges_m[..4].fill(f32::INFINITY);
        localizer.step(&Pose::new(0.0, 0.0, 0.0), &scan);
        // There are two places, the second with 52 of 100 particles, and no reading that distinguishes them.
        let State { particles, mode, .. } = &mut localizer.state;
        for (i, x_px) in particles.x_px.iter_mut().enumerate() {
            *x_px = if i < 48 { 100.0 } else { 400.0 };
        }
        particles.y_px.fill(100.0);
        particles.yaw_rad.fill(0.0);
        *mode = particles.pose(0);
        for turns in 1..=8 {
            let estimate = localizer.step(&Pose::new(0.0, 0.0, 0.5 * f64::from(turns)), &scan);
            assert!((estimate.pose.x - 100.0).abs() < 20.0, "{turns}: {:?}", estimate.pose);
        }
    }

    #[test]
    fn the_filter_sees_doors_as_wide_as_doors_are_and_the_paper_sees_them_as_drawn() {
        assert_eq!(door_px(Parameters::default()), 14);
        assert_eq!(door_px(Parameters { door_width_m: 0.0, ..Parameters::default() }), 8);
        assert_eq!(door_px(Parameters::paper()), 8);
    }
}
