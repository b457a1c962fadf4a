//! The ternary point configuration calculus (TPCC; Moratz, Nebel and Freksa 2003), which describes the position of a
//! referent as seen by an observer at the origin who looks at the relatum. In QSRlib this is `tpcc`.
//!
//! The direction straight on is called "back", since it is behind the relatum. The word of a relation begins with c (close:
//! no farther from the relatum than the origin is) or d (distant). This is followed by a sector of 45°, or by s for a
//! straight or right-angled position. For example, `clb` is close, left of straight back, and `cbl` is farther to the left.
//! If the referent is at the position of the relatum, the relation is `sam`. If origin and relatum coincide there is no
//! direction, and the relation is `dou`, or `tri` if all three coincide.
//!
//! A border at 45° belongs to the sector next to the line of sight, so that relations have mirror images. Instead of a
//! converse, a ternary relation has permutations of its arguments ([`Permutation`]), whose results are sets.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::algebra::{Relation, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::Point;

words! {
    /// The position of the referent.
    Tpcc, "tpcc", limits = Tpcc::reaches, {
        /// Close, straight back: straight on behind the relatum.
        Csb = "csb",
        /// Close, left of straight back.
        Clb = "clb",
        /// Close, back and left.
        Cbl = "cbl",
        /// Close, straight left.
        Csl = "csl",
        /// Close, front and left.
        Cfl = "cfl",
        /// Close, left of straight front.
        Clf = "clf",
        /// Close, straight front: between relatum and origin.
        Csf = "csf",
        /// Close, right of straight front.
        Crf = "crf",
        /// Close, front and right.
        Cfr = "cfr",
        /// Close, straight right.
        Csr = "csr",
        /// Close, back and right.
        Cbr = "cbr",
        /// Close, right of straight back.
        Crb = "crb",
        /// Distant, straight back.
        Dsb = "dsb",
        /// Distant, left of straight back.
        Dlb = "dlb",
        /// Distant, back and left.
        Dbl = "dbl",
        /// Distant, straight left.
        Dsl = "dsl",
        /// Distant, front and left.
        Dfl = "dfl",
        /// Distant, left of straight front.
        Dlf = "dlf",
        /// Distant, straight front: behind the origin.
        Dsf = "dsf",
        /// Distant, right of straight front.
        Drf = "drf",
        /// Distant, front and right.
        Dfr = "dfr",
        /// Distant, straight right.
        Dsr = "dsr",
        /// Distant, back and right.
        Dbr = "dbr",
        /// Distant, right of straight back.
        Drb = "drb",
        /// The referent is at the relatum.
        Sam = "sam",
        /// Origin and relatum have the same position, and the referent has a different one.
        Dou = "dou",
        /// All three points have the same position.
        Tri = "tri",
    }
}

/// Number of sectors and lines between them, counted counter-clockwise from straight back.
const AROUND: usize = 12;

impl Tpcc {
    /// Returns the relation of a referent to an origin and a relatum. Positions within `tolerance_rad` of one of the four
    /// directions count as straight.
    pub fn of(origin: Point, relatum: Point, referent: Point, tolerance_rad: f64) -> Self {
        Self::located([origin, relatum, referent], tolerance_rad, 0.0)
    }

    /// Like [`Self::of`], but with borders that are `border` wide.
    fn located([origin, relatum, referent]: [Point; 3], tolerance_rad: f64, border: f64) -> Self {
        let (sight, away) = (relatum - origin, referent - relatum);
        let (base, distance) = (sight.length(), away.length());
        match (base > border, distance > border) {
            (false, false) => return Self::Tri,
            (false, true) => return Self::Dou,
            (true, false) => return Self::Sam,
            (true, true) => {}
        }
        let (ahead, left) = (sight.dot(away), sight.cross(away));
        let around = Self::around(ahead, left, tolerance_rad.sin() * base * distance, border);
        Self::ALL[around + if distance > base * (1.0 + border) { AROUND } else { 0 }]
    }

    /// Returns the index, among sectors and lines, of a direction with the given components. A component up to `straight` counts as
    /// 0.
    fn around(ahead: f64, left: f64, straight: f64, border: f64) -> usize {
        let is_back = ahead > 0.0;
        let on_left = if left.abs() <= straight && left.abs() <= ahead.abs() {
            return if is_back { 0 } else { 6 };
        } else if ahead.abs() <= straight {
            3
        } else {
            match (is_back, left.abs() <= ahead.abs() * (1.0 + border)) {
                (true, true) => 1,
                (true, false) => 2,
                (false, false) => 4,
                (false, true) => 5,
            }
        };
        if left > 0.0 { on_left } else { AROUND - on_left }
    }

