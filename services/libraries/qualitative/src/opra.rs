//! The oriented point relation algebra OPRA_m (Moratz 2006), which describes the directions in which two oriented points see each
//! other.
//!
//! Around each point, m lines through it make 2m rays and 2m sectors between them, at equal angles. These 4m segments are
//! counted counter-clockwise from the heading, so that rays are even and sectors odd. A relation `i_j` says that b is in
//! segment i of a, and a in segment j of b. If both are in the same position, `s_i` says that the heading of b is in segment i
//! of a. The words are those of SparQ. With m = 1, segment 0 is ahead, 1 on the left, 2 behind and 3 on the right.
//!
//! The composition is computed from the angles of the triangle of the three points (Mossakowski and Moratz 2012), in whole
//! multiples of the angle between a ray and the middle of the next sector, and is exact. A closed network of base relations
//! need not have a model (Wolter and Lee 2010).

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::algebra::{Compose, Converse, Relation, RelationSet, unknown};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Oriented, Vector};

/// A relation of OPRA_m, with m from 1 to 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Opra<const M: usize>(Segments);

/// The segments that make up a relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Segments {
    /// The points are in different positions.
    Apart {
        /// The segment of a that contains the position of b.
        of_a: usize,
        /// The segment of b that contains the position of a.
        of_b: usize,
    },
    /// The points are in the same position.
    Same {
        /// The segment of a that contains the heading of b.
        heading: usize,
    },
}

use Segments::{Apart, Same};

/// A set of angles, in multiples of the angle between a ray and the middle of the next sector: all angles that differ from `middle`
/// by less than `slack`, or only `middle` if `slack` is 0.
#[derive(Debug, Clone, Copy)]
struct Angles {
    middle: i32,
    slack: i32,
}

impl Angles {
    fn of_segment(segment: usize) -> Self {
        Self { middle: segment as i32, slack: (segment % 2) as i32 }
    }

    fn plus(self, other: Self) -> Self {
        Self { middle: self.middle + other.middle, slack: self.slack + other.slack }
    }

    fn minus(self, other: Self) -> Self {
        Self { middle: self.middle - other.middle, slack: self.slack + other.slack }
    }

    fn negated(self) -> Self {
        Self { middle: -self.middle, ..self }
    }

    /// Returns the difference between an angle and the middle, in the shorter direction.
    fn off_middle(self, angle: i32, circle: i32) -> i32 {
        let off = (self.middle - angle).rem_euclid(circle);
        off.min(circle - off)
    }

    fn contains(self, angle: i32, circle: i32) -> bool {
        let off = self.off_middle(angle, circle);
        off == 0 || off < self.slack
    }

    /// Returns the ranges of these angles that lie strictly between 0 and half a circle. Ranges with different ends are open.
    fn inside(self, circle: i32) -> impl Iterator<Item = [i32; 2]> + Clone {
        let middle = self.middle.rem_euclid(circle);
        [middle - circle, middle, middle + circle].into_iter().filter_map(move |middle| {
            let (low, high) = ((middle - self.slack).max(0), (middle + self.slack).min(circle / 2));
            let is_range = if self.slack == 0 { 0 < low && high < circle / 2 } else { low < high };
            is_range.then_some([low, high])
        })
    }
}

/// Returns true if a triangle, possibly a flat one, has inner angles from the given sets. The angles are all counter-clockwise, or
/// all clockwise and then below 0.
fn is_triangle(angles: [Angles; 3], circle: i32) -> bool {
    let is_flat = (0..3)
        .any(|between| (0..3).all(|i| angles[i].contains(if i == between { circle / 2 } else { 0 }, circle)));
    is_flat || has_angles(angles, circle) || has_angles(angles.map(Angles::negated), circle)
}

/// Returns true if three angles above 0 from the given sets add up to half a circle.
fn has_angles([a, b, c]: [Angles; 3], circle: i32) -> bool {
    a.inside(circle).any(|a| {
        b.inside(circle).any(|b| {
            c.inside(circle).any(|c| {
                let [low, high] = [0, 1].map(|end| a[end] + b[end] + c[end]);
                (low < circle / 2 && circle / 2 < high) || (low == high && low == circle / 2)
            })
        })
    })
}

