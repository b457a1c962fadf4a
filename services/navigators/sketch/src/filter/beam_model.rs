//! The beam model, which computes the likelihood of a scan at a pose with two scales from the walls visible there.
//!
//! Ranges in a drawing are off by a factor, and bearings are off as well: a door may be drawn too narrow or in the wrong place, so
//! that even from the true pose some beams pass through drawn walls. The range r of a beam is therefore compared with the drawing
//! at nearby bearings β + δ,
//!
//! ```text
//! p(r) = Σ_δ q(δ) p(r | expected range at β + δ),
//! ```
//!
//! which is the proper likelihood of a reading whose error in bearing is unknown. A maximum over δ instead of the sum would be most
//! forgiving at positions with the widest view, and would attract the estimate to them.
//!
//! Around an expected range x, with e = ln(r / x), a reading r is one of three kinds. It is near the expected range (a Laplace
//! distribution of width w), anywhere, or short of the expected range because of objects that are not drawn. The last kind sets a
//! minimum for the Laplace term on that side. A beam without return means that the wall is beyond the sensor's range. Given r and x
//! to the power 1/w, the Laplace term is the lesser of (r/x)^(1/w) and (x/r)^(1/w), so no exponentials or tables are needed for the
//! five bearings.
//!
//! The width w depends on the source of the drawing: a surveyed map is off by the size of its cells, a drawing from memory by a
//! quarter. The filter learns the width while driving ([`learned`]).

use fearless_simd::{f32x16, prelude::*};

use super::beams::{Beams, SHORTEST_M};
use super::grid::Grid;
use super::lanes::{self, LANES};
use super::metric::{PxFromBase, wrap};
use super::parameters::Parameters;

/// Multiple of the sensor's maximum range up to which rays are followed. Everything beyond is treated alike.
pub const LOOK_BEYOND: f32 = 1.5;
/// Thickness, in metres of the local metric, of the thickest wall in which the robot may be estimated to be.
pub const LEAVE_WALL_M: f32 = 0.4;
/// Number of bearings at which the drawing is compared with a reading.
const BEARINGS: usize = 5;
/// Density over e of a reading that may be anywhere, and of a short reading.
const ANYWHERE: f32 = 0.25;
const ANYWHERE_SHORT: f32 = 0.3;
/// Factor that makes the probability of no return comparable with the density of a return.
const LOST_LEVEL: f32 = 1.2;
/// Share of the beams without return that the expected range explains, and share of those that are random.
const LOST_SHARES: [f32; 2] = [0.9, 0.03];
/// Number of readings whose likelihoods are multiplied before a logarithm is taken. It is small enough that no product leaves the
/// range of single precision.
const PER_LOGARITHM: usize = 4;

/// Returns the range from the sensor to the first drawn wall along beam `i`, in metres of the local metric, but at most
/// [`LOOK_BEYOND`] times the maximum range. `place_px` is the robot's position.
#[inline]
pub fn expected_range(grid: &Grid, beams: &Beams, i: usize, place_px: [f32; 2], metric: &PxFromBase) -> f32 {
    let origin = metric.apply(beams.origin_m[0], beams.origin_m[1]);
    let direction = metric.apply(beams.forward[i], beams.left[i]);
    let from = [place_px[0] + origin[0], place_px[1] + origin[1]];
    grid.cast(from, direction, LEAVE_WALL_M, beams.range_max_m * LOOK_BEYOND)
}

/// Maximum error of the ranges, as |ln(measured / expected)|. Greater errors are capped.
const MOST_ERROR: f32 = 0.5;
/// Rates at which the estimated error rises and falls, as a share per update. It falls slowly, because a single corridor that
/// happens to fit does not make a drawing a map.
const ERROR_RISES: f32 = 0.1;
const ERROR_FALLS: f32 = 0.02;

/// Returns the estimated error of a drawing, which is the typical |ln(measured / expected)|, after an update
/// in which the error `seen` was measured.
pub fn learned(believed: f32, seen: f32) -> f32 {
    let follow = if seen > believed { ERROR_RISES } else { ERROR_FALLS };
    believed + follow * (seen.min(MOST_ERROR) - believed)
}

