//! Robots as files.

use serde::{Deserialize, Serialize};

use crate::geometry::{Base, Pose};

/// A robot: footprint, limits, laser, odometry. Parsed from TOML by [`Robot::parse`].
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
    /// What it can do.
    pub limits: Limits,
    /// Its laser range finder.
    pub laser: Laser,
    /// How its odometry errs.
    pub odometry: OdometryNoise,
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

/// Noise of dead reckoning: the velocity motion model (Thrun, Burgard and Fox,
/// *Probabilistic Robotics*, table 5.3) with a drift and slips on top.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryNoise {
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
}

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

    fn check(&self) -> Result<(), RobotError> {
        let (limits, laser) = (&self.limits, &self.laser);
        let positive = [
            ("radius_m", self.radius_m),
            ("mass_kg", self.mass_kg),
            ("limits.speed_mps", limits.speed_mps),
            ("limits.yaw_rate_radps", limits.yaw_rate_radps),
            ("limits.acceleration_mps2", limits.acceleration_mps2),
            ("limits.yaw_acceleration_radps2", limits.yaw_acceleration_radps2),
            ("laser.range_max_m", laser.range_max_m),
            ("laser.rate_hz", laser.rate_hz),
            ("laser.field_of_view_deg", laser.field_of_view_deg),
        ];
        let not_negative = [
            ("laser.range_min_m", laser.range_min_m),
            ("laser.noise_m", laser.noise_m),
            ("laser.noise_per_m", laser.noise_per_m),
            ("odometry.alpha_speed_speed", self.odometry.alpha_speed_speed),
            ("odometry.alpha_speed_turn", self.odometry.alpha_speed_turn),
            ("odometry.alpha_turn_speed", self.odometry.alpha_turn_speed),
            ("odometry.alpha_turn_turn", self.odometry.alpha_turn_turn),
            ("odometry.drift_distance", self.odometry.drift_distance),
            ("odometry.drift_yaw_radpm", self.odometry.drift_yaw_radpm),
            ("odometry.slips_per_m", self.odometry.slips_per_m),
        ];
        for (key, found) in positive {
            expect(key, "a number above 0", found, found.is_finite() && found > 0.0)?;
        }
        for (key, found) in not_negative {
            expect(key, "a number of 0 or more", found, found.is_finite() && found >= 0.0)?;
        }
        let (beams, share, fov) = (laser.beams, laser.dropout, laser.field_of_view_deg);
        expect("laser.beams", "2 to 1440", beams.into(), (2..=1440).contains(&beams))?;
        expect("laser.dropout", "a share from 0 to below 1", share, (0.0..1.0).contains(&share))?;
        expect("laser.field_of_view_deg", "at most 360", fov, fov <= 360.0)?;
        let min = laser.range_min_m;
        expect("laser.range_min_m", "less than range_max_m", min, min < laser.range_max_m)
    }
}

fn expect(key: &'static str, expected: &'static str, found: f64, holds: bool) -> Result<(), RobotError> {
    if holds { Ok(()) } else { Err(RobotError::Value { key, expected, found }) }
}
