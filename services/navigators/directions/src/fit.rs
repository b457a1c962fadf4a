//! Fits equations 1 and 2 to simulations, by seed, and reports how well they fit.
//!
//! The constants of [`crate::reliability`] are results of [`landmarks`] and [`trajectories`] with [`Effort::FULL`] and the seed
//! of the example `fit`. A refit agrees with them; the tests say how closely.

use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed::stream;

use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::error;
use crate::geometry::Point;
use crate::reliability::{LandmarkModel, TrajectoryModel};
use crate::traversal::Noise;

/// How much is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Trials for each sample of a fit.
    pub trials: u32,
}

impl Effort {
    /// What the constants stand on.
    pub const FULL: Self = Self { trials: 20_000 };
    /// What a test can afford.
    pub const QUICK: Self = Self { trials: 2_000 };
}

/// A fit and its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<Model> {
    /// The fitted model.
    pub model: Model,
    /// How many samples it was fitted to.
    pub samples: usize,
    /// The root of the mean square residual.
    pub rms_residual: f64,
    /// The largest residual.
    pub max_residual: f64,
}

/// A point of figure 21: how often the isolated landmark is identified right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Identified {
    /// How many candidates.
    pub candidates: u16,
    /// The error of position, in window sides.
    pub sigma: f64,
    /// The fraction that was identified right.
    pub fraction: f64,
}

/// The errors of position of the fit, in window sides: 1 to 6 mm for a window of 100 mm.
const SIGMAS: [f64; 6] = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06];
/// The most candidates of the fit.
const MOST: u16 = 10;

/// Measures figure 21: candidates anywhere in the window with equal probability, positions with normal errors.
pub fn identified(effort: Effort, seed: u64) -> Vec<Identified> {
    let mut rng = stream(seed, "directions/fit/landmarks");
    let grid = (2..=MOST).flat_map(|candidates| SIGMAS.map(|sigma| (candidates, sigma)));
    grid.map(|(candidates, sigma)| {
        let effort = Effort { trials: effort.trials.max(1) };
        let right = (0..effort.trials).filter(|_| is_identified(&mut rng, candidates, sigma)).count();
        Identified { candidates, sigma, fraction: right as f64 / f64::from(effort.trials) }
    })
    .collect()
}

fn is_identified(rng: &mut Pcg64Mcg, candidates: u16, sigma: f64) -> bool {
    let dots: Vec<_> = (0..candidates).map(|_| Point::new(rng.random(), rng.random())).collect();
    let seen: Vec<_> = dots.iter().map(|&dot| dot + error(rng, sigma)).collect();
    Descriptor::Isolated.pick(&dots) == Descriptor::Isolated.pick(&seen)
}

/// Fits equation 1. Residuals are probabilities.
pub fn landmarks(effort: Effort, seed: u64) -> Result<Fit<LandmarkModel>, Error> {
    let samples = identified(effort, seed);
    let rows: Vec<_> =
        samples.iter().map(|s| (LandmarkModel::terms(s.candidates, s.sigma), s.fraction)).collect();
    let (coefficients, rms_residual, max_residual) = least_squares(&rows)?;
    Ok(Fit { model: LandmarkModel { coefficients }, samples: rows.len(), rms_residual, max_residual })
}

/// Fits equation 2. Residuals are relative to the variance that was measured.
pub fn trajectories(effort: Effort, seed: u64) -> Result<Fit<TrajectoryModel>, Error> {
    let mut rng = stream(seed, "directions/fit/trajectories");
    let mut rows = Vec::new();
    for slide in [0.5, 1.0, 2.0, 4.0] {
        for pair in [0.4, 0.7, 1.0] {
            for noise in errors() {
                let variance = variance_aside(&mut rng, slide, pair, noise, effort.trials.max(1));
                rows.push((TrajectoryModel::terms(slide, pair, noise).map(|term| term / variance), 1.0));
            }
        }
    }
    let (coefficients, rms_residual, max_residual) = least_squares(&rows)?;
    Ok(Fit { model: TrajectoryModel { coefficients }, samples: rows.len(), rms_residual, max_residual })
}

