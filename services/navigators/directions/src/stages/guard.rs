//! Keeps a robot on land away from everything that isn't a landmark: walls, furniture and people.
//!
//! The laser covers the full circle, so the newest scan shows everything nearby, and earlier scans are not needed. If the robot's
//! direction is blocked, it takes the closest free direction, or stops.
//!
//! A robot with a differential drive follows the free direction by pure pursuit.

use serde::{Deserialize, Serialize};
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_schemas::geometry::{self, Base, Odom, Pose};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::Robot;

use super::error::DirectionsError;
use crate::geometry::Point;

/// Angles from a blocked direction at which others are tried, in radians, starting on the side to which the robot is already
/// moving. The last angles on each side lead away from an obstacle that is already too near.
const ASIDE_RAD: [f64; 9] = [0.0, 0.4, 0.8, 1.2, 1.7, -0.4, -0.8, -1.2, -1.7];
/// Minimum fraction of the desired velocity at which a direction counts as free.
const FREE: f64 = 0.5;
/// Points of the path that a robot with a differential drive follows, by their distances from the robot, in metres.
const PATH_M: [f64; 4] = [0.0, 0.15, 0.4, 0.65];
/// Time that such a robot looks ahead in addition to the time that it needs for braking, in seconds.
const STEER_S: f64 = 0.6;
/// Free space beyond its radius, in metres, that it needs on either side.
const BESIDE_M: f64 = 0.05;

/// Limits the robot's velocity so that it can stop before every obstacle in its newest scan.
pub struct Guard {
    body: Body,
    mount: Pose<Base>,
    obstacles: Obstacles,
}

/// The last command, to which the acceleration limits of the next one apply.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Last(Pursuit);

impl Guard {
    /// Creates the guard of a robot with a laser.
    ///
    /// # Errors
    /// [`DirectionsError`] if the robot has no laser.
    pub fn new(robot: &Robot) -> Result<Self, DirectionsError> {
        let body = Body { radius_m: robot.radius_m, drive: robot.drive, limits: robot.limits };
        Ok(Self { body, mount: robot.laser()?.mount(), obstacles: Obstacles::new(1.0) })
    }

    /// Returns the last command of a robot that is at rest.
    pub fn at_rest(&self) -> Last {
        Last(Pursuit::new(self.body))
    }

    /// Returns the velocity closest to `wish` at which the robot can still stop before every obstacle in the scan.
    pub fn command(&mut self, last: &mut Last, wish: Point, scan: &LaserScan, dt_s: f64) -> Point {
        if wish == Point::default() {
            *last = self.at_rest();
            return wish;
        }
        let here = self.observe(scan);
        let commanded = |way: Point| {
            let mut pursuit = last.0.clone();
            let twist = Twist { vx_mps: way.x, vy_mps: way.y, yaw_rate_radps: 0.0 };
            let twist = pursuit.command(twist, &here, &self.obstacles, dt_s);
            (Point::new(twist.vx_mps, twist.vy_mps), pursuit)
        };
        let before = Point::new(last.0.last().vx_mps, last.0.last().vy_mps);
        // The velocity that the acceleration limits would allow without any obstacle.
        let free = |way: Point| {
            let change = way - before;
            let most = self.body.limits.acceleration_mps2 * dt_s;
            before + change * (most / change.norm().max(most))
        };
        let side = if wish.x * before.y < wish.y * before.x { -1.0 } else { 1.0 };
        let ways = ASIDE_RAD.map(|aside_rad| wish.turned(side * aside_rad));
        let is_free = |way: &&Point| commanded(**way).0.norm() >= FREE * free(**way).norm();
        let (velocity, pursuit) = commanded(*ways.iter().find(is_free).unwrap_or(&wish));
        last.0 = pursuit;
        velocity
    }

    /// Returns the command by which a robot with a differential drive moves at a velocity close to `wish`, which is in its own axes,
    /// or turns towards that direction first.
    pub fn steer(&mut self, last: &mut Last, wish: Point, scan: &LaserScan, dt_s: f64) -> Twist {
        let (speed, Some(towards)) = (wish.norm(), wish.direction()) else {
            *last = self.at_rest();
            return last.0.last();
        };
        let here = self.observe(scan);
        // The side to which the robot already faces, so that it does not hesitate before an obstacle.
        let side = if towards.y > 0.0 { -1.0 } else { 1.0 };
        let ways = ASIDE_RAD.map(|aside_rad| towards.turned(side * aside_rad));
        let way = ways.into_iter().find(|&way| self.is_free(way, speed)).unwrap_or(towards);
        let path = PATH_M.map(|at_m| geometry::Point::new(at_m * way.x, at_m * way.y));
        last.0.follow(&path, &here, &self.obstacles, speed / self.body.limits.speed_mps, dt_s)
    }

    /// Returns true if a robot that drives in this direction, given as a vector of length 1, can stop before every obstacle.
    fn is_free(&self, way: Point, speed: f64) -> bool {
        let brakes_m = speed * STEER_S + 0.5 * speed * speed / self.body.limits.acceleration_mps2;
        let least = self.body.radius_m + BESIDE_M;
        let clearance =
            |at_m: f64| self.obstacles.clearance_m(geometry::Point::new(at_m * way.x, at_m * way.y), least);
        let now = clearance(0.0);
        [0.25, 0.5, 0.75, 1.0]
            .into_iter()
            .map(|share| clearance(share * brakes_m))
            .all(|m| m >= least || m > now)
    }

