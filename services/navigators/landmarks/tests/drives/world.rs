//! A world to drive in, which consists of polygons and a robot with a ring of sonars that moves and turns (Chronis 2007, 4.2).
//!
//! A sonar sees exactly the nearest point in its cone, with an error of 1 %. The thesis does not give the width of the cone, so
//! it is that of the Polaroid sensor, 25°.

use std::f64::consts::FRAC_PI_8;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_landmarks::control::Drive;
use sketchnav_landmarks::plane;
use sketchnav_landmarks::route::INCH_M;
use sketchnav_schemas::geometry::{Base, Point, Pose, World as Floor};

const CONE_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;
const RANGE_MIN_M: f64 = 17.0 * INCH_M;
pub const RANGE_MAX_M: f64 = 255.0 * INCH_M;
pub const ROBOT_RADIUS_M: f64 = 10.0 * INCH_M;

/// A named object.
#[derive(Debug, Clone)]
pub struct Object {
    pub name: &'static str,
    pub outline: Vec<Point<Floor>>,
}

pub struct World<'a> {
    pub objects: &'a [Object],
    pub pose: Pose<Floor>,
    pub noise: Option<Pcg64Mcg>,
}

impl World<'_> {
    /// Returns a factor of 1 with an error of up to 1 %.
    fn one(&mut self) -> f64 {
        self.noise.as_mut().map_or(1.0, |noise| 1.0 + 0.01 * (2.0 * noise.random::<f64>() - 1.0))
    }

    /// Returns the ranges of 16 sonars on the robot's rim, the first one in front.
    pub fn ranges(&mut self) -> [f64; 16] {
        std::array::from_fn(|i| {
            let axis = self.pose.yaw_rad + i as f64 * FRAC_PI_8;
            let (sin, cos) = axis.sin_cos();
            let eye = Point::new(self.pose.x + ROBOT_RADIUS_M * cos, self.pose.y + ROBOT_RADIUS_M * sin);
            let edges = self.objects.iter().flat_map(|object| plane::edges(&object.outline));
            let nearest = edges.filter_map(|edge| in_cone(eye, axis, edge)).fold(f64::INFINITY, f64::min);
            if nearest < RANGE_MAX_M { (nearest * self.one()).max(RANGE_MIN_M) } else { RANGE_MAX_M }
        })
    }

    /// Drives for some time, and stops if the robot meets an object. Returns the distance and the angle, with the errors of
    /// odometry.
    pub fn drive(&mut self, drive: Drive, time_s: f64) -> [f64; 2] {
        let turned = drive.yaw_rate_radps * time_s * self.one();
        let moved = drive.speed_mps * time_s * self.one();
        let (sin, cos) = (self.pose.yaw_rad + turned / 2.0).sin_cos();
        let next = Point::new(self.pose.x + moved * cos, self.pose.y + moved * sin);
        self.pose.yaw_rad += turned;
        let here = self.clearance(self.pose.position());
        let is_free = self.clearance(next) > ROBOT_RADIUS_M || self.clearance(next) > here;
        if is_free {
            (self.pose.x, self.pose.y) = (next.x, next.y);
        }
        [if is_free { moved * self.one() } else { 0.0 }, turned * self.one()]
    }

    fn clearance(&self, at: Point<Floor>) -> f64 {
        let distances = self.objects.iter().map(|object| plane::distance_to_outline(at, &object.outline));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Returns the object nearest to the robot, and its distance from the robot's rim.
    pub fn nearest(&self) -> (&'static str, f64) {
        let distances = self
            .objects
            .iter()
            .map(|object| (object.name, plane::distance_to_outline(self.pose.position(), &object.outline)));
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        (nearest.0, nearest.1 - ROBOT_RADIUS_M)
    }
}

/// Returns the distance to the nearest point of a segment within a cone, or `None` if the segment is outside.
fn in_cone(eye: Point<Floor>, axis_rad: f64, segment: [Point<Floor>; 2]) -> Option<f64> {
    // Coordinates along and across the axis.
    let (sin, cos) = axis_rad.sin_cos();
    let [mut a, mut b] = segment.map(|at| {
        let [x, y] = [at.x - eye.x, at.y - eye.y];
        Point::<Base>::new(x * cos + y * sin, y * cos - x * sin)
    });
    // The cone is the intersection of two half-planes: across ≤ along · tan and −across ≤ along · tan.
    let slope = (CONE_RAD / 2.0).tan();
    for side in [1.0, -1.0] {
        let inside = |at: Point<Base>| at.x * slope - side * at.y;
        let (of_a, of_b) = (inside(a), inside(b));
        if of_a < 0.0 && of_b < 0.0 {
            return None;
        }
        let at = a.towards(&b, of_a / (of_a - of_b));
        if of_a < 0.0 {
            a = at;
        } else if of_b < 0.0 {
            b = at;
        }
    }
    Some(plane::distance_to_segment(Point::new(0.0, 0.0), [a, b]))
}

#[test]
fn a_sonar_sees_the_nearest_point_in_its_cone() {
    let outline = [[2.0, -9.0], [3.0, -9.0], [3.0, 9.0], [2.0, 9.0]].map(Point::from).into();
    let wall = [Object { name: "wall", outline }];
    let mut world = World { objects: &wall, pose: Pose::new(0.0, 0.0, 0.0), noise: None };
    let ranges = world.ranges();
    assert!((ranges[0] - (2.0 - ROBOT_RADIUS_M)).abs() < 1e-12);
    // The next sonar sees the wall at 22.5° − 12.5° from its position on the rim.
    let (sin, cos) = FRAC_PI_8.sin_cos();
    let expected = (2.0 - ROBOT_RADIUS_M * cos) / 10_f64.to_radians().cos();
    assert!((ranges[1] - expected).abs() < 1e-12, "{} {expected} {sin}", ranges[1]);
    assert_eq!(ranges[8], RANGE_MAX_M);
}
