//! The particle set: a structure of arrays, weights, systematic resampling.

use fearless_simd::{Level, dispatch};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::{MAX_PARTICLES, Particle, Particles};

use super::lanes;
use super::scales::ScaledPose;

/// Weighted samples of (x, y, θ, a, b), one array for each coordinate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParticleSet {
    /// Position, pixels.
    pub x_px: Vec<f32>,
    /// Position, pixels, upwards.
    pub y_px: Vec<f32>,
    /// Heading, radians in [−π, π).
    pub yaw_rad: Vec<f32>,
    /// Natural logarithm of scale a, pixels a metre.
    pub ln_a: Vec<f32>,
    /// Natural logarithm of scale b, pixels a metre.
    pub ln_b: Vec<f32>,
    /// Logarithm of the weight, up to a constant.
    pub log_weight: Vec<f32>,
    /// Normalized weight; valid after [`Self::normalize`].
    pub weight: Vec<f32>,
}

impl ParticleSet {
    /// `count` particles at the origin, of equal weight.
    pub fn new(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            x_px: zeros(),
            y_px: zeros(),
            yaw_rad: zeros(),
            ln_a: zeros(),
            ln_b: zeros(),
            log_weight: zeros(),
            weight: vec![1.0 / count as f32; count],
        }
    }

    /// Makes room for `count` particles in all: the set may grow so far without allocating.
    pub fn reserve(&mut self, count: usize) {
        let Self { x_px, y_px, yaw_rad, ln_a, ln_b, log_weight, weight } = self;
        for column in [x_px, y_px, yaw_rad, ln_a, ln_b, log_weight, weight] {
            column.reserve_exact(count.saturating_sub(column.len()));
        }
    }

    /// How many particles there are.
    pub fn len(&self) -> usize {
        self.x_px.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.x_px.is_empty()
    }

    /// Makes the weights sum to one from their logarithms, the largest first brought to one so that
    /// nothing underflows. All weights are equal where no particle has any left.
    pub fn normalize(&mut self) {
        let largest = self.log_weight.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if !largest.is_finite() {
            self.log_weight.fill(0.0);
            let equal = 1.0 / self.len() as f32;
            self.weight.fill(equal);
            return;
        }
        self.log_weight.iter_mut().for_each(|log_weight| *log_weight -= largest);
        let Self { weight, log_weight, .. } = self;
        dispatch!(Level::new(), simd => lanes::exp_all(simd, log_weight, weight));
        let sum: f64 = self.weight.iter().copied().map(f64::from).sum();
        let inverse = (1.0 / sum) as f32;
        self.weight.iter_mut().for_each(|weight| *weight *= inverse);
    }

    /// Kish's effective sample size, 1 / Σ w², of normalized weights.
    pub fn effective_sample_size(&self) -> f64 {
        1.0 / self.weight.iter().map(|&w| f64::from(w) * f64::from(w)).sum::<f64>()
    }

    /// The particle of the largest weight, by its logarithm.
    pub fn best(&self) -> ScaledPose {
        let heavier =
            |best: usize, i: usize| if self.log_weight[i] > self.log_weight[best] { i } else { best };
        self.pose((1..self.len()).fold(0, heavier))
    }

    /// Pose and scales of particle `i`.
    pub fn pose(&self, i: usize) -> ScaledPose {
        ScaledPose {
            x_px: self.x_px[i],
            y_px: self.y_px[i],
            yaw_rad: self.yaw_rad[i],
            a_pxpm: self.ln_a[i].exp(),
            b_pxpm: self.ln_b[i].exp(),
        }
    }

    /// Writes every n-th particle into a message, as many as it holds.
    pub fn sample(&self, message: &mut Particles) {
        let stride = self.len().div_ceil(MAX_PARTICLES).max(1);
        let count = self.len().div_ceil(stride);
        for (slot, i) in message.particles.iter_mut().zip((0..self.len()).step_by(stride)) {
            *slot = self.particle(i);
        }
        message.particles[count..].fill(bytemuck::Zeroable::zeroed());
        message.count = count as u32;
        message.total = self.len() as u32;
    }

    fn particle(&self, i: usize) -> Particle {
        let ScaledPose { x_px, y_px, yaw_rad, a_pxpm, b_pxpm } = self.pose(i);
        Particle { x_px, y_px, yaw_rad, scale_a_pxpm: a_pxpm, scale_b_pxpm: b_pxpm, weight: self.weight[i] }
    }
}

