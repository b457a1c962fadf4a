//! A sweep of a planar laser range finder, the mapper's input.

use sketchnav_schemas::geometry::{Base, Pose};
use sketchnav_schemas::message::{LaserScan, MAX_BEAMS};

use crate::Error;

/// A sweep of a laser, from right to left, with the laser's pose on the robot.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'a> {
    /// Ranges in metres. A range of `range_max_m` or more, such as +∞, means that there was no return. NaN and ranges below
    /// `range_min_m` are invalid (REP 117).
    pub ranges_m: &'a [f32],
    /// Direction of beam 0 in the laser's frame, in radians counter-clockwise from its forward axis.
    pub first_rad: f64,
    /// Angle from one beam to the next, in radians.
    pub step_rad: f64,
    /// Minimum range of the laser, in metres.
    pub range_min_m: f64,
    /// Maximum range of the laser, in metres.
    pub range_max_m: f64,
    /// Pose of the laser on the robot.
    pub base_from_laser: Pose<Base>,
}

/// The measurement of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Beam {
    /// The beam ended at this range, in metres.
    Hit(f64),
    /// There was no return up to the laser's maximum range.
    Open,
    /// The reading is invalid and is ignored.
    Invalid,
}

impl<'a> Scan<'a> {
    /// Creates a scan from the message of a laser that is mounted on the robot at the given pose.
    pub fn of_message(message: &'a LaserScan, base_from_laser: Pose<Base>) -> Self {
        Self {
            ranges_m: message.ranges(),
            first_rad: message.angle_min_rad.into(),
            step_rad: message.angle_increment_rad.into(),
            range_min_m: message.range_min_m.into(),
            range_max_m: message.range_max_m.into(),
            base_from_laser,
        }
    }

    /// Checks that the numbers are plausible and that there are not too many beams.
    ///
    /// # Errors
    /// [`Error::Scan`] if a number is implausible or there are too many beams.
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |expected, found: String| Err(Error::Scan { expected, found });
        if self.ranges_m.len() > MAX_BEAMS {
            return wrong("at most 1440 beams", self.ranges_m.len().to_string());
        }
        let mount = self.base_from_laser;
        let angles = [self.first_rad, self.step_rad, mount.x, mount.y, mount.yaw_rad];
        if let Some(angle) = angles.iter().find(|angle| !angle.is_finite() || angle.abs() > 100.0) {
            return wrong("angles and mount below 100", angle.to_string());
        }
        let ordered =
            self.range_min_m >= 0.0 && self.range_min_m < self.range_max_m && self.range_max_m.is_finite();
        if !ordered {
            return wrong(
                "0 <= range_min_m < range_max_m",
                format!("{} and {}", self.range_min_m, self.range_max_m),
            );
        }
        Ok(())
    }

    pub(crate) fn beam(&self, index: usize) -> Beam {
        let range = f64::from(self.ranges_m[index]);
        if range.is_nan() || range < self.range_min_m {
            Beam::Invalid
        } else if range >= self.range_max_m {
            Beam::Open
        } else {
            Beam::Hit(range)
        }
    }

    /// Returns the direction of a beam as a unit vector in the robot's frame.
    pub(crate) fn direction(&self, index: usize) -> [f64; 2] {
        let angle = self.base_from_laser.yaw_rad + self.first_rad + self.step_rad * index as f64;
        [angle.cos(), angle.sin()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(ranges_m: &[f32]) -> Scan<'_> {
        let base_from_laser = Pose::new(0.1, 0.0, 0.0);
        Scan { ranges_m, first_rad: 0.0, step_rad: 0.1, range_min_m: 0.05, range_max_m: 5.0, base_from_laser }
    }

    #[test]
    fn beams_are_classified_by_rep_117() {
        let ranges = [1.0, f32::INFINITY, 5.0, f32::NAN, 0.01, f32::NEG_INFINITY];
        let found: Vec<_> = (0..6).map(|i| scan(&ranges).beam(i)).collect();
        use Beam::{Hit, Invalid, Open};
        assert_eq!(found, [Hit(1.0), Open, Open, Invalid, Invalid, Invalid]);
    }

    #[test]
    fn an_impossible_scan_is_rejected() {
        assert!(scan(&[1.0]).check().is_ok());
        assert!(scan(&vec![1.0; MAX_BEAMS + 1]).check().is_err());
        let wrong = Scan { range_max_m: 0.01, ..scan(&[1.0]) };
        assert_eq!(
            wrong.check().unwrap_err().to_string(),
            "scan: expected 0 <= range_min_m < range_max_m, found 0.05 and 0.01"
        );
        assert!(Scan { step_rad: f64::NAN, ..scan(&[1.0]) }.check().is_err());
    }
}