    /// Returns all relations that the same three points may have in another order.
    ///
    /// The set is found by trial. The borders of all relations are lines and circles in the plane of the referent, and the
    /// relations are the same throughout each piece of the plane between them. Note that this takes a few microseconds and
    /// allocates.
    pub fn permuted(self, permutation: Permutation) -> RelationSet<Self> {
        let [origin, relatum] = ORIGIN_AND_RELATUM.map(known);
        match self {
            Self::Tri => Self::Tri.into(),
            Self::Dou => {
                let points = [relatum, relatum, known([1.0, 0.0])];
                Self::located(permutation.apply(points), Configurations::TOLERANCE_RAD, BORDER).into()
            }
            _ => {
                let relate = |points| Self::located(points, Configurations::TOLERANCE_RAD, BORDER);
                let points = pieces().into_iter().map(|referent| [origin, relatum, referent]);
                let own = points.filter(|points| relate(*points) == self);
                own.map(|points| relate(permutation.apply(points))).collect()
            }
        }
    }

    /// Returns the index of the direction around the relatum, and true if the referent is distant. Returns `None` for
    /// coincident points.
    fn polar(self) -> Option<(usize, bool)> {
        let index = self.index();
        (index < 2 * AROUND).then_some((index % AROUND, index >= AROUND))
    }

    fn reaches(self, instant: Self) -> bool {
        let Some((at, is_distant)) = self.polar() else {
            return instant == Self::Tri;
        };
        let Some((to, to_distant)) = instant.polar() else {
            return match instant {
                Self::Sam => !is_distant,
                Self::Dou => is_distant,
                _ => true,
            };
        };
        // "Close" includes equal distance. Lines are closed, and so are sectors at their border at 45°.
        let is_line = |at: usize| at.is_multiple_of(3);
        let is_beside = matches!((to + AROUND - at) % AROUND, 1 | 11);
        let has_border = matches!((at, to), (2, 1) | (4, 5) | (8, 7) | (10, 11));
        let turns = at == to || (is_beside && ((is_line(to) && !is_line(at)) || has_border));
        turns && (is_distant == to_distant || is_distant)
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let Some((at, is_distant)) = self.polar() else { return self };
        Self::ALL[(AROUND - at) % AROUND + if is_distant { AROUND } else { 0 }]
    }
}

/// Another order of origin, relatum and referent (a, b, c), named as in the literature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Permutation {
    /// (b, a, c): inversion.
    Inverse,
    /// (a, c, b): the short cut.
    ShortCut,
    /// (c, a, b): the inverse of the short cut.
    InverseShortCut,
    /// (b, c, a): homing.
    Homing,
    /// (c, b, a): the inverse of homing.
    InverseHoming,
}

impl Permutation {
    /// All permutations other than the identity.
    pub const ALL: [Self; 5] =
        [Self::Inverse, Self::ShortCut, Self::InverseShortCut, Self::Homing, Self::InverseHoming];

    /// Returns the three values in this order.
    pub fn apply<T>(self, [a, b, c]: [T; 3]) -> [T; 3] {
        match self {
            Self::Inverse => [b, a, c],
            Self::ShortCut => [a, c, b],
            Self::InverseShortCut => [c, a, b],
            Self::Homing => [b, c, a],
            Self::InverseHoming => [c, b, a],
        }
    }
}

/// The positions of origin and relatum, without loss of generality.
const ORIGIN_AND_RELATUM: [[f64; 2]; 2] = [[-1.0, 0.0], [0.0, 0.0]];
/// Width of a border for points that are computed to be on it.
const BORDER: f64 = 1e-9;

fn known([x, y]: [f64; 2]) -> Point {
    Point::new(x, y).expect("a small number")
}

/// A border between relations in the plane of the referent.
#[derive(Debug, Clone, Copy)]
enum Curve {
    /// A line through a point in a direction.
    Line([f64; 2], [f64; 2]),
    /// A circle with a centre and a radius.
    Circle([f64; 2], f64),
}

impl Curve {
    /// Returns the point at a parameter, which is a length on a line and an angle on a circle.
    fn at(self, t: f64) -> [f64; 2] {
        match self {
            Self::Line([x, y], [dx, dy]) => [x + t * dx, y + t * dy],
            Self::Circle([x, y], r) => [x + r * t.cos(), y + r * t.sin()],
        }
    }

