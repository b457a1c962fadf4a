//! Robots as files.

use serde::{Deserialize, Serialize};

use crate::channels::{ODOMETRY, SCAN, SONAR};
use crate::geometry::{Base, Pose};

/// Ticks a second of a robot that says nothing of them and has no laser.
const TICK_HZ: f64 = 10.0;
/// Most ticks a second, and most readings a second of any sensor.
const MOST_HZ: f64 = 1000.0;

/// A robot: footprint, limits, sensors. Parsed from TOML by [`Robot::parse`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Name, for people.
    pub name: String,
    /// Radius of the round footprint, metres.
    pub radius_m: f64,
    /// Mass, kilograms.
    pub mass_kg: f64,
    /// How it moves.
    pub drive: Drive,
    /// Instants a second, as the file says; see [`Robot::tick_hz`].
    pub tick_hz: Option<f64>,
    /// What it can do.
    pub limits: Limits,
    /// Its laser range finder, where it has one.
    pub laser: Option<Laser>,
    /// Its ring of sonars, where it has one.
    pub sonar: Option<Sonar>,
    /// How its odometry errs, where it has one.
    pub odometry: Option<OdometryNoise>,
}

/// How a robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// In any direction.
    Omnidirectional,
    /// Forward and turning; vy is ignored.
    Differential,
}

/// Largest velocities and accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Turn rate, rad/s.
    pub yaw_rate_radps: f64,
    /// Acceleration and braking, m/s².
    pub acceleration_mps2: f64,
    /// Angular acceleration, rad/s².
    pub yaw_acceleration_radps2: f64,
}

/// A planar laser range finder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laser {
    /// Model name.
    pub model: String,
    /// Field of view, degrees, centred on the sensor's forward axis.
    pub field_of_view_deg: f64,
    /// Number of beams, at most [`crate::message::MAX_BEAMS`].
    pub beams: u32,
    /// Shortest range, metres.
    pub range_min_m: f64,
    /// Longest range, metres.
    pub range_max_m: f64,
    /// Scans a second.
    pub rate_hz: f64,
    /// Standard deviation of a range: a constant part, metres.
    pub noise_m: f64,
    /// Standard deviation of a range: a part that grows with the range, metres a metre.
    pub noise_per_m: f64,
    /// Share of the beams that get lost.
    pub dropout: f64,
    /// Mounting: forward of the robot's centre, metres.
    #[serde(default)]
    pub mount_x_m: f64,
    /// Mounting: left of the robot's centre, metres.
    #[serde(default)]
    pub mount_y_m: f64,
    /// Mounting: direction of the sensor's forward axis, degrees counter-clockwise.
    #[serde(default)]
    pub mount_yaw_deg: f64,
}

impl Laser {
    /// Where the sensor sits on the robot.
    pub fn mount(&self) -> Pose<Base> {
        Pose::new(self.mount_x_m, self.mount_y_m, self.mount_yaw_deg.to_radians())
    }
}

/// A ring of sonars around the robot's centre, all alike, at equal angles; sonar 0 looks forward, the others
/// follow counter-clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sonar {
    /// Model name.
    pub model: String,
    /// Number of sonars, at most [`crate::message::MAX_SONARS`].
    pub sonars: u32,
    /// Opening angle of a sonar's cone, degrees.
    pub opening_deg: f64,
    /// Radius of the ring, metres.
    pub ring_radius_m: f64,
    /// Shortest range, metres.
    pub range_min_m: f64,
    /// Longest range, metres.
    pub range_max_m: f64,
    /// Readings of the whole ring a second.
    pub rate_hz: f64,
    /// Standard deviation of a range, a share of it.
    pub noise_per_m: f64,
}

/// Noise of dead reckoning: the velocity motion model (Thrun, Burgard and Fox,
/// *Probabilistic Robotics*, table 5.3) with a drift and slips on top.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryNoise {
    /// Readings a second; as many as ticks where it is missing.
    pub rate_hz: Option<f64>,
    /// Variance of the speed from the speed, (m/s)² per (m/s)² and second.
    pub alpha_speed_speed: f64,
    /// Variance of the speed from the turn rate.
    pub alpha_speed_turn: f64,
    /// Variance of the turn rate from the speed.
    pub alpha_turn_speed: f64,
    /// Variance of the turn rate from the turn rate.
    pub alpha_turn_turn: f64,
    /// Standard deviation of the run's constant error of the travelled distance, a share.
    pub drift_distance: f64,
    /// Standard deviation of the run's constant error of the heading, radians a metre.
    pub drift_yaw_radpm: f64,
    /// Slips a metre: a slip loses part of a step.
    pub slips_per_m: f64,
}

