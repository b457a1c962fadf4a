//! Fits equations 1 and 2 to seeded simulations, and reports the quality of the fit.
//!
//! The constants of [`crate::reliability`] are the results of [`landmarks`] and [`trajectories`] with [`Effort::FULL`] and the
//! seed of the example `fit`. The tests check how closely a new fit agrees with them.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed::stream;

use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::error;
use crate::geometry::{Corner, Point, Window};
use crate::navigator::Settings;
use crate::reliability::{LandmarkModel, TrajectoryModel};
use crate::traversal::Noise;

/// Amount of simulation for a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Number of trials for each sample.
    pub trials: u32,
}

impl Effort {
    /// The effort with which the constants were fitted.
    pub const FULL: Self = Self { trials: 20_000 };
    /// An effort for tests.
    pub const QUICK: Self = Self { trials: 2_000 };
}

/// A fit and its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<Model> {
    /// The fitted model.
    pub model: Model,
    /// Number of samples that the model was fitted to.
    pub samples: usize,
    /// The root mean square residual, weighted by how often samples occur.
    pub rms_residual: f64,
    /// The largest residual.
    pub max_residual: f64,
}

/// A point of figure 21: how often the isolated landmark is identified correctly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Identified {
    /// Number of candidates.
    pub candidates: u16,
    /// The position error, in window sides.
    pub sigma: f64,
    /// The fraction of trials in which the landmark was identified correctly.
    pub fraction: f64,
    /// The same fraction if no dot crosses an edge of the quadrant, so that the navigator ranks exactly the map-maker's candidates.
    pub enclosed: f64,
}

/// The position errors of the fit, in window sides: 1 to 8 mm for a window of 100 mm. If the map-maker and the navigator each
/// have an error of 5 mm, their combined error is 7 mm.
const SIGMAS: [f64; 8] = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08];
/// Maximum number of candidates of the fit.
const MOST: u16 = 10;
/// Distance around the quadrant up to which additional dots are placed, since errors may bring them into it: 3.5 standard
/// deviations of two of the largest errors combined.
const AROUND: f64 = 0.4;

/// Measures the points of figure 21 on the paper's worlds, which have one dot per window on average (4.3). Dots are distributed
/// uniformly, and positions have normal errors. The landmark's own error moves the whole quadrant, so that dots cross its
/// edges.
pub fn identified(effort: Effort, seed: u64) -> Result<Vec<Identified>, Error> {
    let mut rng = stream(seed, "directions/fit/landmarks");
    // The window of the experiments, in units of its side.
    let window = Window::new(1.0, 0.15)?;
    let trials = effort.trials.max(1);
    let grid = (1..=MOST).flat_map(|candidates| SIGMAS.map(|sigma| (candidates, sigma)));
    let sample = |(candidates, sigma)| {
        // The navigator's own error has half of the variance.
        let slack = Settings::new(window, sigma * FRAC_1_SQRT_2).slack();
        let mut right = [0; 2];
        for _ in 0..trials {
            let identified = identifies(&mut rng, candidates, sigma, slack);
            right.iter_mut().zip(identified).for_each(|(right, is_right)| *right += u32::from(is_right));
        }
        let [fraction, enclosed] = right.map(|right| f64::from(right) / f64::from(trials));
        Identified { candidates, sigma, fraction, enclosed }
    };
    Ok(grid.map(sample).collect())
}

/// Simulates one look. Returns whether the landmark is identified, and whether it would be if no dot crossed an edge.
fn identifies(rng: &mut Pcg64Mcg, candidates: u16, sigma: f64, slack: f64) -> [bool; 2] {
    let dots = dots_around(rng, candidates);
    let landmark = error(rng, sigma);
    let seen: Vec<_> = dots.iter().map(|&dot| dot + error(rng, sigma) - landmark).collect();
    let picked = |places: &[Point], slack| Descriptor::Isolated.pick_in(places, Corner::Sw, 1.0, slack);
    let within = dots.iter().zip(&seen).filter(|(dot, _)| Corner::Sw.covers(**dot, 1.0));
    let (known, looked): (Vec<Point>, Vec<Point>) = within.map(|(&dot, &at)| (dot, at)).unzip();
    [
        picked(&dots, 0.0) == picked(&seen, slack),
        Descriptor::Isolated.pick(&known) == Descriptor::Isolated.pick(&looked),
    ]
}

/// Places dots around a landmark at the origin, a given number of them in its quadrant and a random number outside.
fn dots_around(rng: &mut Pcg64Mcg, candidates: u16) -> Vec<Point> {
    let mut dots: Vec<_> = (0..candidates).map(|_| Point::new(rng.random(), rng.random())).collect();
    let side = 1.0 + 2.0 * AROUND;
    let all = Poisson::new(side * side).map_or(0.0, |chance| chance.sample(rng));
    let anywhere = |_| {
        let [x, y] = [0; 2].map(|_| rng.random_range(-AROUND..1.0 + AROUND));
        Point::new(x, y)
    };
    dots.extend((0..all as u32).map(anywhere).filter(|dot| !Corner::Sw.covers(*dot, 1.0)));
    dots
}

/// Returns the frequency of quadrants with the given number of candidates in the paper's worlds, relative to those with one, by the
/// Poisson distribution with mean 1.
fn frequency(candidates: u16) -> f64 {
    (1..=candidates).map(|number| 1.0 / f64::from(number)).product()
}