impl<const M: usize> Opra<M> {
    /// Number of segments around a point.
    pub const SEGMENTS: usize = {
        assert!(1 <= M && M <= 4, "expected m from 1 to 4");
        4 * M
    };

    /// Creates a relation, or returns `None` if a segment is not below [`Self::SEGMENTS`].
    pub fn new(segments: Segments) -> Option<Self> {
        let is_valid = match segments {
            Apart { of_a, of_b } => of_a.max(of_b) < Self::SEGMENTS,
            Same { heading } => heading < Self::SEGMENTS,
        };
        is_valid.then_some(Self(segments))
    }

    /// Returns the segments that make up the relation.
    pub const fn segments(self) -> Segments {
        self.0
    }

    /// Returns the relation of two oriented points. Directions within `tolerance_rad` of a ray count as on it.
    pub fn of(a: Oriented, b: Oriented, tolerance_rad: f64) -> Self {
        let segment = |from: Oriented, to| Self::segment(from.direction(), to, tolerance_rad);
        let away = b.position() - a.position();
        if away.x == 0.0 && away.y == 0.0 {
            Self(Same { heading: segment(a, b.direction()) })
        } else {
            Self(Apart { of_a: segment(a, away), of_b: segment(b, a.position() - b.position()) })
        }
    }

    fn segment(heading: Vector, to: Vector, tolerance_rad: f64) -> usize {
        let angle = heading.cross(to).atan2(heading.dot(to)).rem_euclid(TAU);
        let sector = TAU / (2 * M) as f64;
        let ray = (angle / sector).round();
        let is_on_ray = (angle - ray * sector).abs() <= tolerance_rad;
        let segment = if is_on_ray { 2 * ray as usize } else { 2 * (angle / sector) as usize + 1 };
        segment % Self::SEGMENTS
    }

    const CIRCLE: i32 = Self::SEGMENTS as i32;

    fn opposite(segment: usize) -> usize {
        (Self::SEGMENTS - segment) % Self::SEGMENTS
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self(match self.0 {
            Apart { of_a, of_b } => Apart { of_a: Self::opposite(of_a), of_b: Self::opposite(of_b) },
            Same { heading } => Same { heading: Self::opposite(heading) },
        })
    }

    /// Returns true if there are three oriented points a, b and c such that a has the first relation to b, b the second to c, and a
    /// the third to c.
    fn exist([first, next, last]: [Self; 3]) -> bool {
        let angles = Angles::of_segment;
        let turns = |angles: Angles| angles.contains(0, Self::CIRCLE);
        match [first.0, next.0, last.0] {
            [Apart { of_a: ab, of_b: ba }, Apart { of_a: bc, of_b: cb }, Apart { of_a: ac, of_b: ca }] => {
                let at_a = angles(ac).minus(angles(ab));
                let at_b = angles(ba).minus(angles(bc));
                let at_c = angles(cb).minus(angles(ca));
                is_triangle([at_a, at_b, at_c], Self::CIRCLE)
            }
            // Points in the same position see a third one in directions that differ by their headings.
            [Same { heading }, Apart { of_a: bc, of_b: cb }, Apart { of_a: ac, of_b: ca }] => {
                cb == ca && turns(angles(bc).plus(angles(heading)).minus(angles(ac)))
            }
            [Apart { of_a: ab, of_b: ba }, Same { heading }, Apart { of_a: ac, of_b: ca }] => {
                ab == ac && turns(angles(ca).plus(angles(heading)).minus(angles(ba)))
            }
            [Apart { of_a: ab, of_b: ba }, Apart { of_a: bc, of_b: cb }, Same { heading }] => {
                ba == bc && turns(angles(cb).plus(angles(heading)).minus(angles(ab)))
            }
            [Same { heading: first }, Same { heading: next }, Same { heading: last }] => {
                turns(angles(first).plus(angles(next)).minus(angles(last)))
            }
            _ => false,
        }
    }

    /// Returns true if a direction in the first segment can reach the second segment, or stay there, within an instant.
    fn turns(from: usize, to: usize) -> bool {
        let off = Angles::of_segment(from).off_middle(to as i32, Self::CIRCLE);
        off == 0 || (off == 1 && to.is_multiple_of(2))
    }
}

impl<const M: usize> Relation for Opra<M> {
    const CALCULUS: &'static str = ["opra-1", "opra-2", "opra-3", "opra-4"][M - 1];
    const COUNT: usize = Self::SEGMENTS * (Self::SEGMENTS + 1);

