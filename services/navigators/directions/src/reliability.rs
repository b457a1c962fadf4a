//! Computes the reliability of a transition from models fitted to simulations (Park and Kender 1995, equations 1 and 2).
//!
//! **Equation 1** is for landmarks: `R(n, σ) = (Aσ + B)/n − Cσ + D` (6.1.2), where n is the number of candidates and σ is the
//! position error in units of the window's side. The paper gives no coefficients. The ones below are fitted by
//! [`crate::fit::landmarks`], where the camera's error shifts the window, so that dots cross its edge. [`crate::arrival`]
//! simulates each transition instead of using this equation.
//!
//! **Equation 2** is for trajectories. The paper's form is unreadable in the copies that we know. Ours is the variance of a
//! slide's sideways error, composed of the terms that the text names (6.2). The position errors of the two landmarks and of the
//! goal contribute one part, which grows with the ratio of the slide's length to the distance between the two landmarks. The
//! errors of translation and rotation contribute the other parts, which grow with the distance travelled. The reliability is
//! the probability that a slide with this error still attains its goal first. The position error also shifts the window at the
//! beginning of the slide, and so decides which dots at its leading edge count as new. The coefficients are fitted by
//! [`crate::fit::trajectories`].

use crate::geometry::{Point, Window};
use crate::plane::{DotId, Plane};
use crate::trajectory::Slide;
use crate::transitions::{Movement, Transition};
use crate::traversal::Noise;

/// Minimum reliability, which keeps costs finite.
pub const LEAST: f64 = 1e-6;

/// The coefficients of equation 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkModel {
    /// The coefficients A, B, C and D.
    pub coefficients: [f64; 4],
}

impl LandmarkModel {
    /// Fitted by [`crate::fit::landmarks`]: 80 samples, residuals of 0.021 (root mean square) and at most 0.239.
    pub const FITTED: Self = Self { coefficients: [4.599_9, 0.078_1, 6.460_6, 0.929_1] };

    /// Returns the factors by which the coefficients are multiplied: σ/n, 1/n, −σ, 1.
    pub fn terms(candidates: u16, sigma: f64) -> [f64; 4] {
        let n = f64::from(candidates);
        [sigma / n, 1.0 / n, -sigma, 1.0]
    }

    /// Returns the probability of identifying the isolated landmark among several candidates. `sigma` is in window sides.
    pub fn reliability(self, candidates: u16, sigma: f64) -> f64 {
        if sigma <= 0.0 {
            return 1.0;
        }
        let terms = Self::terms(candidates.max(1), sigma);
        let sum: f64 =
            terms.iter().zip(self.coefficients).map(|(term, coefficient)| term * coefficient).sum();
        sum.clamp(LEAST, 1.0)
    }
}

/// The coefficients of equation 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrajectoryModel {
    /// The coefficients of the position error, its growth, the translation error and the rotation error.
    pub coefficients: [f64; 4],
}

impl TrajectoryModel {
    /// Fitted by [`crate::fit::trajectories`]: 60 samples, relative residuals of 0.018 (root mean square) and at most 0.067.
    /// Theory predicts 1½, 2, 1 and ⅓.
    pub const FITTED: Self = Self { coefficients: [1.473_5, 2.005_2, 1.002_6, 0.312_1] };

    /// Returns the factors by which the coefficients are multiplied: σ², σ²(d/l)², τ²d, ρ²d³. d is the length of the slide, l
    /// is the distance between the pair, and τ and ρ are [`Noise::translation`] and [`Noise::rotation_rad`].
    pub fn terms(slide: f64, pair: f64, noise: Noise) -> [f64; 4] {
        let sigma = noise.combined_sigma();
        let (ratio, turn) = (slide / pair, noise.rotation_rad);
        [
            sigma * sigma,
            sigma * sigma * ratio * ratio,
            noise.translation * noise.translation * slide,
            turn * turn * slide * slide * slide,
        ]
    }

