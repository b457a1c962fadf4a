//! The dipole calculus (Moratz, Renz and Wolter 2000), which relates two directed line segments by the position of each end of one
//! as seen along the other, in the terms of flip-flop. The four letters of a word are the positions of the start and the end of b
//! as seen by a, followed by those of the start and the end of a as seen by b: `rrll` says that b is on the right of a, and a on
//! the left of b.
//!
//! [`DraF`], the fine-grained calculus, has 72 relations. [`DraC`], the coarse one, has the 24 of them in which no point lies on
//! the line of the other dipole except at its ends. For all other dipoles, none of its relations holds.
//!
//! # Composition
//! The letters depend only on the sides and the order of the ends with respect to the points where the lines of the dipoles cross.
//! Up to affine maps, there are seven arrangements of three lines, and on each line there are finitely many places between and at
//! the crossings (Moratz, Lücke and Mossakowski 2011). The table is computed from all of them and is exact.

use std::array;
use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::algebra::{Compose, Converse, Relation, RelationSet, unknown};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::flipflop::FlipFlop;
use crate::geometry::{Point, not_negative};

/// The words of all relations. The first [`COARSE`] are those of the coarse calculus.
const WORDS: &str = "rrrr rrrl rrlr rrll rlrr rllr rlll lrrr lrrl lrll llrr llrl lllr llll ells errs lere rele slsr srsl lsel rser \
                     sese eses bbbb bbff beie bfii biif blrr brll bsef ebis efbs eifs fbii fefe ffbb ffff fifi flll frrr fsei ibib \
                     iebe ifbi iibf iifb illr irrl iseb lbll lfrr lirl llbr llfl lllb llrf lril lrri rbrr rfll rilr rlir rlli rrbl \
                     rrfr rrlf rrrb sbsb sfsi sisf";
/// Number of relations of the coarse calculus.
pub const COARSE: usize = 24;
/// Number of relations of the fine-grained calculus.
pub const FINE: usize = 72;
/// Number of relations of flip-flop whose points do not coincide.
const LETTERS: usize = 7;

type Letters = [FlipFlop; 4];

/// The letters of each relation, parsed from [`WORDS`].
const RELATIONS: [Letters; FINE] = {
    let mut relations = [[FlipFlop::Left; 4]; FINE];
    let mut at = 0;
    while at < 4 * FINE {
        relations[at / 4][at % 4] = match WORDS.as_bytes()[at / 4 * 5 + at % 4] {
            b'l' => FlipFlop::Left,
            b'r' => FlipFlop::Right,
            b'f' => FlipFlop::Front,
            b'e' => FlipFlop::End,
            b'i' => FlipFlop::Inside,
            b's' => FlipFlop::Start,
            b'b' => FlipFlop::Back,
            _ => panic!("expected a letter of flip-flop"),
        };
        at += 1;
    }
    relations
};

/// The index of the relation with the given letters, read as a number in base [`LETTERS`], or [`FINE`] if there is none.
const PLACES: [u8; LETTERS.pow(4)] = {
    let mut places = [FINE as u8; LETTERS.pow(4)];
    let mut at = 0;
    while at < FINE {
        places[number(RELATIONS[at])] = at as u8;
        at += 1;
    }
    places
};

const fn number([a, b, c, d]: Letters) -> usize {
    ((a as usize * LETTERS + b as usize) * LETTERS + c as usize) * LETTERS + d as usize
}

fn place(letters: Letters) -> Option<usize> {
    let is_apart = letters.iter().all(|letter| letter.index() < LETTERS);
    let place = is_apart.then(|| PLACES[number(letters)] as usize)?;
    (place < FINE).then_some(place)
}

/// A directed line segment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[Point; 2]", into = "[Point; 2]")]
pub struct Dipole {
    start: Point,
    end: Point,
}

impl Dipole {
    /// Creates a dipole.
    ///
    /// # Errors
    /// [`Error::Extent`] if both ends have the same position.
    pub fn new(start: Point, end: Point) -> Result<Self, Error> {
        if start == end { Err(Error::Extent { what: "dipole", found: 0.0 }) } else { Ok(Self { start, end }) }
    }

    /// Returns the point where the dipole starts.
    pub const fn start(self) -> Point {
        self.start
    }

    /// Returns the point where the dipole ends.
    pub const fn end(self) -> Point {
        self.end
    }
}

impl TryFrom<[Point; 2]> for Dipole {
    type Error = Error;

    fn try_from([start, end]: [Point; 2]) -> Result<Self, Error> {
        Self::new(start, end)
    }
}

impl From<Dipole> for [Point; 2] {
    fn from(dipole: Dipole) -> Self {
        [dipole.start, dipole.end]
    }
}