/// The beam model, with the readings of the last scan.
#[derive(Debug, Clone)]
pub struct BeamModel {
    /// The minimum and the maximum Laplace width.
    widths: [f32; 2],
    /// The width w, and 1/w.
    width: f32,
    inverse_width: f32,
    /// Share of the readings at the expected range, and the levels of the other two densities.
    hit: f32,
    short: f32,
    random: f32,
    /// Errors of the bearing, in radians, and their shares, which add up to 1.
    bearing_error_rad: [f32; BEARINGS],
    shares: [f32; BEARINGS],
    readings: Vec<Reading>,
    /// Binary logarithm of the sensor's maximum range in metres, which is the unit of [`Powers`].
    unit_log2: f32,
    /// Binary logarithms of the bounds to which ranges are clamped, in metres.
    bounds_log2: [f32; 2],
}

/// Working memory for the plain form of the model.
#[derive(Debug, Clone, Default)]
pub struct Room {
    expected: Vec<Powers<f32>>,
    errors: Vec<f32>,
}

impl Room {
    /// Creates working memory for `beams` beams.
    pub fn new(beams: usize) -> Self {
        Self { expected: Vec::with_capacity(beams), errors: Vec::with_capacity(beams) }
    }
}

/// The measurement of a beam.
#[derive(Debug, Clone, Copy)]
struct Reading {
    returned: bool,
    range: Powers<f32>,
    /// Indices of the beams at the bearings with which the reading is compared.
    beside: [u16; BEARINGS],
    /// For each of these bearings, r^(1/w) and its inverse, both times the density of a reading that is exactly as expected.
    sharp: [f32; BEARINGS],
    inverse: [f32; BEARINGS],
}

/// Powers x^(1/w) and x^(−1/w) of a range x, which is in units of the sensor's maximum range.
#[derive(Debug, Clone, Copy)]
pub struct Powers<T> {
    sharp: T,
    inverse: T,
}

impl BeamModel {
    /// Creates the model with the given parameters, and buffers for `parameters.beams` readings.
    pub fn new(parameters: &Parameters) -> Self {
        let p = parameters;
        let step = p.bearing_error_rad / (BEARINGS / 2) as f32;
        let bearing_error_rad = std::array::from_fn(|k| (k as f32 - (BEARINGS / 2) as f32) * step);
        let weights = bearing_error_rad.map(|error: f32| (-error.abs() / p.bearing_width_rad).exp());
        let sum: f32 = weights.iter().sum();
        Self {
            widths: [p.least_hit_width, p.hit_width],
            width: p.hit_width,
            inverse_width: 1.0 / p.hit_width,
            hit: p.z_hit,
            short: p.z_short * ANYWHERE_SHORT,
            random: p.z_rand * ANYWHERE,
            bearing_error_rad,
            shares: weights.map(|weight| weight / sum),
            readings: Vec::with_capacity(parameters.beams),
            unit_log2: 0.0,
            bounds_log2: [0.0; 2],
        }
    }

    /// Reads the beams of a scan, for a drawing with the estimated error `error`.
    pub fn read(&mut self, beams: &Beams, error: f32) {
        let [least, largest] = self.widths;
        // Squaring the error separates maps from drawings that happen to fit for a while.
        self.width = (error * error / largest).clamp(least, largest);
        self.inverse_width = 1.0 / self.width;
        self.unit_log2 = beams.range_max_m.log2();
        let (nearest_log2, told) = (SHORTEST_M.log2() - self.unit_log2, lanes::MOST_EXP2 * self.width);
        self.bounds_log2 =
            [nearest_log2.max(-told), LOOK_BEYOND.log2().min(told)].map(|b| b + self.unit_log2);
        let level = self.shares.map(|share| share * self.hit * 0.5 * self.inverse_width);
        self.readings.clear();
        for i in 0..beams.len() {
            let near = |error: f32| nearest(&beams.angle_rad, beams.angle_rad[i] + error);
            let range = self.powers(beams.log2_range[i]);
            self.readings.push(Reading {
                returned: beams.returned[i],
                range,
                beside: self.bearing_error_rad.map(near),
                sharp: level.map(|level| range.sharp * level),
                inverse: level.map(|level| range.inverse * level),
            });
        }
    }

    /// Returns the weight of a scan relative to that in a hand drawing, given the estimated accuracy of this drawing. In an
    /// accurate drawing, the remaining errors are those of the sensor, which are independent between beams.
    pub fn exactness(&self) -> f32 {
        (self.widths[1] / self.width).sqrt()
    }

