//! Refines the best cell to the best pose, assuming that the posterior is a parabola near its peak. Slopes and curvatures are
//! measured on the interpolated field, first over a whole cell and then over half a cell, which smooths out the steps of the
//! raster.

use nalgebra::{Matrix3, Vector3};
use sketchnav_schemas::geometry::{Pose, wrap_angle};

use super::field::Field;
use super::{Fit, Prior};
use crate::Map;

/// Baseline for slopes and curvatures in each step, in cells.
const STENCILS: [f64; 5] = [1.0, 1.0, 0.5, 0.5, 0.5];
/// Maximum length of a step, in cells.
const LONGEST_CELLS: f64 = 1.0;

/// The part of the posterior that comes from the scan.
struct Likelihood<'a> {
    field: &'a Field,
    points: &'a [[f64; 2]],
    evidence: f64,
}

impl Likelihood<'_> {
    /// Returns the mean value of the field at the points.
    fn score(&self, pose: &Pose<Map>) -> f64 {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let place = |[x, y]: &[f64; 2]| [pose.x + cos * x - sin * y, pose.y + sin * x + cos * y];
        self.points.iter().map(|point| self.field.sample(place(point))).sum::<f64>()
            / self.points.len() as f64
    }

    fn at(&self, pose: &Pose<Map>) -> f64 {
        self.evidence * self.score(pose)
    }

    /// Returns the slope and the information. The information is the negative of the curvature, with negative eigenvalues set to
    /// zero.
    fn parabola(&self, pose: &Pose<Map>, stencil: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let at = |a: usize, by_a: f64, b: usize, by_b: f64| {
            let mut off = Vector3::zeros();
            off[a] += by_a * stencil[a];
            off[b] += by_b * stencil[b];
            self.at(&moved(pose, &off))
        };
        let middle = self.at(pose);
        let (mut slope, mut curvature) = (Vector3::zeros(), Matrix3::zeros());
        for a in 0..3 {
            let (more, less) = (at(a, 1.0, a, 0.0), at(a, -1.0, a, 0.0));
            slope[a] = (more - less) / (2.0 * stencil[a]);
            curvature[(a, a)] = (more + less - 2.0 * middle) / (stencil[a] * stencil[a]);
            for b in 0..a {
                let mixed =
                    at(a, 1.0, b, 1.0) + at(a, -1.0, b, -1.0) - at(a, 1.0, b, -1.0) - at(a, -1.0, b, 1.0);
                curvature[(a, b)] = mixed / (4.0 * stencil[a] * stencil[b]);
                curvature[(b, a)] = curvature[(a, b)];
            }
        }
        let mut eigen = (-curvature).symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(0.0));
        (slope, eigen.recompose())
    }
}

/// Refines a pose. The pose does not change if no step increases the posterior.
pub(super) fn refine(
    field: &Field,
    points: &[[f64; 2]],
    prior: &Prior,
    coarse: Pose<Map>,
    evidence: f64,
) -> Fit {
    let likelihood = Likelihood { field, points, evidence };
    let variances = Vector3::new(prior.sigma_m.powi(2), prior.sigma_m.powi(2), prior.sigma_rad.powi(2));
    let prior_information = Matrix3::from_diagonal(&variances.map(|variance| 1.0 / variance));
    let off = |pose: &Pose<Map>| {
        let turn = wrap_angle(prior.pose.yaw_rad - pose.yaw_rad);
        Vector3::new(prior.pose.x - pose.x, prior.pose.y - pose.y, turn)
    };
    let posterior =
        |pose: &Pose<Map>| likelihood.at(pose) - 0.5 * off(pose).dot(&(prior_information * off(pose)));
    let farthest = points.iter().map(|p| p[0].hypot(p[1])).fold(1.0, f64::max);
    let mut pose = coarse;
    let mut now = posterior(&pose);
    let mut information = prior_information;
    let mut in_vain = None;
    for cells in STENCILS {
        if in_vain == Some(cells) {
            continue;
        }
        let size = cells * field.cell_m();
        let (slope, curvature) = likelihood.parabola(&pose, &Vector3::new(size, size, 2.0 * size / farthest));
        information = curvature + prior_information;
        let Some(inverse) = information.try_inverse() else { break };
        let step = inverse * (slope + prior_information * off(&pose));
        let next = moved(&pose, &limited(step, LONGEST_CELLS * field.cell_m()));
        let then = posterior(&next);
        if then > now {
            (pose, now) = (next, then);
        } else {
            // Another step would lead to the same pose.
            in_vain = Some(cells);
        }
    }
    let covariance = information.try_inverse().unwrap_or_else(|| Matrix3::from_diagonal(&variances));
    let pose = Pose::new(pose.x, pose.y, wrap_angle(pose.yaw_rad));
    Fit { pose, score: likelihood.score(&pose), covariance }
}

