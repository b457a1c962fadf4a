//! Computes the velocity that follows a local path. A robot that has to turn uses pure pursuit (R. C.
//! Coulter, 1992), and a robot that moves in any direction heads straight for the target. Both face the
//! direction of travel, so that the laser looks ahead.
//!
//! Commands never bring the robot too close to a known obstacle and never exceed the limits.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Pose, wrap_angle};
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::robot::{Drive, Limits};

use super::obstacles::Obstacles;

/// Look-ahead distance, in metres. The robot heads for the farthest point of the path within it.
const LOOK_AHEAD_M: f64 = 0.7;
/// Look-ahead distance, in metres, if obstacles slowed the last command. It is short, to keep the robot on the path.
const SHORT_AHEAD_M: f64 = 0.15;
/// Free space beyond the robot's radius, in metres, that a shortcut to a point on the path requires.
const SHORTCUT_M: f64 = 0.06;
/// Turn rate per radian of heading error, in 1/s.
const TURN_GAIN: f64 = 2.0;
/// Heading error, in radians, above which a differential drive begins to turn on the spot.
const TURN_FROM_RAD: f64 = 1.0;
/// Heading error, in radians, below which a differential drive stops turning on the spot.
const TURN_UNTIL_RAD: f64 = 0.35;
/// Heading error, in radians, above which an omnidirectional drive waits until its laser faces the direction of travel.
const BLIND_RAD: f64 = 1.7;
/// Minimum speed next to obstacles, as a share of the top speed.
const SLOWEST: f64 = 0.3;
/// Free space beyond the robot's radius required for full speed, in metres.
const WIDE_M: f64 = 0.4;
/// Free space beyond the robot's radius, in metres, that no command may use up.
const SAFETY_M: f64 = 0.02;
/// Time from a command until it takes effect, in seconds.
const LATENCY_S: f64 = 0.2;

/// The properties of a robot that matter for following a path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Radius of the footprint, in metres.
    pub radius_m: f64,
    /// Kind of drive.
    pub drive: Drive,
    /// Limits on speeds and accelerations.
    pub limits: Limits,
}

/// A follower of local paths. It remembers its last command, and whether it is turning on the spot or was slowed by an obstacle.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Pursuit {
    body: Body,
    /// The last command, as vx and vy in m/s and the turn rate in rad/s.
    last: [f64; 3],
    turning: bool,
    /// Whether obstacles slowed the last command down.
    cramped: bool,
}

const STILL: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };

impl Pursuit {
    /// Creates a follower for a robot at rest.
    pub fn new(body: Body) -> Self {
        Self { body, last: [0.0; 3], turning: false, cramped: false }
    }

    /// Returns the last command.
    pub fn last(&self) -> Twist {
        let [vx_mps, vy_mps, yaw_rate_radps] = self.last;
        Twist { vx_mps, vy_mps, yaw_rate_radps }
    }

    fn remember(&mut self, twist: Twist) -> Twist {
        self.last = [twist.vx_mps, twist.vy_mps, twist.yaw_rate_radps];
        twist
    }

    /// Returns the command that follows `path` for the next `dt_s` seconds, at no more than `share` of the
    /// top speed. The path is in the odometry frame, and the robot stops at its end.
    pub fn follow(
        &mut self,
        path: &[Point<Odom>],
        robot: &Pose<Odom>,
        obstacles: &Obstacles,
        share: f64,
        dt_s: f64,
    ) -> Twist {
        let Some((target, rest_m)) = self.target(path, robot.position(), obstacles) else {
            return self.stop(dt_s);
        };
        let bearing = wrap_angle((target.y - robot.y).atan2(target.x - robot.x) - robot.yaw_rad);
        let clearance = obstacles.clearance_m(robot.position(), self.body.radius_m + WIDE_M);
        let width = ((clearance - self.body.radius_m) / WIDE_M).clamp(SLOWEST, 1.0);
        let braking = (self.body.limits.acceleration_mps2 * rest_m).sqrt() + 0.05;
        let speed = (self.body.limits.speed_mps * share * width).min(braking);
        let wish = self.steer(bearing, target.distance(&robot.position()), speed);
        self.command(wish, robot, obstacles, dt_s)
    }

    /// Returns the command closest to `wish` that the limits and the obstacles allow.
    pub fn command(&mut self, wish: Twist, robot: &Pose<Odom>, obstacles: &Obstacles, dt_s: f64) -> Twist {
        let reachable = self.within_limits(wish, dt_s);
        let safe = self.safe(reachable, robot, obstacles);
        self.cramped = safe.vx_mps.hypot(safe.vy_mps) < 0.99 * reachable.vx_mps.hypot(reachable.vy_mps);
        self.remember(safe)
    }

    /// Brakes as hard as the limits allow.
    pub fn stop(&mut self, dt_s: f64) -> Twist {
        self.turning = false;
        self.remember(self.within_limits(STILL, dt_s))
    }

