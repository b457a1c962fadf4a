//! The qualitative trajectory calculus (QTC; Van de Weghe 2004; Delafontaine, Cohn and Van de Weghe 2011), which describes
//! how two points k and l move relative to each other. In QSRlib it is `qtcbs`, `qtccs` and `qtcbcs`.
//!
//! Between a time t − 1 and a time t, with d = l(t−1) − k(t−1), a relation has these signs:
//!
//! - The first sign says whether k moves towards l, **−**; away from it, **+**; or neither, **0**. It is −sgn((k(t) −
//!   k(t−1))·d), so the reference is the position of l at t − 1.
//! - The second sign says the same for l towards k.
//! - The third sign, in QTC_C, says whether k moves to the left of the directed line from k to l, **−**; or to the right,
//!   **+**.
//! - The fourth sign says the same for l and the line from l to k.
//!
//! If the motion along or across the line that decides a sign is no longer than the quantisation, the sign is 0. QTC_B has the
//! first two signs and QTC_C all four (after Zimmermann and Freksa's double cross). QTC_BC has all four if the points are near at
//! t, and otherwise the first two (Dondrup et al. 2015). These are the simplified calculi, which leave out the relative speed.
//! [`QtcB22`] and [`QtcC22`] include it, and the latter also includes the relative angle of the motions to the line.
//!
//! Patil 2019, 2.2.1, defines the signs in the same way. They are inverted in the rules of 3.1.3, because there the robot
//! is at rest in its own frame and the markers move.
//!
//! If both points coincide at t − 1 there is no line. A point that moves then moves away, and to neither side.
//!
//! # Neighbourhood
//! The signs − and + are not neighbours, because motion passes through 0. The sign 0 may hold for an instant but − and +
//! may not, so no sign leaves 0 at the instant at which another reaches it. QTC_B has 9 relations and 16 pairs of
//! neighbours, and QTC_C has 81 relations and 544 pairs. In QTC_BC the same reasoning applies to the distance, which counts
//! as near at the instant at which it reaches the threshold. This gives 225 pairs that connect QTC_B and QTC_C.

mod composition;

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::algebra::{Converse, Relation, unknown};
use crate::calculus::{Before, Calculus, Quantisation};
use crate::error::Error;
use crate::geometry::{Point, Vector, not_negative};

/// A sign of a relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Sign {
    /// Towards the other point, or to the left.
    Minus,
    /// Neither direction.
    Zero,
    /// Away from the other point, or to the right.
    Plus,
}

impl Sign {
    const ALL: [Self; 3] = [Self::Minus, Self::Zero, Self::Plus];

    /// Returns the sign of a number. Numbers of magnitude up to `threshold` count as 0.
    pub fn of(number: f64, threshold: f64) -> Self {
        if number > threshold {
            Self::Plus
        } else if number < -threshold {
            Self::Minus
        } else {
            Self::Zero
        }
    }

    /// Returns the opposite sign.
    #[must_use]
    pub const fn inverted(self) -> Self {
        match self {
            Self::Minus => Self::Plus,
            Self::Zero => Self::Zero,
            Self::Plus => Self::Minus,
        }
    }

    /// Returns the symbol `-`, `0` or `+`.
    pub const fn symbol(self) -> char {
        match self {
            Self::Minus => '-',
            Self::Zero => '0',
            Self::Plus => '+',
        }
    }

    /// Parses a sign from `-`, `−`, `0` or `+`.
    pub const fn from_symbol(symbol: char) -> Option<Self> {
        match symbol {
            '-' | '−' => Some(Self::Minus),
            '0' => Some(Self::Zero),
            '+' => Some(Self::Plus),
            _ => None,
        }
    }
}

/// A relation of QTC_B.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct QtcB {
    /// Motion of k towards or away from l.
    pub k: Sign,
    /// Motion of l towards or away from k.
    pub l: Sign,
}

