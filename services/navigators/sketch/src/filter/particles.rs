//! The particle set, as a structure of arrays, with its weights and systematic resampling.

use std::hint::select_unpredictable;

use fearless_simd::{Level, dispatch, prelude::*, u32x16};
use serde::{Deserialize, Serialize};

use super::lanes::{self, LANES};
use super::scales::ScaledPose;
use crate::messages::{MAX_PARTICLES, Particle, Particles};

/// Weighted samples of (x, y, θ, a, b) and of the drawing's anisotropy, as one array per coordinate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParticleSet {
    /// Positions along x, in pixels.
    pub x_px: Vec<f32>,
    /// Positions along y, upwards, in pixels.
    pub y_px: Vec<f32>,
    /// Headings, in radians from −π up to but excluding π.
    pub yaw_rad: Vec<f32>,
    /// Natural logarithms of the scales a, in pixels per metre.
    pub ln_a: Vec<f32>,
    /// Natural logarithms of the scales b, in pixels per metre.
    pub ln_b: Vec<f32>,
    /// The stretch of the whole drawing that each particle assumes, which is half the logarithm of the ratio of mean scale a to
    /// mean scale b, in addition to that of the drawing's mean scales.
    pub anisotropy: Vec<f32>,
    /// Logarithms of the weights, up to a constant.
    pub log_weight: Vec<f32>,
    /// Normalized weights. Valid after [`Self::normalize`].
    pub weight: Vec<f32>,
}

/// Number of coordinates of a particle.
const COORDINATES: usize = 6;

impl ParticleSet {
    /// Creates `count` particles of equal weight at the origin.
    pub fn new(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            x_px: zeros(),
            y_px: zeros(),
            yaw_rad: zeros(),
            ln_a: zeros(),
            ln_b: zeros(),
            anisotropy: zeros(),
            log_weight: zeros(),
            weight: vec![1.0 / count as f32; count],
        }
    }

    /// Reserves room for `count` particles in total, so that the set can grow to this number without allocating.
    pub fn reserve(&mut self, count: usize) {
        let reserve = |column: &mut Vec<f32>| column.reserve_exact(count.saturating_sub(column.len()));
        self.columns_mut().into_iter().for_each(reserve);
        [&mut self.log_weight, &mut self.weight].into_iter().for_each(reserve);
    }

    /// Resizes the set to `count` particles of equal weight. The caller has to set their coordinates.
    pub(super) fn make_anew(&mut self, count: usize) {
        self.columns_mut().into_iter().for_each(|column| column.resize(count, 0.0));
        self.log_weight.clear();
        self.weight.clear();
        self.log_weight.resize(count, 0.0);
        self.weight.resize(count, 1.0 / count as f32);
    }

    /// Returns the columns of the coordinates, which are all that resampling has to copy.
    pub(super) fn columns_mut(&mut self) -> [&mut Vec<f32>; COORDINATES] {
        let Self { x_px, y_px, yaw_rad, ln_a, ln_b, anisotropy, .. } = self;
        [x_px, y_px, yaw_rad, ln_a, ln_b, anisotropy]
    }

    /// Returns the number of particles.
    pub fn len(&self) -> usize {
        self.x_px.len()
    }

    /// Returns true if there are no particles.
    pub fn is_empty(&self) -> bool {
        self.x_px.is_empty()
    }

    /// Computes weights that sum to one from their logarithms. The largest weight is first scaled to one, so that not all of them
    /// underflow. If no particle has any weight left, all weights become equal.
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

    /// Returns Kish's effective sample size, 1 / Σ w², of the normalized weights.
    pub fn effective_sample_size(&self) -> f64 {
        1.0 / self.weight.iter().map(|&w| f64::from(w) * f64::from(w)).sum::<f64>()
    }

    /// Returns the particle with the largest weight, compared by its logarithm.
    pub fn best(&self) -> ScaledPose {
        let heavier =
            |best: usize, i: usize| if self.log_weight[i] > self.log_weight[best] { i } else { best };
        self.pose((1..self.len()).fold(0, heavier))
    }

    /// Returns the pose and the scales of particle `i`.
    pub fn pose(&self, i: usize) -> ScaledPose {
        ScaledPose {
            x_px: self.x_px[i],
            y_px: self.y_px[i],
            yaw_rad: self.yaw_rad[i],
            a_pxpm: self.ln_a[i].exp(),
            b_pxpm: self.ln_b[i].exp(),
        }
    }

    /// Writes every n-th particle into a message, with the smallest n for which they fit.
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

