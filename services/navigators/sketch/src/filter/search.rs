//! Finds out where the robot is in a map in which it may be anywhere, by collecting evidence for each hypothesis.
//!
//! The scans of the last metres are placed by odometry and form a rigid local map, as in correlative scan matching (Olson 2009). A
//! hypothesis is a pose of this local map in the map. Its evidence is the mean log likelihood of all beams of the local map, so
//! that all hypotheses are judged by the same readings, however late they were found. The search goes through a lattice of poses
//! over the free space again and again, a part of it in each step. The poses that fit best become hypotheses, which are refined by
//! trying poses around them. Hypotheses never compete for particles: a hypothesis ends when it coincides with a better one, or when
//! many others fit better. The search ends when one hypothesis explains the readings so much better than all others that chance is
//! ruled out.
//!
//! A step takes the same time wherever the robot is, and does not allocate.

use std::f32::consts::TAU;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Pose, Sketch, wrap_angle};
use sketchnav_schemas::message::LaserScan;

use super::beams::{Beams, Mounting};
use super::grid::Grid;
use super::metric::wrap;
use super::parameters::Parameters;
use super::range_table::RangeTable;
use super::sight::{self, Densities, Reading, Sight};
use super::workers::Workers;
use crate::sketch::SketchGrid;

/// Distance, in metres, and turn, in radians, after which a scan is added to the local map.
const SCAN_EVERY: (f64, f64) = (0.5, 0.5);
/// Maximum number of scans in the local map. This is enough for a full turn and 6 m.
const SCANS: usize = 24;
/// Number of beams of each scan that are used.
const BEAMS: usize = 32;
/// Distance between the positions of the lattice, in metres, and number of headings at each.
const LATTICE_M: f32 = 0.3;
const HEADINGS: usize = 32;
/// Minimum distance of these positions from walls, in metres.
const OFF_WALLS_M: f32 = 0.15;
/// Number of poses of the lattice that are tried in a step, and number of scans by which they are judged.
const POSES: usize = 6144;
const VIEWS: usize = 4;
/// Number of poses that become hypotheses in a step, and number of steps in which they are refined before they have to compete.
const NEW: usize = 16;
const GRACE: u32 = 4;
/// Maximum number of hypotheses. It includes those of four steps that do not have to compete yet.
const HYPOTHESES: usize = 96;
/// Distance, in metres, and angle, in radians, within which two hypotheses are the same.
const SAME: (f32, f32) = (0.4, 0.3);
/// Distance, in metres, and angle, in radians, beyond which two hypotheses are clearly different places.
const ELSEWHERE: (f32, f32) = (1.0, 0.6);
/// Initial distance, in metres, and turn, in radians, of the poses that are tried around a hypothesis.
const AROUND: (f32, f32) = (0.12, 0.08);
/// Factor on this distance and turn whenever no such pose is better, and the smallest share of them that is tried.
const NARROWER: f32 = 0.7;
const NARROWEST: f32 = 0.1;
/// Typical error of ranges, as |ln(measured / expected)|, by which poses of the lattice are judged, and the one for hypotheses.
const ROUGH: f32 = 0.25;
const FINE: f32 = 0.15;
const ROUGH_DENSITIES: usize = 0;
const FINE_DENSITIES: usize = 1;
/// Number of poses that a thread takes at a time.
const BLOCK: usize = 256;
/// Number of independent beams that a full local map counts as.
const INDEPENDENT: f32 = 40.0;
/// Evidence, in nats, of a scan whose beams have a mean log likelihood of 1.
const NATS: f32 = INDEPENDENT / SCANS as f32;
/// Minimum share of the evidence that a hypothesis needs to be certain.
const CERTAIN: f32 = 0.99;
/// Minimum number of scans in the local map for a hypothesis to be certain.
const LEAST_SCANS: usize = 9;
/// Same as [`LEAST_SCANS`], for the pose at which the robot stood when it was last localized.
const LEAST_SCANS_LIKELY: usize = 4;
/// Log odds, in nats, that the robot still stands where it was last localized, against any other place that fits its scans: ten to
/// one. They are not enough to make it certain, so that a robot that was carried to a room that looks the same goes on to look.
const LAST_POSE: f32 = std::f32::consts::LN_10;
/// Number of scans with which the search begins again for a robot that doubts where it is.
const RECENT: usize = 8;
/// Minimum share of the local map's beams that must have returned for a hypothesis to be certain. In the middle of a hall, where
/// hardly any beam returns, more places look alike than there can be hypotheses.
const RETURNED: f32 = 0.4;
/// Minimum mean log likelihood of a beam for a hypothesis to become certain, and to remain so.
const FITS: f32 = -0.3;
const STILL_FITS: f32 = -0.6;

