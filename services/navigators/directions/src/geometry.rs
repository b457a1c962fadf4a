//! Points, the view window and its four corners.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use std::ops::{Add, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// A point or a displacement, in the plane's unit. x points east, y north.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point {
    /// The coordinate towards the east.
    pub x: f64,
    /// The coordinate towards the north.
    pub y: f64,
}

impl Point {
    /// Returns the point (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Returns the inner product with another vector.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Returns the square of the length.
    pub fn norm_squared(self) -> f64 {
        self.dot(self)
    }

    /// Returns the length.
    pub fn norm(self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// Returns the vector turned to the left by an angle in radians.
    pub fn turned(self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self::new(self.x * cos - self.y * sin, self.x * sin + self.y * cos)
    }

    /// Returns the vector scaled to length 1, or `None` if its length is 0.
    pub fn direction(self) -> Option<Self> {
        let norm = self.norm();
        (norm > 0.0).then(|| self * (1.0 / norm))
    }
}

impl Add for Point {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl Sub for Point {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl Neg for Point {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y)
    }
}

impl Mul<f64> for Point {
    type Output = Self;
    fn mul(self, by: f64) -> Self {
        Self::new(self.x * by, self.y * by)
    }
}

/// A corner of the view window.
///
/// A corner also names a *quadrant* of a landmark: the area that the window covers while the landmark lies in that corner (Park
/// and Kender 1995, 6.3.1). The quadrant `Se` is therefore the area north-west of the landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Corner {
    /// South-east.
    Se,
    /// South-west.
    Sw,
    /// North-east.
    Ne,
    /// North-west.
    Nw,
}

impl Corner {
    /// All corners, in the order used by the paper's signatures.
    pub const ALL: [Self; 4] = [Self::Se, Self::Sw, Self::Ne, Self::Nw];

    /// All corners in the order in which a navigator looks around, so that each is next to the one before.
    pub const ROUND: [Self; 4] = [Self::Se, Self::Sw, Self::Nw, Self::Ne];

    /// Returns the direction from the corner into the window, given by the signs of x and y.
    pub const fn inward(self) -> Point {
        match self {
            Self::Se => Point::new(-1.0, 1.0),
            Self::Sw => Point::new(1.0, 1.0),
            Self::Ne => Point::new(-1.0, -1.0),
            Self::Nw => Point::new(1.0, -1.0),
        }
    }

    /// Returns true if two corners are the ends of one side of the window.
    pub fn is_next_to(self, other: Self) -> bool {
        self.inward().dot(other.inward()) == 0.0
    }

    /// Returns true if a quadrant with the given side covers a point, given relative to the landmark. The edges belong to the
    /// quadrant.
    pub fn covers(self, relative: Point, side: f64) -> bool {
        self.nearly_covers(relative, side, 0.0)
    }

    /// Like [`Corner::covers`], but with each edge of the quadrant moved outwards by `slack`.
    pub fn nearly_covers(self, relative: Point, side: f64, slack: f64) -> bool {
        let inward = self.inward();
        let (along_x, along_y) = (relative.x * inward.x, relative.y * inward.y);
        let range = -slack..=side + slack;
        range.contains(&along_x) && range.contains(&along_y)
    }

    /// Returns the name of the corner as it is written in custom maps.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Se => "SE",
            Self::Sw => "SW",
            Self::Ne => "NE",
            Self::Nw => "NW",
        }
    }
}

/// The square view window.
///
/// Descriptions count the dots within `side` of a landmark in its corner. The camera sees `margin` more on each side, so a landmark
/// in a corner stays visible although the helicopter is never exactly at its intended position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// The side of the square, in the plane's unit.
    pub side: f64,
    /// Distance that the camera sees beyond each edge of the square, in the plane's unit.
    pub margin: f64,
    /// Set for a robot on land, which has a panorama instead of a camera that looks down.
    pub land: Option<Land>,
}

/// The size of landmarks, and the distances at which a robot on land sees and passes them (Park and Kender 1995, 8). All
/// lengths are in the plane's unit.
///
/// All landmarks are identical upright cylinders. The robot sees them in all directions up to its range, unless others hide them. A
/// landmark is *in a corner* when the robot stands beside it, on the side of the quadrant that it looks into.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Land {
    /// Radius of a landmark.
    pub radius: f64,
    /// Maximum distance at which the robot sees a landmark.
    pub range: f64,
    /// Distance between the centres of the robot and of a landmark that it stands beside.
    pub stand_off: f64,
    /// Minimum distance between the centres of the robot and of every landmark.
    pub clearance: f64,
}

impl Window {
    /// Creates a window. Returns [`Error::Parameter`] unless the side is above 0 and the margin is at least 0.
    pub fn new(side: f64, margin: f64) -> Result<Self, Error> {
        let is_length = |value: f64| value.is_finite() && value <= crate::plane::LIMIT;
        if !is_length(side) || side <= 0.0 {
            return Err(Error::Parameter { what: "window side", expected: "a length above 0", found: side });
        }
        if !is_length(margin) || margin < 0.0 {
            return Err(Error::Parameter {
                what: "window margin",
                expected: "a length from 0",
                found: margin,
            });
        }
        Ok(Self { side, margin, land: None })
    }

