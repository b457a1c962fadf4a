//! Landmarks counted along the direction of travel, such as "the second door on the left". The paper has no counterpart of this.
//!
//! A navigator counts what it sees from where it stands. The *direction of travel* leads from the landmark where the last entry began
//! to the one where this entry begins, and is rounded to the nearest axis of the map: east, north, west or south. At the start, it
//! is east, which is where the map's x axis points.
//!
//! The left comprises all landmarks at up to 120° to the left of that direction, and the right is its mirror image. *Ahead* is what
//! lies within 60° on either side, and *behind* is everything else. On each side, the nearest landmark is the first.

use std::f64::consts::FRAC_PI_3;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::description::MOST_CANDIDATES;
use crate::geometry::Point;
use crate::sight::bearing_rad;

/// Where a counted landmark lies, as seen by a navigator that looks in its direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Side {
    /// At up to 120° to the left.
    Left,
    /// At up to 120° to the right.
    Right,
    /// At up to 60° to the left or the right.
    Ahead,
    /// At more than 120° to the left or the right.
    Behind,
}

impl Side {
    /// All sides.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Ahead, Self::Behind];
}

/// Maximum number of an ordinal.
pub const MOST_COUNTED: u8 = 9;

/// Number of a landmark on its side, from 1 to [`MOST_COUNTED`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Ordinal(u8);

impl Ordinal {
    /// The first landmark on a side.
    pub const FIRST: Self = Self(1);

    /// Returns the ordinal of a number, or `None` unless that is 1 to [`MOST_COUNTED`].
    pub const fn of(number: u8) -> Option<Self> {
        match number {
            1..=MOST_COUNTED => Some(Self(number)),
            _ => None,
        }
    }

    /// Iterates over all ordinals.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        (1..=MOST_COUNTED).map(Self)
    }

    /// Returns the position in a list, from 0.
    pub const fn index(self) -> usize {
        self.0 as usize - 1
    }
}

impl TryFrom<u8> for Ordinal {
    type Error = &'static str;
    fn try_from(number: u8) -> Result<Self, Self::Error> {
        Self::of(number).ok_or("expected an ordinal from 1 to 9")
    }
}

impl From<Ordinal> for u8 {
    fn from(ordinal: Ordinal) -> Self {
        ordinal.0
    }
}

/// A direction of travel, along an axis of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Course {
    /// Towards the east, along the x axis.
    #[default]
    East,
    /// Towards the north, along the y axis.
    North,
    /// Towards the west.
    West,
    /// Towards the south.
    South,
}

impl Course {
    /// Returns the direction of travel of a way: the axis closest to it.
    pub fn of(way: Point) -> Self {
        match way {
            Point { x, y } if x.abs() >= y.abs() && x >= 0.0 => Self::East,
            Point { x, y } if x.abs() >= y.abs() => Self::West,
            Point { y, .. } if y > 0.0 => Self::North,
            _ => Self::South,
        }
    }

    /// Returns the vector of length 1 in this direction.
    const fn along(self) -> Point {
        match self {
            Self::East => Point::new(1.0, 0.0),
            Self::North => Point::new(0.0, 1.0),
            Self::West => Point::new(-1.0, 0.0),
            Self::South => Point::new(0.0, -1.0),
        }
    }

    /// Returns the smallest angle between a way and a direction in which the course would be another, in radians. A way that is
    /// diagonal belongs to two courses.
    pub fn clearness_rad(self, way: Point) -> f64 {
        std::f64::consts::FRAC_PI_4 - bearing_rad(self.along(), way).abs()
    }

    /// Returns the index of the landmark with this ordinal on a side, or `None` if there are fewer. Positions are relative to the
    /// navigator. In a view of more than [`MOST_CANDIDATES`] landmarks, none is counted.
    pub fn pick(self, side: Side, ordinal: Ordinal, places: &[Point]) -> Option<usize> {
        if places.len() > MOST_CANDIDATES {
            return None;
        }
        let on_side = places.iter().enumerate().filter(|(_, place)| self.has(side, **place));
        let mut counted: ArrayVec<(f64, usize), MOST_CANDIDATES> =
            on_side.map(|(index, place)| (place.norm_squared(), index)).collect();
        counted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        counted.get(ordinal.index()).map(|(_, index)| *index)
    }

