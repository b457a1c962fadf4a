//! A ring of ranges around the robot, from either its sonars or its laser. A laser is reduced to as many directions as a belief
//! needs.
//!
//! Ranges are measured from the robot's rim. The beams of a laser are reduced to the nearest return in each of 64 directions. A
//! range marked as too near becomes the minimum range, and an invalid one becomes no return (REP 117).

use std::f64::consts::TAU;

use sketchnav_schemas::geometry::{Base, Pose};
use sketchnav_schemas::message::{LaserScan, MAX_SONARS, SonarScan};
use sketchnav_schemas::robot::Robot;

use crate::control::{self, Sectors};
use crate::error::LandmarksError;
use crate::locator::Returns;

/// Number of directions that the beams of a laser are reduced to.
const DIRECTIONS: usize = 64;
/// Minimum number of sonars.
const LEAST_SONARS: u32 = 8;
/// Minimum radius of a ring, in metres. The geometry of the histograms fails for a radius of 0.
const LEAST_RING_M: f64 = 1e-3;

/// Sensors that can provide a ring of ranges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RingSensor {
    /// A ring of sonars.
    Sonar,
    /// A laser.
    Laser,
}

/// A ring of ranges around the robot.
#[derive(Debug, Clone)]
pub struct Ring {
    /// Mounting pose of the laser, or `None` if the ring consists of sonars.
    laser: Option<Pose<Base>>,
    angles_rad: Vec<f64>,
    ranges_m: Vec<f64>,
    ring_m: f64,
    range_max_m: f64,
}

impl Ring {
    /// Creates the ring of a robot from its sonars or, if it has none, from its laser.
    ///
    /// # Errors
    /// - [`LandmarksError::Blind`] if the robot has neither.
    /// - [`LandmarksError::Sonars`] if it has too few sonars.
    pub fn of(robot: &Robot) -> Result<Self, LandmarksError> {
        let empty = |count: usize| Vec::with_capacity(count);
        match (&robot.sonar, &robot.laser) {
            (Some(sonar), _) if sonar.sonars < LEAST_SONARS => {
                Err(LandmarksError::Sonars { robot: robot.name.clone(), found: sonar.sonars })
            }
            (Some(sonar), _) => Ok(Self {
                laser: None,
                angles_rad: empty(MAX_SONARS),
                ranges_m: empty(MAX_SONARS),
                ring_m: sonar.ring_radius_m.max(LEAST_RING_M),
                range_max_m: sonar.range_max_m,
            }),
            (None, Some(laser)) => Ok(Self {
                laser: Some(laser.mount()),
                angles_rad: (0..DIRECTIONS).map(|i| i as f64 * TAU / DIRECTIONS as f64).collect(),
                ranges_m: vec![f64::INFINITY; DIRECTIONS],
                ring_m: robot.radius_m.max(LEAST_RING_M),
                range_max_m: laser.range_max_m,
            }),
            (None, None) => Err(LandmarksError::Blind { robot: robot.name.clone() }),
        }
    }

    /// Returns the kind of sensor that provides the ranges. If the robot has both, the ring uses only one of them.
    pub const fn sensor(&self) -> RingSensor {
        if self.laser.is_some() { RingSensor::Laser } else { RingSensor::Sonar }
    }

    /// Returns the radius of the ring around the robot's centre, in metres.
    pub const fn ring_m(&self) -> f64 {
        self.ring_m
    }

    /// Returns the minimum range that counts as no return, in metres.
    pub const fn range_max_m(&self) -> f64 {
        self.range_max_m
    }

    /// Stores a sonar reading, unless the ring uses the laser.
    pub fn receive(&mut self, scan: &SonarScan) {
        if self.laser.is_some() {
            return;
        }
        self.angles_rad.clear();
        self.ranges_m.clear();
        for (i, range) in scan.ranges().iter().enumerate() {
            self.angles_rad
                .push(f64::from(scan.angle_min_rad) + i as f64 * f64::from(scan.angle_increment_rad));
            self.ranges_m.push(range_m(*range, scan.range_min_m, scan.range_max_m));
        }
    }

