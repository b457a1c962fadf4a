//! Deviations of a robot from its commands, and of its odometry from the truth.

use serde::{Deserialize, Serialize};

use super::{RobotError, within};
use crate::bounds;

/// How a robot deviates from its commands. The errors are random and grow with the square root of the
/// distance travelled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionNoise {
    /// Standard deviation of the position after one metre, along each axis, in metres.
    pub translation_m: f64,
    /// Standard deviation of the heading after one metre, in radians.
    pub rotation_rad: f64,
}

impl MotionNoise {
    pub(super) fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("motion_noise.translation_m", self.translation_m, bounds::TRANSLATION_NOISE_M),
            ("motion_noise.rotation_rad", self.rotation_rad, bounds::ROTATION_NOISE_RAD),
        ])
    }
}

/// Noise of dead reckoning: the velocity motion model of Thrun, Burgard and Fox (*Probabilistic Robotics*, table 5.3) plus a
/// drift and wheel slips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryNoise {
    /// Readings per second. By default, there is one per tick.
    pub rate_hz: Option<f64>,
    /// Variance of the speed due to the speed, in (m/s)² per (m/s)² and second.
    pub alpha_speed_speed: f64,
    /// Variance of the speed due to the turn rate.
    pub alpha_speed_turn: f64,
    /// Variance of the turn rate due to the speed.
    pub alpha_turn_speed: f64,
    /// Variance of the turn rate due to the turn rate.
    pub alpha_turn_turn: f64,
    /// Standard deviation of the relative error of the distance travelled. The error is constant during a
    /// run.
    pub drift_distance: f64,
    /// Standard deviation of the heading drift, in radians per metre. The drift is constant during a run.
    pub drift_yaw_radpm: f64,
    /// Number of slips per metre. In a slip, part of a step is lost.
    pub slips_per_m: f64,
}

impl OdometryNoise {
    pub(super) fn check(&self) -> Result<(), RobotError> {
        self.rate_hz.map_or(Ok(()), |hz| within(&[("odometry.rate_hz", hz, bounds::RATE_HZ)]))?;
        within(&[
            ("odometry.alpha_speed_speed", self.alpha_speed_speed, bounds::MOTION_NOISE),
            ("odometry.alpha_speed_turn", self.alpha_speed_turn, bounds::MOTION_NOISE),
            ("odometry.alpha_turn_speed", self.alpha_turn_speed, bounds::MOTION_NOISE),
            ("odometry.alpha_turn_turn", self.alpha_turn_turn, bounds::MOTION_NOISE),
            ("odometry.drift_distance", self.drift_distance, bounds::SHARE),
            ("odometry.drift_yaw_radpm", self.drift_yaw_radpm, bounds::DRIFT_RADPM),
            ("odometry.slips_per_m", self.slips_per_m, bounds::SLIPS_PER_M),
        ])
    }
}

/// How far a robot on wheels deviates from its commands. Each value is the standard deviation of an error
/// that is drawn at the start of a run and constant during it. The errors are relative to the motion, or are
/// an angle per metre driven. Mecanum wheels also roll sideways.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelSlip {
    /// Error of the distance driven, as a share of the commanded distance.
    pub distance: f64,
    /// Sideways slide relative to the direction of motion, as a share of the motion.
    pub sideways: f64,
    /// Rotation that was not commanded, in radians per metre.
    pub yaw_radpm: f64,
}

impl WheelSlip {
    pub(super) fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("slip.distance", self.distance, bounds::SHARE),
            ("slip.sideways", self.sideways, bounds::SHARE),
            ("slip.yaw_radpm", self.yaw_radpm, bounds::DRIFT_RADPM),
        ])
    }
}