/// A scan of the local map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Keyframe {
    odometry: Pose<Odom>,
    beams: Beams,
}

impl Keyframe {
    /// Creates an empty scan with room for its beams.
    fn room() -> Self {
        Self { odometry: Pose::new(0.0, 0.0, 0.0), beams: Beams::with_capacity(BEAMS) }
    }
}

/// A pose at which the robot may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Position along x, in pixels.
    pub x_px: f32,
    /// Position along y, upwards, in pixels.
    pub y_px: f32,
    /// Heading, in radians.
    pub yaw_rad: f32,
    /// Mean log likelihood of a beam of the local map.
    pub fit: f32,
    /// Sum of the mean log likelihoods of the scans that have left the local map, less that of the best hypothesis. A hypothesis
    /// that is found later starts with the past of the best one.
    past: f32,
    /// Log odds, in nats, in favour of this hypothesis before any scan.
    prior: f32,
    /// Distance and turn of the poses that are tried around it, as a share of [`AROUND`].
    width: f32,
    /// Number of steps in which it has been refined.
    age: u32,
}

/// State of a search, as saved in a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    scans: Vec<Keyframe>,
    /// Empty scans for later use.
    #[serde(skip)]
    spare: Vec<Keyframe>,
    /// The hypotheses, the best one first. They apply to the moment at which the odometry's pose was `at`.
    hypotheses: Vec<Hypothesis>,
    at: Option<Pose<Odom>>,
    /// Number of poses of the lattice that have been tried.
    tried: usize,
    is_certain: bool,
    /// Whether the robot was certain of a place and no longer is.
    has_doubted: bool,
}

impl State {
    /// Creates the state of a search that is over, because the robot knows where it is.
    pub fn certain() -> Self {
        Self {
            scans: Vec::with_capacity(SCANS),
            spare: (0..SCANS).map(|_| Keyframe::room()).collect(),
            hypotheses: Vec::with_capacity(HYPOTHESES + NEW),
            at: None,
            tried: 0,
            is_certain: true,
            has_doubted: false,
        }
    }

    /// Creates the state of a search that has not begun, with one hypothesis: the pose `last`, where the robot stood when it was
    /// last localized.
    pub fn anywhere(last: &Pose<Sketch>) -> Self {
        let mut state = Self { is_certain: false, ..Self::certain() };
        let pose = [last.x as f32, last.y as f32, wrap(last.yaw_rad as f32)];
        state.hypotheses.push(Hypothesis { prior: LAST_POSE, ..Hypothesis::new(pose) });
        state
    }

    /// Reserves memory, so that steps do not allocate.
    pub fn reserve(&mut self) {
        let free = SCANS.saturating_sub(self.scans.len());
        self.scans.reserve(free);
        self.spare = Vec::with_capacity(SCANS);
        self.spare.extend((0..free).map(|_| Keyframe::room()));
        self.hypotheses.reserve((HYPOTHESES + NEW).saturating_sub(self.hypotheses.len()));
    }

    /// Returns true if the robot is certain of where it is.
    pub fn is_certain(&self) -> bool {
        self.is_certain
    }

    /// Returns true if the robot was certain of a place and no longer is.
    pub fn has_doubted(&self) -> bool {
        self.has_doubted
    }

