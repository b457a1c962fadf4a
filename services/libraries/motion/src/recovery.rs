//! Recovery behaviours, which a stuck robot runs before it tries again: it backs up, discards earlier laser data, turns, and looks
//! again.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Pose, wrap_angle};
use sketchnav_schemas::message::Twist;

/// Distance to back up, in metres.
const BACK_M: f64 = 0.35;
/// Speed when backing up, in m/s.
const BACK_MPS: f64 = 0.12;
/// Maximum duration of backing up, in seconds.
const BACK_S: f64 = 4.0;
/// Angle to turn, in radians.
const TURN_RAD: f64 = 2.2;
/// Maximum duration of a turn, in seconds.
const TURN_S: f64 = 8.0;

/// The recovery behaviour that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Recovery {
    /// Drive backwards.
    BackUp {
        /// Position at which backing up began.
        from: Point<Odom>,
        /// Time at which to stop at the latest, in seconds.
        until_s: f64,
    },
    /// Turn on the spot.
    Spin {
        /// Remaining angle, in radians, counter-clockwise.
        left_rad: f64,
        /// Heading at the last step, in radians.
        yaw_rad: f64,
        /// Time at which to stop at the latest, in seconds.
        until_s: f64,
    },
}

/// What the robot does next during a recovery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next {
    /// Drive with this velocity.
    Drive(Twist),
    /// Clear the obstacles that the laser saw, and continue with this spin.
    ClearAndSpin(Recovery),
    /// Continue to the goal.
    Done,
}

impl Recovery {
    /// Begins a recovery by backing up.
    pub fn begin(now_s: f64, robot: Point<Odom>) -> Self {
        Self::BackUp { from: robot, until_s: now_s + BACK_S }
    }

    /// Begins a full turn on the spot, so that the laser sees everything around the robot.
    pub fn look_around(now_s: f64, robot: &Pose<Odom>, turn_rate_radps: f64) -> Self {
        Self::Spin { left_rad: TAU, yaw_rad: robot.yaw_rad, until_s: now_s + 2.0 * TAU / turn_rate_radps }
    }

    /// Takes a step. The direction of the turn alternates with `count`, the number of times the robot has been stuck.
    pub fn step(&mut self, now_s: f64, robot: &Pose<Odom>, count: u32, turn_rate_radps: f64) -> Next {
        match self {
            Self::BackUp { from, until_s } => {
                if now_s < *until_s && robot.position().distance(from) < BACK_M {
                    return Next::Drive(Twist { vx_mps: -BACK_MPS, vy_mps: 0.0, yaw_rate_radps: 0.0 });
                }
                let left_rad = if count % 2 == 1 { TURN_RAD } else { -TURN_RAD };
                Next::ClearAndSpin(Self::Spin { left_rad, yaw_rad: robot.yaw_rad, until_s: now_s + TURN_S })
            }
            Self::Spin { left_rad, yaw_rad, until_s } => {
                let side = left_rad.signum();
                *left_rad -= wrap_angle(robot.yaw_rad - *yaw_rad);
                *yaw_rad = robot.yaw_rad;
                if now_s < *until_s && *left_rad * side > 0.1 {
                    return Next::Drive(Twist {
                        vx_mps: 0.0,
                        vy_mps: 0.0,
                        yaw_rate_radps: side * turn_rate_radps,
                    });
                }
                Next::Done
            }
        }
    }
}