    /// Returns the standard deviation of a dot's position along a slide at its beginning. The position error has the same
    /// effect there as sideways.
    pub fn along(self, noise: Noise) -> f64 {
        self.coefficients[0].sqrt() * noise.combined_sigma()
    }

    /// Returns the standard deviation of a slide's sideways error.
    pub fn aside(self, slide: f64, pair: f64, noise: Noise) -> f64 {
        let terms = Self::terms(slide, pair, noise);
        let sum: f64 =
            terms.iter().zip(self.coefficients).map(|(term, coefficient)| term * coefficient).sum();
        sum.max(0.0).sqrt()
    }
}

/// Number of quantiles that represent the normal distribution.
const QUANTILES: u32 = 21;
/// The Fibonacci number preceding [`QUANTILES`].
const LATTICE: u32 = 13;
/// The start of the lattice, chosen so that the two numbers of a pair are uncorrelated. If it started at 0, the smallest values
/// of both would coincide, and the correlation would be 0.16.
const OFFSET: u32 = 6;

/// Returns the medians of `QUANTILES` equally probable parts of the standard normal distribution.
pub fn quantiles() -> impl Iterator<Item = f64> {
    (0..QUANTILES).map(|part| normal_quantile((f64::from(part) + 0.5) / f64::from(QUANTILES)))
}

/// Returns pairs of independent, standard normal numbers. Each number of a pair takes each of the [`quantiles`] once, arranged
/// in a Fibonacci lattice.
fn quantile_pairs() -> impl Iterator<Item = [f64; 2]> {
    let quantile = |part: u32| normal_quantile((f64::from(part) + 0.5) / f64::from(QUANTILES));
    (0..QUANTILES).map(move |part| [quantile(part), quantile((part * LATTICE + OFFSET) % QUANTILES)])
}

/// Returns the quantile of the standard normal distribution, accurate to 4.5e-4 (Abramowitz and Stegun 1964, 26.2.23).
fn normal_quantile(probability: f64) -> f64 {
    let tail = probability.min(1.0 - probability);
    let t = (-2.0 * tail.ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    let quantile = t - above / below;
    if probability < 0.5 { -quantile } else { quantile }
}

/// Both models, and the errors to which they are applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reliability {
    /// Equation 1.
    pub landmarks: LandmarkModel,
    /// Equation 2.
    pub trajectories: TrajectoryModel,
    /// The errors of the navigator and of the map-maker.
    pub noise: Noise,
}

impl Reliability {
    /// Returns the fitted models with the given errors.
    pub fn fitted(noise: Noise) -> Self {
        Self { landmarks: LandmarkModel::FITTED, trajectories: TrajectoryModel::FITTED, noise }
    }

    /// Returns the probability that a transition attains its target.
    pub fn of(&self, plane: &Plane, window: Window, from: DotId, transition: &Transition) -> f64 {
        let sigma = self.noise.combined_sigma() / window.side;
        let seen = self.landmarks.reliability(transition.candidates, sigma);
        if transition.movement == Movement::Seek {
            return seen;
        }
        (seen * self.hit(plane, window, from, transition)).max(LEAST)
    }

    /// Returns the standard deviation of the sideways error of a trajectory's slide, or 0 within a parkway.
    pub fn aside(&self, plane: &Plane, from: DotId, transition: &Transition) -> f64 {
        let pair: Point = plane.dot(transition.seen) - plane.dot(from);
        self.trajectories.aside(f64::from(transition.slide), pair.norm(), self.noise)
    }