/// Systematic resampling, with the room it needs.
#[derive(Debug, Clone)]
pub struct Resampler {
    /// For each particle of the new set, the one it comes from; one place more than particles.
    ancestor: Vec<u32>,
    spare: Vec<f32>,
}

impl Resampler {
    /// For sets of `count` particles.
    pub fn new(count: usize) -> Self {
        Self { ancestor: vec![0; count + 1], spare: vec![0.0; count] }
    }

    /// Replaces the set by one of equal weights, each particle as often as its weight says. One
    /// random number `offset` in [0, 1) serves all (Thrun, Burgard and Fox, table 4.4).
    pub fn resample(&mut self, set: &mut ParticleSet, offset: f64) {
        self.resample_to(set, set.len(), offset);
    }

    /// The same with `count` particles in the new set, at most as many as there is room for.
    pub fn resample_to(&mut self, set: &mut ParticleSet, count: usize, offset: f64) {
        self.ancestor.resize(count + 1, 0);
        self.choose(&set.weight, offset);
        let Self { ancestor, spare } = self;
        spare.resize(count, 0.0);
        let columns = [&mut set.x_px, &mut set.y_px, &mut set.yaw_rad, &mut set.ln_a, &mut set.ln_b];
        for column in columns {
            for (value, &from) in spare.iter_mut().zip(&*ancestor) {
                *value = column[from as usize];
            }
            std::mem::swap(column, spare);
            spare.resize(count, 0.0);
        }
        set.weight.clear();
        set.weight.resize(count, 1.0 / count as f32);
        set.log_weight.clear();
        set.log_weight.resize(count, 0.0);
    }

    /// Pointer k of the new set, (k + offset) / count, lies in the piece of the first particle with which
    /// the weights' sum exceeds it. There is no branch that depends on a weight, for it would be guessed
    /// wrong at every other particle: each marks the pointer where its piece begins, over the mark of
    /// those before it with no pointer in theirs, and the last mark up to a pointer is its ancestor. Who
    /// has no weight marks the place behind the last pointer.
    fn choose(&mut self, weight: &[f32], offset: f64) {
        let count = self.ancestor.len() - 1;
        self.ancestor.fill(0);
        let mut passed = 0.0;
        for (i, &weight) in weight.iter().enumerate() {
            let begin = ceil(passed * count as f64 - offset).min(count);
            self.ancestor[if weight > 0.0 { begin } else { count }] = i as u32;
            passed += f64::from(weight);
        }
        let mut latest = 0;
        for ancestor in &mut self.ancestor {
            latest = latest.max(*ancestor);
            *ancestor = latest;
        }
    }
}

