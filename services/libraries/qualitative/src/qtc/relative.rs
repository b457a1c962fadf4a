//! QTC with relative speed (Van de Weghe 2004, level 2): [`QtcB22`] and [`QtcC22`], which also has the relative angle.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{QtcB, QtcC, Sign, from_index, index, inserted, reaches, read_signs, write_signs};
use crate::algebra::{Converse, Relation, unknown};
use crate::calculus::{Before, Calculus, Quantisation};
use crate::error::Error;
use crate::geometry::Point;

/// A relation of QTC_B22.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct QtcB22 {
    /// The motion of both points.
    pub basic: QtcB,
    /// Whether k is slower than l, **−**; faster, **+**; or as fast, **0**.
    pub speed: Sign,
}

/// A relation of QTC_C22. A point whose two signs are 0 is at rest. If one of the points rests, the relative speed follows from the
/// other signs, and so does the angle unless both points move within the same quadrants. Therefore, 257 relations exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct QtcC22 {
    cross: QtcC,
    speed: Sign,
    angle: Sign,
}

/// Returns the relative speed of two motions.
fn speed(k: [Point; 2], l: [Point; 2], threshold: f64) -> Sign {
    Sign::of(k[1].distance(k[0]) - l[1].distance(l[0]), threshold)
}

impl QtcB22 {
    /// Returns the relation of two motions, each from a position at t − 1 to a position at t. Speeds are equal if the distances
    /// differ by at most `threshold`.
    pub fn of(k: [Point; 2], l: [Point; 2], threshold: f64) -> Self {
        Self { basic: QtcB::of(k, l, threshold), speed: speed(k, l, threshold) }
    }

    /// Returns the signs, in order.
    pub const fn signs(self) -> [Sign; 3] {
        [self.basic.k, self.basic.l, self.speed]
    }

    /// Creates a relation from its signs.
    pub const fn from_signs([k, l, speed]: [Sign; 3]) -> Self {
        Self { basic: QtcB { k, l }, speed }
    }
}

signed!(QtcB22, "qtc-b22", 3);

impl Converse for QtcB22 {
    fn converse(self) -> Self {
        Self { basic: self.basic.converse(), speed: self.speed.inverted() }
    }
}

/// Returns where in the half circle, from towards the other point to away from it, a motion lies: 0 for straight towards it, 1 for
/// less than a right angle, 2 for a right angle, 3 for more, and 4 for straight away. Returns `None` for a point at rest.
const fn part(along: Sign, side: Sign) -> Option<usize> {
    match (along, side) {
        (Sign::Zero, Sign::Zero) => None,
        (Sign::Minus, Sign::Zero) => Some(0),
        (Sign::Minus, _) => Some(1),
        (Sign::Zero, _) => Some(2),
        (Sign::Plus, Sign::Zero) => Some(4),
        (Sign::Plus, _) => Some(3),
    }
}

impl QtcC22 {
    /// Returns the relation of two motions, each from a position at t − 1 to a position at t. Speeds are equal if the distances
    /// differ by at most `threshold`. Angles are equal if the shorter motion, turned by their difference, ends within `threshold`
    /// of where it ended.
    pub fn of(k: [Point; 2], l: [Point; 2], threshold: f64) -> Self {
        let cross = QtcC::of(k, l, threshold);
        let follows = Self::known(cross);
        let speed = follows[0].unwrap_or_else(|| speed(k, l, threshold));
        let angle = follows[1].unwrap_or_else(|| {
            let to_l = l[0] - k[0];
            let (k_moved, l_moved) = (k[1] - k[0], l[1] - l[0]);
            let [k_along, l_along] = [to_l.dot(k_moved), -to_l.dot(l_moved)];
            let [k_across, l_across] = [k_moved, l_moved].map(|moved| to_l.cross(moved).abs());
            let longer = k_moved.length().max(l_moved.length());
            Sign::of(l_along * k_across - l_across * k_along, threshold * longer * to_l.dot(to_l))
        });
        Self { cross, speed, angle }
    }

    /// Returns the speed and the angle, each if it follows from the other signs.
    const fn known(cross: QtcC) -> [Option<Sign>; 2] {
        match (part(cross.k, cross.k_side), part(cross.l, cross.l_side)) {
            (None, None) => [Some(Sign::Zero), Some(Sign::Zero)],
            (None, Some(_)) => [Some(Sign::Minus), Some(Sign::Zero)],
            (Some(_), None) => [Some(Sign::Plus), Some(Sign::Zero)],
            (Some(1), Some(1)) | (Some(3), Some(3)) => [None, None],
            (Some(k), Some(l)) if k < l => [None, Some(Sign::Minus)],
            (Some(k), Some(l)) if k > l => [None, Some(Sign::Plus)],
            (Some(_), Some(_)) => [None, Some(Sign::Zero)],
        }
    }

