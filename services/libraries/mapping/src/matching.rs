//! Finds the best-fitting pose of a scan in the map.
//!
//! The search is correlative scan matching (Olson 2009), by branch and bound over fields of maxima (Hess, Kohler, Rapp and Andor
//! 2016). Newton's method on the interpolated field then refines the result to a fraction of a cell. Both steps use the pose
//! predicted by odometry as a prior.

pub mod field;
mod refine;
mod search;

use nalgebra::Matrix3;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::MAX_BEAMS;

use crate::{Map, Parameters};
use field::Field;

/// The pose predicted by odometry, before the scan is taken into account.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// The predicted pose.
    pub pose: Pose<Map>,
    /// Standard deviation of x and of y, in metres.
    pub sigma_m: f64,
    /// Standard deviation of the heading, in radians.
    pub sigma_rad: f64,
}

/// Best-fitting pose of a scan, and its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The robot's pose.
    pub pose: Pose<Map>,
    /// How well the points lie on walls: the mean value of the field there, from 0 (no point is near a wall) to 1 (all are on
    /// walls).
    pub score: f64,
    /// Covariance of x, y and the heading, in metres and radians.
    pub covariance: Matrix3<f64>,
}

/// Matches scans with a field. Its working memory has a fixed size, which depends on the parameters.
#[derive(Debug)]
pub struct Matcher {
    blur_m: f64,
    evidence: f64,
    window_sigmas: f64,
    window_max_m: f64,
    window_max_rad: f64,
    max_points: usize,
    /// Points of the scan that is being matched, in the robot's frame, in metres.
    points: Vec<[f64; 2]>,
    search: search::Search,
}

impl Matcher {
    /// Creates a matcher with the given parameters.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            blur_m: parameters.blur_m,
            evidence: parameters.evidence,
            window_sigmas: parameters.window_sigmas,
            window_max_m: parameters.window_max_m,
            window_max_rad: parameters.window_max_rad,
            max_points: parameters.max_points,
            points: Vec::with_capacity(MAX_BEAMS),
            search: search::Search::new(parameters),
        }
    }

    /// Sets the points of the scan to match, given the ends of its beams in the robot's frame and in the
    /// order of the sweep. An end closer than the blur to the last point kept is dropped, so that near walls
    /// do not outweigh far ones. The remaining points are thinned evenly to the maximum number.
    pub fn set_points(&mut self, ends_m: impl Iterator<Item = [f64; 2]>) {
        self.points.clear();
        for end in ends_m.take(MAX_BEAMS) {
            let is_near = |last: &[f64; 2]| (last[0] - end[0]).hypot(last[1] - end[1]) < self.blur_m;
            if !self.points.last().is_some_and(is_near) {
                self.points.push(end);
            }
        }
        let (found, most) = (self.points.len(), self.max_points);
        if found > most {
            (0..most).for_each(|k| self.points[k] = self.points[k * found / most]);
            self.points.truncate(most);
        }
    }

    /// Returns the best pose within the window around the prior, or `None` if the scan has no points.
    pub fn fit(&mut self, field: &Field, prior: &Prior) -> Option<Fit> {
        if self.points.is_empty() {
            return None;
        }
        let window = search::Window {
            half_m: (self.window_sigmas * prior.sigma_m).min(self.window_max_m),
            half_rad: (self.window_sigmas * prior.sigma_rad).min(self.window_max_rad),
        };
        let coarse = self.search.best(field, &self.points, prior, &window, self.evidence);
        Some(refine::refine(field, &self.points, prior, coarse, self.evidence))
    }
}
