//! Corrects the heading of a robot by the bearings of landmarks in its map. The paper has no counterpart of this.
//!
//! A robot that never turns on purpose keeps its initial heading error. The map states the bearing of a landmark from the
//! reference. If the robot sees both, the difference between the stated and the observed bearing is a measurement of the error for
//! a one-dimensional Kalman filter. If the difference is too large to be a heading error, the landmark must be the wrong one.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// Standard deviation of a bearing that is rounded to one degree, in radians.
const ROUNDED_RAD: f64 = PI / 180.0 * 0.289;
/// Maximum difference that counts as a heading error, in standard deviations.
const GATE: f64 = 3.0;

/// Returns the compass bearing of a displacement, in degrees.
pub fn bearing_deg(way: Point) -> u16 {
    let degrees = way.x.atan2(way.y).to_degrees().round();
    degrees.rem_euclid(f64::from(crate::custom_map::FULL_TURN_DEG)) as u16
}

/// An estimate of a heading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Angle from the map's axes to the robot's axes, counter-clockwise, in radians.
    pub turned_rad: f64,
    variance: f64,
}

/// The difference between a stated and an observed bearing.
struct Off {
    /// Angle from the observed to the stated bearing, counter-clockwise, in radians.
    angle_rad: f64,
    /// The variance of the angle, not counting that of the heading.
    noise: f64,
}

impl Heading {
    /// Returns the heading of a robot whose initial error has the given standard deviation, in radians.
    pub fn of_sigma(sigma_rad: f64) -> Self {
        Self { turned_rad: 0.0, variance: sigma_rad * sigma_rad }
    }

    /// Updates the estimate with the stated bearing of a landmark, which is observed at `way` from the reference in the map's axes
    /// as currently estimated. `sigma` is the position error. Returns the change of the estimate, counter-clockwise.
    pub fn correct(&mut self, bearing_deg: u16, way: Point, sigma: f64) -> f64 {
        if self.variance <= 0.0 {
            return 0.0;
        }
        let Some(Off { angle_rad, noise }) = self.off(bearing_deg, way, sigma) else { return 0.0 };
        let gain = self.variance / (self.variance + noise);
        self.variance *= 1.0 - gain;
        self.turned_rad += gain * angle_rad;
        gain * angle_rad
    }

    /// Returns the index of the landmark whose observed bearing is closest to a stated one, or `None` if none is close enough. The
    /// landmarks are seen at `ways` from the reference.
    pub fn pick(&self, bearing_deg: u16, ways: &[Point], sigma: f64) -> Option<usize> {
        let off = |(index, &way)| Some((self.off(bearing_deg, way, sigma)?.angle_rad.abs(), index));
        let off = ways.iter().enumerate().filter_map(off);
        off.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
    }

    /// Returns the difference between the stated and the observed bearing of a landmark, or `None` if the landmark is too near or
    /// the difference is too large for a heading error.
    fn off(&self, bearing_deg: u16, way: Point, sigma: f64) -> Option<Off> {
        let distance = way.norm();
        if distance <= sigma {
            return None;
        }
        let noise = ROUNDED_RAD * ROUNDED_RAD + (sigma / distance).powi(2);
        let meant = Point::new(0.0, 1.0).turned(-f64::from(bearing_deg).to_radians());
        let angle_rad = (way.x * meant.y - way.y * meant.x).atan2(way.dot(meant));
        let is_error = angle_rad * angle_rad <= GATE * GATE * (self.variance + noise);
        is_error.then_some(Off { angle_rad, noise })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bearings_go_from_north_to_the_east() {
        let ways = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (-0.001, 1.0), (3.0, 4.0)];
        assert_eq!(ways.map(|(x, y)| bearing_deg(Point::new(x, y))), [0, 90, 180, 270, 0, 37]);
    }

    #[test]
    fn a_heading_is_found_by_a_few_bearings() {
        let (sigma_rad, turned_rad) = (3_f64.to_radians(), -4_f64.to_radians());
        let mut heading = Heading::of_sigma(sigma_rad);
        for (x, y) in [(4.0, 3.0), (-1.0, 6.0), (5.0, -2.0), (-3.0, -3.0)] {
            let way = Point::new(x, y);
            let seen = way.turned(-turned_rad);
            let before = (heading.turned_rad - turned_rad).abs();
            heading.correct(bearing_deg(way), seen.turned(heading.turned_rad), 0.05);
            let after = (heading.turned_rad - turned_rad).abs();
            assert!(after < before || after < 0.01, "{before} {after}");
        }
        assert!((heading.turned_rad - turned_rad).abs() < 0.006, "{heading:?}");
    }

    #[test]
    fn a_landmark_is_known_by_its_bearing_within_the_error_of_the_heading() {
        let ways = [(1.0, 4.0), (4.0, 1.0), (5.0, -5.0)].map(|(x, y)| Point::new(x, y));
        let heading = Heading::of_sigma(2_f64.to_radians());
        let picked = |bearing_deg: u16| heading.pick(bearing_deg, &ways, 0.05);
        assert_eq!([14, 17, 74, 135].map(picked), [Some(0), Some(0), Some(1), Some(2)]);
        assert_eq!([45, 315].map(picked), [None; 2], "nothing is there");
        let turned = ways.map(|way| way.turned(-0.06));
        assert_eq!(heading.pick(14, &turned, 0.05), Some(0));
        assert_eq!(Heading::of_sigma(0.0).pick(14, &turned, 0.05), None);
    }

    #[test]
    fn a_wrong_landmark_and_a_heading_that_is_sure_change_nothing() {
        let mut heading = Heading::of_sigma(2_f64.to_radians());
        assert_eq!(heading.correct(90, Point::new(4.0, 1.0), 0.05), 0.0);
        assert_eq!(heading.correct(90, Point::new(0.01, 0.0), 0.05), 0.0, "too near to tell");
        assert_eq!(heading, Heading::of_sigma(2_f64.to_radians()));
        assert_eq!(Heading::of_sigma(0.0).correct(90, Point::new(4.0, 0.1), 0.05), 0.0);
    }
}
