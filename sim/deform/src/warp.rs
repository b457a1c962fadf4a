//! The map from the floor to a drawing, which determines where people draw things.
//!
//! People draw rectangles as rectangles, in the right order but out of proportion. The map is therefore monotone along each of
//! the two wall directions, while the logarithm of its local scale varies from patch to patch and from one part of the floor to
//! another. In addition, rows of rooms are shifted against each other, mostly where few walls run across (in the corridors), so
//! that walls stay roughly straight. One end is drawn larger than the other, and the whole is slightly turned and sheared. The
//! map is one-to-one, since shifts that would fold it are reduced.

use nalgebra::{Matrix2, Rotation2, Vector2};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed;

use crate::floor::Floor;

/// Standard deviations at degree 1, tuned until the drawings had the same figures as people's (`tests/people.rs`).
const LOG_SCALE: f64 = 0.25;
const LOG_SCALE_OF_PARTS: f64 = 1.1;
const LOG_ANISOTROPY: f64 = 0.62;
/// Standard deviations at degree 1: of the shifts, as a share of the floor's extent, and of the taper, the shear and the rotation.
const SHIFT: f64 = 0.5;
const TAPER: f64 = 0.2;
const SHEAR: f64 = 0.05;
const TURN_RAD: f64 = 0.03;
/// Maximum deviation of the logarithm of the scale at degree 1. People leave enough space for a door, and do not draw any room far
/// too small or too large.
const FARTHEST: f64 = 1.1;
/// Range of sizes of patches that share one scale, in metres. Patches that shift together have the size [`SHIFT_PATCH_M`].
const PATCH_M: [f64; 2] = [2.5, 6.0];
/// Range of sizes of the parts of the floor that are drawn larger or smaller than others, as shares of the floor's length.
const PARTS: [f64; 2] = [0.3, 0.6];
const SHIFT_PATCH_M: f64 = 8.0;
/// Step of the tables, in metres.
const STEP_M: f64 = 0.1;
/// Minimum share of the scale that remains where parts are shifted against each other.
const LEAST_STRETCH: f64 = 0.3;
/// Margin around the walls that is also mapped, in metres.
const RIM_M: f64 = 1.0;

/// A map from the floor, in metres, to a drawing of no particular size. The result of [`Warp::apply`] is in metres at the mean
/// scale.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Warp {
    /// Rotation from the axes of the world to the directions of the walls.
    turn: Rotation2<f64>,
    middle: Vector2<f64>,
    axes: [Axis; 2],
    /// Factor by which the shifts are reduced.
    shift: f64,
    linear: Matrix2<f64>,
}

/// The map along one wall direction.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    low: f64,
    /// Position in the drawing at each step.
    places: Vec<f64>,
    /// Shifts, for each patch along the axis and each band across it.
    shifts: Vec<Vec<f64>>,
    /// Band at each step across the axis, counted in patches.
    bands: Vec<f64>,
    across_low: f64,
    /// By what share one side is drawn larger than the middle.
    taper: f64,
}

impl Warp {
    pub fn draw(floor: &Floor, degree: f64, mission_seed: u64) -> Self {
        let mut rng = seed::stream(mission_seed, "deform/warp");
        let turn = Rotation2::new(-wall_direction(&floor.walls));
        let walls: Vec<Vec<Vector2<f64>>> =
            floor.walls.iter().map(|wall| wall.iter().map(|p| turn * p).collect()).collect();
        let (low, high) = bounds(&walls);
        let stretch = LOG_ANISOTROPY * degree * normal(&mut rng).clamp(-2.0, 2.0) / 2.0;
        let axes = [0, 1].map(|axis| Axis::draw(&walls, axis, [low, high], degree, &mut rng));
        let angle = TURN_RAD * degree * normal(&mut rng);
        let shear = Matrix2::new(1.0, SHEAR * degree * normal(&mut rng), 0.0, 1.0);
        let scales = Matrix2::new(stretch.exp(), 0.0, 0.0, (-stretch).exp());
        let linear = Rotation2::new(angle).matrix() * turn.matrix().transpose() * shear * scales;
        let mut warp = Self { turn, middle: (low + high) / 2.0, axes, shift: 1.0, linear };
        while !warp.is_one_to_one(low, high) {
            warp.shift = if warp.shift < 0.05 { 0.0 } else { 0.85 * warp.shift };
        }
        warp
    }

