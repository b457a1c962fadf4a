//! The start of the filter, given the pose at which a person has placed the robot and the scales suggested by
//! the first scan. Once the filter is running, none of this has an effect, unless a person places the robot
//! again.

use std::f64::consts::PI;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Pose, Sketch};

use super::FilterError;
use super::beams::Beams;
use super::grid::Grid;
use super::metric::{PxFromBase, ScaleFrame, wrap};
use super::motion::{Terrain, free_place_anywhere, normal, scales_about};
use super::parameters::{Parameters, Scales, StartScales};
use super::particles::ParticleSet;
use super::scales::{ScaledPose, least_squares, trimmed_means};
use crate::sketch::SketchGrid;

/// The pose at which a person has placed the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Pose in the drawing.
    pub pose: Pose<Sketch>,
    /// Standard deviation of the position, in pixels.
    pub spread_px: f64,
    /// Standard deviation of the heading, in radians. With π or more, the heading is unknown.
    pub spread_rad: f64,
}

/// Number of rounds of estimating the scales. Several are needed because the result depends on the scales of the pose.
const ROUNDS: usize = 6;
/// Maximum factor by which a scale from the first scan may differ from the guess.
const FARTHEST: f32 = 8.0;

impl Start {
    /// Creates the start of a robot that may be anywhere in a drawing of this size, with any heading. `pose` is a place from which
    /// the robot can get to wherever it may be.
    pub fn anywhere(pose: Pose<Sketch>, [width, height]: [usize; 2]) -> Self {
        Self { pose, spread_px: 2.0 * (width as f64).hypot(height as f64), spread_rad: PI }
    }

    /// Rejects a start outside the drawing.
    pub(super) fn check_within(&self, [width, height]: [usize; 2]) -> Result<(), FilterError> {
        let (x, y) = (self.pose.x, self.pose.y);
        let inside = (0.0..width as f64).contains(&x) && (0.0..height as f64).contains(&y);
        if inside { Ok(()) } else { Err(FilterError::StartOutside { x, y, width, height }) }
    }

    /// Returns true if the heading is unknown.
    pub fn has_any_heading(&self) -> bool {
        self.spread_rad >= PI
    }

    /// Returns true if the robot may be anywhere in a drawing of this size. No mark is as uncertain, since the spread of a mark is at
    /// most the drawing's diagonal.
    pub fn is_anywhere(&self, [width, height]: [usize; 2]) -> bool {
        self.spread_px > 1.5 * (width as f64).hypot(height as f64)
    }

    /// Returns the pose with the scales that the first scan suggests, or with `guess_pxpm` if the scan sees nothing.
    pub(super) fn scaled_pose(
        &self,
        grid: &Grid,
        frame: &ScaleFrame,
        beams: &Beams,
        guess_pxpm: f32,
        parameters: &Parameters,
    ) -> ScaledPose {
        let pose = ScaledPose {
            x_px: self.pose.x as f32,
            y_px: self.pose.y as f32,
            yaw_rad: self.pose.yaw_rad as f32,
            a_pxpm: guess_pxpm,
            b_pxpm: guess_pxpm,
        };
        let [a_pxpm, b_pxpm] = initial_scales(grid, frame, beams, pose, parameters);
        ScaledPose { a_pxpm, b_pxpm, ..pose }
    }

    /// Returns the drawing's mean scales, as (ln a, ln b). They are between those of the first pose and the one that follows from the
    /// size of the drawing.
    pub(super) fn mean_ln_scales(
        &self,
        first: &ScaledPose,
        size_pxpm: f32,
        parameters: &Parameters,
    ) -> [f32; 2] {
        let share = parameters.start_size_share;
        [first.a_pxpm, first.b_pxpm].map(|scale| scale.ln() + share * (size_pxpm / scale).ln())
    }

    /// Scatters the particles with these numbers around the start, in free cells if any can be found, with scales around (ln a, ln b).
    pub(super) fn scatter(
        &self,
        particles: &mut ParticleSet,
        numbers: impl Iterator<Item = usize>,
        [ln_a, ln_b]: [f32; 2],
        terrain: &Terrain<'_>,
        parameters: &Parameters,
        rng: &mut Pcg64Mcg,
    ) {
        let middle = [self.pose.x as f32, self.pose.y as f32];
        let spread_rad = (self.spread_rad as f32).max(parameters.start_spread_rad);
        // The person's own uncertainty is in pixels. The minimum uncertainty is in metres, along the walls and across.
        let spread_px = |ln: f32| (self.spread_px as f32).max(parameters.start_spread_m * ln.exp());
        let px_from_draw = terrain.frame.px_from_frame(spread_px(ln_a), spread_px(ln_b));
        for i in numbers {
            let place = match self.is_anywhere(terrain.grid.size_px().map(|side| side as usize)) {
                true => free_place_anywhere(terrain, rng).unwrap_or(middle),
                false => free_place(terrain.grid, middle, &px_from_draw, rng),
            };
            [particles.x_px[i], particles.y_px[i]] = place;
            let off_rad = match self.has_any_heading() {
                true => rng.random_range(-PI as f32..PI as f32),
                false => spread_rad * normal(rng),
            };
            particles.yaw_rad[i] = wrap(self.pose.yaw_rad as f32 + off_rad);
            let anisotropy = terrain.proportions.anisotropy(parameters, rng);
            particles.anisotropy[i] = anisotropy;
            [particles.ln_a[i], particles.ln_b[i]] =
                scales_about([ln_a + anisotropy, ln_b - anisotropy], parameters, rng);
        }
    }
}

