//! Cardinal directions between points (Frank 1991): eight cones of 45°, or the same position. In QSRlib this is
//! `cardir`.
//!
//! North is along the second axis, east along the first. The cones around the axes (n, e, s, w) are open and those between
//! them are closed, so that converse and mirror image also hold at the borders. QSRlib's cones are half open instead.

use std::f64::consts::SQRT_2;

use crate::algebra::{Compose, Converse, Relation, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::geometry::{Point, Rect};

words! {
    /// The direction of a as seen from b.
    Direction, "cardir", limits = Direction::reaches, {
        /// North: along the second axis.
        N = "n",
        /// North-east.
        Ne = "ne",
        /// East: along the first axis.
        E = "e",
        /// South-east.
        Se = "se",
        /// South.
        S = "s",
        /// South-west.
        Sw = "sw",
        /// West.
        W = "w",
        /// North-west.
        Nw = "nw",
        /// The same position.
        Eq = "eq",
    }
}

/// tan 22.5°, the slope of a border between cones.
const TAN_BORDER: f64 = SQRT_2 - 1.0;
const CONES: usize = 8;

impl Direction {
    /// Returns the direction of point a as seen from point b.
    pub fn of(a: Point, b: Point) -> Self {
        let away = a - b;
        let (x, y) = (away.x.abs(), away.y.abs());
        let (east, north) = (away.x > 0.0, away.y > 0.0);
        if x == 0.0 && y == 0.0 {
            Self::Eq
        } else if x < y * TAN_BORDER {
            if north { Self::N } else { Self::S }
        } else if y < x * TAN_BORDER {
            if east { Self::E } else { Self::W }
        } else {
            match (north, east) {
                (true, true) => Self::Ne,
                (false, true) => Self::Se,
                (false, false) => Self::Sw,
                (true, false) => Self::Nw,
            }
        }
    }

    /// Returns the direction between the centres of two rectangles, as in QSRlib.
    pub fn of_centres(a: Rect, b: Rect) -> Self {
        Self::of(a.centre(), b.centre())
    }

    fn cone(self) -> Option<usize> {
        (self != Self::Eq).then(|| self.index())
    }

    fn from_cone(cone: usize) -> Self {
        Self::ALL[cone % CONES]
    }

    fn reaches(self, instant: Self) -> bool {
        match (self.cone(), instant.cone()) {
            (Some(open), Some(closed)) => open % 2 == 0 && matches!((closed + CONES - open) % CONES, 1 | 7),
            (Some(_), None) => true,
            _ => false,
        }
    }

    /// Returns the direction in a mirror image that swaps east and west.
    #[must_use]
    pub fn mirrored(self) -> Self {
        self.cone().map_or(Self::Eq, |cone| Self::from_cone(CONES - cone))
    }
}

impl Converse for Direction {
    fn converse(self) -> Self {
        self.cone().map_or(Self::Eq, |cone| Self::from_cone(cone + CONES / 2))
    }
}

impl Compose for Direction {
    /// Returns the cones that the sum of a vector from each cone may lie in. The sum lies between the two on the shorter way
    /// round, or anywhere if the cones are opposite. (Frank 1991 gives the part that holds for vectors of about the same
    /// length.)
    fn compose(self, next: Self) -> RelationSet<Self> {
        let (Some(a), Some(b)) = (self.cone(), next.cone()) else {
            return if self == Self::Eq { next.into() } else { self.into() };
        };
        let (first, steps) = match (b + CONES - a) % CONES {
            4 => return RelationSet::universal(),
            ahead @ 0..4 => (a, ahead),
            ahead => (b, CONES - ahead),
        };
        (first..=first + steps).map(Self::from_cone).collect()
    }
}

/// [`Direction`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Directions;

impl Calculus for Directions {
    type Scene = [Point; 2];
    type Relation = Direction;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Direction> {
        Some(Direction::of(*a, *b))
    }
}
