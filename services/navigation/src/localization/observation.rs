//! How likely a scan is from a pose with two scales: the paper's likelihood field (equation 7) and
//! the visibility model.

use fearless_simd::{f32x16, i32x16, prelude::*};

use super::beams::{Beams, SHORTEST_M};
use super::grid::Grid;
use super::lanes;
use super::metric::PxFromBase;
use super::parameters::Parameters;

/// Rays are followed up to so many times the sensor's longest range: beyond, all is one.
pub const LOOK_BEYOND: f32 = 1.5;
/// Thickest wall that a robot may be believed to stand in, metres of the local metric.
pub const LEAVE_WALL_M: f32 = 0.4;

/// Range from the sensor to the first drawn wall along beam `i`, metres of the local metric, at most
/// `LOOK_BEYOND` times the longest range. `place_px` is the robot's.
#[inline]
pub fn expected_range(grid: &Grid, beams: &Beams, i: usize, place_px: [f32; 2], metric: &PxFromBase) -> f32 {
    let origin = metric.apply(beams.origin_m[0], beams.origin_m[1]);
    let direction = metric.apply(beams.forward[i], beams.left[i]);
    let from = [place_px[0] + origin[0], place_px[1] + origin[1]];
    grid.cast(from, direction, LEAVE_WALL_M, beams.range_max_m * LOOK_BEYOND)
}

/// The visibility model: ln p of a beam by the logarithm of measured over expected range.
///
/// A reading is about where the wall is drawn (Laplace in the logarithm: a drawing errs by
/// proportion), or short of it (furniture), or anywhere. A beam without return says that the wall is
/// beyond the sensor's range.
#[derive(Debug, Clone)]
pub struct Visibility {
    returned: Vec<f32>,
    lost: Vec<f32>,
}

/// Entries of the tables over log₂(measured / expected) in [−[`LOG2_SPAN`], [`LOG2_SPAN`]].
const ENTRIES: usize = 2048;
const LOG2_SPAN: f32 = 8.0;
/// Brings the probability of no return to the level of the density of a return.
const LOST_LEVEL: f32 = 1.2;

impl Visibility {
    /// Tabulates the model.
    pub fn new(parameters: &Parameters) -> Self {
        let error =
            |i: usize| ((i as f32 + 0.5) / ENTRIES as f32 * 2.0 - 1.0) * LOG2_SPAN * std::f32::consts::LN_2;
        let table =
            |p: fn(&Parameters, f32) -> f32| (0..ENTRIES).map(|i| p(parameters, error(i)).ln()).collect();
        Self { returned: table(density_returned), lost: table(probability_lost) }
    }

    /// Σ ln p over all beams.
    pub fn log_likelihood(&self, grid: &Grid, beams: &Beams, place_px: [f32; 2], metric: &PxFromBase) -> f32 {
        let mut sum = 0.0;
        for i in 0..beams.len() {
            let expected = expected_range(grid, beams, i, place_px, metric).max(SHORTEST_M);
            let entry = entry(beams.log2_range[i] - fast_log2(expected));
            sum += if beams.returned[i] { self.returned[entry] } else { self.lost[entry] };
        }
        sum
    }

    /// ln p of sixteen beams by log₂(measured / expected).
    #[inline(always)]
    pub fn of<S: Simd>(&self, simd: S, returned: bool, log2_ratio: f32x16<S>) -> f32x16<S> {
        let table = if returned { &self.returned } else { &self.lost };
        let at = (log2_ratio + LOG2_SPAN) * (ENTRIES as f32 / (2.0 * LOG2_SPAN));
        let entry: i32x16<S> = at.max(0.0).to_int();
        lanes::gather(simd, table, entry)
    }
}

#[inline]
fn entry(log2_ratio: f32) -> usize {
    let at = (log2_ratio + LOG2_SPAN) * (ENTRIES as f32 / (2.0 * LOG2_SPAN));
    (at.max(0.0) as usize).min(ENTRIES - 1)
}

