//! Corrects the heading of a robot by the bearings of landmarks in its map. This part is our own.
//!
//! A robot that never turns on purpose keeps the heading error that it has at the start. The map states the bearing of a
//! landmark from the reference. If the robot sees both, the difference between the bearing in the map and the one that it sees
//! measures this error, which a one-dimensional Kalman filter estimates. If the difference is too large to be a heading error,
//! the landmark must be the wrong one.

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
    /// Angle by which the robot's axes are turned to the left of the map's axes, in radians.
    pub turned_rad: f64,
    variance: f64,
}

impl Heading {
    /// Returns the heading of a robot whose initial error has this standard deviation, in radians.
    pub fn of_sigma(sigma_rad: f64) -> Self {
        Self { turned_rad: 0.0, variance: sigma_rad * sigma_rad }
    }

    /// Takes in the bearing of a landmark, which is seen at `way` from the reference, in the map's axes as currently estimated.
    /// `sigma` is the position error. Returns the angle by which the estimate turns to the left.
    pub fn correct(&mut self, bearing_deg: u16, way: Point, sigma: f64) -> f64 {
        let distance = way.norm();
        if self.variance <= 0.0 || distance <= sigma {
            return 0.0;
        }
        let noise = ROUNDED_RAD * ROUNDED_RAD + (sigma / distance).powi(2);
        let meant = Point::new(0.0, 1.0).turned(-f64::from(bearing_deg).to_radians());
        let off = (way.x * meant.y - way.y * meant.x).atan2(way.dot(meant));
        if off * off > GATE * GATE * (self.variance + noise) {
            return 0.0;
        }
        let gain = self.variance / (self.variance + noise);
        self.variance *= 1.0 - gain;
        self.turned_rad += gain * off;
        gain * off
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
    fn a_wrong_landmark_and_a_heading_that_is_sure_change_nothing() {
        let mut heading = Heading::of_sigma(2_f64.to_radians());
        assert_eq!(heading.correct(90, Point::new(4.0, 1.0), 0.05), 0.0);
        assert_eq!(heading.correct(90, Point::new(0.01, 0.0), 0.05), 0.0, "too near to tell");
        assert_eq!(heading, Heading::of_sigma(2_f64.to_radians()));
        assert_eq!(Heading::of_sigma(0.0).correct(90, Point::new(4.0, 0.1), 0.05), 0.0);
    }
}