    /// Finds the obstacles in a scan. Returns the robot's pose among them.
    fn observe(&mut self, scan: &LaserScan) -> Pose<Odom> {
        let here = Pose::<Odom>::new(0.0, 0.0, 0.0);
        let laser = Pose::<Odom>::new(self.mount.x, self.mount.y, self.mount.yaw_rad);
        self.obstacles.clear();
        self.obstacles.observe(&here, self.body.radius_m, &laser, scan);
        here
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use sketchnav_schemas::robot::Drive;

    use super::*;

    const DT_S: f64 = 0.1;

    fn guard() -> Guard {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let file = path.join("../../../sim/missions/directions/panorama.toml");
        Guard::new(&sketchnav_sim::files::robot(&file.to_string_lossy()).unwrap()).unwrap()
    }

    /// Returns a scan of a disc with the given radius.
    fn scan(at: Point, radius_m: f64) -> Box<LaserScan> {
        let mut scan: Box<LaserScan> = Box::new(Zeroable::zeroed());
        (scan.beam_count, scan.range_min_m, scan.range_max_m) = (720, 0.05, 10.0);
        (scan.angle_min_rad, scan.angle_increment_rad) =
            (-std::f32::consts::PI, std::f32::consts::TAU / 720.0);
        for beam in 0..720 {
            let bearing = f64::from(scan.angle_min_rad) + f64::from(scan.angle_increment_rad) * beam as f64;
            let way = Point::new(1.0, 0.0).turned(bearing);
            let (along, aside) = (at.dot(way), at.x * way.y - at.y * way.x);
            let half = radius_m * radius_m - aside * aside;
            let range = if along > 0.0 && half > 0.0 { along - half.sqrt() } else { f64::INFINITY };
            scan.ranges_m[beam] = range as f32;
        }
        scan
    }

    /// Drives east for a while. Returns the robot's final position, and the smallest distance from its centre to the edge of
    /// the disc.
    fn driven(at: Point, radius_m: f64) -> (Point, f64) {
        let mut guard = guard();
        let (mut last, mut place, mut nearest) = (guard.at_rest(), Point::default(), f64::INFINITY);
        for _ in 0..200 {
            let velocity = guard.command(&mut last, Point::new(0.5, 0.0), &scan(at - place, radius_m), DT_S);
            place = place + velocity * DT_S;
            nearest = nearest.min((at - place).norm() - radius_m);
        }
        (place, nearest)
    }

    #[test]
    fn it_drives_on_where_nothing_is_and_around_what_stands_in_the_way() {
        let (far, _) = driven(Point::new(3.0, 4.0), 0.3);
        assert!(far.x > 9.0 && far.y.abs() < 1e-9, "{far:?}");
        for aside in [0.0, 0.1, -0.3] {
            let (place, nearest) = driven(Point::new(3.0, aside), 0.3);
            assert!(place.x > 5.0, "{place:?}");
            assert!(nearest > 0.225, "{nearest}");
        }
    }

    /// Drives a robot with a differential drive towards a direction of the floor for a while. Returns its final position and the
    /// smallest distance from its centre to the edge of the disc.
    fn steered(wish: Point, at: Point, radius_m: f64) -> (Point, f64) {
        let mut guard = guard();
        guard.body.drive = Drive::Differential;
        (guard.body.limits.yaw_rate_radps, guard.body.limits.yaw_acceleration_radps2) = (1.0, 2.0);
        let (mut last, mut place, mut yaw_rad) = (guard.at_rest(), Point::default(), 0.0);
        let mut nearest = f64::INFINITY;
        for _ in 0..300 {
            let seen = scan((at - place).turned(-yaw_rad), radius_m);
            let twist = guard.steer(&mut last, wish.turned(-yaw_rad), &seen, DT_S);
            assert_eq!(twist.vy_mps, 0.0);
            yaw_rad += twist.yaw_rate_radps * DT_S;
            place = place + Point::new(twist.vx_mps, 0.0).turned(yaw_rad) * DT_S;
            nearest = nearest.min((at - place).norm() - radius_m);
        }
        (place, nearest)
    }

    #[test]
    fn a_differential_drive_turns_towards_where_it_is_to_drive_and_passes_what_stands_there() {
        let (far, _) = steered(Point::new(-0.3, 0.3), Point::new(30.0, 40.0), 0.3);
        assert!(far.x < -4.0 && (far.x + far.y).abs() < 0.5, "{far:?}");
        for aside in [0.0, 0.1, -0.3] {
            let (place, nearest) = steered(Point::new(0.5, 0.0), Point::new(3.0, aside), 0.3);
            assert!(place.x > 5.0 && nearest > 0.225, "{aside} {place:?} {nearest}");
        }
        let (place, nearest) = steered(Point::new(0.5, 0.0), Point::new(503.0, 0.0), 500.0);
        assert!(place.x < 2.8 && nearest > 0.225, "a wall: {place:?} {nearest}");
        assert_eq!(steered(Point::default(), Point::new(3.0, 0.0), 0.3).0, Point::default());
    }

    #[test]
    fn it_stops_before_a_wall() {
        let (place, nearest) = driven(Point::new(503.0, 0.0), 500.0);
        assert!((2.0..2.8).contains(&place.x) && nearest > 0.225, "{place:?} {nearest}");
    }
}
