//! How a drive follows a command: towards the commanded velocity, as fast as its limits let it.

use nalgebra::{Rotation2, Vector2};
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::robot::{Drive, Limits};

/// A velocity in the world's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    /// m/s, frame `World`.
    pub linear: Vector2<f64>,
    /// rad/s, counter-clockwise.
    pub angular: f64,
}

/// The command as far as the robot can obey it. A command that is not finite stops it, and one above its speed is shortened in
/// its direction. A differential drive does not move sideways.
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

/// The velocity after `dt_s` of following `command` at the heading `yaw_rad`.
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
        // Wheels do not slip sideways.
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

    #[test]
    fn commands_beyond_the_limits_are_shortened() {
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
