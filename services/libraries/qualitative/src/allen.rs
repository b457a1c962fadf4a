//! Allen's interval algebra (Allen 1983): the thirteen relations between two intervals.
//!
//! Every relation follows from four comparisons of endpoints. The composition table is enumerated at compile time. Three
//! intervals have at most six distinct endpoints, so intervals over six values cover every case.

use std::cmp::Ordering;

use crate::algebra::{Compose, Converse, Relation, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Interval, not_negative};

words! {
    /// The relation of interval a to interval b.
    Allen, "allen", limits = Allen::reaches, {
        /// Before: a ends before b begins.
        Before = "<",
        /// After: the converse of before.
        After = ">",
        /// Meets: a ends exactly where b begins.
        Meets = "m",
        /// Met by.
        MetBy = "mi",
        /// Overlaps: a begins first, and ends inside b.
        Overlaps = "o",
        /// Overlapped by.
        OverlappedBy = "oi",
        /// Starts: both begin together, and a ends first.
        Starts = "s",
        /// Started by.
        StartedBy = "si",
        /// During: both ends of a are inside b.
        During = "d",
        /// Contains.
        Contains = "di",
        /// Finishes: both end together, and b begins first.
        Finishes = "f",
        /// Finished by.
        FinishedBy = "fi",
        /// Equal.
        Equal = "=",
    }
}

const COUNT: usize = 13;

/// The comparisons of endpoints: start with start, end with end, the end of a with the start of b, and the start of a with
/// the end of b.
type Ends = [Ordering; 4];

impl Allen {
    /// Returns the relation between two intervals. Ends that differ by no more than `tolerance` count as equal.
    ///
    /// Note that a tolerance greater than the length of an interval makes its two ends equal. If such an interval touches
    /// another, the two are reported as equal if both pairs of ends match, and as meeting otherwise.
    pub fn of(a: Interval, b: Interval, tolerance: f64) -> Self {
        let compare = |a: f64, b: f64| {
            let difference = a - b;
            if difference > tolerance {
                Ordering::Greater
            } else if difference < -tolerance {
                Ordering::Less
            } else {
                Ordering::Equal
            }
        };
        Self::from_ends([
            compare(a.low(), b.low()),
            compare(a.high(), b.high()),
            compare(a.high(), b.low()),
            compare(a.low(), b.high()),
        ])
    }

    const fn from_ends(ends: Ends) -> Self {
        use Ordering::{Equal, Greater, Less};
        match ends {
            [Equal, Equal, ..] => Self::Equal,
            [.., Less, _] => Self::Before,
            [.., Greater] => Self::After,
            [.., Equal, _] => Self::Meets,
            [.., Equal] => Self::MetBy,
            [Less, Less, ..] => Self::Overlaps,
            [Greater, Greater, ..] => Self::OverlappedBy,
            [Equal, Less, ..] => Self::Starts,
            [Equal, Greater, ..] => Self::StartedBy,
            [Greater, Less, ..] => Self::During,
            [Less, Greater, ..] => Self::Contains,
            [Greater, Equal, ..] => Self::Finishes,
            [Less, Equal, ..] => Self::FinishedBy,
        }
    }

    const fn ends(self) -> Ends {
        use Ordering::{Equal, Greater, Less};
        match self {
            Self::Before => [Less, Less, Less, Less],
            Self::After => [Greater, Greater, Greater, Greater],
            Self::Meets => [Less, Less, Equal, Less],
            Self::MetBy => [Greater, Greater, Greater, Equal],
            Self::Overlaps => [Less, Less, Greater, Less],
            Self::OverlappedBy => [Greater, Greater, Greater, Less],
            Self::Starts => [Equal, Less, Greater, Less],
            Self::StartedBy => [Equal, Greater, Greater, Less],
            Self::During => [Greater, Less, Greater, Less],
            Self::Contains => [Less, Greater, Greater, Less],
            Self::Finishes => [Greater, Equal, Greater, Less],
            Self::FinishedBy => [Less, Equal, Greater, Less],
            Self::Equal => [Equal, Equal, Greater, Less],
        }
    }

    fn reaches(self, instant: Self) -> bool {
        self.ends().iter().zip(instant.ends()).all(|(end, at)| at == *end || at == Ordering::Equal)
    }

    /// Returns the relation of the mirror images of both intervals, where [low, high] becomes [−high, −low].
    #[must_use]
    pub fn mirrored(self) -> Self {
        let [low, high, end_begin, begin_end] = self.ends();
        Self::from_ends([high.reverse(), low.reverse(), begin_end.reverse(), end_begin.reverse()])
    }
}

impl Converse for Allen {
    fn converse(self) -> Self {
        let [low, high, end_begin, begin_end] = self.ends();
        Self::from_ends([low.reverse(), high.reverse(), begin_end.reverse(), end_begin.reverse()])
    }
}

/// The composition table: for each pair of relations, a bit set of the relations in their composition.
static COMPOSITION: [[u16; COUNT]; COUNT] = composition();

const fn compare(a: usize, b: usize) -> Ordering {
    if a < b {
        Ordering::Less
    } else if a > b {
        Ordering::Greater
    } else {
        Ordering::Equal
    }
}

const fn between(a: [usize; 2], b: [usize; 2]) -> usize {
    Allen::from_ends([compare(a[0], b[0]), compare(a[1], b[1]), compare(a[1], b[0]), compare(a[0], b[1])])
        as usize
}

const fn composition() -> [[u16; COUNT]; COUNT] {
    const ENDS: usize = 6;
    const INTERVALS: usize = ENDS * (ENDS - 1) / 2;
    let mut intervals = [[0; 2]; INTERVALS];
    let (mut i, mut low) = (0, 0);
    while low < ENDS {
        let mut high = low + 1;
        while high < ENDS {
            intervals[i] = [low, high];
            i += 1;
            high += 1;
        }
        low += 1;
    }
    let mut table = [[0; COUNT]; COUNT];
    let mut case = 0;
    while case < INTERVALS * INTERVALS * INTERVALS {
        let a = intervals[case % INTERVALS];
        let b = intervals[case / INTERVALS % INTERVALS];
        let c = intervals[case / INTERVALS / INTERVALS];
        table[between(a, b)][between(b, c)] |= 1 << between(a, c);
        case += 1;
    }
    table
}

impl Compose for Allen {
    fn compose(self, next: Self) -> RelationSet<Self> {
        let bits = COMPOSITION[self.index()][next.index()];
        Self::all().filter(|relation| bits >> relation.index() & 1 == 1).collect()
    }
}

/// [`Allen`] of two intervals.
#[derive(Debug, Clone, Copy, Default)]
pub struct Intervals {
    tolerance: f64,
}

impl Intervals {
    /// Creates the calculus where ends that differ by no more than `tolerance` are equal.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)? })
    }
}

impl Calculus for Intervals {
    type Scene = [Interval; 2];
    type Relation = Allen;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Allen> {
        Some(Allen::of(*a, *b, self.tolerance))
    }
}
