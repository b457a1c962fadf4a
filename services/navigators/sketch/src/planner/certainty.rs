//! How likely it is that an arrival is right.
//!
//! Neither the evidence of an alignment nor that of the filter says much about that. Whether regions and doors agree, and by how
//! much, does. A logistic regression combines these signs. `sketchnav eval witnesses` fits its weights.

use serde::{Deserialize, Serialize};

use crate::rooms::Answer;
use sketchnav_mapping::outline::{Place, minus};

/// Distance, in metres, up to which regions and doors have the goal at the same place.
pub const AGREE_M: f64 = 2.5;
/// Largest margin that makes a difference.
const MOST_MARGIN: f64 = 15.0;
/// Number of features.
pub const FEATURES: usize = 4;
/// Probability below which an arrival is doubtful.
pub const DOUBTFUL: f64 = 0.5;
/// The constant and the weight of each feature (see [`Signs::features`]), fitted to arrivals on the first floor of each kind of
/// `sketchnav eval witnesses`.
const WEIGHTS: [f64; FEATURES + 1] = [0.901, 0.669, 1.965, 0.65, -0.2];

/// What an arrival is based on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// The pose that the filter estimates.
    Filter,
    /// The alignment of the outline of what was seen.
    Outline,
}

/// What regions and doors say about a place of the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// True if they have the goal in the same region, or within 2.5 m.
    pub agrees: bool,
    /// Amount by which the best alignment that has the goal elsewhere than where they have it costs more, or 0 if they have no place
    /// for it.
    pub margin: f64,
    /// Share of the alignments that have the goal within 2.5 m of the place.
    pub share_here: f64,
}

impl Said {
    /// Returns what an answer says about a place, which lies in the region `room` of the map. `None` if the answer says nothing.
    pub fn of(answer: &Answer, room: Option<u16>, place: Place) -> Option<Self> {
        let best = answer.hypotheses.first()?;
        let off = best.place.map(|at| minus(at, place));
        let is_near = off.is_some_and(|off| off[0].hypot(off[1]) <= AGREE_M);
        Some(Self {
            agrees: is_near || best.place.is_some() && room == Some(best.room),
            margin: answer.margin.unwrap_or_default(),
            share_here: answer.share_near(place, AGREE_M),
        })
    }
}

/// The signs by which an arrival is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signs {
    /// What the arrival is based on.
    pub basis: Basis,
    /// What regions and doors say, or `None` if they were not asked or have no answer.
    pub rooms: Option<Said>,
}

impl Signs {
    /// Returns the features: whether regions and doors agree, their margin in tens, negative if they disagree, the share of their
    /// alignments with the goal here, and whether the arrival is based on the outline. Regions and doors that say nothing count as
    /// half an agreement.
    pub fn features(&self) -> [f64; FEATURES] {
        let [agrees, margin, share_here] = self.rooms.map_or([0.5, 0.0, 0.5], |said| {
            let margin = said.margin.clamp(0.0, MOST_MARGIN) / 10.0;
            let (agrees, margin) = if said.agrees { (1.0, margin) } else { (0.0, -margin) };
            [agrees, margin, said.share_here]
        });
        [agrees, margin, share_here, f64::from(u8::from(self.basis == Basis::Outline))]
    }

    /// Returns the probability that the arrival is right.
    #[must_use]
    pub fn probability(&self) -> f64 {
        let [constant, weights @ ..] = WEIGHTS;
        let sum: f64 = weights.iter().zip(self.features()).map(|(weight, x)| weight * x).sum();
        1.0 / (1.0 + (-constant - sum).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probability(basis: Basis, rooms: Option<(bool, f64)>) -> f64 {
        let said = |(agrees, margin)| Said { agrees, margin, share_here: if agrees { 0.9 } else { 0.1 } };
        Signs { basis, rooms: rooms.map(said) }.probability()
    }

    #[test]
    fn an_arrival_is_the_surer_the_more_regions_and_doors_agree() {
        for basis in [Basis::Filter, Basis::Outline] {
            let falling =
                [Some((true, 8.0)), Some((true, 1.0)), None, Some((false, 1.0)), Some((false, 8.0))]
                    .map(|rooms| probability(basis, rooms));
            assert!(falling.is_sorted_by(|a, b| a > b), "{basis:?}: {falling:?}");
            assert!(falling[0] > 0.9 && falling[4] < DOUBTFUL, "{basis:?}: {falling:?}");
        }
    }

    #[test]
    fn margins_beyond_the_largest_make_no_difference() {
        let sure = |margin| probability(Basis::Filter, Some((true, margin)));
        assert_eq!(sure(MOST_MARGIN), sure(1e9));
        assert!(sure(f64::INFINITY).is_finite());
    }
}