    /// Returns the powers of a range in metres, given its binary logarithm.
    fn powers(&self, log2_m: f32) -> Powers<f32> {
        let log2 = log2_m.clamp(self.bounds_log2[0], self.bounds_log2[1]) - self.unit_log2;
        let sharp = (log2 * self.inverse_width).exp2();
        Powers { sharp, inverse: 1.0 / sharp }
    }

    /// Returns Σ ln p over all beams of the scan that was read, `beams`. This is the plain equivalent of [`super::weighing`].
    pub fn log_likelihood(
        &self,
        grid: &Grid,
        beams: &Beams,
        place_px: [f32; 2],
        metric: &PxFromBase,
        room: &mut Room,
    ) -> f32 {
        let range = |i| expected_range(grid, beams, i, place_px, metric);
        room.expected.clear();
        room.expected.extend((0..beams.len()).map(|i| self.powers(range(i).log2())));
        self.readings.iter().map(|reading| self.likelihood(reading, &room.expected).ln()).sum()
    }

    /// Returns the median of |ln(measured / expected)| over the beams that returned, at their own bearings, from the last call of
    /// [`Self::log_likelihood`] with this `room`. Returns `None` if no beam returned.
    pub fn error(&self, room: &mut Room) -> Option<f32> {
        let Room { expected, errors } = room;
        errors.clear();
        let returned = self.readings.iter().zip(expected).filter(|(reading, _)| reading.returned);
        errors
            .extend(returned.map(|(reading, expected)| (reading.range.sharp * expected.inverse).ln().abs()));
        let middle = errors.len() / 2;
        (middle < errors.len()).then(|| *errors.select_nth_unstable_by(middle, f32::total_cmp).1 * self.width)
    }

    /// Returns the likelihood of a reading, given the ranges that the drawing shows.
    fn likelihood(&self, reading: &Reading, expected: &[Powers<f32>]) -> f32 {
        let of_each = (0..BEARINGS).map(|k| {
            let expected = &expected[usize::from(reading.beside[k])];
            let p = if reading.returned {
                let about = self.hit * 0.5 * self.inverse_width;
                let farther = about * reading.range.inverse * expected.sharp;
                let nearer = about * reading.range.sharp * expected.inverse;
                farther.min(nearer.max(self.short)) + self.random
            } else {
                let beyond =
                    if expected.inverse < 1.0 { 1.0 - 0.5 * expected.inverse } else { 0.5 * expected.sharp };
                LOST_LEVEL * (LOST_SHARES[0] * beyond + LOST_SHARES[1])
            };
            self.shares[k] * p
        });
        of_each.sum()
    }

    /// Returns the powers of the expected ranges of sixteen particles along one beam, given the binary logarithms of the ranges in
    /// metres.
    #[inline(always)]
    pub fn expect<S: Simd>(&self, log2_m: f32x16<S>) -> Powers<[f32; LANES]> {
        let [least, most] = self.bounds_log2;
        let log2 = log2_m.max(least).min(most) - self.unit_log2;
        let [sharp, inverse] = lanes::fast_exp2(log2, self.inverse_width).map(Into::into);
        Powers { sharp, inverse }
    }

    /// Returns Σ ln p of sixteen particles, given their expected ranges of each beam.
    #[inline(always)]
    pub fn of<S: Simd>(&self, simd: S, expected: &[Powers<[f32; LANES]>]) -> f32x16<S> {
        let mut sum = f32x16::splat(simd, 0.0);
        for readings in self.readings.chunks(PER_LOGARITHM) {
            let mut product = f32x16::splat(simd, 1.0);
            for reading in readings {
                product *= self.likelihood_of_each(simd, reading, expected);
            }
            sum += lanes::fast_log2(product);
        }
        sum * std::f32::consts::LN_2
    }

