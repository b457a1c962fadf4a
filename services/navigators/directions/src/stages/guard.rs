//! Keeps a robot on land away from everything that isn't a landmark: walls, furniture and people.
//!
//! The laser covers the full circle, so the newest scan shows everything nearby, and earlier scans are not needed. If the robot's
//! direction is blocked, it takes the closest free direction, or stops.

use serde::{Deserialize, Serialize};
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_schemas::geometry::{Base, Odom, Pose};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::Robot;

use super::error::DirectionsError;
use crate::geometry::Point;

/// Angles from a blocked direction at which others are tried, in radians, starting on the side to which the robot is already
/// moving. The last angles on each side lead away from an obstacle that is already too near.
const ASIDE_RAD: [f64; 9] = [0.0, 0.4, 0.8, 1.2, 1.7, -0.4, -0.8, -1.2, -1.7];
/// Minimum fraction of the desired velocity at which a direction counts as free.
const FREE: f64 = 0.5;

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
        let here = Pose::<Odom>::new(0.0, 0.0, 0.0);
        let laser = Pose::<Odom>::new(self.mount.x, self.mount.y, self.mount.yaw_rad);
        self.obstacles.clear();
        self.obstacles.observe(&here, self.body.radius_m, &laser, scan);
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
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

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

    #[test]
    fn it_stops_before_a_wall() {
        let (place, nearest) = driven(Point::new(503.0, 0.0), 500.0);
        assert!((2.0..2.8).contains(&place.x) && nearest > 0.225, "{place:?} {nearest}");
    }
}