    /// Stores a laser scan, unless the ring uses sonars.
    pub fn see(&mut self, scan: &LaserScan) {
        let Some(mount) = self.laser else { return };
        self.ranges_m.fill(f64::INFINITY);
        for (i, range) in scan.ranges().iter().enumerate() {
            let range = range_m(*range, scan.range_min_m, scan.range_max_m);
            if range.is_finite() {
                let angle = f64::from(scan.angle_min_rad) + i as f64 * f64::from(scan.angle_increment_rad);
                let (sin, cos) = angle.sin_cos();
                let at = mount.compose(&Pose::<Base>::new(range * cos, range * sin, 0.0));
                let direction =
                    (at.y.atan2(at.x) / TAU * DIRECTIONS as f64).round().rem_euclid(DIRECTIONS as f64);
                let nearest = &mut self.ranges_m[direction as usize % DIRECTIONS];
                *nearest = nearest.min((at.x.hypot(at.y) - self.ring_m).max(0.0));
            }
        }
    }

    /// Returns the latest measurements.
    pub fn returns(&self) -> Returns<'_> {
        let Self { angles_rad, ranges_m, ring_m, range_max_m, .. } = self;
        Returns { angles_rad, ranges_m, ring_m: *ring_m, range_max_m: *range_max_m }
    }

    /// Returns the nearest range in each of sixteen directions.
    pub fn sectors(&self) -> Sectors {
        control::sectors(&self.angles_rad, &self.ranges_m, self.range_max_m)
    }
}

fn range_m(range: f32, least: f32, most: f32) -> f64 {
    match range {
        range if range == f32::NEG_INFINITY => f64::from(least),
        range if range.is_finite() && range < most => f64::from(range),
        _ => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    const NOMAD: &str = include_str!("../../../../sim/robots/nomad200.toml");
    const ROBOTINO: &str = include_str!("../../../../sim/robots/robotino.toml");

    #[test]
    fn sonars_are_as_they_are_and_too_near_is_near() {
        let mut ring = Ring::of(&Robot::parse(NOMAD).unwrap()).unwrap();
        let mut scan = SonarScan::zeroed();
        (scan.sonar_count, scan.angle_increment_rad) = (16, std::f32::consts::PI / 8.0);
        (scan.range_min_m, scan.range_max_m) = (0.15, 6.5);
        scan.ranges_m[..16].fill(f32::INFINITY);
        (scan.ranges_m[4], scan.ranges_m[15], scan.ranges_m[8]) = (2.0, f32::NEG_INFINITY, f32::NAN);
        ring.receive(&scan);
        let sectors = ring.sectors();
        assert_eq!((sectors[4], sectors[8]), (2.0, f64::INFINITY));
        assert!((sectors[15] - 0.15).abs() < 1e-6);
        assert!((ring.ring_m() - 0.23).abs() < 1e-12);
    }

    #[test]
    fn a_laser_s_ranges_are_from_the_rim() {
        let robot = Robot::parse(ROBOTINO).unwrap();
        let mount = robot.laser().unwrap().mount();
        let mut ring = Ring::of(&robot).unwrap();
        let mut scan = LaserScan::zeroed();
        (scan.beam_count, scan.range_min_m, scan.range_max_m) = (1, 0.02, 5.6);
        scan.ranges_m[0] = 2.0;
        ring.see(&scan);
        let expected = mount.x + 2.0 - robot.radius_m;
        assert!((ring.sectors()[0] - expected).abs() < 1e-6, "{:?}", ring.sectors());
        assert_eq!(ring.returns().ranges_m.iter().filter(|range| range.is_finite()).count(), 1);
    }

    #[test]
    fn a_robot_needs_sonars_all_around_or_a_laser() {
        let few = NOMAD.replace("sonars = 16", "sonars = 6");
        let error = Ring::of(&Robot::parse(&few).unwrap()).unwrap_err().to_string();
        assert!(error.contains("sonar.sonars: expected 8 or more, found 6"), "{error}");
        let blind = Robot { sonar: None, laser: None, ..Robot::parse(NOMAD).unwrap() };
        assert!(Ring::of(&blind).unwrap_err().to_string().contains("[sonar] and [laser]"));
    }
}