    /// Returns the hypotheses, the best one first.
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }

    /// Ends the search, because the robot knows where it is.
    pub fn settle(&mut self) {
        self.spare.append(&mut self.scans);
        self.hypotheses.clear();
        (self.is_certain, self.has_doubted) = (true, false);
    }

    /// Begins a search with only the latest scans.
    pub fn doubt(&mut self) {
        self.begin_with(RECENT);
    }

    /// Begins a search without any scans, because somebody has carried the robot.
    pub fn begin_anew(&mut self) {
        self.begin_with(0);
    }

    fn begin_with(&mut self, recent: usize) {
        let old = self.scans.len().saturating_sub(recent);
        self.spare.extend(self.scans.drain(..old));
        self.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.prior = 0.0);
        (self.tried, self.is_certain, self.has_doubted) = (0, false, true);
    }

    /// Returns true if the best hypothesis explains the local map, and no other one does nearly as well.
    pub fn prevails(&self) -> bool {
        let share = self.shares().next().unwrap_or_default();
        let fits = self.hypotheses.first().is_some_and(|best| best.fit >= FITS && best.age >= GRACE);
        fits && share >= CERTAIN && self.is_informed()
    }

    /// Returns true if the local map shows enough to tell places apart.
    fn is_informed(&self) -> bool {
        let (beams, returned) = self.scans.iter().fold((0, 0), |(beams, returned), scan| {
            (beams + scan.beams.len(), returned + scan.beams.end_m.len())
        });
        let is_likely = self.hypotheses.first().is_some_and(|best| best.prior > 0.0);
        let least = if is_likely { LEAST_SCANS_LIKELY } else { LEAST_SCANS };
        self.scans.len() >= least && returned as f32 >= RETURNED * beams as f32
    }

    /// Returns each hypothesis's share of the evidence.
    pub fn shares(&self) -> impl Iterator<Item = f32> + '_ {
        let scans = self.scans.len();
        let best = self.hypotheses.first().map_or(0.0, |best| best.evidence(scans));
        let weight = move |hypothesis: &Hypothesis| (hypothesis.evidence(scans) - best).exp();
        let sum: f32 = self.hypotheses.iter().map(weight).sum();
        self.hypotheses.iter().map(move |hypothesis| weight(hypothesis) / sum)
    }

    /// Returns the past of the best hypothesis.
    fn best_past(&self) -> f32 {
        self.hypotheses.first().map_or(0.0, |best| best.past)
    }

    /// Moves the hypotheses by the odometry's motion.
    fn advance(&mut self, odometry: &Pose<Odom>, scale_pxpm: f32) {
        let Some(before) = self.at.replace(*odometry) else { return };
        let step = before.motion_to(odometry);
        for hypothesis in &mut self.hypotheses {
            let (sin, cos) = hypothesis.yaw_rad.sin_cos();
            let (x, y) = (step.x as f32 * scale_pxpm, step.y as f32 * scale_pxpm);
            hypothesis.x_px += cos * x - sin * y;
            hypothesis.y_px += sin * x + cos * y;
            hypothesis.yaw_rad = wrap(hypothesis.yaw_rad + step.yaw_rad as f32);
        }
    }

    /// Sorts the hypotheses, and drops those that coincide with better ones and those that are worse than many others.
    fn merge(&mut self, scale_pxpm: f32) {
        let hypotheses = &mut self.hypotheses;
        let scans = self.scans.len();
        hypotheses
            .sort_unstable_by(|a, b| b.evidence(scans).total_cmp(&a.evidence(scans)).then(b.age.cmp(&a.age)));
        let mut kept = 0;
        for i in 0..hypotheses.len() {
            let hypothesis = hypotheses[i];
            let has_room = kept < HYPOTHESES - GRACE as usize * NEW || hypothesis.age < GRACE;
            if let Some(better) =
                hypotheses[..kept].iter_mut().find(|better| better.is_same(&hypothesis, scale_pxpm))
            {
                better.prior = better.prior.max(hypothesis.prior);
            } else if has_room {
                hypotheses[kept] = hypothesis;
                kept += 1;
            }
        }
        hypotheses.truncate(kept.min(HYPOTHESES));
    }
}

/// The map in which a search takes place.
#[derive(Debug, Clone, Copy)]
pub struct Map<'a> {
    /// The map.
    pub sketch: &'a SketchGrid,
    /// The map as the filter sees it.
    pub grid: &'a Grid,
    /// Table of its ranges.
    pub table: &'a RangeTable,
    /// Scale of the map, in pixels per metre.
    pub scale_pxpm: f32,
}