    /// Returns true if a landmark at this position lies on a side.
    pub fn has(self, side: Side, place: Point) -> bool {
        let left_rad = bearing_rad(self.along(), place);
        match side {
            Side::Left => (0.0..=2.0 * FRAC_PI_3).contains(&left_rad),
            Side::Right => (-2.0 * FRAC_PI_3..=0.0).contains(&left_rad),
            Side::Ahead => left_rad.abs() <= FRAC_PI_3,
            Side::Behind => left_rad.abs() > 2.0 * FRAC_PI_3,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::config;

    fn ordinal(number: u8) -> Ordinal {
        Ordinal::of(number).unwrap()
    }

    /// A corridor to the east with three doors on its left, two on its right, and another door on the left that the robot has passed.
    const DOORS: [(f64, f64); 6] =
        [(2.0, 1.0), (-4.0, 1.0), (8.0, 1.2), (5.0, 0.9), (3.0, -1.5), (-0.5, -1.5)];

    fn doors() -> Vec<Point> {
        DOORS.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    #[test]
    fn doors_along_a_corridor_are_counted_on_either_side() {
        let picked = |side, number| Course::East.pick(side, ordinal(number), &doors());
        assert_eq!([1, 2, 3, 4].map(|number| picked(Side::Left, number)), [Some(0), Some(3), Some(2), None]);
        // The first door on the right is abreast of the robot.
        assert_eq!([1, 2, 3].map(|number| picked(Side::Right, number)), [Some(5), Some(4), None]);
        assert_eq!([1, 2].map(|number| picked(Side::Ahead, number)), [Some(0), Some(4)]);
        assert_eq!([1, 2].map(|number| picked(Side::Behind, number)), [Some(1), None]);
    }

    #[test]
    fn who_comes_back_has_the_same_doors_on_the_other_side() {
        let picked = |side, number| Course::West.pick(side, ordinal(number), &doors());
        assert_eq!([1, 2].map(|number| picked(Side::Right, number)), [Some(1), None]);
        assert_eq!([1, 2].map(|number| picked(Side::Left, number)), [Some(5), None]);
        assert_eq!(
            [1, 2].map(|number| picked(Side::Behind, number)),
            [Some(0), Some(4)],
            "the nearest one first"
        );
    }

    #[test]
    fn a_course_is_the_axis_closest_to_the_way() {
        let ways = [(3.0, 1.0), (1.0, 3.0), (-3.0, -1.0), (1.0, -3.0)].map(|(x, y)| Point::new(x, y));
        let courses = [Course::East, Course::North, Course::West, Course::South];
        assert_eq!(ways.map(Course::of), courses);
        for (way, course) in ways.into_iter().zip(courses) {
            let clear = course.clearness_rad(way);
            assert!((clear - (45_f64.to_radians() - (1.0_f64 / 3.0).atan())).abs() < 1e-9, "{clear}");
        }
        assert!(Course::East.clearness_rad(Point::new(1.0, 3.0)) < 0.0);
    }

    #[test]
    fn ordinals_go_from_first_to_ninth() {
        assert_eq!([0, 10].map(Ordinal::of), [None; 2]);
        assert!(postcard::from_bytes::<Ordinal>(&[0]).is_err());
        let stored = postcard::to_allocvec(&ordinal(9)).unwrap();
        assert_eq!(postcard::from_bytes(&stored), Ok(ordinal(9)));
    }

    proptest! {
        #![proptest_config(config(256))]

        /// Whatever there is to see, no landmark has two ordinals on a side, and none is left out of all sides.
        #[test]
        fn every_landmark_is_counted_once_on_its_side(
            places in prop::collection::vec((-8.0..8.0_f64, -8.0..8.0_f64), 0..9),
            course in prop_oneof![Just(Course::East), Just(Course::North), Just(Course::West), Just(Course::South)],
        ) {
            let places: Vec<_> = places.into_iter().map(|(x, y)| Point::new(x, y)).collect();
            let on = |side| -> Vec<usize> {
                Ordinal::all().map_while(|number| course.pick(side, number, &places)).collect()
            };
            let (mut all, ahead) = ([on(Side::Left), on(Side::Right), on(Side::Behind)].concat(), on(Side::Ahead));
            all.sort_unstable();
            prop_assert_eq!(&all, &(0..places.len()).collect::<Vec<_>>());
            prop_assert!(ahead.iter().all(|index| !on(Side::Behind).contains(index)));
        }
    }
}