/// Estimates the scales at the start from the first scan. An axis that is not observed takes the scale of the other one. If neither
/// is observed, both scales are the guess, which is the scale of `pose`. The result stays within a factor of [`FARTHEST`] of the
/// guess.
fn initial_scales(
    grid: &Grid,
    frame: &ScaleFrame,
    beams: &Beams,
    mut pose: ScaledPose,
    parameters: &Parameters,
) -> [f32; 2] {
    let guess_pxpm = pose.a_pxpm;
    for _ in 0..ROUNDS {
        let found = match parameters.start_scales {
            StartScales::LeastSquares => least_squares(grid, frame, beams, &pose, parameters.scales),
            StartScales::TrimmedMean => trimmed_means(grid, frame, beams, &pose),
        };
        let bounded = |scale: f32| scale.clamp(guess_pxpm / FARTHEST, guess_pxpm * FARTHEST);
        let (a, b) = (found.a_pxpm.map(bounded), found.b_pxpm.map(bounded));
        pose.a_pxpm = a.or(b).unwrap_or(guess_pxpm);
        pose.b_pxpm = b.or(a).unwrap_or(guess_pxpm);
    }
    [pose.a_pxpm, pose.b_pxpm]
}

/// Returns the stretch that the first scan shows, which is half the logarithm of the ratio of scale a to scale b, or 0 with a
/// single scale.
pub(super) fn first_anisotropy(first: &ScaledPose, parameters: &Parameters) -> f32 {
    match parameters.scales {
        Scales::Two => (first.a_pxpm / first.b_pxpm).ln() / 2.0,
        Scales::One => 0.0,
    }
}

/// Returns the pose with the scales of the first scan to the extent that they are believed to differ. A `start_anisotropy` of 1
/// leaves them unchanged, and 0 makes them equal.
pub(super) fn believed(first: &ScaledPose, parameters: &Parameters) -> ScaledPose {
    let share = match parameters.scales {
        Scales::Two => parameters.start_anisotropy,
        Scales::One => 0.0,
    };
    let ln_scales = [first.a_pxpm, first.b_pxpm].map(f32::ln);
    let mean = (ln_scales[0] + ln_scales[1]) / 2.0;
    let [a_pxpm, b_pxpm] = ln_scales.map(|ln| (mean + share * (ln - mean)).exp());
    ScaledPose { a_pxpm, b_pxpm, ..*first }
}

/// Returns a free position around `middle`, or `middle` itself if ten attempts find none.
fn free_place(grid: &Grid, middle: [f32; 2], px_from_draw: &PxFromBase, rng: &mut Pcg64Mcg) -> [f32; 2] {
    for _ in 0..10 {
        let step = px_from_draw.apply(normal(rng), normal(rng));
        let place = [middle[0] + step[0], middle[1] + step[1]];
        if !grid.is_wall(place[0], place[1]) {
            return place;
        }
    }
    middle
}

/// Returns the longer side, in pixels, of the box around all walls that is aligned with the walls' direction, or the longer side of
/// the drawing if it has no walls.
pub fn extent_px(sketch: &SketchGrid) -> f32 {
    let (sin, cos) = (sketch.wall_direction_rad() as f32).sin_cos();
    let (mut least, mut most) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for (row, walls) in sketch.walls().chunks_exact(sketch.width()).enumerate() {
        // Along a row, each coordinate only rises or only falls, so the ends of the row are enough.
        let ends = [walls.iter().position(|&wall| wall), walls.iter().rposition(|&wall| wall)];
        for column in ends.into_iter().flatten() {
            let (x, y) = (column as f32, row as f32);
            let place = [cos * x + sin * y, cos * y - sin * x];
            (0..2).for_each(|axis| {
                least[axis] = least[axis].min(place[axis]);
                most[axis] = most[axis].max(place[axis]);
            });
        }
    }
    let extent = (most[0] - least[0]).max(most[1] - least[1]) + 1.0;
    if extent.is_finite() { extent } else { sketch.width().max(sketch.height()) as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first scan gives 10 and 40 px/m, and the size of the drawing gives 90 px/m. Halfway between, in logarithms, lie
    /// √(10·90) = 30 and √(40·90) = 60.
    #[test]
    fn the_mean_scale_is_between_the_first_scans_and_the_drawings() {
        let start = Start { pose: Pose::new(0.0, 0.0, 0.0), spread_px: 0.0, spread_rad: 0.0 };
        let first = ScaledPose { a_pxpm: 10.0, b_pxpm: 40.0, ..ScaledPose::default() };
        let mean = |start_size_share| {
            let parameters = Parameters { start_size_share, ..Parameters::default() };
            start.mean_ln_scales(&first, 90.0, &parameters).map(f32::exp)
        };
        let is_near =
            |found: [f32; 2], [a, b]: [f32; 2]| (found[0] - a).abs() < 1e-3 && (found[1] - b).abs() < 1e-3;
        assert!(is_near(mean(0.5), [30.0, 60.0]) && is_near(mean(0.0), [10.0, 40.0]));
    }
}
