//! Keeps a robot on land from what is no landmark: walls, furniture and people.
//!
//! The laser looks all around, so the newest scan says what is near, and nothing is remembered of those before. Where the way
//! is barred, the robot takes the free one that is nearest to it, or stands.

use serde::{Deserialize, Serialize};
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_schemas::geometry::{Base, Odom, Pose};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::Robot;

use super::error::DirectionsError;
use crate::geometry::Point;

/// How far aside of a way that is barred others are tried, radians: first on the side to which the robot moves already.
/// The last ones lead away again from where it is too near.
const ASIDE_RAD: [f64; 9] = [0.0, 0.4, 0.8, 1.2, 1.7, -0.4, -0.8, -1.2, -1.7];
/// The least part of the wish with which a way counts as free.
const FREE: f64 = 0.5;

/// What is near the robot, in its own axes.
pub struct Guard {
    body: Body,
    mount: Pose<Base>,
    obstacles: Obstacles,
}

/// The last command.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Last(Pursuit);

impl Guard {
    /// Of a robot with a laser.
    ///
    /// # Errors
    /// [`DirectionsError`] for a robot without one.
    pub fn new(robot: &Robot) -> Result<Self, DirectionsError> {
        let body = Body { radius_m: robot.radius_m, drive: robot.drive, limits: robot.limits };
        Ok(Self { body, mount: robot.laser()?.mount(), obstacles: Obstacles::new(1.0) })
    }

    /// The robot at rest.
    pub fn at_rest(&self) -> Last {
        Last(Pursuit::new(self.body))
    }

    /// The velocity nearest to `wish` with which the robot can stop before everything in the scan.
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
        // What the limits of acceleration allow with nothing in the way.
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

    /// A scan of a disc of some radius.
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

    /// Drives east for a while; where the robot is, and the nearest that it came to the disc's edge with its centre.
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