/// A relation of QTC_C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct QtcC {
    /// Motion of k towards or away from l.
    pub k: Sign,
    /// Motion of l towards or away from k.
    pub l: Sign,
    /// Motion of k to the left or right of the line from k to l.
    pub k_side: Sign,
    /// Motion of l to the left or right of the line from l to k.
    pub l_side: Sign,
}

/// A relation of QTC_BC, which is one of QTC_B if the points are far from each other and one of QTC_C if they are near.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum QtcBc {
    /// The points are far from each other.
    Far(QtcB),
    /// The points are near each other.
    Near(QtcC),
}

/// Returns the signs of `moved` along and across the line `to` the other point, which indicate whether a point moves towards or
/// away from the other, and to which side.
fn signs(moved: Vector, to: Vector, threshold: f64) -> [Sign; 2] {
    let length = to.length();
    if length == 0.0 {
        return [Sign::of(moved.length(), threshold), Sign::Zero];
    }
    let threshold = threshold * length;
    [Sign::of(-moved.dot(to), threshold), Sign::of(-to.cross(moved), threshold)]
}

impl QtcC {
    /// Returns the relation of two motions, each from a position at t − 1 to a position at t.
    pub fn of(k: [Point; 2], l: [Point; 2], threshold: f64) -> Self {
        let (to_l, to_k) = (l[0] - k[0], k[0] - l[0]);
        let [k_to, k_side] = signs(k[1] - k[0], to_l, threshold);
        let [l_to, l_side] = signs(l[1] - l[0], to_k, threshold);
        Self { k: k_to, l: l_to, k_side, l_side }
    }

    /// Returns the QTC_B part of the relation.
    pub const fn basic(self) -> QtcB {
        QtcB { k: self.k, l: self.l }
    }

    /// Returns the signs, in order.
    pub const fn signs(self) -> [Sign; 4] {
        [self.k, self.l, self.k_side, self.l_side]
    }

    /// Creates a relation from its signs.
    pub const fn from_signs([k, l, k_side, l_side]: [Sign; 4]) -> Self {
        Self { k, l, k_side, l_side }
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { k_side: self.k_side.inverted(), l_side: self.l_side.inverted(), ..self }
    }
}

impl QtcB {
    /// Returns the relation of two motions, each from a position at t − 1 to a position at t.
    pub fn of(k: [Point; 2], l: [Point; 2], threshold: f64) -> Self {
        QtcC::of(k, l, threshold).basic()
    }

    /// Returns the signs, in order.
    pub const fn signs(self) -> [Sign; 2] {
        [self.k, self.l]
    }

    /// Creates a relation from its signs.
    pub const fn from_signs([k, l]: [Sign; 2]) -> Self {
        Self { k, l }
    }

    /// Returns the relation with all signs inverted, as it appears in the frame of the other object (Patil 2019, 3.1.3).
    #[must_use]
    pub const fn inverted(self) -> Self {
        Self { k: self.k.inverted(), l: self.l.inverted() }
    }
}

impl QtcBc {
    /// Returns the relation in QTC_B, or the QTC_B part of the one in QTC_C.
    pub const fn basic(self) -> QtcB {
        match self {
            Self::Far(far) => far,
            Self::Near(near) => near.basic(),
        }
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::Far(far) => Self::Far(far),
            Self::Near(near) => Self::Near(near.mirrored()),
        }
    }
}

/// Returns true if each sign is either 0 or the corresponding sign of `from`.
fn reaches<const N: usize>(from: [Sign; N], instant: [Sign; N]) -> bool {
    from.iter().zip(instant).all(|(from, at)| at == *from || at == Sign::Zero)
}

/// Returns the signs that are passed through between two relations: those that differ are 0.
fn meeting<const N: usize>(from: [Sign; N], to: [Sign; N]) -> [Sign; N] {
    std::array::from_fn(|i| if from[i] == to[i] { from[i] } else { Sign::Zero })
}

/// Returns the signs that QSRlib inserts between two relations, or `None` if the relations are equal or neighbours.
pub(crate) fn inserted<const N: usize>(from: [Sign; N], to: [Sign; N]) -> Option<[Sign; N]> {
    let is_neighbour = reaches(from, to) || reaches(to, from);
    (!is_neighbour).then(|| meeting(from, to))
}