/// Density of a returned beam over e = ln(measured / expected).
fn density_returned(p: &Parameters, e: f32) -> f32 {
    let laplace = (-e.abs() / p.visibility_width).exp() / (2.0 * p.visibility_width);
    let short = if e < 0.0 { 0.5 * (e / 2.0).exp() } else { 0.0 };
    p.visibility_hit * laplace + p.visibility_short * short + p.visibility_random * 0.25
}

/// Level of a beam without return, e = ln(longest / expected).
fn probability_lost(p: &Parameters, e: f32) -> f32 {
    let tail = 0.5 * (-e.abs() / p.visibility_width).exp();
    let beyond = if e < 0.0 { 1.0 - tail } else { tail };
    LOST_LEVEL * (0.9 * beyond + 0.03)
}

/// log₂ of a positive, normal number to 3·10⁻³: exponent plus a parabola through the mantissa.
#[inline]
fn fast_log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let mantissa = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000) - 1.0;
    exponent as f32 + mantissa * (1.3465553 - 0.3465553 * mantissa)
}

/// The likelihood field (Thrun, Burgard and Fox, section 6.4): ln p of an end point by its distance
/// from the nearest drawn wall.
#[derive(Debug, Clone)]
pub struct Field {
    cells: [usize; 2],
    px_per_cell: f32,
    /// ln p of an end point in each cell.
    by_cell: Vec<f32>,
}

impl Field {
    /// Tabulates the kernel for a drawing of mean scale `scale_pxpm`.
    pub fn new(grid: &Grid, parameters: &Parameters, scale_pxpm: f32) -> Self {
        let sigma_px = (parameters.field_sigma_m * scale_pxpm).max(grid.px_per_cell());
        let kernel = |step: u8| {
            let away = grid.distance_px(step) / sigma_px;
            let hit = (1.0 - parameters.field_random) * (-0.5 * away * away).exp();
            (hit + parameters.field_random.max(1e-3)).ln()
        };
        let by_step: Vec<f32> = (0..=u8::MAX).map(kernel).collect();
        let by_cell = grid.distance_steps().iter().map(|&step| by_step[usize::from(step)]).collect();
        Self { cells: grid.cells(), px_per_cell: grid.px_per_cell(), by_cell }
    }

    /// Columns and rows, the ring around the drawing included.
    pub fn cells(&self) -> [usize; 2] {
        self.cells
    }

    /// Pixels along an edge of a cell.
    pub fn px_per_cell(&self) -> f32 {
        self.px_per_cell
    }

    /// ln p of an end point in each cell, row by row from the bottom.
    pub fn by_cell(&self) -> &[f32] {
        &self.by_cell
    }

    /// Σ ln p over the beams that returned: the plain form of what [`super::weighing`] computes.
    pub fn log_likelihood(&self, beams: &Beams, place_px: [f32; 2], metric: &PxFromBase) -> f32 {
        let inverse = 1.0 / self.px_per_cell;
        let cell = |px: f32, size: usize| ((px * inverse + 1.0) as usize).min(size - 1);
        let [width, height] = self.cells;
        let mut sum = 0.0;
        for end_m in &beams.end_m {
            let end = metric.apply(end_m[0], end_m[1]);
            let (x, y) = (place_px[0] + end[0], place_px[1] + end[1]);
            sum += self.by_cell[cell(y, height) * width + cell(x, width)];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_logarithm_is_close() {
        for i in 1..100_000 {
            let x = i as f32 * 3e-4;
            assert!((fast_log2(x) - x.log2()).abs() < 1e-2, "{x}");
        }
    }

    #[test]
    fn the_expected_range_is_the_likeliest() {
        let p = Parameters::default();
        let at = |e: f32| density_returned(&p, e);
        assert!(at(0.0) > at(0.1) && at(0.0) > at(-0.1) && at(-1.5) > at(1.5));
        assert!(probability_lost(&p, -1.0) > 10.0 * probability_lost(&p, 1.0));
    }
}