    fn hit(&self, plane: &Plane, window: Window, from: DotId, transition: &Transition) -> f64 {
        let aside = self.aside(plane, from, transition);
        let is_backward = transition.movement == Movement::Backward;
        let Some(slide) = Slide::of_pair(plane.dot(from), plane.dot(transition.seen), is_backward) else {
            return 0.0;
        };
        let along = self.trajectories.along(self.noise);
        let hits = |[to_side, ahead]: &[f64; 2]| {
            let moved = slide.moved_aside(to_side * aside).moved_along(ahead * along);
            moved.lands(plane, window).is_some_and(|landing| landing.dot == transition.to)
        };
        quantile_pairs().filter(hits).count() as f64 / f64::from(QUANTILES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::plane;
    use crate::transitions::{Kinds, Transitions};

    #[test]
    fn quantiles_have_the_moments_of_the_normal_distribution() {
        let all: Vec<_> = quantiles().collect();
        assert!(all.iter().sum::<f64>().abs() < 1e-3);
        let variance = all.iter().map(|q| q * q).sum::<f64>() / all.len() as f64;
        assert!((0.93..1.0).contains(&variance), "{variance}");
        assert!((normal_quantile(0.975) - 1.95996).abs() < 5e-4);
    }

    #[test]
    fn pairs_of_quantiles_are_independent() {
        let pairs: Vec<_> = quantile_pairs().collect();
        let mut second: Vec<_> = pairs.iter().map(|pair| pair[1]).collect();
        second.sort_by(f64::total_cmp);
        assert!(second.iter().zip(quantiles()).all(|(a, b)| (a - b).abs() < 1e-12));
        let correlation = pairs.iter().map(|[a, b]| a * b).sum::<f64>() / pairs.len() as f64;
        assert!(correlation.abs() < 0.01, "{correlation}");
    }

    #[test]
    fn more_candidates_and_more_error_are_less_reliable() {
        let model = LandmarkModel::FITTED;
        for n in 3..10 {
            assert!(model.reliability(n + 1, 0.03) < model.reliability(n, 0.03), "{n}");
            assert!(model.reliability(n, 0.04) < model.reliability(n, 0.03), "{n}");
        }
        assert!(model.reliability(3, 0.03) < model.reliability(2, 0.03));
        // A second dot may enter the quadrant.
        assert!(model.reliability(1, 0.05) < 0.95);
        assert_eq!(model.reliability(5, 0.0), 1.0);
    }

    #[test]
    fn a_longer_slide_and_a_closer_pair_err_more() {
        let model = TrajectoryModel::FITTED;
        let noise = Noise { translation: 0.1, rotation_rad: 0.01, ..Noise::of_sigma(0.3) };
        assert!(model.aside(40.0, 6.0, noise) > model.aside(20.0, 6.0, noise));
        assert!(model.aside(40.0, 3.0, noise) > model.aside(40.0, 6.0, noise));
        assert_eq!(model.aside(40.0, 3.0, Noise::NONE), 0.0);
    }

    #[test]
    fn a_goal_at_the_leading_edge_of_the_window_is_doubtful() {
        let window = Window::new(10.0, 1.0).unwrap();
        let hit = |at: f64| {
            let world = plane(&[(0.0, 0.0), (6.0, 0.0), (at, 1.0), (40.0, 0.0)]);
            let all = Transitions::new(&world, window, Kinds::PAPER);
            let slide = all.from(0).iter().find(|e| e.seen == 1 && e.movement == Movement::Forward).unwrap();
            assert_eq!(slide.to, 2);
            Reliability::fitted(Noise::of_sigma(0.3)).hit(&world, window, 0, slide)
        };
        // The window is first centred on x = 3, so its edge is at 8. The errors of the window and of the dot combine to 0.5.
        let (far, near) = (hit(12.0), hit(8.1));
        assert!(far == 1.0 && (0.4..0.75).contains(&near), "{far} {near}");
    }

    #[test]
    fn a_goal_in_the_middle_is_more_reliable_than_one_at_the_edge() {
        let window = Window::new(10.0, 1.0).unwrap();
        let hit = |aside: f64| {
            let world = plane(&[(0.0, 0.0), (6.0, 0.0), (40.0, aside)]);
            let all = Transitions::new(&world, window, Kinds::PAPER);
            let slide = all.from(0).iter().find(|e| e.to == 2 && e.movement == Movement::Forward).unwrap();
            Reliability::fitted(Noise::of_sigma(0.3)).of(&world, window, 0, slide)
        };
        let (middle, edge) = (hit(0.0), hit(4.8));
        assert!(middle > 0.8 && edge < 0.6, "{middle} {edge}");
    }
}