/// What is wrong with a robot file.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// No TOML, a key that is not known, a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A value that cannot be.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: &'static str,
        /// What would be right.
        expected: &'static str,
        /// What stands there.
        found: f64,
    },
    /// A sensor that somebody needs and the robot does not have.
    #[error("robot {robot:?}: expected the sensor [{key}] in its file, found none")]
    Lacks {
        /// The robot's name.
        robot: String,
        /// The table of the robot file.
        key: &'static str,
    },
}

/// A number with its key.
type Keyed = (&'static str, f64);

impl Robot {
    /// Reads a robot file.
    ///
    /// # Errors
    /// [`RobotError`] with the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, RobotError> {
        let robot: Self = toml::from_str(text)?;
        robot.check()?;
        Ok(robot)
    }

    /// Instants a second: as the file says, else as many as the laser's scans, else 10.
    pub fn tick_hz(&self) -> f64 {
        self.tick_hz.or(self.laser.as_ref().map(|laser| laser.rate_hz)).unwrap_or(TICK_HZ)
    }

    /// The laser, for those who cannot do without.
    ///
    /// # Errors
    /// [`RobotError::Lacks`].
    pub fn laser(&self) -> Result<&Laser, RobotError> {
        self.laser.as_ref().ok_or_else(|| self.lacks("laser"))
    }

    /// The ring of sonars, for those who cannot do without.
    ///
    /// # Errors
    /// [`RobotError::Lacks`].
    pub fn sonar(&self) -> Result<&Sonar, RobotError> {
        self.sonar.as_ref().ok_or_else(|| self.lacks("sonar"))
    }

    /// The odometry, for those who cannot do without.
    ///
    /// # Errors
    /// [`RobotError::Lacks`].
    pub fn odometry(&self) -> Result<&OdometryNoise, RobotError> {
        self.odometry.as_ref().ok_or_else(|| self.lacks("odometry"))
    }

    fn lacks(&self, key: &'static str) -> RobotError {
        RobotError::Lacks { robot: self.name.clone(), key }
    }

    fn check(&self) -> Result<(), RobotError> {
        let limits = &self.limits;
        positive(&[
            ("radius_m", self.radius_m),
            ("mass_kg", self.mass_kg),
            ("limits.speed_mps", limits.speed_mps),
            ("limits.yaw_rate_radps", limits.yaw_rate_radps),
            ("limits.acceleration_mps2", limits.acceleration_mps2),
            ("limits.yaw_acceleration_radps2", limits.yaw_acceleration_radps2),
        ])?;
        self.tick_hz.map_or(Ok(()), |hz| rate("tick_hz", hz))?;
        self.laser.as_ref().map_or(Ok(()), Laser::check)?;
        self.sonar.as_ref().map_or(Ok(()), Sonar::check)?;
        self.odometry.as_ref().map_or(Ok(()), OdometryNoise::check)?;
        self.check_rates()
    }

    /// A channel holds so many readings for each tick.
    fn check_rates(&self) -> Result<(), RobotError> {
        let rates = [
            ("laser.rate_hz", self.laser.as_ref().map(|laser| laser.rate_hz), SCAN.spec),
            ("sonar.rate_hz", self.sonar.as_ref().map(|sonar| sonar.rate_hz), SONAR.spec),
            ("odometry.rate_hz", self.odometry.and_then(|odometry| odometry.rate_hz), ODOMETRY.spec),
        ];
        for (key, hz, spec) in rates {
            let hz = hz.unwrap_or_default();
            let most = spec.per_tick as f64 * self.tick_hz();
            expect(key, "at most as many as its channel holds for the ticks of tick_hz", hz, hz <= most)?;
        }
        Ok(())
    }
}