    #[inline(always)]
    fn likelihood_of_each<S: Simd>(
        &self,
        simd: S,
        reading: &Reading,
        expected: &[Powers<[f32; LANES]>],
    ) -> f32x16<S> {
        let mut near = f32x16::splat(simd, 0.0);
        // Indexing is faster here. With iterators over both arrays, copying the shares took a tenth of the time.
        if reading.returned {
            for k in 0..BEARINGS {
                let expected = &expected[usize::from(reading.beside[k])];
                let nearer = f32x16::from_slice(simd, &expected.inverse) * reading.sharp[k];
                let farther = f32x16::from_slice(simd, &expected.sharp) * reading.inverse[k];
                near += farther.min(nearer.max(self.short * self.shares[k]));
            }
            near + self.random
        } else {
            for k in 0..BEARINGS {
                let expected = &expected[usize::from(reading.beside[k])];
                let inverse = f32x16::from_slice(simd, &expected.inverse);
                let sharp = f32x16::from_slice(simd, &expected.sharp);
                near += inverse.simd_lt(1.0).select(-inverse + 2.0, sharp) * self.shares[k];
            }
            near * (0.5 * LOST_LEVEL * LOST_SHARES[0]) + LOST_LEVEL * LOST_SHARES[1]
        }
    }
}