fn index<const N: usize>(signs: [Sign; N]) -> usize {
    signs.iter().fold(0, |index, sign| 3 * index + *sign as usize)
}

fn from_index<const N: usize>(index: usize) -> Option<[Sign; N]> {
    let digit = |i: usize| index / 3_usize.pow((N - 1 - i) as u32) % 3;
    (index < 3_usize.pow(N as u32)).then(|| std::array::from_fn(|i| Sign::ALL[digit(i)]))
}

/// Writes signs as `-,+`, or as `(- +)` in the alternate form.
fn write_signs(f: &mut fmt::Formatter<'_>, signs: &[Sign]) -> fmt::Result {
    let (open, between, close) = if f.alternate() { ("(", " ", ")") } else { ("", ",", "") };
    f.write_str(open)?;
    for (i, sign) in signs.iter().enumerate() {
        write!(f, "{}{}", if i == 0 { "" } else { between }, sign.symbol())?;
    }
    f.write_str(close)
}

/// Parses signs from `-,+`, `-+` or `(- +)`.
fn read_signs<const N: usize>(word: &str) -> Option<[Sign; N]> {
    let word = word.trim();
    let word = word.strip_prefix('(').and_then(|word| word.strip_suffix(')')).unwrap_or(word);
    let mut symbols = word.chars().filter(|symbol| *symbol != ',' && !symbol.is_whitespace());
    let mut signs = [Sign::Zero; N];
    for sign in &mut signs {
        *sign = Sign::from_symbol(symbols.next()?)?;
    }
    symbols.next().is_none().then_some(signs)
}

macro_rules! signed {
    ($name:ident, $calculus:literal, $signs:literal) => {
        impl Relation for $name {
            const CALCULUS: &'static str = $calculus;
            const COUNT: usize = 3_usize.pow($signs);

            fn index(self) -> usize {
                index(self.signs())
            }

            fn from_index(at: usize) -> Option<Self> {
                from_index(at).map(Self::from_signs)
            }

            fn limits_to(self, instant: Self) -> bool {
                self != instant && reaches(self.signs(), instant.signs())
            }

            /// Sets all signs that differ to 0, as QSRlib does: a sign that jumps must pass through 0, and a sign must not leave 0
            /// as another reaches it. Note that if neither of two signs jumps, both could also differ from 0 in between.
            fn between(self, next: Self) -> Option<Self> {
                inserted(self.signs(), next.signs()).map(Self::from_signs)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write_signs(f, &self.signs())
            }
        }

        impl FromStr for $name {
            type Err = Error;

            fn from_str(word: &str) -> Result<Self, Error> {
                read_signs(word).map(Self::from_signs).ok_or_else(|| unknown::<Self>(word))
            }
        }
    };
}
signed!(QtcB, "qtcbs", 2);
signed!(QtcC, "qtccs", 4);

mod relative;

pub use relative::{Angles, QtcB22, QtcC22, Speeds};

impl Converse for QtcB {
    fn converse(self) -> Self {
        Self { k: self.l, l: self.k }
    }
}

impl Converse for QtcC {
    fn converse(self) -> Self {
        Self { k: self.l, l: self.k, k_side: self.l_side, l_side: self.k_side }
    }
}

impl Converse for QtcBc {
    fn converse(self) -> Self {
        match self {
            Self::Far(far) => Self::Far(far.converse()),
            Self::Near(near) => Self::Near(near.converse()),
        }
    }
}

impl Relation for QtcBc {
    const CALCULUS: &'static str = "qtcbcs";
    const COUNT: usize = QtcB::COUNT + QtcC::COUNT;

    fn index(self) -> usize {
        match self {
            Self::Far(far) => far.index(),
            Self::Near(near) => QtcB::COUNT + near.index(),
        }
    }

    fn from_index(at: usize) -> Option<Self> {
        match at.checked_sub(QtcB::COUNT) {
            None => QtcB::from_index(at).map(Self::Far),
            Some(at) => QtcC::from_index(at).map(Self::Near),
        }
    }

