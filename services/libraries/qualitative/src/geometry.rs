//! Points, oriented points and rectangles. Values are checked on construction, so calculi only ever see finite values and
//! regions with an extent.
//!
//! Lengths are in a unit of the caller's choice, which must be the same for all arguments. The axes x and y are
//! right-handed.

use std::ops::Sub;

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// The largest accepted coordinate. Products of differences of coordinates up to this limit are finite.
pub const MAX_COORDINATE: f64 = 1e150;

/// Checks that a coordinate is small enough to compute with.
fn coordinate(what: &'static str, found: f64) -> Result<f64, Error> {
    let is_valid = found.abs() <= MAX_COORDINATE;
    if is_valid { Ok(found) } else { Err(Error::Coordinate { what, limit: MAX_COORDINATE, found }) }
}

/// A point in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 2]", into = "[f64; 2]")]
pub struct Point {
    x: f64,
    y: f64,
}

impl Point {
    /// Creates a point.
    ///
    /// # Errors
    /// [`Error::Coordinate`] if a coordinate is not finite or exceeds [`MAX_COORDINATE`].
    pub fn new(x: f64, y: f64) -> Result<Self, Error> {
        Ok(Self { x: coordinate("x", x)?, y: coordinate("y", y)? })
    }

    /// Returns the first coordinate.
    pub const fn x(self) -> f64 {
        self.x
    }

    /// Returns the second coordinate.
    pub const fn y(self) -> f64 {
        self.y
    }

    /// Returns the distance to another point.
    pub fn distance(self, other: Self) -> f64 {
        (other - self).length()
    }
}

impl TryFrom<[f64; 2]> for Point {
    type Error = Error;

    fn try_from([x, y]: [f64; 2]) -> Result<Self, Error> {
        Self::new(x, y)
    }
}

impl From<Point> for [f64; 2] {
    fn from(point: Point) -> Self {
        [point.x, point.y]
    }
}

impl Sub for Point {
    type Output = Vector;

    fn sub(self, from: Self) -> Vector {
        Vector { x: self.x - from.x, y: self.y - from.y }
    }
}

/// The difference of two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector {
    /// Component along the first axis.
    pub x: f64,
    /// Component along the second axis.
    pub y: f64,
}

impl Vector {
    /// Returns the scalar product of two vectors.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Returns the third component of the cross product. It is positive if `other` points to the left of `self`.
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Returns the length of the vector.
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }
}

/// A point with a heading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Oriented {
    position: Point,
    heading_rad: f64,
}

impl Oriented {
    /// Creates an oriented point. The heading is in radians, counter-clockwise from the first axis.
    ///
    /// # Errors
    /// [`Error::Coordinate`] if the heading is not finite or exceeds [`MAX_COORDINATE`].
    pub fn new(position: Point, heading_rad: f64) -> Result<Self, Error> {
        Ok(Self { position, heading_rad: coordinate("heading_rad", heading_rad)? })
    }

    /// Returns the later of two positions with the direction of motion as its heading, or `None` if the positions are equal.
    pub fn from_motion(before: Point, now: Point) -> Option<Self> {
        let moved = now - before;
        (moved.length() > 0.0).then(|| Self { position: now, heading_rad: moved.y.atan2(moved.x) })
    }

    /// Returns the position.
    pub const fn position(self) -> Point {
        self.position
    }

    /// Returns the heading, in radians.
    pub const fn heading_rad(self) -> f64 {
        self.heading_rad
    }

    /// Returns the unit vector in the direction of the heading.
    pub fn direction(self) -> Vector {
        let (y, x) = self.heading_rad.sin_cos();
        Vector { x, y }
    }
}

/// An interval with a length above 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 2]", into = "[f64; 2]")]
pub struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    /// Creates an interval.
    ///
    /// # Errors
    /// [`Error::Coordinate`] if an end is not finite or exceeds [`MAX_COORDINATE`]; [`Error::Extent`] if `high` is not above
    /// `low`.
    pub fn new(low: f64, high: f64) -> Result<Self, Error> {
        Self::named("interval", low, high)
    }

    fn named(what: &'static str, low: f64, high: f64) -> Result<Self, Error> {
        let (low, high) = (coordinate(what, low)?, coordinate(what, high)?);
        if high > low { Ok(Self { low, high }) } else { Err(Error::Extent { what, found: high - low }) }
    }

    /// Returns the lower end.
    pub const fn low(self) -> f64 {
        self.low
    }

    /// Returns the upper end.
    pub const fn high(self) -> f64 {
        self.high
    }
}

impl TryFrom<[f64; 2]> for Interval {
    type Error = Error;

    fn try_from([low, high]: [f64; 2]) -> Result<Self, Error> {
        Self::new(low, high)
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.low, interval.high]
    }
}

/// A rectangle with sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rect {
    x: Interval,
    y: Interval,
}

impl Rect {
    /// Creates a rectangle from two opposite corners.
    ///
    /// # Errors
    /// [`Error::Coordinate`] if a coordinate is not finite or exceeds [`MAX_COORDINATE`]; [`Error::Extent`] if `high` is not
    /// above `low` in both coordinates.
    pub fn new(low: [f64; 2], high: [f64; 2]) -> Result<Self, Error> {
        let [x, y] =
            [Interval::named("width", low[0], high[0])?, Interval::named("height", low[1], high[1])?];
        Ok(Self { x, y })
    }

    /// Creates a rectangle around a centre.
    ///
    /// # Errors
    /// Any error of [`Self::new`].
    pub fn around(centre: Point, width: f64, height: f64) -> Result<Self, Error> {
        let [x, y] = [width / 2.0, height / 2.0];
        Self::new([centre.x - x, centre.y - y], [centre.x + x, centre.y + y])
    }

    /// Returns the projection of the rectangle on the first axis.
    pub const fn x(self) -> Interval {
        self.x
    }

    /// Returns the projection of the rectangle on the second axis.
    pub const fn y(self) -> Interval {
        self.y
    }

    /// Returns the centre of the rectangle.
    pub fn centre(self) -> Point {
        Point { x: (self.x.low + self.x.high) / 2.0, y: (self.y.low + self.y.high) / 2.0 }
    }
}

/// Checks that a tolerance or threshold is finite and not below 0.
pub(crate) fn not_negative(what: &'static str, found: f64) -> Result<f64, Error> {
    let is_valid = (0.0..=MAX_COORDINATE).contains(&found);
    if is_valid {
        Ok(found)
    } else {
        Err(Error::Parameter { what, expected: "a finite number from 0", found })
    }
}