/// Mixtures of errors, with the window's side as the unit.
fn errors() -> impl Iterator<Item = Noise> {
    let table =
        [(0.02, 0.0, 0.0), (0.05, 0.0, 0.0), (0.005, 0.05, 0.0), (0.005, 0.0, 0.05), (0.03, 0.03, 0.03)];
    table.into_iter().map(|(sigma, translation, rotation_rad)| Noise {
        sigma,
        translation,
        rotation_rad,
        ..Noise::NONE
    })
}

/// The variance to the side of slides that start from a pair of landmarks as it is seen.
fn variance_aside(rng: &mut Pcg64Mcg, slide: f64, pair: f64, noise: Noise, trials: u32) -> f64 {
    let sum: f64 = (0..trials).map(|_| aside(rng, slide, pair, noise).powi(2)).sum();
    sum / f64::from(trials)
}

/// One slide in steps of a twentieth of the window's side, as [`crate::traversal::Helicopter::fly`] makes them.
fn aside(rng: &mut Pcg64Mcg, slide: f64, pair: f64, noise: Noise) -> f64 {
    const STEP: f64 = 0.05;
    let first = Point::new(-pair / 2.0, 0.0) + error(rng, noise.sigma);
    let second = Point::new(pair / 2.0, 0.0) + error(rng, noise.sigma);
    let along = (second - first).direction().unwrap_or(Point::new(1.0, 0.0));
    let (mut place, mut heading_rad) = ((first + second) * 0.5, 0.0);
    for _ in 0..(slide / STEP).round() as u32 {
        let turn: f64 = StandardNormal.sample(rng);
        place = place + (along * STEP).turned(heading_rad) + error(rng, noise.translation * STEP.sqrt());
        heading_rad += turn * noise.rotation_rad * STEP.sqrt();
    }
    place.y
}

/// The coefficients with the least squares of the residuals, the root of their mean square, and the largest.
fn least_squares(rows: &[([f64; 4], f64)]) -> Result<([f64; 4], f64, f64), Error> {
    let terms = DMatrix::from_fn(rows.len(), 4, |row, column| rows[row].0[column]);
    let values = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
    let solution = terms.clone().svd(true, true).solve(&values, 1e-12);
    let wrong = |found| Error::Parameter { what: "samples of a fit", expected: "enough to fit", found };
    let solution = solution.map_err(|_| wrong(rows.len() as f64))?;
    let residuals = terms * &solution - values;
    let rms = (residuals.norm_squared() / rows.len() as f64).sqrt();
    Ok((std::array::from_fn(|index| solution[index]), rms, residuals.amax()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The constants are what a fit gives: a new one, with another seed, predicts the same.
    #[test]
    fn a_refit_of_equation_1_agrees() {
        let again = landmarks(Effort::QUICK, 7).unwrap();
        assert!(again.rms_residual < 0.045, "{again:?}");
        for candidates in 2..=MOST {
            for sigma in SIGMAS {
                let ours = LandmarkModel::FITTED.reliability(candidates, sigma);
                let theirs = again.model.reliability(candidates, sigma);
                assert!((ours - theirs).abs() < 0.012, "{candidates} {sigma}: {ours} {theirs}");
            }
        }
    }

    #[test]
    fn a_refit_of_equation_2_agrees() {
        let again = trajectories(Effort::QUICK, 7).unwrap();
        assert!(again.rms_residual < 0.06, "{again:?}");
        for noise in errors() {
            let (ours, theirs) =
                (TrajectoryModel::FITTED.aside(2.0, 0.7, noise), again.model.aside(2.0, 0.7, noise));
            assert!((ours / theirs - 1.0).abs() < 0.05, "{noise:?}: {ours} {theirs}");
        }
    }

    /// A line through two points, each with an error: half the variance in the middle, and 2(d/l)² more at d. Random walks
    /// of place and heading: d and d³/3.
    #[test]
    fn equation_2_is_near_the_theory() {
        let theory = [0.5, 2.0, 1.0, 1.0 / 3.0];
        for (ours, theirs) in TrajectoryModel::FITTED.coefficients.into_iter().zip(theory) {
            assert!((ours - theirs).abs() < 0.1 * theirs + 0.05, "{:?}", TrajectoryModel::FITTED);
        }
    }
}