/// A pose to try, in pixels and radians, and the log likelihood of the local map there.
#[derive(Debug, Clone, Copy, Default)]
struct Try {
    pose: [f32; 3],
    log_likelihood: f32,
}

/// A search for where the robot is, with its working memory.
#[derive(Debug, Clone)]
pub struct Search {
    mounting: Mounting,
    scale_pxpm: f32,
    sight: Sight,
    /// Likelihoods of readings, first for poses of the lattice and then for hypotheses, once the sensor's range is known.
    densities: Option<[Densities; 2]>,
    parameters: Parameters,
    /// The free positions of the lattice, in pixels.
    places: Vec<[f32; 2]>,
    readings: Vec<Reading>,
    tries: Vec<Try>,
    /// Indices of the tries, the best one first.
    order: Vec<usize>,
}

impl Search {
    /// Creates a search in a map.
    pub fn new(map: &Map<'_>, mounting: Mounting, parameters: &Parameters) -> Self {
        let most = POSES.max((HYPOTHESES + NEW) * TRIES.len());
        Self {
            mounting,
            scale_pxpm: map.scale_pxpm,
            sight: Sight::new(map.sketch, map.grid, map.table),
            densities: None,
            parameters: parameters.clone(),
            places: places(map.grid, map.scale_pxpm),
            readings: Vec::with_capacity(BEAMS),
            tries: Vec::with_capacity(most),
            order: Vec::with_capacity(most),
        }
    }

    /// Processes a scan and the odometry at the same time. `known` is the robot's pose, which counts if the robot is certain of it.
    pub fn step(
        &mut self,
        state: &mut State,
        odometry: &Pose<Odom>,
        scan: &LaserScan,
        known: &Hypothesis,
        table: &RangeTable,
        workers: &Workers,
    ) {
        if self.densities.is_none() {
            let of =
                |error| Densities::new(&self.parameters, error, table, self.scale_pxpm, scan.range_max_m);
            self.densities = Some([ROUGH, FINE].map(of));
        }
        state.advance(odometry, self.scale_pxpm);
        let is_new = self.keep(state, odometry, scan, table, workers);
        if state.is_certain {
            if !is_new {
                return;
            }
            if state.hypotheses.iter().all(|other| !other.is_same(known, self.scale_pxpm)) {
                state.hypotheses.push(Hypothesis { past: state.best_past(), ..*known });
            }
        }
        self.sweep(state, table, workers);
        self.refine(state, table, workers);
        state.merge(self.scale_pxpm);
        self.judge(state);
    }

    /// Adds the scan to the local map if the robot has moved since the last scan in it. Returns true if the scan was added.
    fn keep(
        &mut self,
        state: &mut State,
        odometry: &Pose<Odom>,
        scan: &LaserScan,
        table: &RangeTable,
        workers: &Workers,
    ) -> bool {
        let has_moved = |last: &Keyframe| {
            last.odometry.position().distance(&odometry.position()) >= SCAN_EVERY.0
                || wrap_angle(last.odometry.yaw_rad - odometry.yaw_rad).abs() >= SCAN_EVERY.1
        };
        if !state.scans.last().is_none_or(has_moved) {
            return false;
        }
        if state.scans.len() == SCANS {
            self.remember_oldest(state, table, workers);
        }
        let State { scans, spare, .. } = state;
        if scans.len() < SCANS {
            scans.push(spare.pop().unwrap_or_else(Keyframe::room));
        } else {
            scans.rotate_left(1);
        }
        if let Some(last) = scans.last_mut() {
            last.odometry = *odometry;
            last.beams.select(scan, &self.mounting, BEAMS);
        }
        true
    }