    fn index(self) -> usize {
        match self.0 {
            Apart { of_a, of_b } => of_a * Self::SEGMENTS + of_b,
            Same { heading } => Self::SEGMENTS * Self::SEGMENTS + heading,
        }
    }

    fn from_index(index: usize) -> Option<Self> {
        let (row, column) = (index / Self::SEGMENTS, index % Self::SEGMENTS);
        let is_apart = row < Self::SEGMENTS;
        let relation = if is_apart { Apart { of_a: row, of_b: column } } else { Same { heading: column } };
        (index < Self::COUNT).then_some(Self(relation))
    }

    fn limits_to(self, instant: Self) -> bool {
        let limits = match (self.0, instant.0) {
            (Apart { of_a, of_b }, Apart { of_a: a, of_b: b }) => {
                Self::turns(of_a, a) && Self::turns(of_b, b)
            }
            (Same { heading }, Same { heading: at }) => Self::turns(heading, at),
            // As the points meet, their headings still differ by the angle from one segment to the other.
            (Apart { of_a, of_b }, Same { heading }) => {
                let half = Angles { middle: Self::CIRCLE / 2, slack: 0 };
                let turn = Angles::of_segment(of_a).minus(Angles::of_segment(of_b)).plus(half);
                // A ray may lie on the border of these angles, whereas an open sector must reach into them. Since slacks are whole
                // numbers, both mean that the middle is no farther away than the slack.
                turn.off_middle(heading as i32, Self::CIRCLE) <= turn.slack
            }
            (Same { .. }, Apart { .. }) => false,
        };
        self != instant && limits
    }
}

impl<const M: usize> Converse for Opra<M> {
    fn converse(self) -> Self {
        Self(match self.0 {
            Apart { of_a, of_b } => Apart { of_a: of_b, of_b: of_a },
            Same { heading } => Same { heading: Self::opposite(heading) },
        })
    }
}

impl<const M: usize> Compose for Opra<M> {
    fn compose(self, next: Self) -> RelationSet<Self> {
        Self::all().filter(|last| Self::exist([self, next, *last])).collect()
    }
}

impl<const M: usize> fmt::Display for Opra<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Apart { of_a, of_b } => write!(f, "{of_a}_{of_b}"),
            Same { heading } => write!(f, "s_{heading}"),
        }
    }
}

impl<const M: usize> FromStr for Opra<M> {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let read = || {
            let (first, second) = word.trim().split_once('_')?;
            let second = second.parse().ok()?;
            Self::new(if first.eq_ignore_ascii_case("s") {
                Same { heading: second }
            } else {
                Apart { of_a: first.parse().ok()?, of_b: second }
            })
        };
        read().ok_or_else(|| unknown::<Self>(word))
    }
}

impl<const M: usize> TryFrom<String> for Opra<M> {
    type Error = Error;

    fn try_from(word: String) -> Result<Self, Error> {
        word.parse()
    }
}

impl<const M: usize> From<Opra<M>> for String {
    fn from(relation: Opra<M>) -> Self {
        relation.to_string()
    }
}

/// [`Opra`] of two oriented points.
#[derive(Debug, Clone, Copy)]
pub struct Orientations<const M: usize> {
    tolerance_rad: f64,
}

impl<const M: usize> Orientations<M> {
    /// Creates the calculus where directions within `tolerance_rad` of a ray count as on it.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is not at least 0 and below π/16, half of the narrowest sector.
    pub fn new(tolerance_rad: f64) -> Result<Self, Error> {
        if (0.0..TAU / 32.0).contains(&tolerance_rad) {
            Ok(Self { tolerance_rad })
        } else {
            Err(Error::Parameter {
                what: "tolerance_rad", expected: "0 to below π/16", found: tolerance_rad
            })
        }
    }
}

impl<const M: usize> Default for Orientations<M> {
    /// Returns a tolerance that only absorbs rounding errors: 1e-9 rad.
    fn default() -> Self {
        Self { tolerance_rad: 1e-9 }
    }
}

impl<const M: usize> Calculus for Orientations<M> {
    type Scene = [Oriented; 2];
    type Relation = Opra<M>;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Opra<M>> {
        Some(Opra::of(*a, *b, self.tolerance_rad))
    }
}