    /// Maps a point of the world, with a mean scale of 1.
    pub fn apply(&self, place: Vector2<f64>) -> Vector2<f64> {
        self.linear * self.along_walls(self.turn * place - self.middle)
    }

    /// Maps a point given along the directions of the walls, relative to the middle of the floor.
    fn along_walls(&self, p: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.axes[0].at(p.x, p.y, self.shift), self.axes[1].at(p.y, p.x, self.shift))
    }

    /// Returns true if no point is folded over another: everywhere, a minimum stretch remains in both directions.
    fn is_one_to_one(&self, low: Vector2<f64>, high: Vector2<f64>) -> bool {
        if self.shift == 0.0 {
            return true;
        }
        const STEP: f64 = 0.25;
        let (low, high) = (low - self.middle, high - self.middle);
        let steps = |axis: usize| ((high[axis] - low[axis]) / STEP).ceil() as usize;
        let places = (0..=steps(1)).flat_map(|j| (0..=steps(0)).map(move |i| (i, j)));
        places.into_iter().all(|(i, j)| {
            let p = low + Vector2::new(i as f64, j as f64) * STEP;
            let q = self.along_walls(p);
            let dx = (self.along_walls(p + Vector2::x() * STEP) - q) / STEP;
            let dy = (self.along_walls(p + Vector2::y() * STEP) - q) / STEP;
            let plain = self.axes[0].slope(p.x) * self.axes[1].slope(p.y);
            dx.perp(&dy) > LEAST_STRETCH * plain
        })
    }
}

impl Axis {
    fn draw(
        walls: &[Vec<Vector2<f64>>],
        axis: usize,
        [low, high]: [Vector2<f64>; 2],
        degree: f64,
        rng: &mut Pcg64Mcg,
    ) -> Self {
        let (half, across) = ((high - low) / 2.0, 1 - axis);
        let count = |axis: usize| (2.0 * half[axis] / STEP_M).ceil() as usize + 1;
        let bands = bands(walls, across, low[across], count(across));
        let patches = (2.0 * half[axis] / SHIFT_PATCH_M).ceil() as usize + 2;
        let rows = bands.last().map_or(0, |band| band.ceil() as usize) + 2;
        let extent = half.norm() / 3.0_f64.sqrt();
        let mut shift = || SHIFT * extent * degree * normal(rng);
        let shifts = (0..patches).map(|_| (0..rows).map(|_| shift()).collect()).collect();
        let taper = TAPER * degree * normal(rng).clamp(-2.0, 2.0) * (half[across] / half[axis]).min(1.0);
        let places = places(count(axis), half[axis], degree, rng);
        Self { low: -half[axis], places, shifts, bands, across_low: -half[across], taper }
    }

    fn at(&self, along: f64, across: f64, share: f64) -> f64 {
        let step = (along - self.low) / STEP_M;
        let taper = 1.0 - share * self.taper * across / self.across_low;
        self.place(step) * taper + share * self.shift(along, across)
    }

    /// Returns the position at a step. Beyond the table, it is extrapolated from the end.
    fn place(&self, step: f64) -> f64 {
        let last = self.places.len() - 2;
        let i = (step.max(0.0) as usize).min(last);
        self.places[i] + (step - i as f64) * (self.places[i + 1] - self.places[i])
    }

    fn slope(&self, along: f64) -> f64 {
        let step = (along - self.low) / STEP_M;
        (self.place(step + 1.0) - self.place(step)) / STEP_M
    }