    /// Adds the fit of the oldest scan, which leaves the local map, to the past of each hypothesis.
    fn remember_oldest(&mut self, state: &mut State, table: &RangeTable, workers: &Workers) {
        self.tries.clear();
        self.tries.extend(state.hypotheses.iter().map(|hypothesis| Try::at(hypothesis.pose())));
        self.weigh(state, FINE_DENSITIES, 0..1, 1, table, workers);
        let beams = state.scans.first().map_or(0, |scan| scan.beams.len()).max(1) as f32;
        for (hypothesis, tried) in state.hypotheses.iter_mut().zip(&self.tries) {
            hypothesis.past += tried.log_likelihood / beams;
        }
        let best = state.best_past();
        state.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.past -= best);
    }

    /// Tries the next poses of the lattice, and turns the best ones into hypotheses.
    fn sweep(&mut self, state: &mut State, table: &RangeTable, workers: &Workers) {
        let all = self.places.len() * HEADINGS;
        let count = POSES.min(all);
        let places = &self.places;
        let of_lattice = |i: usize| {
            let pose = (state.tried + i) % all;
            let [x, y] = places[pose / HEADINGS];
            Try::at([x, y, wrap(TAU * (pose % HEADINGS) as f32 / HEADINGS as f32)])
        };
        self.tries.clear();
        self.tries.extend((0..count).map(of_lattice));
        state.tried += count;
        let stride = state.scans.len().div_ceil(VIEWS).max(1);
        self.weigh(state, ROUGH_DENSITIES, 0..state.scans.len(), stride, table, workers);
        let tries = &self.tries;
        let fit = |i: usize| tries[i].log_likelihood;
        self.order.clear();
        self.order.extend(0..count);
        self.order.sort_unstable_by(|&a, &b| fit(b).total_cmp(&fit(a)).then(a.cmp(&b)));
        let most = (state.hypotheses.len() + NEW).min(HYPOTHESES + NEW);
        let past = state.best_past();
        for &i in &self.order {
            if state.hypotheses.len() >= most {
                break;
            }
            let new = Hypothesis { past, ..Hypothesis::new(tries[i].pose) };
            if state.hypotheses.iter().all(|other| !other.is_same(&new, self.scale_pxpm)) {
                state.hypotheses.push(new);
            }
        }
    }

    /// Moves each hypothesis to the best pose around it, and determines how well the scans of the local map fit there.
    fn refine(&mut self, state: &mut State, table: &RangeTable, workers: &Workers) {
        self.tries.clear();
        for hypothesis in &state.hypotheses {
            let step_px = hypothesis.width * AROUND.0 * self.scale_pxpm;
            let step_rad = hypothesis.width * AROUND.1;
            let [x_px, y_px, yaw_rad] = hypothesis.pose();
            self.tries.extend(TRIES.map(|[x, y, yaw]| {
                Try::at([x_px + step_px * x, y_px + step_px * y, wrap(yaw_rad + step_rad * yaw)])
            }));
        }
        self.weigh(state, FINE_DENSITIES, 0..state.scans.len(), 1, table, workers);
        let beams: usize = state.scans.iter().map(|scan| scan.beams.len()).sum();
        for (hypothesis, tries) in state.hypotheses.iter_mut().zip(self.tries.chunks(TRIES.len())) {
            let better = |best: usize, i: usize| {
                if tries[i].log_likelihood > tries[best].log_likelihood { i } else { best }
            };
            let best = (0..tries.len()).fold(0, better);
            if best == 0 {
                hypothesis.width = (hypothesis.width * NARROWER).max(NARROWEST);
            }
            [hypothesis.x_px, hypothesis.y_px, hypothesis.yaw_rad] = tries[best].pose;
            hypothesis.fit = tries[best].log_likelihood / beams.max(1) as f32;
            hypothesis.age = hypothesis.age.saturating_add(1);
        }
    }

    /// Adds up the log likelihoods of every `stride`-th of some scans of the local map, counted from the newest, at each try.
    fn weigh(
        &mut self,
        state: &State,
        densities: usize,
        scans: Range<usize>,
        stride: usize,
        table: &RangeTable,
        workers: &Workers,
    ) {
        let (Some(now), Some(known)) = (state.at, &self.densities) else { return };
        let (densities, scale_pxpm, sight) = (&known[densities], self.scale_pxpm, &self.sight);
        for scan in state.scans[scans].iter().rev().step_by(stride) {
            let back = now.motion_to(&scan.odometry);
            let (forward_m, left_m, turn_rad) = (back.x as f32, back.y as f32, back.yaw_rad as f32);
            // The sensor's pose at that time, in the robot's present axes.
            let (sin, cos) = turn_rad.sin_cos();
            let [x_m, y_m] = scan.beams.origin_m;
            let sensor_px =
                [forward_m + cos * x_m - sin * y_m, left_m + sin * x_m + cos * y_m].map(|m| m * scale_pxpm);
            sight::read(&scan.beams, table, scale_pxpm, &mut self.readings);
            let readings = &self.readings;
            workers.each(&mut self.tries, BLOCK, |_, tries| {
                for tried in tries {
                    let [x_px, y_px, yaw_rad] = tried.pose;
                    let (sin, cos) = yaw_rad.sin_cos();
                    let place = [
                        x_px + cos * sensor_px[0] - sin * sensor_px[1],
                        y_px + sin * sensor_px[0] + cos * sensor_px[1],
                    ];
                    tried.log_likelihood +=
                        sight.log_likelihood(table, densities, readings, place, yaw_rad + turn_rad);
                }
            });
        }
    }

    /// Decides whether the robot is certain of the best hypothesis.
    fn judge(&self, state: &mut State) {
        let Some(best) = state.hypotheses.first() else { return };
        if !state.is_certain {
            if !state.is_informed() {
                state.tried = 0;
            }
            let all = self.places.len() * HEADINGS + GRACE as usize * POSES;
            state.is_certain = state.tried >= all && state.prevails();
        } else if best.fit < STILL_FITS && state.scans.len() >= RECENT {
            state.doubt();
        }
    }
}