    /// Returns the QTC_C part of the relation.
    pub const fn cross(self) -> QtcC {
        self.cross
    }

    /// Returns whether k is slower than l, **−**; faster, **+**; or as fast, **0**.
    pub const fn speed(self) -> Sign {
        self.speed
    }

    /// Returns whether the angle from the line to l to the motion of k is smaller than the angle from the line to k to the motion
    /// of l, **−**; greater, **+**; or equal, **0**, which also stands for a point at rest. Angles are from 0 to 180°.
    pub const fn angle(self) -> Sign {
        self.angle
    }

    /// Returns the signs, in order.
    pub const fn signs(self) -> [Sign; 6] {
        let [k, l, k_side, l_side] = self.cross.signs();
        [k, l, k_side, l_side, self.speed, self.angle]
    }

    /// Creates a relation from its signs, or returns `None` if no motions have these signs.
    pub fn from_signs([k, l, k_side, l_side, speed, angle]: [Sign; 6]) -> Option<Self> {
        let cross = QtcC::from_signs([k, l, k_side, l_side]);
        let agrees = |known: Option<Sign>, sign| known.is_none_or(|known| known == sign);
        let [known_speed, known_angle] = Self::known(cross);
        (agrees(known_speed, speed) && agrees(known_angle, angle)).then_some(Self { cross, speed, angle })
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { cross: self.cross.mirrored(), ..self }
    }
}

impl Relation for QtcC22 {
    const CALCULUS: &'static str = "qtc-c22";
    const COUNT: usize = 257;

    fn index(self) -> usize {
        let number = index(self.signs()) as u16;
        EXISTING.binary_search(&number).expect("only relations that exist are made")
    }

    fn from_index(at: usize) -> Option<Self> {
        Self::from_signs(from_index(usize::from(*EXISTING.get(at)?))?)
    }

    fn limits_to(self, instant: Self) -> bool {
        self != instant && reaches(self.signs(), instant.signs())
    }

    /// Sets all signs that differ to 0, as in QTC_C, or returns `None` if no motions have these signs.
    fn between(self, next: Self) -> Option<Self> {
        inserted(self.signs(), next.signs()).and_then(Self::from_signs)
    }
}

/// The numbers of the relations that exist among all combinations of signs.
static EXISTING: std::sync::LazyLock<[u16; QtcC22::COUNT]> = std::sync::LazyLock::new(|| {
    let exists = |number: &u16| from_index(usize::from(*number)).and_then(QtcC22::from_signs).is_some();
    let mut numbers = (0..729).filter(exists);
    let existing = std::array::from_fn(|_| numbers.next().expect("as many relations as are counted"));
    assert_eq!(numbers.next(), None);
    existing
});

impl Converse for QtcC22 {
    fn converse(self) -> Self {
        Self { cross: self.cross.converse(), speed: self.speed.inverted(), angle: self.angle.inverted() }
    }
}

impl fmt::Display for QtcC22 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_signs(f, &self.signs())
    }
}

impl FromStr for QtcC22 {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        read_signs(word).and_then(Self::from_signs).ok_or_else(|| unknown::<Self>(word))
    }
}

impl TryFrom<String> for QtcC22 {
    type Error = Error;

    fn try_from(word: String) -> Result<Self, Error> {
        word.parse()
    }
}

impl From<QtcC22> for String {
    fn from(relation: QtcC22) -> Self {
        relation.to_string()
    }
}

/// [`QtcB22`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Speeds {
    /// Threshold above which a change of position, or a difference of distances, counts.
    pub quantisation: Quantisation,
}

/// [`QtcC22`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Angles {
    /// Threshold above which a change of position, or a difference of distances, counts.
    pub quantisation: Quantisation,
}

impl Calculus for Speeds {
    type Scene = [Point; 2];
    type Relation = QtcB22;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Self::Scene>, [k, l]: &Self::Scene) -> Option<QtcB22> {
        before.map(|(before, elapsed_s)| {
            QtcB22::of([before[0], *k], [before[1], *l], self.quantisation.over(elapsed_s))
        })
    }
}

impl Calculus for Angles {
    type Scene = [Point; 2];
    type Relation = QtcC22;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Self::Scene>, [k, l]: &Self::Scene) -> Option<QtcC22> {
        before.map(|(before, elapsed_s)| {
            QtcC22::of([before[0], *k], [before[1], *l], self.quantisation.over(elapsed_s))
        })
    }
}
