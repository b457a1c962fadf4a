//! Finds the pose around which the particles are densest. A mean over several modes would not do, because the robot is never
//! between them.

use fearless_simd::{Level, dispatch, f32x16, prelude::*};

use super::lanes::{self, LANES};
use super::metric::wrap;
use super::particles::ParticleSet;
use super::scales::ScaledPose;

/// The pose around which the particles are densest, and their spread around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Weighted mean of the particles near the mode.
    pub pose: ScaledPose,
    /// Covariance of (x, y, yaw, a, b) around the mode, in row-major order.
    pub covariance: [f64; 25],
    /// Share of the weight near the mode.
    pub share: f64,
}

/// Radii within which particles count as near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// Radius in position, in pixels.
    pub radius_px: f32,
    /// Radius in heading, in radians.
    pub radius_rad: f32,
}

/// Number of particles, drawn evenly by weight, that are candidates for the mode.
const CANDIDATES: usize = 4 * LANES;
/// Number of rounds of mean shift, in each of which the mean of the nearby particles becomes the new centre.
const SHIFTS: usize = 3;

impl Kernel {
    fn overlap(&self, a: &ScaledPose, b: &ScaledPose) -> bool {
        let (dx, dy) = (a.x_px - b.x_px, a.y_px - b.y_px);
        let yaw = wrap(a.yaw_rad - b.yaw_rad) / self.radius_rad;
        (dx * dx + dy * dy) / (self.radius_px * self.radius_px) + yaw * yaw < 1.0
    }
}

/// The candidates for the mode, and the density around each.
struct Candidates {
    particle: [usize; CANDIDATES],
    density: [f32; CANDIDATES],
    count: usize,
}

impl Candidates {
    /// Returns the particles at the middles of [`CANDIDATES`] equal shares of the weight.
    fn of(set: &ParticleSet) -> Self {
        let (mut particle, mut count, mut passed, mut next) = ([0; CANDIDATES], 0, 0.0, 0.5);
        for (i, weight) in set.weight.iter().enumerate() {
            passed += weight * CANDIDATES as f32;
            if passed > next && count < CANDIDATES {
                particle[count] = i;
                count += 1;
                next = passed.round() + 0.5;
            }
        }
        Self { particle, density: [0.0; CANDIDATES], count }
    }

    /// Computes the density around each candidate, with Epanechnikov's kernel.
    fn weigh(&mut self, level: Level, set: &ParticleSet, kernel: &Kernel) {
        dispatch!(level, simd => self.weigh_by(simd, set, kernel));
    }

    #[inline(always)]
    fn weigh_by<S: Simd>(&mut self, simd: S, set: &ParticleSet, kernel: &Kernel) {
        let inverse = [1.0 / kernel.radius_px, 1.0 / kernel.radius_rad];
        for first in (0..self.count).step_by(LANES) {
            let at = |column: &[f32]| f32x16::from_fn(simd, |lane| column[self.particle[first + lane]]);
            let (x, y, yaw) = (at(&set.x_px), at(&set.y_px), at(&set.yaw_rad));
            let mut sum = f32x16::splat(simd, 0.0);
            for i in 0..set.len() {
                let (dx, dy) = ((x - set.x_px[i]) * inverse[0], (y - set.y_px[i]) * inverse[0]);
                let turned = lanes::wrap(yaw - set.yaw_rad[i]) * inverse[1];
                let near = (-(dx * dx + dy * dy + turned * turned) + 1.0).max(0.0);
                sum += near * set.weight[i];
            }
            self.density[first..first + LANES].copy_from_slice(sum.as_slice());
        }
    }
}