impl Try {
    fn at(pose: [f32; 3]) -> Self {
        Self { pose, log_likelihood: 0.0 }
    }
}

impl Hypothesis {
    /// Creates a hypothesis at a position, in pixels, and a heading.
    pub fn new([x_px, y_px, yaw_rad]: [f32; 3]) -> Self {
        Self { x_px, y_px, yaw_rad, fit: f32::MIN, past: 0.0, prior: 0.0, width: 1.0, age: 0 }
    }

    fn pose(&self) -> [f32; 3] {
        [self.x_px, self.y_px, self.yaw_rad]
    }

    /// Returns the log odds of the hypothesis, in nats, up to a constant.
    fn evidence(&self, scans: usize) -> f32 {
        (self.fit * scans as f32 + self.past) * NATS + self.prior
    }

    fn is_same(&self, other: &Self, scale_pxpm: f32) -> bool {
        self.is_within(other, SAME.0 * scale_pxpm, SAME.1)
    }

    /// Returns true if the other hypothesis is at most this far away and its heading is at most this different.
    fn is_within(&self, other: &Self, off_px: f32, off_rad: f32) -> bool {
        (self.x_px - other.x_px).hypot(self.y_px - other.y_px) < off_px
            && wrap(self.yaw_rad - other.yaw_rad).abs() < off_rad
    }

    /// Returns true if this hypothesis is clearly another place.
    pub fn is_elsewhere(&self, other: &Self, scale_pxpm: f32) -> bool {
        !self.is_within(other, ELSEWHERE.0 * scale_pxpm, ELSEWHERE.1)
    }
}

/// The poses that are tried around a hypothesis, the first of which is the hypothesis itself.
const TRIES: [[f32; 3]; 16] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [0.7, 0.7, 0.7],
    [-0.7, 0.7, 0.7],
    [0.7, -0.7, 0.7],
    [-0.7, -0.7, 0.7],
    [0.7, 0.7, -0.7],
    [-0.7, 0.7, -0.7],
    [0.7, -0.7, -0.7],
    [-0.7, -0.7, -0.7],
    [0.0, 0.0, 2.0],
];

/// Returns the free positions of a lattice over the map, in pixels.
fn places(grid: &Grid, scale_pxpm: f32) -> Vec<[f32; 2]> {
    let step_px = LATTICE_M * scale_pxpm;
    let off_px = OFF_WALLS_M * scale_pxpm;
    let [width, height] = grid.size_px();
    let [columns, rows] = [width, height].map(|side| (side / step_px) as usize + 1);
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    let middle = all.map(|at| at.map(|k| (k as f32 + 0.5) * step_px));
    let is_free = |&[x, y]: &[f32; 2]| {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [0.0, 0.0]];
        corners.iter().all(|[dx, dy]| !grid.is_wall(x + dx * off_px, y + dy * off_px))
    };
    middle.filter(is_free).collect()
}
