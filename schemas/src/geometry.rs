//! Planar geometry with frames checked at compile time.
//!
//! The type of a [`Point`] or a [`Pose`] includes the frame in which it is expressed. [`World`], [`Odom`] and
//! [`Base`] are in metres, and [`Sketch`] is in pixels. Nothing here converts metres to pixels, because only
//! the local scale of a pose estimate relates the two.

use std::f64::consts::PI;
use std::marker::PhantomData;

use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};

/// The frame of the building, in metres, with x to the right and y up. Known only to the simulator and the
/// judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct World;
/// The odometry frame, in metres. The robot tracks its pose in this frame with its wheel encoders, and the frame drifts relative to
/// [`World`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Odom;
/// The frame of the robot, in metres, with x forward and y to the left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Base;
/// The frame of the drawing, in pixels. The origin is the lower left corner of the lower left pixel, x points
/// right and y **up**.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sketch;

/// A position in frame `F`. Serialised as a pair, `[x, y]`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "", from = "[f64; 2]", into = "[f64; 2]")]
pub struct Point<F> {
    /// First coordinate, in the frame's unit.
    pub x: f64,
    /// Second coordinate, in the frame's unit.
    pub y: f64,
    frame: PhantomData<F>,
}

impl<F> Point<F> {
    /// Creates the position (x, y), in the frame's unit.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y, frame: PhantomData }
    }

    /// Returns the straight-line distance to `other`, in the frame's unit.
    pub fn distance(&self, other: &Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// Returns the direction of `other`, in radians counter-clockwise from the frame's x axis.
    pub fn direction_rad(&self, other: &Self) -> f64 {
        (other.y - self.y).atan2(other.x - self.x)
    }

    /// Interpolates linearly between `self`, at `part` 0, and `other`, at `part` 1.
    pub fn towards(&self, other: &Self, part: f64) -> Self {
        Self::new(self.x + (other.x - self.x) * part, self.y + (other.y - self.y) * part)
    }

    /// Returns the position as a vector from the frame's origin.
    pub fn coords(&self) -> Vector2<f64> {
        Vector2::new(self.x, self.y)
    }
}

// A derive would also require the frame to be `Clone` and `Copy`.
impl<F> Clone for Point<F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<F> Copy for Point<F> {}

impl<F> From<Vector2<f64>> for Point<F> {
    fn from(v: Vector2<f64>) -> Self {
        Self::new(v.x, v.y)
    }
}

impl<F> From<[f64; 2]> for Point<F> {
    fn from([x, y]: [f64; 2]) -> Self {
        Self::new(x, y)
    }
}

impl<F> From<Point<F>> for [f64; 2] {
    fn from(at: Point<F>) -> Self {
        [at.x, at.y]
    }
}

/// Returns true if a closed polygon contains a point of the same frame, by the even-odd rule.
pub fn encloses<P: Copy + Into<[f64; 2]>>(polygon: &[P], at: P) -> bool {
    let [x, y] = at.into();
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let edges = edges.map(|(a, b)| ((*a).into(), (*b).into()));
    let crossed = edges.filter(|(a, b): &([f64; 2], [f64; 2])| {
        (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]
    });
    crossed.count() % 2 == 1
}

/// A position and a heading in frame `F`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Pose<F> {
    /// First coordinate, in the frame's unit.
    pub x: f64,
    /// Second coordinate, in the frame's unit.
    pub y: f64,
    /// Heading, in radians counter-clockwise from the frame's x axis.
    pub yaw_rad: f64,
    frame: PhantomData<F>,
}

impl<F> Pose<F> {
    /// Creates the pose (x, y, yaw), with x and y in the frame's unit and yaw in radians.
    pub const fn new(x: f64, y: f64, yaw_rad: f64) -> Self {
        Self { x, y, yaw_rad, frame: PhantomData }
    }

    /// Returns the position of the pose.
    pub const fn position(&self) -> Point<F> {
        Point::new(self.x, self.y)
    }

    /// Returns `self ⊕ step`: the pose after `step`, a motion expressed in the axes of `self`.
    pub fn compose<G>(&self, step: &Pose<G>) -> Pose<F> {
        let moved = Rotation2::new(self.yaw_rad) * Vector2::new(step.x, step.y);
        Pose::new(self.x + moved.x, self.y + moved.y, wrap_angle(self.yaw_rad + step.yaw_rad))
    }

    /// Returns `⊖ self ⊕ other`: the motion that leads to `other`, expressed in the axes of `self`.
    pub fn motion_to(&self, other: &Pose<F>) -> Pose<Base> {
        let moved = Rotation2::new(-self.yaw_rad) * Vector2::new(other.x - self.x, other.y - self.y);
        Pose::new(moved.x, moved.y, wrap_angle(other.yaw_rad - self.yaw_rad))
    }
}

/// Returns the equivalent angle in (−π, π].
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let wrapped = angle_rad - 2.0 * PI * ((angle_rad + PI) / (2.0 * PI)).floor();
    if wrapped <= -PI { wrapped + 2.0 * PI } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_encloses_by_the_even_odd_rule() {
        let hook = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, 4.0], [3.0, 1.0], [0.0, 1.0]];
        assert!(encloses(&hook, [1.0, 0.5]) && encloses(&hook, [3.5, 3.5]));
        assert!(!encloses(&hook, [1.0, 2.0]) && !encloses(&hook, [5.0, 0.5]) && !encloses(&[], [0.0, 0.0]));
        assert!(encloses(&hook.map(Point::<World>::from), Point::new(1.0, 0.5)));
    }

    #[test]
    fn a_point_is_serialized_as_a_pair() {
        let at = Point::<Sketch>::new(1.5, -2.0);
        let text = serde_json::to_string(&at).unwrap();
        assert_eq!(text, "[1.5,-2.0]");
        assert_eq!(serde_json::from_str::<Point<Sketch>>(&text).unwrap(), at);
    }

    #[test]
    fn the_midpoint_lies_in_the_direction_of_the_target() {
        let (from, to) = (Point::<World>::new(1.0, 1.0), Point::new(3.0, 3.0));
        assert_eq!(from.towards(&to, 0.5), Point::new(2.0, 2.0));
        assert!((from.direction_rad(&to) - PI / 4.0).abs() < 1e-12);
    }

    #[test]
    fn motion_undoes_compose() {
        let start = Pose::<World>::new(1.0, -2.0, 2.5);
        let step = Pose::<Base>::new(0.3, -0.1, 1.4);
        let back = start.motion_to(&start.compose(&step));
        assert!((back.x - step.x).abs() < 1e-12 && (back.y - step.y).abs() < 1e-12);
        assert!((back.yaw_rad - step.yaw_rad).abs() < 1e-12);
    }

    #[test]
    fn angles_wrap_into_the_half_open_interval() {
        for (angle, wrapped) in [(PI, PI), (-PI, PI), (3.0 * PI, PI), (0.5, 0.5), (-7.0, -7.0 + 2.0 * PI)] {
            assert!((wrap_angle(angle) - wrapped).abs() < 1e-12, "{angle}");
        }
    }
}