/// Finds the mode of `set`. Near `last`, the robot's previous estimated pose, the density is multiplied by
/// `hysteresis`, so that the estimate does not alternate between two equal rivals.
pub fn find_mode(set: &ParticleSet, kernel: &Kernel, last: Option<&ScaledPose>, hysteresis: f32) -> Mode {
    let mut candidates = Candidates::of(set);
    candidates.weigh(Level::new(), set, kernel);
    let mut best = (f32::NEG_INFINITY, set.pose(0));
    for (&particle, density) in candidates.particle.iter().zip(candidates.density).take(candidates.count) {
        let pose = set.pose(particle);
        let factor = if last.is_some_and(|l| kernel.overlap(l, &pose)) { hysteresis } else { 1.0 };
        if density * factor > best.0 {
            best = (density * factor, pose);
        }
    }
    let mut pose = best.1;
    for _ in 0..SHIFTS {
        pose = mean_near(Level::new(), set, kernel, &pose).map_or(pose, |(mean, _)| mean);
    }
    let share = mean_near(Level::new(), set, kernel, &pose).map_or(0.0, |(_, share)| share);
    Mode { pose, covariance: covariance_near(Level::new(), set, kernel, &pose), share }
}

/// Returns the weighted mean of the particles within the kernel's radius and their total weight, or `None` if there are none.
/// Scales are averaged as logarithms.
fn mean_near(
    level: Level,
    set: &ParticleSet,
    kernel: &Kernel,
    pose: &ScaledPose,
) -> Option<(ScaledPose, f64)> {
    let sums = dispatch!(level, simd => sum_near(simd, set, kernel, pose, 1.0, |[x, y, yaw, ln_a, ln_b]| {
        [f32x16::splat(simd, 1.0), x, y, yaw, ln_a, ln_b]
    }));
    let weights = sums[0];
    if weights <= 0.0 {
        return None;
    }
    let [_, x, y, yaw, ln_a, ln_b] = sums.map(|s| (s / weights) as f32);
    let mean = ScaledPose {
        x_px: pose.x_px + x,
        y_px: pose.y_px + y,
        yaw_rad: wrap(pose.yaw_rad + yaw),
        a_pxpm: ln_a.exp(),
        b_pxpm: ln_b.exp(),
    };
    Some((mean, weights))
}

/// Returns the covariance of (x, y, yaw, a, b) of the particles within twice the kernel's radius.
fn covariance_near(level: Level, set: &ParticleSet, kernel: &Kernel, pose: &ScaledPose) -> [f64; 25] {
    let products: [f64; 16] = dispatch!(level, simd => sum_near(simd, set, kernel, pose, 4.0, |[x, y, yaw, ln_a, ln_b]| {
        let away = [x, y, yaw, lanes::exp(ln_a) - pose.a_pxpm, lanes::exp(ln_b) - pose.b_pxpm];
        let one = f32x16::splat(simd, 1.0);
        std::array::from_fn(|k| TRIANGLE[k].map_or(one, |(row, column)| away[row] * away[column]))
    }));
    let mut covariance = [0.0; 25];
    for (product, entry) in products.into_iter().zip(TRIANGLE) {
        if let Some((row, column)) = entry.filter(|_| products[0] > 0.0) {
            covariance[row * 5 + column] = product / products[0];
            covariance[column * 5 + row] = product / products[0];
        }
    }
    covariance
}

/// The sums for a covariance: first the weight, then the entries on and above the diagonal.
const TRIANGLE: [Option<(usize, usize)>; 16] = {
    let mut entries = [None; 16];
    let (mut k, mut row) = (1, 0);
    while row < 5 {
        let mut column = row;
        while column < 5 {
            entries[k] = Some((row, column));
            (k, column) = (k + 1, column + 1);
        }
        row += 1;
    }
    entries
};

