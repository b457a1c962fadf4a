//! The densest place of the particle set. Never a mean over several places: between two modes the
//! robot is for sure not.

use super::metric::wrap;
use super::particles::ParticleSet;
use super::scales::ScaledPose;

/// The densest place and how the particles lie around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Weighted mean of the particles there.
    pub pose: ScaledPose,
    /// Covariance of those particles: (x, y, yaw, a, b), row by row.
    pub covariance: [f64; 25],
    /// Share of the weight there.
    pub share: f64,
}

/// What counts as near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// Radius in position, pixels.
    pub radius_px: f32,
    /// Radius in heading, radians.
    pub radius_rad: f32,
}

/// How many particles, drawn evenly by weight, are tried as the densest.
const CANDIDATES: usize = 64;
/// How often the mean of what is near becomes the new middle (mean shift).
const SHIFTS: usize = 3;

impl Kernel {
    /// Squared distance in radii.
    #[inline]
    fn distance2(&self, set: &ParticleSet, i: usize, pose: &ScaledPose) -> f32 {
        let (dx, dy) = (set.x_px[i] - pose.x_px, set.y_px[i] - pose.y_px);
        let yaw = wrap(set.yaw_rad[i] - pose.yaw_rad) / self.radius_rad;
        (dx * dx + dy * dy) / (self.radius_px * self.radius_px) + yaw * yaw
    }

    /// Epanechnikov's kernel density.
    fn density(&self, set: &ParticleSet, pose: &ScaledPose) -> f32 {
        let near = |i: usize| (1.0 - self.distance2(set, i, pose)).max(0.0);
        (0..set.len()).map(|i| set.weight[i] * near(i)).sum()
    }

    fn overlap(&self, a: &ScaledPose, b: &ScaledPose) -> bool {
        let (dx, dy) = (a.x_px - b.x_px, a.y_px - b.y_px);
        let yaw = wrap(a.yaw_rad - b.yaw_rad) / self.radius_rad;
        (dx * dx + dy * dy) / (self.radius_px * self.radius_px) + yaw * yaw < 1.0
    }
}

/// The mode of `set`. Near `last`, where the robot was believed to be, the density counts `loyalty`
/// times, so that two equal rivals do not take turns.
pub fn find_mode(set: &ParticleSet, kernel: &Kernel, last: Option<&ScaledPose>, loyalty: f32) -> Mode {
    let mut best = (f32::NEG_INFINITY, set.pose(0));
    let mut passed = 0.0;
    for i in 0..set.len() {
        let before = (passed * CANDIDATES as f32).ceil();
        passed += set.weight[i];
        if passed * (CANDIDATES as f32) < before && i > 0 {
            continue;
        }
        let pose = set.pose(i);
        let faith = if last.is_some_and(|l| kernel.overlap(l, &pose)) { loyalty } else { 1.0 };
        let density = kernel.density(set, &pose) * faith;
        if density > best.0 {
            best = (density, pose);
        }
    }
    let mut pose = best.1;
    for _ in 0..SHIFTS {
        pose = mean_near(set, kernel, &pose).map_or(pose, |(mean, _)| mean);
    }
    let share = mean_near(set, kernel, &pose).map_or(0.0, |(_, share)| share);
    Mode { pose, covariance: covariance_near(set, kernel, &pose), share }
}

/// Weighted mean of the particles within the kernel's radius (scales in the logarithm), and their
/// weight; `None` where there is none.
fn mean_near(set: &ParticleSet, kernel: &Kernel, pose: &ScaledPose) -> Option<(ScaledPose, f64)> {
    let mut sum = [0.0_f64; 5];
    let mut weights = 0.0_f64;
    for i in (0..set.len()).filter(|&i| kernel.distance2(set, i, pose) < 1.0) {
        let weight = f64::from(set.weight[i]);
        let yaw = wrap(set.yaw_rad[i] - pose.yaw_rad);
        let value = [set.x_px[i] - pose.x_px, set.y_px[i] - pose.y_px, yaw, set.ln_a[i], set.ln_b[i]];
        sum.iter_mut().zip(value).for_each(|(s, v)| *s += weight * f64::from(v));
        weights += weight;
    }
    if weights <= 0.0 {
        return None;
    }
    let [x, y, yaw, ln_a, ln_b] = sum.map(|s| (s / weights) as f32);
    let mean = ScaledPose {
        x_px: pose.x_px + x,
        y_px: pose.y_px + y,
        yaw_rad: wrap(pose.yaw_rad + yaw),
        a_pxpm: ln_a.exp(),
        b_pxpm: ln_b.exp(),
    };
    Some((mean, weights))
}

/// Covariance of (x, y, yaw, a, b) of the particles within twice the kernel's radius.
fn covariance_near(set: &ParticleSet, kernel: &Kernel, pose: &ScaledPose) -> [f64; 25] {
    let mut covariance = [0.0; 25];
    let mut weights = 0.0;
    for i in (0..set.len()).filter(|&i| kernel.distance2(set, i, pose) < 4.0) {
        let weight = f64::from(set.weight[i]);
        let other = set.pose(i);
        let away = [
            other.x_px - pose.x_px,
            other.y_px - pose.y_px,
            wrap(other.yaw_rad - pose.yaw_rad),
            other.a_pxpm - pose.a_pxpm,
            other.b_pxpm - pose.b_pxpm,
        ]
        .map(f64::from);
        for (entry, cell) in covariance.iter_mut().enumerate() {
            *cell += weight * away[entry / 5] * away[entry % 5];
        }
        weights += weight;
    }
    if weights > 0.0 {
        covariance.iter_mut().for_each(|cell| *cell /= weights);
    }
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KERNEL: Kernel = Kernel { radius_px: 10.0, radius_rad: 0.5 };

    /// Two heaps of particles, the first of share `share`, `apart` pixels from each other.
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