/// Returns the index of the element of `angles` nearest to `angle`. The angles rise or fall and cover at most one turn.
fn nearest(angles: &[f32], angle: f32) -> u16 {
    use std::f32::consts::TAU;
    let rises = angles.first() <= angles.last();
    let last = angles.len() - 1;
    let mut best = (f32::INFINITY, 0);
    for turned in [angle, angle - TAU, angle + TAU] {
        let after = angles.partition_point(|&one| (one < turned) == rises);
        for at in [after.saturating_sub(1), after.min(last)] {
            let off = wrap(angles[at] - angle).abs();
            if off < best.0 {
                best = (off, at);
            }
        }
    }
    best.1 as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};
    use proptest::prelude::*;

    /// Creates a fan of beams 0.1 rad apart with these ranges, for a sensor with a maximum range of 5 m.
    fn fan(ranges_m: &[f32]) -> Beams {
        let mut beams = Beams::with_capacity(ranges_m.len());
        beams.range_max_m = 5.0;
        let middle = (ranges_m.len() / 2) as f32;
        ranges_m.iter().enumerate().for_each(|(i, &range)| beams.push((i as f32 - middle) * 0.1, range));
        beams
    }

    /// Returns the likelihood of the middle reading of `measured` if the drawing shows the ranges `drawn`.
    fn likelihood(parameters: &Parameters, measured: &[f32], drawn: &[f32]) -> f32 {
        let mut beam_model = BeamModel::new(parameters);
        beam_model.read(&fan(measured), parameters.hit_width);
        let expected: Vec<_> = drawn.iter().map(|range| beam_model.powers(range.log2())).collect();
        beam_model.likelihood(&beam_model.readings[measured.len() / 2], &expected)
    }

    #[test]
    fn by_hand_it_is_made_of_three_densities() {
        let p = Parameters { bearing_error_rad: 0.0, ..Parameters::default() };
        let level = |measured: f32| likelihood(&p, &[measured], &[2.0]);
        let hit = |e: f32| p.z_hit * (-e.abs() / p.hit_width).exp() / (2.0 * p.hit_width);
        let anywhere = p.z_rand * 0.25;
        let short = p.z_short * 0.3;
        for measured in [0.5_f32, 1.9, 2.1, 4.0, 4.99] {
            let e = (measured / 2.0).ln();
            let expected = anywhere + if e < 0.0 { hit(e).max(short) } else { hit(e) };
            assert!((level(measured) / expected - 1.0).abs() < 1e-4, "{measured}");
        }
        // A wall at 2 m, which is closer than the sensor's maximum range by ln 2.5, gives no return.
        let lost = 1.2 * (0.9 * 0.5 * (2.0_f32 / 5.0).powf(1.0 / p.hit_width) + 0.03);
        assert!((level(6.0) / lost - 1.0).abs() < 1e-4);
        assert!(likelihood(&p, &[6.0], &[7.4]) > 10.0 * level(6.0));
    }

    #[test]
    fn a_door_that_is_drawn_beside_its_place_is_forgiven() {
        let rigid = Parameters { bearing_error_rad: 0.0, ..Parameters::default() };
        let ours = Parameters { bearing_error_rad: 0.2, ..Parameters::default() };
        let measured = [1.0, 1.0, 4.0, 1.0, 1.0];
        let beside = [1.0, 1.0, 1.0, 4.0, 1.0];
        assert!(likelihood(&ours, &measured, &beside) > 2.0 * likelihood(&rigid, &measured, &beside));
        // The likelihood is higher still if the door is in its true place, and lower without any door.
        assert!(likelihood(&ours, &measured, &measured) > likelihood(&ours, &measured, &beside) * 1.05);
        assert!(likelihood(&ours, &measured, &[1.0; 5]) < 0.5 * likelihood(&ours, &measured, &beside));
    }

    /// Returns the likelihoods of a reading for sixteen particles that expect the same range at every bearing.
    #[inline(always)]
    fn of_sixteen<S: Simd>(simd: S, beam_model: &BeamModel, reading: &Reading, range: f32) -> [f32; LANES] {
        let expected = beam_model.expect(f32x16::splat(simd, range.log2()));
        beam_model.likelihood_of_each(simd, reading, &vec![expected; beam_model.readings.len()]).into()
    }

    /// Regression test: with a maximum range of 79 m, a reading and a wall both closer than 7 cm fitted infinitely well, because
    /// their ratio to the maximum range, raised to the power 1/w of a map, left the range of single precision.
    #[test]
    fn the_shortest_ranges_of_a_long_laser_are_as_likely_as_any() {
        let p = Parameters::default();
        let mut beams = fan(&[0.05, 0.2, 7.0, 100.0]);
        beams.range_max_m = 79.0;
        let mut beam_model = BeamModel::new(&p);
        beam_model.read(&beams, 0.0);
        assert_eq!(beam_model.width, p.least_hit_width);
        let all =
            |range: f32| -> Vec<_> { (0..beams.len()).map(|_| beam_model.powers(range.log2())).collect() };
        let hit = p.z_hit / (2.0 * p.least_hit_width);
        for range in [SHORTEST_M, 0.05, 0.06, 0.2, 7.0, 79.0, 79.0 * LOOK_BEYOND] {
            let expected = all(range);
            for reading in &beam_model.readings {
                let likelihood = beam_model.likelihood(reading, &expected);
                assert!(likelihood > 0.0 && likelihood < 1.3 * hit, "{range} m: {likelihood}");
                let found = dispatch!(Level::new(), simd => of_sixteen(simd, &beam_model, reading, range));
                assert!(
                    found.iter().all(|found| (found / likelihood).ln().abs() < 0.01),
                    "{range} m: {found:?}"
                );
            }
        }
        assert!(beam_model.likelihood(&beam_model.readings[0], &all(0.05)) > 0.99 * hit);
    }

    #[test]
    fn a_drawing_that_fits_for_a_while_is_not_yet_a_map() {
        let after = |from: f32, seen: f32, updates: usize| (0..updates).fold(from, |e, _| learned(e, seen));
        assert!(after(0.25, 0.05, 25) > 0.15);
        assert!((after(0.25, 0.05, 400) - 0.05).abs() < 1e-3);
        assert!(after(0.05, 0.3, 25) > 0.25, "an error is believed soon");
        assert!(after(0.25, 100.0, 400) <= MOST_ERROR);
    }

    #[test]
    fn the_more_exact_a_drawing_is_the_more_a_scan_tells() {
        let p = Parameters::default();
        let of = |error: f32| {
            let mut beam_model = BeamModel::new(&p);
            beam_model.read(&fan(&[1.0]), error);
            (beam_model.width, beam_model.exactness())
        };
        assert_eq!(of(1.0), (p.hit_width, 1.0));
        assert_eq!(of(0.0).0, p.least_hit_width);
        assert!(of(0.1).1 > of(0.2).1 && of(0.2).1 > 1.0);
    }

    proptest! {
        #[test]
        fn the_nearest_bearing_is_found_all_around(
            first in -7.0_f32..7.0, step in 0.01_f32..0.3, count in 1usize..40, falls: bool, angle in -7.0_f32..7.0
        ) {
            let step = if falls { -step } else { step };
            let count = count.min((std::f32::consts::TAU / step.abs()) as usize);
            let angles: Vec<f32> = (0..count).map(|i| first + i as f32 * step).collect();
            prop_assume!((first - angle).abs() < 6.0 && (angles[count - 1] - angle).abs() < 6.0);
            let off = |i: usize| wrap(angles[i] - angle).abs();
            let least = (0..count).map(off).fold(f32::INFINITY, f32::min);
            prop_assert!((off(usize::from(nearest(&angles, angle))) - least).abs() < 1e-4);
        }
    }
}
