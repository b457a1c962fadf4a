//! Qualitative distances by thresholds with names chosen by the user (ARGD). The idea is from Clementini, Di Felice and
//! Hernández 1997, the form from QSRlib's `argd`.
//!
//! A scale of n thresholds has n labels. Two readings of a threshold are in use, and they assign different labels:
//!
//! - [`Bound::Upper`], used by QSRlib: a threshold is the greatest distance of its label, inclusive. Distances beyond the
//!   last threshold get the last label too.
//! - [`Bound::Lower`], used by Patil 2019, 3.1.2: a threshold is the least distance of its label. Distances below the first
//!   threshold get the first label too. With Near 3.0 m, Medium 3.5 m and Far 4.0 m, a distance of 3.7 m is Medium by this
//!   reading and Far by the other.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::algebra::{Relation, RelationSet, unknown};
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{MAX_COORDINATE, Point};
use crate::network::Table;

/// Maximum number of thresholds in a scale.
pub const MAX_THRESHOLDS: usize = 64;

/// Selects which end of a label's range of distances the threshold marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Bound {
    /// The greatest distance, as in QSRlib.
    Upper,
    /// The least distance, as in Patil 2019.
    Lower,
}

/// A scale of labelled distances.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    thresholds: Vec<f64>,
    labels: Vec<String>,
    bound: Bound,
}

/// A qualitative distance between two objects, which is symmetric. It is the index of a label on the scale, counted from 0
/// for the nearest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rank(u8);

impl Rank {
    /// Returns the index of the label on the scale, from 0.
    pub const fn place(self) -> usize {
        self.0 as usize
    }
}

impl Scale {
    /// Creates a scale from labels and their thresholds, in any order.
    ///
    /// # Errors
    /// [`Error::Thresholds`] if there are no thresholds or more than [`MAX_THRESHOLDS`]; [`Error::Threshold`] if a threshold is
    /// not a number above 0, exceeds [`MAX_COORDINATE`] or is given twice.
    pub fn new<L: Into<String>>(
        labels: impl IntoIterator<Item = (L, f64)>,
        bound: Bound,
    ) -> Result<Self, Error> {
        let mut labels: Vec<_> = labels.into_iter().map(|(label, at)| (label.into(), at)).collect();
        if labels.is_empty() || labels.len() > MAX_THRESHOLDS {
            return Err(Error::Thresholds { limit: MAX_THRESHOLDS, found: labels.len() });
        }
        labels.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut above = 0.0;
        for (at, (_, found)) in labels.iter().enumerate() {
            if !(*found > above && *found <= MAX_COORDINATE) {
                return Err(Error::Threshold { at, above, found: *found });
            }
            above = *found;
        }
        let (labels, thresholds) = labels.into_iter().unzip();
        Ok(Self { thresholds, labels, bound })
    }

    /// Returns the number of labels.
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Returns false, since a scale has at least one label.
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Returns the rank of a distance.
    pub fn rank(&self, distance: f64) -> Rank {
        let passed = |is_passed: fn(&f64, &f64) -> bool| {
            self.thresholds.iter().take_while(|threshold| is_passed(threshold, &distance)).count()
        };
        let rank = match self.bound {
            Bound::Upper => passed(|threshold, distance| threshold < distance).min(self.len() - 1),
            Bound::Lower => passed(|threshold, distance| threshold <= distance).saturating_sub(1),
        };
        Rank(rank as u8)
    }

    /// Returns the label of a rank, or `None` if the rank is beyond the scale.
    pub fn label(&self, rank: Rank) -> Option<&str> {
        self.labels.get(rank.place()).map(String::as_str)
    }

    /// Returns the rank of a label.
    ///
    /// # Errors
    /// [`Error::UnknownRelation`] if the scale has no such label.
    pub fn parse(&self, label: &str) -> Result<Rank, Error> {
        let place = self.labels.iter().position(|own| own == label);
        place.map(|place| Rank(place as u8)).ok_or_else(|| Error::UnknownRelation {
            calculus: Rank::CALCULUS,
            expected: self.labels.join(" "),
            found: label.to_owned(),
        })
    }

    /// Returns the infimum and the supremum of the distances with the given rank.
    pub fn distances(&self, rank: Rank) -> [f64; 2] {
        let place = rank.place().min(self.len() - 1);
        let (below, above) = match self.bound {
            Bound::Upper => (place.checked_sub(1), (place + 1 < self.len()).then_some(place)),
            Bound::Lower => ((place > 0).then_some(place), (place + 1 < self.len()).then_some(place + 1)),
        };
        [below.map_or(0.0, |i| self.thresholds[i]), above.map_or(f64::INFINITY, |i| self.thresholds[i])]
    }

    /// Returns the ranks that the distance between a and c may have, given the rank `first` for a and b and `next` for b and c.
    /// By the triangle inequality the distance is between |d₁ − d₂| and d₁ + d₂, so the result depends on the thresholds.
    pub fn compose(&self, first: Rank, next: Rank) -> RangeInclusive<Rank> {
        let ([a_low, a_high], [b_low, b_high]) = (self.distances(first), self.distances(next));
        let low = (a_low - b_high).max(b_low - a_high).max(0.0);
        // The sum does not reach its supremum if labels exclude their greatest distance.
        let high = a_high + b_high;
        let highest = match self.bound {
            Bound::Upper => self.rank(high),
            Bound::Lower => self.rank(high.next_down()),
        };
        // The difference does not reach its infimum, except for 0, if labels exclude their least distance (upper bounds) or their
        // greatest (lower bounds).
        let lowest = match self.bound {
            Bound::Upper if low > 0.0 => self.rank(low.next_up()),
            _ => self.rank(low),
        };
        lowest..=highest
    }

    /// Returns the table for reasoning about networks of distances on this scale.
    pub fn table(&self) -> Table<Rank> {
        let within = |ranks: RangeInclusive<Rank>| {
            Rank::all().filter(|rank| ranks.contains(rank)).collect::<RelationSet<_>>()
        };
        let all = within(Rank(0)..=Rank((self.len() - 1) as u8));
        Table::from_fn(all, RelationSet::from, |first, next| within(self.compose(first, next)))
    }
}

impl Relation for Rank {
    const CALCULUS: &'static str = "argd";
    const COUNT: usize = MAX_THRESHOLDS;

    fn index(self) -> usize {
        self.place()
    }

    fn from_index(index: usize) -> Option<Self> {
        (index < MAX_THRESHOLDS).then_some(Self(index as u8))
    }

    /// Uses the reading of upper bounds, in which a distance at the threshold has the nearer label. Neighbours are the same for
    /// both readings.
    fn limits_to(self, instant: Self) -> bool {
        self.0 == instant.0 + 1
    }
}

impl fmt::Display for Rank {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl FromStr for Rank {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        word.trim().parse().ok().and_then(Self::from_index).ok_or_else(|| unknown::<Self>(word))
    }
}

impl crate::algebra::Converse for Rank {
    fn converse(self) -> Self {
        self
    }
}

impl Calculus for Scale {
    type Scene = [Point; 2];
    type Relation = Rank;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Rank> {
        Some(self.rank(a.distance(*b)))
    }
}