fn moved(pose: &Pose<Map>, by: &Vector3<f64>) -> Pose<Map> {
    Pose::new(pose.x + by.x, pose.y + by.y, pose.yaw_rad + by.z)
}

/// Shortens a step to at most `longest_m`.
fn limited(step: Vector3<f64>, longest_m: f64) -> Vector3<f64> {
    let length = step.x.hypot(step.y);
    if length > longest_m { step * (longest_m / length) } else { step }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occupancy::Occupancy;
    use crate::{Parameters, matching::Matcher};

    /// Returns the field of a room of 3 by 2 m.
    fn room() -> Field {
        let parameters = Parameters { max_tiles: 64, extent_m: 10.0, ..Parameters::default() };
        let mut map = Occupancy::new(&parameters);
        let mut touched = Vec::new();
        let mut scan = map.scan(&mut touched);
        (-30..30).for_each(|x| [-20, 19].into_iter().for_each(|y| scan.hit([x, y])));
        (-20..20).for_each(|y| [-30, 29].into_iter().for_each(|x| scan.hit([x, y])));
        drop(scan);
        let mut field = Field::new(0.05, 5.0, 0.08);
        field.rebuild(&map, [0, 0]);
        field
    }

    /// Returns the endpoints of beams that hit the centres of the walls' cells, as seen from a pose.
    fn seen_from(pose: &Pose<Map>) -> Vec<[f64; 2]> {
        let along = (0..60).map(|k| -1.475 + 0.05 * f64::from(k));
        let up = (0..40).map(|k| -0.975 + 0.05 * f64::from(k));
        let walls =
            along.flat_map(|x| [[x, -0.975], [x, 0.975]]).chain(up.flat_map(|y| [[-1.475, y], [1.475, y]]));
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let from = |[x, y]: [f64; 2]| {
            let (x, y) = (x - pose.x, y - pose.y);
            [cos * x + sin * y, cos * y - sin * x]
        };
        walls.map(from).collect()
    }

    #[test]
    fn a_scan_is_matched_to_less_than_a_cell() {
        let field = room();
        let mut matcher = Matcher::new(&Parameters { max_points: 400, ..Parameters::default() });
        for k in 0..20 {
            let k = f64::from(k);
            let truth = Pose::new(0.37 * (k * 1.7).sin(), 0.21 * (k * 0.9).cos(), 0.3 * k);
            let guess = Pose::new(
                truth.x + 0.21 * k.cos(),
                truth.y - 0.17 * k.sin(),
                truth.yaw_rad + 0.11 * (2.0 * k).sin(),
            );
            matcher.set_points(seen_from(&truth).into_iter());
            let fit = matcher.fit(&field, &Prior { pose: guess, sigma_m: 0.2, sigma_rad: 0.1 }).unwrap();
            let off = fit.pose.motion_to(&truth);
            assert!(off.x.hypot(off.y) < 0.01, "{off:?}");
            assert!(off.yaw_rad.abs() < 0.005, "{off:?}");
            assert!(fit.score > 0.9);
        }
    }

    /// Two long walls provide no information about the position along them, so the prior decides, and the covariance shows the
    /// uncertainty.
    #[test]
    fn along_a_corridor_the_odometry_decides() {
        let field = room();
        let mut matcher = Matcher::new(&Parameters::default());
        let sides = |k: i32| [[0.05 * f64::from(k), -0.975], [0.05 * f64::from(k), 0.975]];
        matcher.set_points((-12..12).map(|k| sides(k)[0]).chain((-12..12).map(|k| sides(k)[1])));
        let prior = Prior { pose: Pose::new(0.13, 0.08, 0.03), sigma_m: 0.1, sigma_rad: 0.05 };
        let fit = matcher.fit(&field, &prior).unwrap();
        assert!(
            (fit.pose.x - 0.13).abs() < 0.03 && fit.pose.y.abs() < 0.01 && fit.pose.yaw_rad.abs() < 0.01,
            "{fit:?}"
        );
        assert!(fit.covariance[(0, 0)] > 8.0 * fit.covariance[(1, 1)], "{}", fit.covariance);
    }
}