impl Laser {
    fn check(&self) -> Result<(), RobotError> {
        positive(&[
            ("laser.range_max_m", self.range_max_m),
            ("laser.field_of_view_deg", self.field_of_view_deg),
        ])?;
        not_negative(&[
            ("laser.range_min_m", self.range_min_m),
            ("laser.noise_m", self.noise_m),
            ("laser.noise_per_m", self.noise_per_m),
        ])?;
        rate("laser.rate_hz", self.rate_hz)?;
        let (beams, share, fov) = (self.beams, self.dropout, self.field_of_view_deg);
        expect("laser.beams", "2 to 1440", beams.into(), (2..=1440).contains(&beams))?;
        expect("laser.dropout", "a share from 0 to below 1", share, (0.0..1.0).contains(&share))?;
        expect("laser.field_of_view_deg", "at most 360", fov, fov <= 360.0)?;
        let min = self.range_min_m;
        expect("laser.range_min_m", "less than range_max_m", min, min < self.range_max_m)
    }
}

impl Sonar {
    fn check(&self) -> Result<(), RobotError> {
        positive(&[("sonar.opening_deg", self.opening_deg), ("sonar.range_max_m", self.range_max_m)])?;
        not_negative(&[
            ("sonar.ring_radius_m", self.ring_radius_m),
            ("sonar.range_min_m", self.range_min_m),
            ("sonar.noise_per_m", self.noise_per_m),
        ])?;
        rate("sonar.rate_hz", self.rate_hz)?;
        let (sonars, opening, min) = (self.sonars, self.opening_deg, self.range_min_m);
        expect("sonar.sonars", "1 to 32", sonars.into(), (1..=32).contains(&sonars))?;
        expect("sonar.opening_deg", "less than 180", opening, opening < 180.0)?;
        expect("sonar.range_min_m", "less than range_max_m", min, min < self.range_max_m)
    }
}

impl OdometryNoise {
    fn check(&self) -> Result<(), RobotError> {
        self.rate_hz.map_or(Ok(()), |hz| rate("odometry.rate_hz", hz))?;
        not_negative(&[
            ("odometry.alpha_speed_speed", self.alpha_speed_speed),
            ("odometry.alpha_speed_turn", self.alpha_speed_turn),
            ("odometry.alpha_turn_speed", self.alpha_turn_speed),
            ("odometry.alpha_turn_turn", self.alpha_turn_turn),
            ("odometry.drift_distance", self.drift_distance),
            ("odometry.drift_yaw_radpm", self.drift_yaw_radpm),
            ("odometry.slips_per_m", self.slips_per_m),
        ])
    }
}

fn positive(numbers: &[Keyed]) -> Result<(), RobotError> {
    let mut numbers = numbers.iter();
    numbers.try_for_each(|&(key, n)| expect(key, "a number above 0", n, n.is_finite() && n > 0.0))
}

fn not_negative(numbers: &[Keyed]) -> Result<(), RobotError> {
    let mut numbers = numbers.iter();
    numbers.try_for_each(|&(key, n)| expect(key, "a number of 0 or more", n, n.is_finite() && n >= 0.0))
}

fn rate(key: &'static str, hz: f64) -> Result<(), RobotError> {
    expect(key, "a number above 0, at most 1000", hz, hz > 0.0 && hz <= MOST_HZ)
}

fn expect(key: &'static str, expected: &'static str, found: f64, holds: bool) -> Result<(), RobotError> {
    if holds { Ok(()) } else { Err(RobotError::Value { key, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BARE: &str = "name='bare'\nradius_m=0.2\nmass_kg=10\ndrive='differential'\n[limits]\nspeed_mps=1\n\
        yaw_rate_radps=1\nacceleration_mps2=1\nyaw_acceleration_radps2=1\n";

    #[test]
    fn a_robot_needs_no_sensors_and_whoever_needs_one_hears_which_is_missing() {
        let robot = Robot::parse(BARE).unwrap();
        assert_eq!((robot.tick_hz(), robot.laser.is_none(), robot.odometry.is_none()), (10.0, true, true));
        let error = robot.laser().unwrap_err().to_string();
        assert_eq!(error, "robot \"bare\": expected the sensor [laser] in its file, found none");
        assert!(robot.odometry().unwrap_err().to_string().contains("[odometry]"));
    }

    #[test]
    fn rates_must_be_possible() {
        for (line, key) in [("tick_hz=0", "tick_hz"), ("tick_hz=nan", "tick_hz"), ("tick_hz=1e6", "tick_hz")]
        {
            let error = Robot::parse(&format!("{line}\n{BARE}")).unwrap_err().to_string();
            assert!(error.starts_with(key), "{error}");
        }
    }
}
