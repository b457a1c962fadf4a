//! Determines the number of particles needed to represent the belief (Fox 2003, *Adapting the sample size in particle filters
//! through KLD-sampling*). With this number, the Kullback-Leibler divergence between the distribution of the particles over bins
//! and that of the belief is at most ε with probability 1 − δ.
//!
//! The bins divide x, y and θ, but not the scales, which spread about equally wherever the robot is. With
//! bins in all five dimensions, each would contain one particle, and the bound would always be the maximum.
//! Nothing is allocated after [`SampleSize::new`].

use std::f32::consts::TAU;

use super::parameters::Parameters;
use super::particles::ParticleSet;

/// Upper 1 − δ quantile of the standard normal distribution for δ = 0.01.
const Z: f64 = 2.326_347_9;
/// Number of bins for the heading.
const DIRECTIONS: f32 = 36.0;

/// Computes the number of particles needed, with a buffer for the bins.
#[derive(Debug, Clone)]
pub struct SampleSize {
    bins: Vec<u64>,
}

impl SampleSize {
    /// Creates a buffer for sets of at most `most` particles.
    pub fn new(most: usize) -> Self {
        Self { bins: Vec::with_capacity(most) }
    }

    /// Returns the number of particles needed, within the parameters' limits. `set` must have equal weights, as just after
    /// resampling, so that the number of bins that it fills reflects the spread of the belief. Fox draws one particle after another
    /// until there are enough for the bins filled so far, whereas systematic resampling creates all particles at once.
    pub fn wanted(&mut self, set: &ParticleSet, scale_pxpm: f32, parameters: &Parameters) -> usize {
        let bin_px = parameters.bin_m * scale_pxpm;
        self.bins.clear();
        self.bins
            .extend((0..set.len()).map(|i| bin(set.x_px[i] / bin_px, set.y_px[i] / bin_px, set.yaw_rad[i])));
        self.bins.sort_unstable();
        self.bins.dedup();
        bound(self.bins.len(), parameters.kld_error.into())
            .clamp(parameters.least_particles.min(parameters.particles), parameters.particles)
    }
}

/// Returns the number that identifies a bin: 24 bits each for its column and its row, and 16 bits for its direction.
fn bin(column: f32, row: f32, yaw_rad: f32) -> u64 {
    let cell = |v: f32| u64::from((v.floor() as i32).wrapping_add(1 << 23) as u32 & 0xff_ffff);
    let direction = (yaw_rad / TAU * DIRECTIONS).floor().rem_euclid(DIRECTIONS) as u64;
    cell(column) << 40 | cell(row) << 16 | direction
}

/// Returns the number of particles by equation (7) of Fox 2003, the Wilson-Hilferty approximation of the χ² quantile. For k bins, n
/// = (k − 1)/2ε · (1 − 2/9(k − 1) + √(2/9(k − 1))·z)³.
fn bound(bins: usize, error: f64) -> usize {
    if bins < 2 {
        return 1;
    }
    let k = (bins - 1) as f64;
    let c = 2.0 / (9.0 * k);
    (k / (2.0 * error) * (1.0 - c + c.sqrt() * Z).powi(3)).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For k − 1 = 50 and ε = 0.05: c = 2/450 = 0.004444, √c·z = 0.066667·2.326348 = 0.155090; (1 − 0.004444 + 0.155090)³ =
    /// 1.150645³ = 1.523446; · 50/0.1 = 761.7.
    #[test]
    fn the_bound_by_hand() {
        assert_eq!(bound(51, 0.05), 762);
        assert_eq!(bound(1, 0.05), 1);
    }

    #[test]
    fn a_wide_belief_needs_more_particles() {
        let parameters = Parameters { particles: 2000, least_particles: 100, ..Parameters::default() };
        let mut size = SampleSize::new(2000);
        let mut set = ParticleSet::new(500);
        assert_eq!(size.wanted(&set, 20.0, &parameters), 100);
        let mut wanted = Vec::new();
        for spread_px in [5.0, 20.0, 200.0] {
            for i in 0..500 {
                set.x_px[i] = spread_px * (i % 25) as f32 / 25.0;
                set.y_px[i] = spread_px * (i / 25) as f32 / 20.0;
            }
            wanted.push(size.wanted(&set, 20.0, &parameters));
        }
        assert!(wanted.is_sorted() && wanted[2] > 4 * wanted[0], "{wanted:?}");
    }

    #[test]
    fn headings_on_both_sides_of_the_cut_are_neighbours() {
        assert_eq!(bin(0.5, 0.5, -std::f32::consts::PI), bin(0.5, 0.5, std::f32::consts::PI));
        assert_ne!(bin(-0.5, 0.5, 0.0), bin(0.5, 0.5, 0.0));
    }
}
