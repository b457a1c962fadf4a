//! The composition of QTC_C. A moving point is an oriented point, and its signs tell in which segment of OPRA_2 it sees the other
//! point. The table is therefore that of OPRA_2, where a point at rest may have any heading, and coincident points either move
//! straight away from each other or rest.
//!
//! The composition of QTC_B22 follows from it. Speeds compose like numbers and do not depend on directions, except that a point at
//! rest has none. Points that must move because another one is slower cannot have all directions.

use std::iter;
use std::sync::LazyLock;

use super::{QtcB22, QtcC, Sign};
use crate::algebra::{Compose, Relation, RelationSet};
use crate::opra::{Opra, Segments};

/// Number of segments around a moving point.
const AROUND: usize = Opra::<2>::SEGMENTS;

/// The signs along and across the line, by the segment that contains the other point. Segments are counted counter-clockwise from
/// the heading, so a point that sees the other one on its left moves to the right of the line.
const SIGNS: [[Sign; 2]; AROUND] = {
    use Sign::{Minus, Plus, Zero};
    [
        [Minus, Zero],
        [Minus, Plus],
        [Zero, Plus],
        [Plus, Plus],
        [Plus, Zero],
        [Plus, Minus],
        [Zero, Minus],
        [Minus, Minus],
    ]
};
const AT_REST: [Sign; 2] = [Sign::Zero; 2];
/// The signs of a moving point if the other one is at the same position.
const AWAY: [Sign; 2] = SIGNS[4];

/// The motion of one point with respect to the other.
type Part = [Sign; 2];

/// Returns the segments in which a point may see the other one. A point at rest may have any heading.
fn segments(part: Part) -> impl Iterator<Item = usize> + Clone {
    (0..AROUND).filter(move |segment| part == AT_REST || SIGNS[*segment] == part)
}

/// Returns the motions that a point may have with respect to one that may be anywhere.
fn anything(part: Part) -> impl Iterator<Item = Part> {
    (0..AROUND).map(move |segment| seen(part, segment))
}

/// Returns the motion of a point with respect to one in the given segment.
fn seen(part: Part, segment: usize) -> Part {
    if part == AT_REST { AT_REST } else { SIGNS[segment] }
}

/// Returns the motion of a point with respect to one at the same position.
fn met(part: Part) -> Part {
    if part == AT_REST { AT_REST } else { AWAY }
}

fn may_coincide(relation: QtcC) -> bool {
    parts(relation).iter().all(|part| *part == met(*part))
}

fn parts(QtcC { k, l, k_side, l_side }: QtcC) -> [Part; 2] {
    [[k, k_side], [l, l_side]]
}

fn bit([[k, k_side], [l, l_side]]: [Part; 2]) -> u128 {
    1 << QtcC { k, l, k_side, l_side }.index()
}

/// The compositions of the relations of OPRA_2 between points at different positions, as bit masks.
static APART: LazyLock<Vec<Vec<u128>>> = LazyLock::new(|| {
    let apart = || Opra::<2>::all().take(AROUND * AROUND);
    let bits = |set: RelationSet<Opra<2>>| set.iter().fold(0, |bits, relation| bits | 1 << relation.index());
    apart().map(|first| apart().map(|next| bits(first.compose(next))).collect()).collect()
});

static TABLE: LazyLock<Vec<Vec<u128>>> = LazyLock::new(|| {
    let row = |first| QtcC::all().map(|next| composed(first, next)).collect();
    QtcC::all().map(row).collect()
});

fn composed(first: QtcC, next: QtcC) -> u128 {
    let ([k, l], [l_next, m]) = (parts(first), parts(next));
    if (l == AT_REST) != (l_next == AT_REST) {
        return 0;
    }
    let mut found = apart([k, l], [l_next, m]);
    if may_coincide(first) {
        found = anything(k).fold(found, |found, k| found | bit([k, m]));
    }
    if may_coincide(next) {
        found = anything(m).fold(found, |found, m| found | bit([k, m]));
    }
    if may_coincide(first) && may_coincide(next) {
        found |= bit([met(k), met(m)]);
    }
    found
}

/// Returns the possible relations of k to m, as a bit mask, if the position of l differs from both of theirs.
fn apart([k, l]: [Part; 2], [l_next, m]: [Part; 2]) -> u128 {
    let index = |a: usize, b: usize| a * AROUND + b;
    let firsts = segments(k).flat_map(|k| segments(l).map(move |l| index(k, l)));
    let nexts = segments(l_next).flat_map(|l| segments(m).map(move |m| index(l, m)));
    let pairs = firsts.flat_map(|first| nexts.clone().zip(iter::repeat(first)));
    let found = pairs.fold(0, |found, (next, first)| found | APART[first][next]);
    let related = Opra::<2>::all().filter(|relation| found >> relation.index() & 1 == 1);
    related.fold(0, |bits, relation| {
        bits | match relation.segments() {
            Segments::Apart { of_a, of_b } => bit([seen(k, of_a), seen(m, of_b)]),
            Segments::Same { .. } => bit([met(k), met(m)]),
        }
    })
}

impl Compose for QtcC {
    fn compose(self, next: Self) -> RelationSet<Self> {
        RelationSet::from_bits(TABLE[self.index()][next.index()])
    }
}

/// Returns the relative speeds that two points may have, given which of them are at rest.
fn speeds(rest: [bool; 2]) -> &'static [Sign] {
    match rest {
        [true, true] => &[Sign::Zero],
        [true, false] => &[Sign::Minus],
        [false, true] => &[Sign::Plus],
        [false, false] => &Sign::ALL,
    }
}

/// Returns true if there are three speeds that compare like this: the first with the second, the second with the third, and the
/// first with the third.
fn speeds_exist([first, next, last]: [Sign; 3]) -> bool {
    match (first, next) {
        (Sign::Zero, other) | (other, Sign::Zero) => last == other,
        (first, next) => first != next || last == first,
    }
}

static WITH_SPEED: LazyLock<Vec<Vec<u128>>> = LazyLock::new(|| {
    let mut table = vec![vec![0; QtcB22::COUNT]; QtcB22::COUNT];
    for [first, next] in QtcC::all().flat_map(|first| QtcC::all().map(move |next| [first, next])) {
        let ([k, l], [_, m]) = (parts(first), parts(next));
        let [k, l, m] = [k, l, m].map(|part| part == AT_REST);
        let lasts = first.compose(next);
        for of_first in speeds([k, l]) {
            for of_next in speeds([l, m]) {
                let faster = speeds([k, m]).iter().filter(|last| speeds_exist([*of_first, *of_next, **last]));
                let with = |relation: QtcC, speed| QtcB22 { basic: relation.basic(), speed }.index();
                let found = faster.flat_map(|speed| lasts.iter().map(move |last| 1 << with(last, *speed)));
                table[with(first, *of_first)][with(next, *of_next)] |=
                    found.fold(0, |found, bit| found | bit);
            }
        }
    }
    table
});

impl Compose for QtcB22 {
    fn compose(self, next: Self) -> RelationSet<Self> {
        RelationSet::from_bits(WITH_SPEED[self.index()][next.index()])
    }
}