/// Returns the sums of weight times each of `values` over the particles closer to `pose` than √`reach` radii. The values are
/// computed from (x, y, yaw) relative to `pose` and the logarithms of the scales.
#[inline(always)]
fn sum_near<S: Simd, const N: usize>(
    simd: S,
    set: &ParticleSet,
    kernel: &Kernel,
    pose: &ScaledPose,
    reach: f32,
    values: impl Fn([f32x16<S>; 5]) -> [f32x16<S>; N],
) -> [f64; N] {
    let inverse = [1.0 / kernel.radius_px, 1.0 / kernel.radius_rad];
    let nothing = f32x16::splat(simd, 0.0);
    let mut sums = [nothing; N];
    for first in (0..set.len()).step_by(LANES) {
        let column = |column: &[f32]| lanes::load(simd, column, first);
        let (x, y) = (column(&set.x_px) - pose.x_px, column(&set.y_px) - pose.y_px);
        let yaw = lanes::wrap(column(&set.yaw_rad) - pose.yaw_rad);
        let away = [x * inverse[0], y * inverse[0], yaw * inverse[1]];
        let near = (away[0] * away[0] + away[1] * away[1] + away[2] * away[2]).simd_lt(reach);
        let weight = lanes::load_or_zero(simd, &set.weight, first);
        let values = values([x, y, yaw, column(&set.ln_a), column(&set.ln_b)]);
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += near.select(value * weight, nothing);
        }
    }
    sums.map(|sum| sum.as_slice().iter().copied().map(f64::from).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KERNEL: Kernel = Kernel { radius_px: 10.0, radius_rad: 0.5 };

    /// Returns the squared distance in radii.
    fn distance2(set: &ParticleSet, i: usize, pose: &ScaledPose) -> f32 {
        let (dx, dy) = (set.x_px[i] - pose.x_px, set.y_px[i] - pose.y_px);
        let yaw = wrap(set.yaw_rad[i] - pose.yaw_rad) / KERNEL.radius_rad;
        (dx * dx + dy * dy) / (KERNEL.radius_px * KERNEL.radius_px) + yaw * yaw
    }

    /// Creates two clusters of particles `apart` pixels from each other, the first with a share of `share`.
    fn two_heaps(share: f32, apart: f32, turned: f32) -> ParticleSet {
        let mut set = ParticleSet::new(200);
        for i in 0..200 {
            let first = (i as f32) < share * 200.0;
            let jitter = ((i * 37) % 11) as f32 / 11.0 - 0.5;
            set.x_px[i] = 100.0 + 4.0 * jitter + if first { 0.0 } else { apart };
            set.y_px[i] = 50.0 - 3.0 * jitter;
            set.yaw_rad[i] = wrap(3.1 + 0.1 * jitter + if first { 0.0 } else { turned });
            set.ln_a[i] = 3.0;
            set.ln_b[i] = 2.0;
        }
        set
    }

    proptest! {
        #[test]
        fn the_estimate_is_never_between_two_modes(share in 0.05f32..0.95, apart in 30.0f32..200.0) {
            let set = two_heaps(share, apart, 0.0);
            let mode = find_mode(&set, &KERNEL, None, 1.0);
            let at_first = (mode.pose.x_px - 100.0).abs() < 3.0;
            let at_second = (mode.pose.x_px - 100.0 - apart).abs() < 3.0;
            prop_assert!(at_first || at_second, "{}", mode.pose.x_px);
            if (share - 0.5).abs() > 0.1 {
                prop_assert_eq!(at_first, share > 0.5);
            }
        }
    }

    proptest! {
        #[test]
        fn densities_are_those_of_the_plain_loop(share in 0.05f32..0.95, apart in 0.0f32..40.0, turned in 0.0f32..6.0) {
            let mut set = two_heaps(share, apart, turned);
            set.log_weight.iter_mut().enumerate().for_each(|(i, w)| *w = -((i * 13 % 29) as f32) / 9.0);
            set.normalize();
            let of = |level| {
                let mut candidates = Candidates::of(&set);
                candidates.weigh(level, &set, &KERNEL);
                candidates
            };
            let found = of(Level::new());
            prop_assert!(lanes::levels().into_iter().all(|level| of(level).density == found.density));
            prop_assert!(found.count > CANDIDATES / 2 && found.particle[..found.count].is_sorted());
            for (&particle, density) in found.particle.iter().zip(found.density).take(found.count) {
                let pose = set.pose(particle);
                let near = |i: usize| set.weight[i] * (1.0 - distance2(&set, i, &pose)).max(0.0);
                let plain: f32 = (0..set.len()).map(near).sum();
                prop_assert!((density - plain).abs() < 1e-4, "{density} {plain}");
            }
        }

        #[test]
        fn moments_are_those_of_the_plain_loop(
            share in 0.05f32..0.95, apart in 0.0f32..40.0, turned in 0.0f32..6.0, count in 1usize..200,
        ) {
            let mut set = two_heaps(share, apart, turned);
            set.ln_a.iter_mut().enumerate().for_each(|(i, ln)| *ln += (i * 13 % 29) as f32 / 29.0);
            set.columns_mut().into_iter().for_each(|column| column.truncate(count));
            (set.weight, set.log_weight) = (vec![1.0 / count as f32; count], vec![0.0; count]);
            let pose = set.pose(count / 2);
            let of = |level| {
                (mean_near(level, &set, &KERNEL, &pose).unwrap(), covariance_near(level, &set, &KERNEL, &pose))
            };
            let ((mean, weight), covariance) = of(Level::new());
            prop_assert!(lanes::levels().into_iter().all(|level| of(level) == ((mean, weight), covariance)));
            let near: Vec<usize> = (0..count).filter(|&i| distance2(&set, i, &pose) < 1.0).collect();
            let mean_x = near.iter().map(|&i| set.x_px[i]).sum::<f32>() / near.len() as f32;
            prop_assert!((mean.x_px - mean_x).abs() < 1e-3, "{} {mean_x}", mean.x_px);
            prop_assert!((weight - near.len() as f64 / count as f64).abs() < 1e-5, "{weight}");
            let near = || (0..count).filter(|&i| distance2(&set, i, &pose) < 4.0).map(|i| set.pose(i));
            let product = |p: ScaledPose| (p.a_pxpm - pose.a_pxpm) * wrap(p.yaw_rad - pose.yaw_rad);
            let plain = f64::from(near().map(product).sum::<f32>()) / near().count() as f64;
            prop_assert!((covariance[13] - plain).abs() < 1e-4 && covariance[13] == covariance[17], "{plain}");
        }

        #[test]
        fn candidates_hold_the_middles_of_equal_shares(heavy in 0usize..200, weight in 0.0f32..6.0) {
            let mut set = two_heaps(0.5, 30.0, 0.0);
            set.log_weight[heavy] = weight;
            set.normalize();
            let found = Candidates::of(&set);
            let mut end = 0.0;
            for (i, &weight) in set.weight.iter().enumerate() {
                let begin = end;
                end += f64::from(weight) * CANDIDATES as f64;
                // Sums are rounded, so a middle at the very end of a piece may fall on either side.
                let middles = |slack: f64| (begin - 0.5 - slack).ceil() < (end - 0.5 + slack).ceil();
                let tried = found.particle[..found.count].contains(&i);
                prop_assert!(if tried { middles(1e-3) } else { !middles(-1e-3) }, "{i}: {begin} to {end}");
            }
        }
    }

    #[test]
    fn opposite_headings_are_two_modes() {
        let mode = find_mode(&two_heaps(0.6, 0.0, std::f32::consts::PI), &KERNEL, None, 1.0);
        assert!(wrap(mode.pose.yaw_rad - 3.1).abs() < 0.1, "{}", mode.pose.yaw_rad);
        assert!((mode.share - 0.6).abs() < 0.02 && (mode.pose.a_pxpm - 3.0_f32.exp()).abs() < 1e-3);
    }

    #[test]
    fn rivals_do_not_take_turns() {
        let set = two_heaps(0.54, 100.0, 0.0);
        let second = ScaledPose { x_px: 200.0, y_px: 50.0, yaw_rad: 3.1, a_pxpm: 1.0, b_pxpm: 1.0 };
        assert!((find_mode(&set, &KERNEL, Some(&second), 1.3).pose.x_px - 200.0).abs() < 3.0);
        assert!((find_mode(&set, &KERNEL, None, 1.3).pose.x_px - 100.0).abs() < 3.0);
    }
}
