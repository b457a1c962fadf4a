//! The ternary point configuration calculus (TPCC; Moratz, Nebel and Freksa 2003): where a referent is, seen by
//! somebody at the origin who looks at the relatum. QSRlib's `tpcc`.
//!
//! Straight on is "back": behind the relatum. The word of a relation has c (close: no farther from the relatum than the
//! origin is) or d (distant); then the sector, of 45°, or s for a straight or right-angled position. So `clb` is close,
//! left of straight back, and `cbl` is farther to the left. The same place as the relatum is `sam`; where origin and
//! relatum coincide, there is no direction: `dou`, and `tri` where all three do.
//!
//! A border of 45° belongs to the sector at the line of sight, so that the mirror image holds. A ternary relation has
//! no converse but permutations of its arguments, whose results are sets; they are not given here.

use std::f64::consts::FRAC_PI_2;

use crate::algebra::{Relation, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::Point;

words! {
    /// Where the referent is.
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
        /// Origin and relatum are at one place, and the referent is not.
        Dou = "dou",
        /// All three are at one place.
        Tri = "tri",
    }
}

/// Sectors and the four lines between them, counter-clockwise from straight back.
const AROUND: usize = 12;

impl Tpcc {
    /// The relation of a referent to an origin and a relatum. Within `tolerance_rad` of the four directions a position
    /// counts as straight.
    pub fn of(origin: Point, relatum: Point, referent: Point, tolerance_rad: f64) -> Self {
        let (sight, away) = (relatum - origin, referent - relatum);
        let (base, distance) = (sight.length(), away.length());
        match (base > 0.0, distance > 0.0) {
            (false, false) => return Self::Tri,
            (false, true) => return Self::Dou,
            (true, false) => return Self::Sam,
            (true, true) => {}
        }
        let (ahead, left) = (sight.dot(away), sight.cross(away));
        let around = Self::around(ahead, left, tolerance_rad.sin() * base * distance);
        Self::ALL[around + if distance > base { AROUND } else { 0 }]
    }

    /// The place among the sectors and lines, of a direction with these parts; a part up to `straight` counts as none.
    fn around(ahead: f64, left: f64, straight: f64) -> usize {
        let is_back = ahead > 0.0;
        let on_left = if left.abs() <= straight && left.abs() <= ahead.abs() {
            return if is_back { 0 } else { 6 };
        } else if ahead.abs() <= straight {
            3
        } else {
            match (is_back, left.abs() <= ahead.abs()) {
                (true, true) => 1,
                (true, false) => 2,
                (false, false) => 4,
                (false, true) => 5,
            }
        };
        if left > 0.0 { on_left } else { AROUND - on_left }
    }

    /// The place around the relatum and whether it is distant; `None` for coincident points.
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
        // What is at no greater distance is closed, and so are lines, and sectors at their border of 45°.
        let is_line = |at: usize| at.is_multiple_of(3);
        let is_beside = matches!((to + AROUND - at) % AROUND, 1 | 11);
        let has_border = matches!((at, to), (2, 1) | (4, 5) | (8, 7) | (10, 11));
        let turns = at == to || (is_beside && ((is_line(to) && !is_line(at)) || has_border));
        turns && (is_distant == to_distant || is_distant)
    }

    /// The relation in the mirror image: left and right swap.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let Some((at, is_distant)) = self.polar() else { return self };
        Self::ALL[(AROUND - at) % AROUND + if is_distant { AROUND } else { 0 }]
    }
}

/// [`Tpcc`] of three points: origin, relatum, referent.
#[derive(Debug, Clone, Copy)]
pub struct Configurations {
    tolerance_rad: f64,
}

impl Configurations {
    /// The tolerance of the default: points that are in line but for rounding are.
    pub const TOLERANCE_RAD: f64 = 1e-9;

    /// With positions straight that are within `tolerance_rad` of it.
    ///
    /// # Errors
    /// [`Error::Parameter`] where it is not from 0 to below π/4.
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