/// A relation of the dipole calculus with N relations, [`COARSE`] or [`FINE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Dra<const N: usize>(u8);

/// A relation of the coarse calculus, with 24 relations.
pub type DraC = Dra<COARSE>;
/// A relation of the fine-grained calculus, with 72 relations.
pub type DraF = Dra<FINE>;

impl<const N: usize> Dra<N> {
    /// Returns the relation of a to b, or `None` if the calculus has none for them. Points within `tolerance` of each other count
    /// as coincident, and points within 0.866 times the tolerance of a line count as on the line, unless no two dipoles can have
    /// the resulting letters.
    pub fn of(a: Dipole, b: Dipole, tolerance: f64) -> Option<Self> {
        let place = place(Self::letters_of(a, b, tolerance)).or_else(|| place(Self::letters_of(a, b, 0.0)));
        place.and_then(Self::from_index)
    }

    fn letters_of(a: Dipole, b: Dipole, tolerance: f64) -> Letters {
        let of = |from: Dipole, at| FlipFlop::of(from.start, from.end, at, tolerance);
        [of(a, b.start), of(a, b.end), of(b, a.start), of(b, a.end)]
    }

    /// Returns the positions of the start and the end of b as seen by a, and of the start and the end of a as seen by b.
    pub const fn letters(self) -> [FlipFlop; 4] {
        RELATIONS[self.0 as usize]
    }

    /// Returns the relation with the given letters, or `None` if there is none.
    pub fn from_letters(letters: [FlipFlop; 4]) -> Option<Self> {
        place(letters).and_then(Self::from_index)
    }

    /// Returns the relation in a mirror image, which swaps left and right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self::from_letters(self.letters().map(FlipFlop::mirrored)).expect("relations have mirror images")
    }
}

impl<const N: usize> Relation for Dra<N> {
    const CALCULUS: &'static str = match N {
        COARSE => "dra-c",
        FINE => "dra-f",
        _ => panic!("expected the number of relations of DRA_c or DRA_f"),
    };
    const COUNT: usize = N;

    fn index(self) -> usize {
        self.0.into()
    }

    fn from_index(index: usize) -> Option<Self> {
        (index < N).then_some(Self(index as u8))
    }

    fn limits_to(self, instant: Self) -> bool {
        LIMITS[self.index()] >> instant.0 & 1 == 1
    }

    /// In the coarse calculus, no relation holds at an instant at which a point is on the line of the other dipole, so the
    /// relations before and after that instant are neighbours.
    fn is_neighbour(self, other: Self) -> bool {
        let passed = u128::MAX << N;
        let both = LIMITS[self.index()] & LIMITS[other.index()] & passed;
        self != other && (self.limits_to(other) || other.limits_to(self) || both != 0)
    }
}

impl<const N: usize> Converse for Dra<N> {
    fn converse(self) -> Self {
        let [a, b, c, d] = self.letters();
        Self::from_letters([c, d, a, b]).expect("relations have converses")
    }
}

impl<const N: usize> Compose for Dra<N> {
    fn compose(self, next: Self) -> RelationSet<Self> {
        RelationSet::from_bits(COMPOSITION[self.index()][next.index()] & !(u128::MAX << N))
    }
}

impl<const N: usize> fmt::Display for Dra<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.letters().iter().try_for_each(|letter| f.write_str(letter.word()))
    }
}

impl<const N: usize> FromStr for Dra<N> {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let found = WORDS.split(' ').position(|own| own.eq_ignore_ascii_case(word.trim()));
        found.and_then(Self::from_index).ok_or_else(|| unknown::<Self>(word))
    }
}

impl<const N: usize> TryFrom<String> for Dra<N> {
    type Error = Error;

    fn try_from(word: String) -> Result<Self, Error> {
        word.parse()
    }
}

impl<const N: usize> From<Dra<N>> for String {
    fn from(relation: Dra<N>) -> Self {
        relation.to_string()
    }
}

fn point([x, y]: [i32; 2]) -> Point {
    Point::try_from([x, y].map(f64::from)).expect("a small number")
}

fn fine(a: Dipole, b: Dipole) -> DraF {
    DraF::of(a, b, 0.0).expect("whole numbers are exact")
}