/// The least natural number that is not below `x`. (Older processors have no instruction for it.)
#[inline]
fn ceil(x: f64) -> usize {
    let whole = x as i64;
    (whole + i64::from(x > whole as f64)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use proptest::prelude::*;

    fn set_of(log_weights: &[f32]) -> ParticleSet {
        let mut set = ParticleSet::new(log_weights.len());
        set.log_weight.copy_from_slice(log_weights);
        set.x_px.iter_mut().enumerate().for_each(|(i, x)| *x = i as f32);
        set.normalize();
        set
    }

    proptest! {
        #[test]
        fn weights_are_normalized(log_weights in proptest::collection::vec(-200.0f32..200.0, 16..300)) {
            let set = set_of(&log_weights);
            let sum: f64 = set.weight.iter().map(|&w| f64::from(w)).sum();
            prop_assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            let effective = set.effective_sample_size();
            prop_assert!((0.99..=set.len() as f64 + 0.01).contains(&effective), "{effective}");
        }

        #[test]
        fn every_particle_survives_as_often_as_its_weight_says(
            log_weights in proptest::collection::vec(-6.0f32..0.0, 16..300), offset in 0.0f64..1.0,
        ) {
            let before = set_of(&log_weights);
            let mut after = before.clone();
            Resampler::new(before.len()).resample(&mut after, offset);
            prop_assert_eq!(after.len(), before.len());
            for i in 0..before.len() {
                let copies = after.x_px.iter().filter(|&&x| x == i as f32).count() as f64;
                let expected = f64::from(before.weight[i]) * before.len() as f64;
                prop_assert!((copies - expected).abs() < 1.001, "{i}: {copies} of {expected}");
            }
        }
    }

    /// Table 4.4 of Thrun, Burgard and Fox: pointer by pointer, particle by particle, and never past the
    /// last that has any weight.
    fn two_loops(weight: &[f32], count: usize, offset: f64) -> Vec<u32> {
        let last = weight.iter().rposition(|&w| w > 0.0).unwrap_or(0);
        let (mut i, mut passed) = (0, f64::from(weight[0]));
        let mut ancestor = |k: usize| {
            while k as f64 >= passed * count as f64 - offset && i < last {
                i += 1;
                passed += f64::from(weight[i]);
            }
            i as u32
        };
        (0..count).map(&mut ancestor).collect()
    }

    fn log_weight() -> impl Strategy<Value = f32> {
        prop_oneof![4 => -6.0f32..0.0, 1 => -120.0f32..120.0, 2 => Just(f32::NEG_INFINITY), 1 => Just(0.0)]
    }

    fn offset() -> impl Strategy<Value = f64> {
        prop_oneof![8 => 0.0f64..1.0, 1 => Just(0.0), 1 => Just(1.0 - f64::EPSILON / 2.0)]
    }

    proptest! {
        #[test]
        fn ancestors_are_those_of_the_plain_loops(
            log_weights in proptest::collection::vec(log_weight(), 1..300), count in 1usize..400, offset in offset(),
        ) {
            let set = set_of(&log_weights);
            let mut resampler = Resampler::new(count);
            resampler.choose(&set.weight, offset);
            prop_assert_eq!(&resampler.ancestor[..count], two_loops(&set.weight, count, offset));
            prop_assert!(resampler.ancestor[..count].iter().all(|&i| set.weight[i as usize] > 0.0));
        }
    }

    /// In single precision 100,000 weights sum to a little less than one. The last pointer then went to
    /// the last particle, whatever its weight.
    #[test]
    fn who_has_no_weight_is_never_an_ancestor() {
        let count = 100_000;
        for heavy in [0, 1, 777, count - 1] {
            let mut log_weights = vec![f32::NEG_INFINITY; count];
            log_weights[heavy] = -3.0;
            let mut resampler = Resampler::new(count);
            resampler.choose(&set_of(&log_weights).weight, 0.999_999);
            assert!(resampler.ancestor[..count].iter().all(|&i| i as usize == heavy), "{heavy}");
        }
        let falling: Vec<f32> =
            (0..count).map(|i| if i < count / 2 { -1e-3 * (i % 97) as f32 } else { -1e9 }).collect();
        let mut resampler = Resampler::new(count);
        resampler.choose(&set_of(&falling).weight, 1.0 - f64::EPSILON / 2.0);
        assert!(resampler.ancestor[..count].iter().all(|&i| (i as usize) < count / 2));
    }

    #[test]
    fn a_resampled_set_may_be_larger_or_smaller() {
        let before = set_of(&[-1.0, 0.0, -2.0, 0.0]);
        for count in [2, 4, 40] {
            let mut after = before.clone();
            Resampler::new(40).resample_to(&mut after, count, 0.5);
            assert_eq!((after.len(), after.weight.len(), after.log_weight.len()), (count, count, count));
            let copies = after.x_px.iter().filter(|&&x| x == 1.0).count() as f32;
            assert!((copies - before.weight[1] * count as f32).abs() < 1.001, "{copies}");
        }
    }

    #[test]
    fn resampling_is_unbiased() {
        let before = set_of(&(0..40).map(|i| -0.1 * (i % 7) as f32 - 0.02 * i as f32).collect::<Vec<_>>());
        let (mut mean, rounds) = (0.0, 1000);
        for round in 0..rounds {
            let mut after = before.clone();
            Resampler::new(40).resample(&mut after, (round as f64 + 0.5) / rounds as f64);
            mean += after.x_px.iter().map(|&x| f64::from(x)).sum::<f64>() / 40.0 / rounds as f64;
        }
        let expected: f64 = before.x_px.iter().zip(&before.weight).map(|(&x, &w)| f64::from(x * w)).sum();
        assert!((mean - expected).abs() < 1e-3, "{mean} {expected}");
    }

    #[test]
    fn infinitely_unlikely_particles_have_no_weight() {
        let set = set_of(&[f32::NEG_INFINITY, 3.0, f32::NAN, 3.0, -200.0]);
        assert_eq!(set.weight, [0.0, 0.5, 0.0, 0.5, 0.0]);
    }

    #[test]
    fn a_set_without_weight_gets_equal_weights() {
        let set = set_of(&[f32::NEG_INFINITY; 20]);
        assert!(set.weight.iter().all(|&w| w == 0.05));
    }

    #[test]
    fn a_sample_of_a_large_set_fits_the_message() {
        let mut message = Particles::zeroed();
        ParticleSet::new(1500).sample(&mut message);
        assert_eq!((message.count, message.total), (500, 1500));
    }
}