    /// Returns the parameters at which this curve meets another.
    fn crossings(self, other: Self) -> Vec<f64> {
        match (self, other) {
            (Self::Line(p, d), Self::Line(q, e)) => {
                let turn = d[0] * e[1] - d[1] * e[0];
                let t = ((q[0] - p[0]) * e[1] - (q[1] - p[1]) * e[0]) / turn;
                if turn.abs() > BORDER { vec![t] } else { Vec::new() }
            }
            (Self::Line(p, d), Self::Circle(centre, r)) => {
                let away = [p[0] - centre[0], p[1] - centre[1]];
                let along = -(away[0] * d[0] + away[1] * d[1]);
                let beside = away[0] * d[1] - away[1] * d[0];
                let half = (r * r - beside * beside).max(0.0).sqrt();
                if beside.abs() <= r + BORDER { vec![along - half, along + half] } else { Vec::new() }
            }
            (Self::Circle(centre, _), Self::Line(..)) => {
                let shared = other.crossings(self).into_iter().map(|t| other.at(t));
                shared.map(|[x, y]| (y - centre[1]).atan2(x - centre[0])).collect()
            }
            (Self::Circle([x, y], r), Self::Circle([u, v], s)) => {
                let (dx, dy) = (u - x, v - y);
                let apart = dx.hypot(dy);
                let cosine = (apart * apart + r * r - s * s) / (2.0 * apart * r);
                if apart > BORDER && cosine.abs() <= 1.0 + BORDER {
                    let (middle, half) = (dy.atan2(dx), cosine.clamp(-1.0, 1.0).acos());
                    vec![middle - half, middle + half]
                } else {
                    Vec::new()
                }
            }
        }
    }
}

/// Returns the borders between relations. On some of them, the referent is straight or at 45° as seen from one of the other
/// points, or the other points are as seen from the referent. On the rest, two of the distances between the three points
/// are equal.
fn borders() -> Vec<Curve> {
    let [a, b] = ORIGIN_AND_RELATUM;
    let turns = (0..4).map(|i| f64::from(i) * FRAC_PI_2 / 2.0).map(|angle| [angle.cos(), angle.sin()]);
    let mut curves: Vec<_> = turns.clone().map(|to| Curve::Line(b, to)).collect();
    curves.extend(turns.skip(1).map(|to| Curve::Line(a, to)));
    curves.push(Curve::Line([-0.5, 0.0], [0.0, 1.0]));
    curves.extend([Curve::Circle(a, 1.0), Curve::Circle(b, 1.0), Curve::Circle([-0.5, 0.0], 0.5)]);
    curves.extend([-0.5, 0.5].map(|y| Curve::Circle([-0.5, y], 0.5_f64.sqrt())));
    curves
}

/// Returns a point for each piece of the plane: each crossing, each stretch of a border, and the area on either side of it.
fn pieces() -> Vec<Point> {
    const ASIDE: f64 = 1e-4;
    let curves = borders();
    let mut found = Vec::new();
    for (i, curve) in curves.iter().enumerate() {
        let others = curves.iter().enumerate().filter(|(j, _)| *j != i);
        let mut shared: Vec<_> = others.flat_map(|(_, other)| curve.crossings(*other)).collect();
        if let Curve::Circle(..) = curve {
            shared.iter_mut().for_each(|angle| *angle = angle.rem_euclid(TAU));
        }
        shared.sort_by(f64::total_cmp);
        found.extend(shared.iter().map(|t| curve.at(*t)));
        let (first, last) = (shared[0], shared[shared.len() - 1]);
        let ends = match curve {
            Curve::Line(..) => vec![first - 1.0, last + 1.0],
            Curve::Circle(..) => vec![(first + TAU + last) / 2.0],
        };
        let stretches = shared.windows(2).filter(|pair| pair[1] - pair[0] > BORDER);
        for t in stretches.map(|pair| (pair[0] + pair[1]) / 2.0).chain(ends) {
            let [x, y] = curve.at(t);
            let normal = match curve {
                Curve::Line(_, [dx, dy]) => [-dy, *dx],
                Curve::Circle(..) => [t.cos(), t.sin()],
            };
            found.extend([0.0, ASIDE, -ASIDE].map(|by| [x + by * normal[0], y + by * normal[1]]));
        }
    }
    found.into_iter().map(known).collect()
}

/// [`Tpcc`] of an origin, a relatum and a referent.
#[derive(Debug, Clone, Copy)]
pub struct Configurations {
    tolerance_rad: f64,
}

impl Configurations {
    /// The default tolerance in radians, which only absorbs rounding errors of points that are on a line.
    pub const TOLERANCE_RAD: f64 = 1e-9;

    /// Creates the calculus where positions within `tolerance_rad` of straight count as straight.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is not at least 0 and below π/4.
    pub fn new(tolerance_rad: f64) -> Result<Self, Error> {
        if (0.0..FRAC_PI_2 / 2.0).contains(&tolerance_rad) {
            Ok(Self { tolerance_rad })
        } else {
            Err(Error::Parameter { what: "tolerance_rad", expected: "0 to below π/4", found: tolerance_rad })
        }
    }
}

impl Default for Configurations {
    fn default() -> Self {
        Self { tolerance_rad: Self::TOLERANCE_RAD }
    }
}

impl Calculus for Configurations {
    type Scene = [Point; 3];
    type Relation = Tpcc;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [origin, relatum, referent]: &Self::Scene) -> Option<Tpcc> {
        Some(Tpcc::of(*origin, *relatum, *referent, self.tolerance_rad))
    }
}
