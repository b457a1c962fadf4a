//! The qualitative rectilinear projection calculus (QRPC; Glez-Cabrera, Álvarez-Bravo and Díaz 2013, as presented in Patil
//! 2019, 2.2.2). It describes the relation between the straight-line projections of two oriented points i and j.
//!
//! - [`Disposition`]: the projections are parallel or on one line, in the same or opposite directions, or they cross at a
//!   point C.
//! - `side`: i is to the left of the projection of j, **−**; on it, **0**; or to the right of it, **+**.
//! - `i_ahead`, `j_ahead`: C is in front of i (or j), **+**; at the position of i (or j), **0**; or behind it, **−**.
//! - `ahead`: when both are on one line, i is in front of j, **+**; abreast of it, **0**; or behind it, **−**. If the
//!   projections cross, that of i is first turned about C so that the two face each other. The sign is then that of the sum
//!   of the distances of i and j to C.
//!
//! According to Patil 2019, C counts as (+,+) or (−,−) if there is no crossing, but the thesis does not specify when to use
//! which. Here it is (−,−) if the two point away from each other, and (+,+) otherwise.
//!
//! Only 41 combinations of these signs exist. The side of j relative to i does not always follow from the relation of i to
//! j, so the converse is a set. See [`Qrpc::converses`].

use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::algebra::{Relation, RelationSet, unknown, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Oriented, not_negative};
use crate::qtc::Sign;

words! {
    /// The position of the two projections relative to each other.
    Disposition, "qrpc disposition", limits = |from, to| {
        use Disposition::{Crossed, LineOpposite, LineSame, ParallelOpposite, ParallelSame};
        from == Crossed || matches!((from, to), (ParallelSame, LineSame) | (ParallelOpposite, LineOpposite))
    }, {
        /// Parallel, in the same direction.
        ParallelSame = "↑↑",
        /// Parallel, in opposite directions.
        ParallelOpposite = "↑↓",
        /// On one line, in the same direction.
        LineSame = "↑",
        /// On one line, in opposite directions.
        LineOpposite = "↓",
        /// The projections cross.
        Crossed = "X",
    }
}

/// A relation of QRPC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Qrpc {
    disposition: Disposition,
    side: Sign,
    i_ahead: Sign,
    j_ahead: Sign,
    ahead: Sign,
}

/// Tolerances for deciding on a relation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projections {
    angle_rad: f64,
    distance: f64,
}

impl Projections {
    /// Creates tolerances. Projections whose directions differ by no more than `angle_rad` count as parallel, and points within
    /// `distance` count as on a line or in the same position.
    ///
    /// # Errors
    /// [`Error::Parameter`] if either is negative or not finite.
    pub fn new(angle_rad: f64, distance: f64) -> Result<Self, Error> {
        Ok(Self {
            angle_rad: not_negative("angle_rad", angle_rad)?,
            distance: not_negative("distance", distance)?,
        })
    }
}

impl Default for Projections {
    /// Returns tolerances that only absorb rounding errors: 1e-9 rad and 1e-9 units of length.
    fn default() -> Self {
        Self { angle_rad: 1e-9, distance: 1e-9 }
    }
}

use Sign::{Minus, Plus, Zero};

/// Returns the sign of a sum, or `None` if it does not follow from the signs of the terms.
const fn sum(a: Sign, b: Sign) -> Option<Sign> {
    match (a, b) {
        (Zero, other) | (other, Zero) => Some(other),
        (Plus, Plus) => Some(Plus),
        (Minus, Minus) => Some(Minus),
        _ => None,
    }
}

fn product(a: Sign, b: Sign) -> Sign {
    match a {
        Plus => b,
        Zero => Zero,
        Minus => b.inverted(),
    }
}

fn reaches(from: Sign, instant: Sign) -> bool {
    instant == from || instant == Zero
}