    /// Returns the farthest point of the path that lies within the look-ahead distance and is connected by a free straight line,
    /// and the length of the rest of the path, in metres.
    fn target(
        &self,
        path: &[Point<Odom>],
        robot: Point<Odom>,
        obstacles: &Obstacles,
    ) -> Option<(Point<Odom>, f64)> {
        let by_distance =
            |a: &usize, b: &usize| path[*a].distance(&robot).total_cmp(&path[*b].distance(&robot));
        let nearest = (0..path.len()).min_by(by_distance)?;
        let ahead = &path[nearest..];
        let rest_m = ahead.windows(2).map(|w| w[0].distance(&w[1])).sum::<f64>();
        let most_m = if self.cramped { SHORT_AHEAD_M } else { LOOK_AHEAD_M };
        let mut target = ahead[0];
        for &point in ahead {
            let distance = point.distance(&robot);
            let needs_room = distance > SHORT_AHEAD_M;
            if distance > most_m || (needs_room && !self.has_room(robot, point, obstacles)) {
                break;
            }
            target = point;
        }
        Some((target, rest_m.max(target.distance(&robot))))
    }

    fn has_room(&self, from: Point<Odom>, to: Point<Odom>, obstacles: &Obstacles) -> bool {
        let least = self.body.radius_m + SHORTCUT_M;
        let steps = (from.distance(&to) / 0.1).ceil().max(1.0) as usize;
        (1..=steps).all(|i| {
            let share = i as f64 / steps as f64;
            let place = Point::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y));
            obstacles.clearance_m(place, least + 0.01) >= least
        })
    }

    fn steer(&mut self, bearing_rad: f64, distance_m: f64, speed_mps: f64) -> Twist {
        let from = if self.turning { TURN_UNTIL_RAD } else { TURN_FROM_RAD };
        let (sin, cos) = bearing_rad.sin_cos();
        match self.body.drive {
            Drive::Differential => {
                self.turning = bearing_rad.abs() > from;
                let speed = if self.turning { 0.0 } else { speed_mps * cos };
                let arc = 2.0 * speed * sin / distance_m.max(0.2);
                let on_the_spot = TURN_GAIN * bearing_rad;
                let turn = if self.turning { on_the_spot } else { 0.5 * (arc + on_the_spot) };
                Twist { vx_mps: speed, vy_mps: 0.0, yaw_rate_radps: turn }
            }
            Drive::Omnidirectional => {
                let share = (1.0 - bearing_rad.abs() / BLIND_RAD).clamp(0.0, 0.5) * 2.0;
                let speed = speed_mps * share;
                let yaw_rate_radps = TURN_GAIN * bearing_rad;
                Twist { vx_mps: speed * cos, vy_mps: speed * sin, yaw_rate_radps }
            }
        }
    }

    /// Returns the command closest to `wish` that the limits on speed and acceleration allow after the last command.
    fn within_limits(&self, wish: Twist, dt_s: f64) -> Twist {
        let (limits, last) = (&self.body.limits, self.last());
        let (vx, vy) = shorten(wish.vx_mps, wish.vy_mps, limits.speed_mps);
        let (dx, dy) = (vx - last.vx_mps, vy - last.vy_mps);
        let (dx, dy) = shorten(dx, dy, limits.acceleration_mps2 * dt_s);
        let turn = wish.yaw_rate_radps.clamp(-limits.yaw_rate_radps, limits.yaw_rate_radps);
        let change = limits.yaw_acceleration_radps2 * dt_s;
        let d_turn = (turn - last.yaw_rate_radps).clamp(-change, change);
        Twist {
            vx_mps: last.vx_mps + dx,
            vy_mps: last.vy_mps + dy,
            yaw_rate_radps: last.yaw_rate_radps + d_turn,
        }
    }

    /// Slows `wish` down to the highest speed at which the robot can still stop before any known obstacle. Turning on the spot is
    /// always safe, because the footprint is round.
    fn safe(&self, wish: Twist, robot: &Pose<Odom>, obstacles: &Obstacles) -> Twist {
        let slowed = |share: f64| Twist {
            vx_mps: share * wish.vx_mps,
            vy_mps: share * wish.vy_mps,
            yaw_rate_radps: wish.yaw_rate_radps,
        };
        let steps = [1.0, 0.75, 0.5, 0.3, 0.15].map(slowed);
        let safe = steps.into_iter().find(|twist| self.can_stop(twist, robot, obstacles));
        safe.unwrap_or(slowed(0.0))
    }

    fn can_stop(&self, twist: &Twist, robot: &Pose<Odom>, obstacles: &Obstacles) -> bool {
        let speed = twist.vx_mps.hypot(twist.vy_mps);
        let ahead_s = LATENCY_S + 0.5 * speed / self.body.limits.acceleration_mps2;
        let least = self.body.radius_m + SAFETY_M;
        let now = obstacles.clearance_m(robot.position(), least);
        (1..=4).all(|i| {
            let t = ahead_s * f64::from(i) / 4.0;
            let step = Pose::<Odom>::new(twist.vx_mps * t, twist.vy_mps * t, 0.0);
            let turned = Pose::new(robot.x, robot.y, robot.yaw_rad + 0.5 * twist.yaw_rate_radps * t);
            let there = obstacles.clearance_m(turned.compose(&step).position(), least);
            there >= least || (now < least && there > now)
        })
    }
}

/// Shortens a vector to at most the length `most`.
fn shorten(x: f64, y: f64, most: f64) -> (f64, f64) {
    let length = x.hypot(y);
    if length > most { (x * most / length, y * most / length) } else { (x, y) }
}