/// Systematic resampling with its buffers.
#[derive(Debug, Clone)]
pub struct Resampler {
    /// For each particle of the new set, the index of its original in the old set. An additional entry at the end receives marks
    /// that do not count.
    ancestor: Vec<u32>,
    /// Buffer for a column of the new set, which is then swapped with the old one.
    spare: Vec<f32>,
}

impl Resampler {
    /// Creates buffers for sets of `count` particles.
    pub fn new(count: usize) -> Self {
        Self { ancestor: vec![0; count + 1], spare: Vec::with_capacity(count) }
    }

    /// Replaces the set by one of equal weights, in which each particle occurs in proportion to its weight. A single random number
    /// `offset` in [0, 1) serves for all particles (Thrun, Burgard and Fox, table 4.4).
    pub fn resample(&mut self, set: &mut ParticleSet, offset: f64) {
        self.resample_to(set, set.len(), offset);
    }

    /// Like [`Self::resample`], but with `count` particles in the new set, which may be at most as many as there is room for.
    pub fn resample_to(&mut self, set: &mut ParticleSet, count: usize, offset: f64) {
        self.ancestor.resize(count + 1, 0);
        self.mark(&set.weight, offset);
        let Self { ancestor, spare } = self;
        dispatch!(Level::new(), simd => fill_up(simd, &mut ancestor[..count]));
        for column in set.columns_mut() {
            spare.clear();
            spare.extend(ancestor[..count].iter().map(|&i| column[i as usize]));
            std::mem::swap(column, spare);
        }
        set.weight.clear();
        set.weight.resize(count, 1.0 / count as f32);
        set.log_weight.clear();
        set.log_weight.resize(count, 0.0);
    }

    /// Marks the first copy of each particle in the new set.
    ///
    /// Pointer k of the new set is (k + offset) / count. It lies in the piece of the first particle at which the sum of weights
    /// exceeds the pointer. No branch here depends on a weight, since the processor would mispredict it for every other particle.
    /// Instead, each particle marks the first pointer after the beginning of its piece, thus overwriting the marks of earlier
    /// particles without a pointer in their pieces. The last mark up to a pointer is its ancestor ([`fill_up`]). Particles without
    /// weight mark the entry after the last pointer.
    fn mark(&mut self, weight: &[f32], offset: f64) {
        let count = self.ancestor.len() - 1;
        self.ancestor.fill(0);
        // This start makes the integer part of `passed` the least integer that is not below the weights so far minus the offset.
        let mut passed = (ONE - 1) - (offset * ONE as f64) as u64;
        let mut pieces = [0; LANES];
        for (k, weights) in weight.chunks(LANES).enumerate() {
            pieces.iter_mut().zip(weights).for_each(|(piece, &weight)| *piece = pointers(weight, count));
            for (lane, &piece) in pieces[..weights.len()].iter().enumerate() {
                let begin = (passed / ONE).min(count as u64) as usize;
                self.ancestor[select_unpredictable(piece > 0, begin, count)] = (k * LANES + lane) as u32;
                passed = passed.wrapping_add(piece);
            }
        }
    }
}