impl Qrpc {
    /// Returns the relation of two oriented points.
    pub fn of(i: Oriented, j: Oriented, tolerances: &Projections) -> Self {
        let Projections { angle_rad, distance } = *tolerances;
        let (i_to, j_to) = (i.direction(), j.direction());
        let away = i.position() - j.position();
        let turn = i_to.cross(j_to);
        // Both offsets are positive on the left.
        let beside = |offset: f64| if offset.abs() <= distance { 0.0 } else { offset };
        let i_left = beside(j_to.cross(away));
        let j_left = beside(-i_to.cross(away));
        let side = Sign::of(-i_left, 0.0);
        if turn.abs() <= angle_rad.sin() {
            let side = if j_left == 0.0 { Zero } else { side };
            return Self::uncrossed(i_to.dot(j_to) > 0.0, side, Sign::of(away.dot(j_to), distance));
        }
        let turn_sign = Sign::of(turn, 0.0);
        let i_ahead = product(Sign::of(i_left, 0.0), turn_sign);
        let j_ahead = product(Sign::of(-j_left, 0.0), turn_sign);
        let ahead = sum(i_ahead, j_ahead);
        let ahead = ahead.unwrap_or_else(|| Sign::of((i_left - j_left) / turn, distance));
        Self { disposition: Disposition::Crossed, side, i_ahead, j_ahead, ahead }
    }

    fn uncrossed(is_same: bool, side: Sign, ahead: Sign) -> Self {
        let disposition = match (is_same, side) {
            (true, Zero) => Disposition::LineSame,
            (true, _) => Disposition::ParallelSame,
            (false, Zero) => Disposition::LineOpposite,
            (false, _) => Disposition::ParallelOpposite,
        };
        let crossing = if !is_same && ahead == Minus { Minus } else { Plus };
        Self { disposition, side, i_ahead: crossing, j_ahead: crossing, ahead }
    }

    /// Creates a relation from its parts, or returns `None` if the relation does not hold for any two oriented points.
    pub fn new(
        disposition: Disposition,
        side: Sign,
        [i_ahead, j_ahead]: [Sign; 2],
        ahead: Sign,
    ) -> Option<Self> {
        let own = Self { disposition, side, i_ahead, j_ahead, ahead };
        let exists = match disposition {
            Disposition::Crossed => {
                (side == Zero) == (i_ahead == Zero) && sum(i_ahead, j_ahead).is_none_or(|sum| sum == ahead)
            }
            Disposition::ParallelSame | Disposition::LineSame => own == Self::uncrossed(true, side, ahead),
            Disposition::ParallelOpposite | Disposition::LineOpposite => {
                own == Self::uncrossed(false, side, ahead)
            }
        };
        exists.then_some(own)
    }

    /// Returns the position of the two projections relative to each other.
    pub const fn disposition(self) -> Disposition {
        self.disposition
    }

    /// Returns the side of the projection of j on which i is.
    pub const fn side(self) -> Sign {
        self.side
    }

    /// Returns the signs that say whether C is in front of i and of j.
    pub const fn crossing(self) -> [Sign; 2] {
        [self.i_ahead, self.j_ahead]
    }

    /// Returns the sign that says whether i is in front of j on one line.
    pub const fn ahead(self) -> Sign {
        self.ahead
    }

    /// Returns all relations that j may have to i.
    pub fn converses(self) -> RelationSet<Self> {
        let crossing = [self.j_ahead, self.i_ahead];
        let with = |side, ahead| Self::new(self.disposition, side, crossing, ahead);
        let found: [Option<Self>; 2] = match self.disposition {
            Disposition::ParallelSame | Disposition::LineSame => {
                [with(self.side.inverted(), self.ahead.inverted()), None]
            }
            Disposition::ParallelOpposite | Disposition::LineOpposite => [with(self.side, self.ahead), None],
            Disposition::Crossed if self.i_ahead == Zero => {
                [with(self.j_ahead, self.ahead), with(self.j_ahead.inverted(), self.ahead)]
            }
            // i is left of j if j comes from the right and C is ahead of i.
            Disposition::Crossed => {
                let turn = product(self.side, self.i_ahead).inverted();
                [with(product(self.j_ahead, turn), self.ahead), None]
            }
        };
        found.into_iter().flatten().collect()
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { side: self.side.inverted(), ..self }
    }

    /// Returns true if the order of i and j may be `ahead` at the instant at which the two come to lie on one line, in the same
    /// direction.
    fn comes_in_line(self, ahead: Sign) -> bool {
        let apart = sum(self.j_ahead, self.i_ahead.inverted());
        apart.is_none_or(|apart| reaches(apart, ahead))
    }
}