    fn limits_to(self, instant: Self) -> bool {
        match (self, instant) {
            (Self::Far(far), Self::Far(at)) => far.limits_to(at),
            (Self::Near(near), Self::Near(at)) => near.limits_to(at),
            (Self::Far(far), Self::Near(at)) => reaches(far.signs(), at.basic().signs()),
            (Self::Near(_), Self::Far(_)) => false,
        }
    }

    /// Same as for QTC_B and QTC_C. If the distance passes the threshold, the relation in between is one of QTC_C, because the
    /// distance counts as near at that instant.
    fn between(self, next: Self) -> Option<Self> {
        if self.is_neighbour(next) {
            return None;
        }
        match (self, next) {
            (Self::Far(from), Self::Far(to)) => from.between(to).map(Self::Far),
            (Self::Near(from), Self::Near(to)) => from.between(to).map(Self::Near),
            (Self::Far(far), Self::Near(near)) | (Self::Near(near), Self::Far(far)) => {
                let [k, l] = meeting(far.signs(), near.basic().signs());
                Some(Self::Near(QtcC { k, l, ..near }))
            }
        }
    }
}

impl fmt::Display for QtcBc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Far(far) => far.fmt(f),
            Self::Near(near) => near.fmt(f),
        }
    }
}

impl FromStr for QtcBc {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let far = read_signs(word).map(|signs| Self::Far(QtcB::from_signs(signs)));
        let near = || read_signs(word).map(|signs| Self::Near(QtcC::from_signs(signs)));
        far.or_else(near).ok_or_else(|| unknown::<Self>(word))
    }
}

/// [`QtcB`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Basic {
    /// Threshold above which a change of position counts as motion.
    pub quantisation: Quantisation,
}

/// [`QtcC`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct DoubleCross {
    /// Threshold above which a change of position counts as motion.
    pub quantisation: Quantisation,
}

/// [`QtcBc`] of two points.
#[derive(Debug, Clone, Copy)]
pub struct Switching {
    /// Threshold above which a change of position counts as motion.
    pub quantisation: Quantisation,
    near: f64,
}

/// Maximum distance, in metres, at which QSRlib's QTC_BC includes the signs of the sides. It is the limit of personal space
/// according to Hall 1966.
pub const PERSONAL_SPACE_M: f64 = 1.22;

impl Switching {
    /// Creates the calculus with side signs for points that are at most `near` apart at the later of the two times.
    ///
    /// # Errors
    /// [`Error::Parameter`] if `near` is negative or not finite.
    pub fn new(quantisation: Quantisation, near: f64) -> Result<Self, Error> {
        Ok(Self { quantisation, near: not_negative("distance of QTC_BC", near)? })
    }
}

impl Default for Switching {
    fn default() -> Self {
        Self { quantisation: Quantisation::NONE, near: PERSONAL_SPACE_M }
    }
}

impl Calculus for Basic {
    type Scene = [Point; 2];
    type Relation = QtcB;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Self::Scene>, [k, l]: &Self::Scene) -> Option<QtcB> {
        before.map(|(before, elapsed_s)| {
            QtcB::of([before[0], *k], [before[1], *l], self.quantisation.over(elapsed_s))
        })
    }
}

impl Calculus for DoubleCross {
    type Scene = [Point; 2];
    type Relation = QtcC;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Self::Scene>, [k, l]: &Self::Scene) -> Option<QtcC> {
        before.map(|(before, elapsed_s)| {
            QtcC::of([before[0], *k], [before[1], *l], self.quantisation.over(elapsed_s))
        })
    }
}

impl Calculus for Switching {
    type Scene = [Point; 2];
    type Relation = QtcBc;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Self::Scene>, now: &Self::Scene) -> Option<QtcBc> {
        let near = DoubleCross { quantisation: self.quantisation }.relate(before, now)?;
        let is_near = now[0].distance(now[1]) <= self.near;
        Some(if is_near { QtcBc::Near(near) } else { QtcBc::Far(near.basic()) })
    }
}