    /// Creates the window of a robot on land. Its side is the distance along the edges of a quadrant that the robot sees from
    /// beside a landmark. The part of the quadrant beyond its range remains out of sight ([`crate::sight`]).
    pub fn on_land(land: Land) -> Result<Self, Error> {
        let Land { radius, range, stand_off, clearance } = land;
        for (what, expected, found, is_right) in [
            ("radius of a landmark", "a length above 0", radius, radius > 0.0),
            ("clearance", "more than the radius of a landmark", clearance, clearance > radius),
            ("stand-off", "more than the clearance", stand_off, stand_off > clearance),
            ("range", "more than twice the stand-off", range, range > 2.0 * stand_off),
        ] {
            if !is_right {
                return Err(Error::Parameter { what, expected, found });
            }
        }
        let beside = stand_off * FRAC_1_SQRT_2;
        let side = beside + (range * range - beside * beside).sqrt();
        Ok(Self { land: Some(land), ..Self::new(side, stand_off)? })
    }

    /// Returns the displacement from a landmark to the centre of the window that has it in a corner.
    pub fn centre_from(self, corner: Corner) -> Point {
        match self.land {
            None => corner.inward() * (self.side / 2.0),
            Some(land) => corner.inward() * (land.stand_off * FRAC_1_SQRT_2),
        }
    }

    /// Returns the displacement from the window's centre to its position over a landmark or, on land, beside it.
    pub fn over(self, place: Point) -> Point {
        let stand_off = self.land.map_or(0.0, |land| land.stand_off);
        place.direction().map_or(place, |towards| place - towards * stand_off)
    }

    /// Returns true if the window proper shows a point, given relative to its centre.
    pub fn shows(self, relative: Point) -> bool {
        let half = self.side / 2.0;
        relative.x.abs() <= half && relative.y.abs() <= half
    }

    /// Returns true if the camera sees a point, given relative to the window's centre.
    pub fn camera_sees(self, relative: Point) -> bool {
        if let Some(land) = self.land {
            return relative.norm() <= land.range;
        }
        let half = self.side / 2.0 + self.margin;
        relative.x.abs() <= half && relative.y.abs() <= half
    }

    /// Returns the maximum distance from its centre at which the camera sees anything.
    pub fn reach(self) -> f64 {
        self.land.map_or((self.side / 2.0 + self.margin) * SQRT_2, |land| land.range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadrant_is_named_by_the_corner_where_the_landmark_lies() {
        let north_west = Point::new(-3.0, 4.0);
        let holds = Corner::ALL.map(|corner| corner.covers(north_west, 10.0));
        assert_eq!(holds, [true, false, false, false]);
        assert_eq!(Window::new(10.0, 0.0).unwrap().centre_from(Corner::Se), Point::new(-5.0, 5.0));
    }

    #[test]
    fn a_point_on_an_axis_lies_in_two_quadrants() {
        let east = Point::new(10.0, 0.0);
        let holds = Corner::ALL.map(|corner| corner.covers(east, 10.0));
        assert_eq!(holds, [false, true, false, true]);
    }

    #[test]
    fn on_land_the_robot_sees_a_quadrant_from_beside_its_landmark() {
        let land = Land { radius: 0.15, range: 8.0, stand_off: 0.9, clearance: 0.5 };
        let window = Window::on_land(land).unwrap();
        for corner in Corner::ALL {
            let centre = window.centre_from(corner);
            assert!(
                (centre.norm() - 0.9).abs() < 1e-9 && corner.covers(centre, 1.0),
                "beside it, in the quadrant"
            );
            let Point { x, y } = corner.inward();
            for along in [Point::new(x, 0.0), Point::new(0.0, y)] {
                let end = along * window.side - centre;
                assert!((end.norm() - land.range).abs() < 1e-9, "as far as it sees along the edges");
            }
            let corner_end = corner.inward() * (0.75 * window.side) - centre;
            assert!(!window.camera_sees(corner_end), "the far corner of the square is out of sight");
        }
        assert!((window.over(Point::new(0.0, 3.0)).y - 2.1).abs() < 1e-9);
        for wrong in [
            Land { radius: 0.0, ..land },
            Land { clearance: 0.1, ..land },
            Land { stand_off: 0.5, ..land },
            Land { range: 1.0, ..land },
        ] {
            assert!(matches!(Window::on_land(wrong), Err(Error::Parameter { .. })), "{wrong:?}");
        }
    }

    #[test]
    fn a_window_without_extent_is_rejected() {
        assert!(Window::new(0.0, 1.0).is_err());
        assert!(Window::new(f64::NAN, 1.0).is_err());
        assert!(Window::new(10.0, -1.0).is_err());
    }
}