/// The relations that each relation limits to, as bits. They are found by moving a dipole of each relation a little, relative to
/// the other one, in all directions.
static LIMITS: LazyLock<[u128; FINE]> = LazyLock::new(|| {
    // Whether a point near an end of a dipole is on its line depends on products of steps, which reach across small steps.
    const FAR: i32 = 10_000;
    const LONG: i32 = 400;
    let mut limits = [0; FINE];
    let a = Dipole { start: point([0, 0]), end: point([3 * FAR, 0]) };
    let grid = [0, 3, 1, 2, 4, -1, 5, -2].into_iter().flat_map(|x| [0, 1, -1, 2, -2].map(|y| [x, y]));
    let dipoles = grid.clone().flat_map(|start| grid.clone().map(move |end| [start, end]));
    let across = || (-5..=5).chain([LONG, -LONG]);
    let steps = || across().flat_map(|y| [0, 1, -1, 4, -4, LONG, -LONG].map(|x| [x, y]));
    let mut is_known = [false; FINE];
    for ends in dipoles.filter(|[start, end]| start != end) {
        let moved = |by: [[i32; 2]; 2]| {
            let [start, end] =
                array::from_fn(|i| point(array::from_fn(|axis| FAR * ends[i][axis] + by[i][axis])));
            fine(a, Dipole { start, end }).index()
        };
        let instant = moved([[0; 2]; 2]);
        if std::mem::replace(&mut is_known[instant], true) {
            continue;
        }
        // Move the dipoles in exchanged roles as well, because whole steps of one reach the line of the other, but not the reverse.
        let converse = |place: usize| Dra::<FINE>(place as u8).converse().index();
        for around in steps().flat_map(|start| steps().map(move |end| moved([start, end]))) {
            limits[around] |= u128::from(around != instant) << instant;
            limits[converse(around)] |= u128::from(around != instant) << converse(instant);
        }
    }
    assert!(is_known.iter().all(|is_known| *is_known), "expected a dipole of each relation");
    limits
});

/// A line, given by a point and a direction. Positions of dipole ends are counted along it.
type Line = [[i32; 2]; 2];

/// The arrangements of three lines, each with the positions to try: two in each part of a line between crossings and, on lines that
/// coincide, as many as there are ends.
const ARRANGEMENTS: [([Line; 3], std::ops::RangeInclusive<i32>); 7] = {
    const X: Line = [[0, 0], [1, 0]];
    const Y: Line = [[0, 0], [0, 1]];
    [
        ([X, Y, [[0, 3], [1, -1]]], -2..=5),
        ([X, Y, [[0, 0], [1, 1]]], -2..=2),
        ([X, [[0, 3], [1, 0]], Y], -2..=5),
        ([X, [[0, 3], [1, 0]], [[0, 6], [1, 0]]], 0..=1),
        ([X, X, Y], -4..=4),
        ([X, X, [[0, 3], [1, 0]]], 0..=3),
        ([X, X, X], 0..=5),
    ]
};

/// The composition table, as bit masks.
static COMPOSITION: LazyLock<[[u128; FINE]; FINE]> = LazyLock::new(|| {
    let mut table = [[0; FINE]; FINE];
    for (lines, places) in ARRANGEMENTS {
        for [a, b, c] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let [a, b, c] = [a, b, c].map(|line: usize| dipoles(lines[line], places.clone()));
            let related = |ones: &[Dipole], others: &[Dipole]| -> Vec<Vec<usize>> {
                let row = |one: &Dipole| others.iter().map(|other| fine(*one, *other).index()).collect();
                ones.iter().map(row).collect()
            };
            let [ab, bc, ac] = [related(&a, &b), related(&b, &c), related(&a, &c)];
            for (ab, ac) in ab.iter().zip(&ac) {
                for (ab, bc) in ab.iter().zip(&bc) {
                    for (bc, ac) in bc.iter().zip(ac) {
                        table[*ab][*bc] |= 1 << *ac;
                    }
                }
            }
        }
    }
    table
});

/// Returns all dipoles between the given positions on a line.
fn dipoles([[x, y], [dx, dy]]: Line, places: std::ops::RangeInclusive<i32>) -> Vec<Dipole> {
    let at = |place: i32| point([x + place * dx, y + place * dy]);
    let pairs = places.clone().flat_map(|start| places.clone().map(move |end| [start, end]));
    pairs.filter_map(|[start, end]| Dipole::new(at(start), at(end)).ok()).collect()
}

/// [`Dra`] of two dipoles.
#[derive(Debug, Clone, Copy)]
pub struct Dipoles<const N: usize> {
    tolerance: f64,
}

impl<const N: usize> Dipoles<N> {
    /// Creates the calculus where points within `tolerance` of each other coincide, and points within 0.866 times the tolerance of
    /// a line are on it.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)? })
    }
}

impl<const N: usize> Default for Dipoles<N> {
    /// Returns a tolerance that only absorbs rounding errors: 1e-9 units of length.
    fn default() -> Self {
        Self { tolerance: 1e-9 }
    }
}

impl<const N: usize> Calculus for Dipoles<N> {
    type Scene = [Dipole; 2];
    type Relation = Dra<N>;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Dra<N>> {
        Dra::of(*a, *b, self.tolerance)
    }
}