/// Fits equation 1. The residuals are probabilities, and each sample is weighted by how often its number of candidates occurs.
pub fn landmarks(effort: Effort, seed: u64) -> Result<Fit<LandmarkModel>, Error> {
    let samples = identified(effort, seed)?;
    let row =
        |s: &Identified| (LandmarkModel::terms(s.candidates, s.sigma), s.fraction, frequency(s.candidates));
    let rows: Vec<_> = samples.iter().map(row).collect();
    let (coefficients, rms_residual, max_residual) = least_squares(&rows)?;
    Ok(Fit { model: LandmarkModel { coefficients }, samples: rows.len(), rms_residual, max_residual })
}

/// Fits equation 2. The residuals are relative to the measured variance.
pub fn trajectories(effort: Effort, seed: u64) -> Result<Fit<TrajectoryModel>, Error> {
    let mut rng = stream(seed, "directions/fit/trajectories");
    let mut rows = Vec::new();
    for slide in [0.5, 1.0, 2.0, 4.0] {
        for pair in [0.4, 0.7, 1.0] {
            for noise in errors() {
                let variance = variance_aside(&mut rng, slide, pair, noise, effort.trials.max(1));
                rows.push((TrajectoryModel::terms(slide, pair, noise).map(|term| term / variance), 1.0, 1.0));
            }
        }
    }
    let (coefficients, rms_residual, max_residual) = least_squares(&rows)?;
    Ok(Fit { model: TrajectoryModel { coefficients }, samples: rows.len(), rms_residual, max_residual })
}

/// Returns mixtures of errors, in units of the window's side.
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

/// Returns the variance of the sideways error of slides that start from a pair of landmarks as seen by the camera.
fn variance_aside(rng: &mut Pcg64Mcg, slide: f64, pair: f64, noise: Noise, trials: u32) -> f64 {
    let sum: f64 = (0..trials).map(|_| aside(rng, slide, pair, noise).powi(2)).sum();
    sum / f64::from(trials)
}

/// Simulates a slide and returns its sideways distance from the goal. The slide proceeds in steps of a twentieth of the window's
/// side, as in [`crate::traversal::Helicopter::fly`].
fn aside(rng: &mut Pcg64Mcg, slide: f64, pair: f64, noise: Noise) -> f64 {
    const STEP: f64 = 0.05;
    let first = Point::new(-pair / 2.0, 0.0) + error(rng, noise.sigma);
    let second = Point::new(pair / 2.0, 0.0) + error(rng, noise.sigma);
    let along = (second - first).direction().unwrap_or(Point::new(1.0, 0.0));
    let goal = error(rng, noise.sigma);
    let (mut place, mut heading_rad) = ((first + second) * 0.5, 0.0);
    for _ in 0..(slide / STEP).round() as u32 {
        let turn: f64 = StandardNormal.sample(rng);
        place = place + (along * STEP).turned(heading_rad) + error(rng, noise.translation * STEP.sqrt());
        heading_rad += turn * noise.rotation_rad * STEP.sqrt();
    }
    place.y - goal.y
}

/// The factors of the coefficients, the value, and the weight of a sample.
type Row = ([f64; 4], f64, f64);

/// Returns the coefficients of the least-squares fit, their weighted root mean square residual, and the largest residual.
fn least_squares(rows: &[Row]) -> Result<([f64; 4], f64, f64), Error> {
    let terms = DMatrix::from_fn(rows.len(), 4, |row, column| rows[row].0[column]);
    let values = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
    let roots = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.2.sqrt()));
    let weighted = DMatrix::from_diagonal(&roots);
    let solution = (&weighted * &terms).svd(true, true).solve(&(&weighted * &values), 1e-12);
    let wrong = |found| Error::Parameter { what: "samples of a fit", expected: "enough to fit", found };
    let solution = solution.map_err(|_| wrong(rows.len() as f64))?;
    let residuals = terms * &solution - values;
    let rms = (&weighted * &residuals).norm() / roots.norm();
    Ok((std::array::from_fn(|index| solution[index]), rms, residuals.amax()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: equation 1 assumed that no dot crosses the edge of the window, and was far too optimistic.
    #[test]
    fn dots_that_cross_the_edge_of_the_window_are_most_of_the_errors() {
        let samples = identified(Effort::QUICK, 7).unwrap();
        for Identified { candidates, sigma, fraction, enclosed } in samples {
            let (wrong, ranked_wrong) = (1.0 - fraction, 1.0 - enclosed);
            assert!(candidates > 1 || ranked_wrong == 0.0);
            assert!(wrong > 1.2 * ranked_wrong, "{candidates} {sigma}: {wrong} {ranked_wrong}");
        }
    }

    /// The constants are the result of a fit, so a new fit with another seed predicts the same reliabilities.
    #[test]
    fn a_refit_of_equation_1_agrees() {
        let again = landmarks(Effort::QUICK, 7).unwrap();
        assert!(again.rms_residual < 0.035, "{again:?}");
        for candidates in 1..=MOST {
            for sigma in SIGMAS {
                let ours = LandmarkModel::FITTED.reliability(candidates, sigma);
                let theirs = again.model.reliability(candidates, sigma);
                assert!((ours - theirs).abs() < 0.02, "{candidates} {sigma}: {ours} {theirs}");
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

    /// A line through two points, each with an error, has half of that variance in the middle, and an additional 2(d/l)² at d.
    /// The goal adds its own variance. Random walks of the position and the heading add d and d³/3.
    #[test]
    fn equation_2_is_near_the_theory() {
        let theory = [1.5, 2.0, 1.0, 1.0 / 3.0];
        for (ours, theirs) in TrajectoryModel::FITTED.coefficients.into_iter().zip(theory) {
            assert!((ours - theirs).abs() < 0.1 * theirs + 0.05, "{:?}", TrajectoryModel::FITTED);
        }
    }
}