const SIGNS: [Sign; 3] = [Minus, Zero, Plus];
/// Number of combinations of the five parts.
const COMBINATIONS: usize = Disposition::COUNT * 81;

/// The relations that exist among all combinations of the five parts, and the index of each combination among them.
struct Existing {
    relations: [Option<Qrpc>; Qrpc::COUNT],
    indices: [usize; COMBINATIONS],
}

static EXISTING: LazyLock<Existing> = LazyLock::new(|| {
    let mut existing = Existing { relations: [None; Qrpc::COUNT], indices: [0; COMBINATIONS] };
    let mut index = 0;
    for code in 0..COMBINATIONS {
        let sign = |place: usize| SIGNS[code / 3_usize.pow(place as u32) % 3];
        let disposition = Disposition::ALL[code / 81];
        if let Some(relation) = Qrpc::new(disposition, sign(3), [sign(2), sign(1)], sign(0)) {
            existing.relations[index] = Some(relation);
            existing.indices[code] = index;
            index += 1;
        }
    }
    existing
});

impl Qrpc {
    /// Returns the number of this combination of parts.
    fn code(self) -> usize {
        let signs = [self.side, self.i_ahead, self.j_ahead, self.ahead];
        signs.iter().fold(self.disposition.index(), |code, sign| 3 * code + *sign as usize)
    }
}

impl Relation for Qrpc {
    const CALCULUS: &'static str = "qrpc";
    const COUNT: usize = 41;

    fn index(self) -> usize {
        EXISTING.indices[self.code()]
    }

    fn from_index(index: usize) -> Option<Self> {
        EXISTING.relations.get(index).copied().flatten()
    }

    fn limits_to(self, instant: Self) -> bool {
        use Disposition::{Crossed, LineOpposite, LineSame, ParallelOpposite, ParallelSame};
        let is_beside = reaches(self.side, instant.side);
        let keeps_order = reaches(self.ahead, instant.ahead);
        let is_alike = self.i_ahead == self.j_ahead && self.i_ahead != Zero;
        let is_opposed = self.i_ahead == self.j_ahead.inverted() && self.i_ahead != Zero;
        self != instant
            && match (self.disposition, instant.disposition) {
                (Crossed, Crossed) => {
                    let crossing =
                        reaches(self.i_ahead, instant.i_ahead) && reaches(self.j_ahead, instant.j_ahead);
                    is_beside && crossing && keeps_order
                }
                // C goes to infinity. It ends up in front of both or behind both, or in front of one and behind the other.
                (Crossed, ParallelSame) => is_alike && self.side == instant.side,
                (Crossed, ParallelOpposite) => is_opposed && self.side == instant.side && keeps_order,
                (Crossed, LineSame) => self.comes_in_line(instant.ahead),
                (Crossed, LineOpposite) => keeps_order,
                (ParallelSame | LineSame, ParallelSame | LineSame)
                | (ParallelOpposite | LineOpposite, ParallelOpposite | LineOpposite) => {
                    is_beside && keeps_order
                }
                _ => false,
            }
    }
}

impl fmt::Display for Qrpc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [side, i, j, ahead] = [self.side, self.i_ahead, self.j_ahead, self.ahead].map(Sign::symbol);
        write!(f, "[{} {side} ({i},{j}) {ahead}]", self.disposition)
    }
}

impl FromStr for Qrpc {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let read = || {
            let word = word.trim().strip_prefix('[')?.strip_suffix(']')?;
            let (disposition, signs) = word.trim().split_once(' ')?;
            let mut signs = signs.chars().filter_map(Sign::from_symbol);
            let [side, i, j, ahead] = [signs.next()?, signs.next()?, signs.next()?, signs.next()?];
            Self::new(disposition.parse().ok()?, side, [i, j], ahead).filter(|_| signs.next().is_none())
        };
        read().ok_or_else(|| unknown::<Self>(word))
    }
}

impl Calculus for Projections {
    type Scene = [Oriented; 2];
    type Relation = Qrpc;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [i, j]: &Self::Scene) -> Option<Qrpc> {
        Some(Qrpc::of(*i, *j, self))
    }
}
