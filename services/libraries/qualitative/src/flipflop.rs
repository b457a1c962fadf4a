//! The flip-flop calculus (Ligozat 1993) as refined by Scivos and Nebel 2004 (LR), which describes the position of a third point as
//! seen on the way from a first point to a second. The words are those of SparQ.
//!
//! All relations except those of coincident points are invariant under affine maps that keep left and right, so one configuration
//! represents each of them. The permutations of the arguments and the composition are computed from these configurations.

use std::sync::LazyLock;

use crate::algebra::{Relation, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Point, not_negative};
use crate::tpcc::Permutation;

words! {
    /// The position of c as seen on the way from a to b.
    FlipFlop, "flipflop", limits = FlipFlop::reaches, {
        /// On the left of the line from a to b.
        Left = "l",
        /// On the right of the line from a to b.
        Right = "r",
        /// On the line, in front of b.
        Front = "f",
        /// At b, the end.
        End = "e",
        /// On the line, inside the way: between a and b.
        Inside = "i",
        /// At a, the start.
        Start = "s",
        /// On the line, behind a.
        Back = "b",
        /// a and b have the same position, and c has a different one.
        Dou = "dou",
        /// All three have the same position.
        Tri = "tri",
    }
}

const COUNT: usize = 9;
/// Maximum distance, in tolerances, of a point that counts as on the line. It is the greatest distance at which a point is near a
/// or near b by the time that a and b are near each other, so that motion leads from `i` to `dou` by way of `s` or `e`.
const ON_LINE: f64 = 0.866;

impl FlipFlop {
    /// Returns the position of c as seen on the way from a to b. Points within `tolerance` of each other count as coincident, and a
    /// point within 0.866 times the tolerance of the line counts as on it.
    pub fn of(a: Point, b: Point, c: Point, tolerance: f64) -> Self {
        let (way, away) = (b - a, c - a);
        let length = way.length();
        let is_near = [length, away.length(), c.distance(b)].map(|distance| distance <= tolerance);
        match is_near {
            [_, true, true] | [true, true, _] | [true, _, true] => return Self::Tri,
            [true, false, false] => return Self::Dou,
            [false, true, false] => return Self::Start,
            [false, false, true] => return Self::End,
            [false, false, false] => {}
        }
        let (left, ahead) = (way.cross(away), way.dot(away));
        if left.abs() > ON_LINE * tolerance * length {
            return if left > 0.0 { Self::Left } else { Self::Right };
        }
        if ahead < 0.0 {
            Self::Back
        } else if way.dot(c - b) < 0.0 {
            Self::Inside
        } else {
            Self::Front
        }
    }

    fn reaches(self, instant: Self) -> bool {
        use FlipFlop::{Back, Dou, End, Front, Inside, Left, Right, Start, Tri};
        match self {
            Left | Right => !matches!(instant, Left | Right),
            Front => matches!(instant, End | Dou | Tri),
            Inside => matches!(instant, Start | End | Tri),
            Back => matches!(instant, Start | Dou | Tri),
            Start | End | Dou => instant == Tri,
            Tri => false,
        }
    }

    /// Returns a configuration of points that represents this relation.
    fn points(self) -> [Point; 3] {
        let (a, b, left) = ([0.0, 0.0], [2.0, 0.0], [0.0, 2.0]);
        let points = match self {
            Self::Left => [a, b, left],
            Self::Right => [a, b, [0.0, -2.0]],
            Self::Front => [a, b, [4.0, 0.0]],
            Self::End => [a, b, b],
            Self::Inside => [a, b, [1.0, 0.0]],
            Self::Start => [a, b, a],
            Self::Back => [a, b, [-2.0, 0.0]],
            Self::Dou => [a, a, b],
            Self::Tri => [a, a, a],
        };
        points.map(|at| Point::try_from(at).expect("a small number"))
    }

    /// Returns the relation of the same points taken in another order.
    #[must_use]
    pub fn permuted(self, by: Permutation) -> Self {
        let [a, b, c] = by.apply(self.points());
        Self::of(a, b, c, 0.0)
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            on_line => on_line,
        }
    }

    /// Returns all relations that a, b and d may have, given `self` as that of a, b and c, and `next` as that of b, c and d.
    pub fn compose(self, next: Self) -> RelationSet<Self> {
        COMPOSITION[self.index()][next.index()]
    }
}

/// The composition table. The possible relations of a fourth point depend only on the lines through a and b and through b and c,
/// and on these points, so the points of a grid around them cover all cases.
static COMPOSITION: LazyLock<[[RelationSet<FlipFlop>; COUNT]; COUNT]> = LazyLock::new(|| {
    let mut table = [[RelationSet::EMPTY; COUNT]; COUNT];
    let steps = || (-12..=12).map(|half| f64::from(half) / 2.0);
    for first in FlipFlop::all() {
        let [a, b, c] = first.points();
        for d in steps().flat_map(|x| steps().map(move |y| Point::try_from([x, y]).expect("a small number")))
        {
            let next = FlipFlop::of(b, c, d, 0.0);
            table[first.index()][next.index()].insert(FlipFlop::of(a, b, d, 0.0));
        }
    }
    table
});

/// [`FlipFlop`] of three points.
#[derive(Debug, Clone, Copy)]
pub struct Ways {
    tolerance: f64,
}

impl Ways {
    /// Creates the calculus where points within `tolerance` of each other coincide, and a point within 0.866 times the tolerance of
    /// a line is on it.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)? })
    }
}

impl Default for Ways {
    /// Returns a tolerance that only absorbs rounding errors: 1e-9 units of length.
    fn default() -> Self {
        Self { tolerance: 1e-9 }
    }
}

impl Calculus for Ways {
    type Scene = [Point; 3];
    type Relation = FlipFlop;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b, c]: &Self::Scene) -> Option<FlipFlop> {
        Some(FlipFlop::of(*a, *b, *c, self.tolerance))
    }
}