    fn shift(&self, along: f64, across: f64) -> f64 {
        let step = ((across - self.across_low) / STEP_M).clamp(0.0, (self.bands.len() - 1) as f64);
        let band = self.bands[step.round() as usize];
        let patch = ((along - self.low) / SHIFT_PATCH_M).max(0.0);
        let (i, u) = split(patch, self.shifts.len());
        let (j, v) = split(band, self.shifts[0].len());
        let row = |i: usize| self.shifts[i][j] * (1.0 - v) + self.shifts[i][j + 1] * v;
        row(i) * (1.0 - u) + row(i + 1) * u
    }
}

/// Returns the position of each step along an axis, relative to the middle, with a mean scale of 1.
fn places(count: usize, half: f64, degree: f64, rng: &mut Pcg64Mcg) -> Vec<f64> {
    let farthest = FARTHEST * degree;
    let patches = logs(count, PATCH_M, LOG_SCALE * degree, rng);
    let parts = logs(count, PARTS.map(|share| share * 2.0 * half), LOG_SCALE_OF_PARTS * degree, rng);
    let logs: Vec<f64> =
        patches.iter().zip(&parts).map(|(patch, part)| (patch + part).clamp(-farthest, farthest)).collect();
    let mut at = 0.0;
    let places: Vec<f64> = logs
        .iter()
        .take(count)
        .map(|log| {
            let place = at;
            at += STEP_M * log.exp();
            place
        })
        .collect();
    let length = places[count - 1];
    let scale = if length > 0.0 { STEP_M * (count - 1) as f64 / length } else { 1.0 };
    places.into_iter().map(|place| place * scale - half).collect()
}

/// Returns the logarithm of the scale at each step, constant within stretches of random length.
fn logs(count: usize, stretch_m: [f64; 2], deviation: f64, rng: &mut Pcg64Mcg) -> Vec<f64> {
    let mut logs = Vec::with_capacity(count);
    while logs.len() < count {
        let stretch = rng.random_range(stretch_m[0]..stretch_m[1]);
        let log = deviation * 3.0_f64.sqrt() * rng.random_range(-1.0..1.0);
        logs.extend(std::iter::repeat_n(log, (stretch / STEP_M).ceil() as usize));
    }
    logs
}

/// Returns the position across the floor at each step, in patches. Steps are short where many walls run along the axis, so that
/// shifts change where there are few walls.
fn bands(walls: &[Vec<Vector2<f64>>], across: usize, low: f64, count: usize) -> Vec<f64> {
    let running = |i: usize| {
        let at = low + (i as f64 + 0.5) * STEP_M;
        let crossed = |pair: &&[Vector2<f64>]| (pair[0][across] > at) != (pair[1][across] > at);
        walls.iter().flat_map(|wall| wall.windows(2)).filter(crossed).count() as f64
    };
    let freedom: Vec<f64> = (0..count).map(|i| (1.0 + running(i)).powi(-2)).collect();
    let total: f64 = freedom.iter().sum();
    let patches = count as f64 * STEP_M / SHIFT_PATCH_M;
    let mut band = 0.0;
    freedom
        .into_iter()
        .map(|free| {
            let at = band;
            band += patches * free / total;
            at
        })
        .collect()
}

fn split(at: f64, count: usize) -> (usize, f64) {
    let i = (at as usize).min(count - 2);
    (i, (at - i as f64).min(1.0))
}

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(rng)
}

/// Returns the direction of most walls, modulo a right angle.
fn wall_direction(walls: &[Vec<Vector2<f64>>]) -> f64 {
    let pieces = walls.iter().flat_map(|wall| wall.windows(2)).map(|pair| pair[1] - pair[0]);
    let sum: Vector2<f64> = pieces
        .map(|piece| {
            let turn = 4.0 * piece.y.atan2(piece.x);
            Vector2::new(turn.cos(), turn.sin()) * piece.norm()
        })
        .sum();
    sum.y.atan2(sum.x) / 4.0
}

fn bounds(walls: &[Vec<Vector2<f64>>]) -> (Vector2<f64>, Vector2<f64>) {
    let points = || walls.iter().flatten();
    let low = points().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = points().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    (low.add_scalar(-RIM_M), high.add_scalar(RIM_M))
}
