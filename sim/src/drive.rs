//! How a drive follows a command: it approaches the commanded velocity as fast as its limits allow, while wheel slip makes the
//! robot deviate from it.

use nalgebra::{Rotation2, Vector2};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::robot::{Drive, Limits, WheelSlip};

/// A velocity in the axes of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    /// Linear velocity in m/s, in frame `World`.
    pub linear: Vector2<f64>,
    /// Turn rate in rad/s, counter-clockwise.
    pub angular: f64,
}

/// Wheel slip, which makes a robot deviate from its commands. It is constant during a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slip {
    distance: f64,
    sideways: f64,
    yaw_radpm: f64,
}

impl Slip {
    /// Draws the slip of a run from `stream`.
    pub fn new(slip: &WheelSlip, mut stream: Pcg64Mcg) -> Self {
        let mut of = |deviation: f64| deviation * stream.sample::<f64, _>(StandardNormal);
        Self { distance: of(slip.distance), sideways: of(slip.sideways), yaw_radpm: of(slip.yaw_radpm) }
    }

    /// Returns the motion that results from a command.
    pub fn motion(&self, command: &Twist) -> Twist {
        let Twist { vx_mps, vy_mps, yaw_rate_radps } = *command;
        let gets = 1.0 + self.distance;
        Twist {
            vx_mps: gets * vx_mps - self.sideways * vy_mps,
            vy_mps: gets * vy_mps + self.sideways * vx_mps,
            yaw_rate_radps: yaw_rate_radps + self.yaw_radpm * vx_mps.hypot(vy_mps),
        }
    }
}

/// Returns the part of a command that the robot can follow. A command that is not finite stops the robot. A
/// command above its top speed is shortened without changing its direction. A differential drive does not
/// move sideways.
pub fn feasible(command: &Twist, drive: Drive, limits: &Limits) -> Twist {
    let Twist { vx_mps, vy_mps, yaw_rate_radps } = *command;
    if ![vx_mps, vy_mps, yaw_rate_radps].iter().all(|v| v.is_finite()) {
        return Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };
    }
    let sideways = if drive == Drive::Omnidirectional { vy_mps } else { 0.0 };
    let linear = Vector2::new(vx_mps, sideways).cap_magnitude(limits.speed_mps);
    let most = limits.yaw_rate_radps;
    Twist { vx_mps: linear.x, vy_mps: linear.y, yaw_rate_radps: yaw_rate_radps.clamp(-most, most) }
}

/// Returns the velocity after following `command` for `dt_s` seconds at the heading `yaw_rad`.
pub fn accelerate(
    now: Velocity,
    yaw_rad: f64,
    command: &Twist,
    drive: Drive,
    limits: &Limits,
    dt_s: f64,
) -> Velocity {
    let goal = feasible(command, drive, limits);
    let turn = Rotation2::new(yaw_rad);
    let mut body = turn.inverse() * now.linear;
    if drive == Drive::Differential {
        // The wheels of a differential drive do not slip sideways.
        body.y = 0.0;
    }
    let change = Vector2::new(goal.vx_mps, goal.vy_mps) - body;
    body += change.cap_magnitude(limits.acceleration_mps2 * dt_s);
    let most = limits.yaw_acceleration_radps2 * dt_s;
    let angular = now.angular + (goal.yaw_rate_radps - now.angular).clamp(-most, most);
    Velocity { linear: turn * body, angular }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { speed_mps: 0.5, yaw_rate_radps: 1.0, acceleration_mps2: 1.0, yaw_acceleration_radps2: 2.0 };

    fn twist(vx_mps: f64, vy_mps: f64, yaw_rate_radps: f64) -> Twist {
        Twist { vx_mps, vy_mps, yaw_rate_radps }
    }

    /// When the robot drives at 0.1 m/s, it goes a tenth too far, slides a twentieth of the distance to the left and turns by 0.2
    /// rad per metre.
    #[test]
    fn slip_displaces_the_robot_in_proportion_to_its_motion() {
        let slip = Slip { distance: 0.1, sideways: 0.05, yaw_radpm: 0.2 };
        let close = |found: Twist, [x, y, yaw]: [f64; 3]| {
            let off = [found.vx_mps - x, found.vy_mps - y, found.yaw_rate_radps - yaw];
            assert!(off.iter().all(|off| off.abs() < 1e-12), "{found:?}");
        };
        close(slip.motion(&twist(0.1, 0.0, 0.0)), [0.11, 0.005, 0.02]);
        close(slip.motion(&twist(0.0, 0.1, 0.0)), [-0.005, 0.11, 0.02]);
        close(slip.motion(&twist(0.0, 0.0, 0.5)), [0.0, 0.0, 0.5]);
    }

    #[test]
    fn commands_beyond_the_limits_are_clipped() {
        let got = feasible(&twist(3.0, 4.0, -9.0), Drive::Omnidirectional, &LIMITS);
        assert!((got.vx_mps - 0.3).abs() < 1e-12 && (got.vy_mps - 0.4).abs() < 1e-12);
        assert_eq!(got.yaw_rate_radps, -1.0);
        assert_eq!(feasible(&twist(0.1, 4.0, 0.0), Drive::Differential, &LIMITS), twist(0.1, 0.0, 0.0));
        let nonsense = feasible(&twist(0.1, f64::NAN, 0.0), Drive::Omnidirectional, &LIMITS);
        assert_eq!(nonsense, twist(0.0, 0.0, 0.0));
    }

    #[test]
    fn the_velocity_changes_no_faster_than_the_limits() {
        let rest = Velocity { linear: Vector2::zeros(), angular: 0.0 };
        let got = accelerate(rest, 1.0, &twist(0.5, 0.0, 1.0), Drive::Differential, &LIMITS, 0.01);
        assert!((got.linear.norm() - 0.01).abs() < 1e-12 && (got.angular - 0.02).abs() < 1e-12);
        assert!((got.linear.y.atan2(got.linear.x) - 1.0).abs() < 1e-9);
    }
}