/// Fills each gap with the last mark before it. Since marks only increase, this is the running maximum, which is computed for
/// sixteen entries at a time by doubling steps (Hillis and Steele 1986).
#[inline(always)]
fn fill_up<S: Simd>(simd: S, marks: &mut [u32]) {
    let none = u32x16::splat(simd, 0);
    let mut latest = 0;
    let (blocks, rest) = marks.as_chunks_mut::<LANES>();
    for block in blocks {
        let mut marks = u32x16::from_slice(simd, block);
        marks = marks.max(none.slide::<15>(marks));
        marks = marks.max(none.slide::<14>(marks));
        marks = marks.max(none.slide::<12>(marks));
        marks = marks.max(none.slide::<8>(marks)).max(latest);
        marks.store_slice(block);
        latest = block[LANES - 1];
    }
    for mark in rest {
        latest = latest.max(*mark);
        *mark = latest;
    }
}

/// The distance between two pointers, in fixed point with 32 fractional bits, which keeps sums of any number of terms exact.
const ONE: u64 = 1 << 32;

/// Returns the number of pointers, out of `count`, due to a weight, rounded to the nearest multiple of 2⁻³².
#[inline]
fn pointers(weight: f32, count: usize) -> u64 {
    // From 2⁵² on, the last bit of a double's mantissa is worth one, so adding this rounds to an integer.
    const WHOLE: f64 = (1_u64 << 52) as f64;
    let pointers = f64::from(weight) * (count as f64 * ONE as f64);
    (pointers + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits())
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

    /// Resamples as in table 4.4 of Thrun, Burgard and Fox, pointer by pointer and particle by particle, but never goes past the
    /// last particle that has any weight.
    fn two_loops(weight: &[f32], count: usize, offset: f64) -> Vec<u32> {
        let scale = count as f64 * 2.0_f64.powi(32);
        let pieces: Vec<u64> =
            weight.iter().map(|&w| (f64::from(w) * scale).round_ties_even() as u64).collect();
        let last = pieces.iter().rposition(|&piece| piece > 0).unwrap_or(0);
        let (mut i, mut passed) = (0, pieces[0]);
        let offset = (offset * 2.0_f64.powi(32)) as u64;
        let mut ancestor = |k: usize| {
            while ((k as u64) << 32) + offset >= passed && i < last {
                i += 1;
                passed += pieces[i];
            }
            i as u32
        };
        (0..count).map(&mut ancestor).collect()
    }

    /// Returns the ancestor of each particle after resampling a set whose particles are at x = 0, 1, 2, …
    fn ancestors(set: &ParticleSet, count: usize, offset: f64) -> Vec<u32> {
        let mut after = set.clone();
        Resampler::new(count).resample_to(&mut after, count, offset);
        after.x_px.iter().map(|&x| x as u32).collect()
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
            let found = ancestors(&set, count, offset);
            prop_assert_eq!(&found, &two_loops(&set.weight, count, offset));
            prop_assert!(found.iter().all(|&i| set.weight[i as usize] > 0.0));
        }
    }

    /// Regression test: in single precision, 100,000 weights sum to a little less than one, and the last pointer went to the last
    /// particle, whatever its weight.
    #[test]
    fn who_has_no_weight_is_never_an_ancestor() {
        let count = 100_000;
        for heavy in [0, 1, 777, count - 1] {
            let mut log_weights = vec![f32::NEG_INFINITY; count];
            log_weights[heavy] = -3.0;
            let found = ancestors(&set_of(&log_weights), count, 0.999_999);
            assert!(found.iter().all(|&i| i as usize == heavy), "{heavy}");
        }
        let likely = |i: usize| if i < count / 2 { -1e-3 * (i % 97) as f32 } else { -1e9 };
        let half = set_of(&(0..count).map(likely).collect::<Vec<_>>());
        let found = ancestors(&half, count, 1.0 - f64::EPSILON / 2.0);
        assert!(found.iter().all(|&i| (i as usize) < count / 2));
        assert_eq!(found, two_loops(&half.weight, count, 1.0 - f64::EPSILON / 2.0));
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
