//! The double cross calculus (Freksa 1992; Zimmermann and Freksa 1996), which describes the position of a third point as seen on
//! the way from a first point to a second: on which side of the line it is, and whether it is before or behind the perpendiculars
//! at both ends.
//!
//! The words are the authors' abbreviations: `lf` is left front, `lp` left on the perpendicular at b, `lc` left centre, `ll` left
//! on the line across a, and `lb` left back. On the way itself, `sf` is straight front, `if` identical with the front (b), `sc`
//! straight centre, `ib` identical with the back (a), and `sb` straight back. If a and b coincide, the words are `dou` and `tri`,
//! as in flip-flop.

use std::cmp::Ordering;
use std::sync::LazyLock;

use crate::algebra::{Relation, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Point, not_negative};
use crate::tpcc::Permutation;

words! {
    /// The position of c as seen on the way from a to b.
    DoubleCross, "doublecross", limits = DoubleCross::reaches, {
        /// Left front: on the left, ahead of b.
        Lf = "lf",
        /// Left, on the perpendicular at b.
        Lp = "lp",
        /// Left centre: on the left, between the perpendiculars.
        Lc = "lc",
        /// Left, on the perpendicular at a.
        Ll = "ll",
        /// Left back: on the left, behind a.
        Lb = "lb",
        /// Straight front: on the line, ahead of b.
        Sf = "sf",
        /// Identical with the front, b.
        If = "if",
        /// Straight centre: on the line, between a and b.
        Sc = "sc",
        /// Identical with the back, a.
        Ib = "ib",
        /// Straight back: on the line, behind a.
        Sb = "sb",
        /// Right front.
        Rf = "rf",
        /// Right, on the perpendicular at b.
        Rp = "rp",
        /// Right centre.
        Rc = "rc",
        /// Right, on the perpendicular at a.
        Rl = "rl",
        /// Right back.
        Rb = "rb",
        /// a and b have the same position, and c has a different one.
        Dou = "dou",
        /// All three have the same position.
        Tri = "tri",
    }
}

const COUNT: usize = 17;
/// Number of zones along the way: ahead, at b, between, at a, behind.
const ZONES: usize = 5;
/// Maximum distance, in tolerances, of a point that counts as on a line. Points on two lines are then within a tolerance of the
/// crossing, and points that do not coincide have a gap between their perpendiculars.
const ON_LINE: f64 = 0.5;

impl DoubleCross {
    /// Returns the position of c as seen on the way from a to b. Points within `tolerance` of each other count as coincident, and a
    /// point within half of it of a line counts as on the line.
    pub fn of(a: Point, b: Point, c: Point, tolerance: f64) -> Self {
        let (way, from_a, from_b) = (b - a, c - a, c - b);
        let is_near = [way, from_a, from_b].map(|between| between.length() <= tolerance);
        match is_near {
            [_, true, true] | [true, true, _] | [true, _, true] => return Self::Tri,
            [true, false, false] => return Self::Dou,
            [false, true, false] => return Self::Ib,
            [false, false, true] => return Self::If,
            [false, false, false] => {}
        }
        let width = ON_LINE * tolerance * way.length();
        let sign = |product: f64| {
            if product.abs() <= width { Ordering::Equal } else { product.total_cmp(&0.0) }
        };
        let zone = match (sign(way.dot(from_b)), sign(way.dot(from_a))) {
            (Ordering::Greater, _) => 0,
            (Ordering::Equal, _) => 1,
            (_, Ordering::Greater) => 2,
            (_, Ordering::Equal) => 3,
            _ => 4,
        };
        let side = match sign(way.cross(from_a)) {
            Ordering::Greater => 0,
            Ordering::Equal => 1,
            Ordering::Less => 2,
        };
        Self::ALL[ZONES * side + zone]
    }

    /// Returns the side, counted from the left, and the zone, counted from the front, or `None` if a and b coincide.
    fn place(self) -> Option<(usize, usize)> {
        (self.index() < 3 * ZONES).then(|| (self.index() / ZONES, self.index() % ZONES))
    }

    fn reaches(self, instant: Self) -> bool {
        match (self.place(), instant.place()) {
            (Some((side, zone)), Some((to_side, to_zone))) => {
                let is_line = to_zone % 2 == 1 && zone.abs_diff(to_zone) == 1;
                (to_side == side || to_side == 1) && (to_zone == zone || is_line)
            }
            // A point between a and b, or at one of them, meets both when they meet.
            (Some(_), None) => instant == Self::Tri || !matches!(self, Self::If | Self::Sc | Self::Ib),
            (None, None) => instant == Self::Tri,
            (None, Some(_)) => false,
        }
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        self.place().map_or(self, |(side, zone)| Self::ALL[ZONES * (2 - side) + zone])
    }

    /// Returns all relations that the same three points may have in another order.
    pub fn permuted(self, by: Permutation) -> RelationSet<Self> {
        let at = Permutation::ALL.iter().position(|other| *other == by);
        at.map_or(RelationSet::EMPTY, |at| TABLES.permuted[at][self.index()])
    }

    /// Returns all relations that a, b and d may have, given `self` as that of a, b and c, and `next` as that of b, c and d.
    pub fn compose(self, next: Self) -> RelationSet<Self> {
        TABLES.composition[self.index()][next.index()]
    }
}

struct Tables {
    composition: [[RelationSet<DoubleCross>; COUNT]; COUNT],
    permuted: [[RelationSet<DoubleCross>; COUNT]; 5],
}

/// The tables. Which relations occur together depends on the angles at b and on the order of lengths along them. Points on a grid
/// around a way of six steps cover all cases, and a finer or wider grid adds nothing.
static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let mut tables = Tables {
        composition: [[RelationSet::EMPTY; COUNT]; COUNT],
        permuted: [[RelationSet::EMPTY; COUNT]; 5],
    };
    let point = |x: i32, y: i32| Point::try_from([x, y].map(f64::from)).expect("a small number");
    let grid: Vec<_> = (-16..=22).flat_map(|x| (-16..=16).map(move |y| point(x, y))).collect();
    let a = point(0, 0);
    for b in [a, point(6, 0)] {
        for c in &grid {
            let first = DoubleCross::of(a, b, *c, 0.0).index();
            for (by, permuted) in Permutation::ALL.iter().zip(&mut tables.permuted) {
                let [a, b, c] = by.apply([a, b, *c]);
                permuted[first].insert(DoubleCross::of(a, b, c, 0.0));
            }
            for d in &grid {
                let next = DoubleCross::of(b, *c, *d, 0.0).index();
                tables.composition[first][next].insert(DoubleCross::of(a, b, *d, 0.0));
            }
        }
    }
    tables
});

/// [`DoubleCross`] of three points.
#[derive(Debug, Clone, Copy)]
pub struct Crosses {
    tolerance: f64,
}

impl Crosses {
    /// Creates the calculus where points within `tolerance` of each other coincide, and a point within half of it of a line is on
    /// the line.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)? })
    }
}

impl Default for Crosses {
    /// Returns a tolerance that only absorbs rounding errors: 1e-9 units of length.
    fn default() -> Self {
        Self { tolerance: 1e-9 }
    }
}

impl Calculus for Crosses {
    type Scene = [Point; 3];
    type Relation = DoubleCross;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b, c]: &Self::Scene) -> Option<DoubleCross> {
        Some(DoubleCross::of(*a, *b, *c, self.tolerance))
    }
}
