//! The words for landmarks, and how they select a dot from a view (Park and Kender 1995, 5.6).
//!
//! A word selects one of the *candidates*, which are all dots in the window except the reference landmark. Positions are relative
//! to that landmark or, if there is none yet, to the window's centre. The map-maker and the navigator use the same function, so
//! they can only disagree because of position errors.
//!
//! The paper ranks "all the other objects" of a scene. Here, the reference does not take part in the ranking, because it is known
//! and never a candidate. Ties go to the dot furthest from the reference (5.2), then to the easternmost, then to the northernmost.

use std::cmp::Ordering;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::geometry::{Corner, Point};
use crate::isolation::{c_value, c_value_of_pair, mutual_neighbourhood};

/// Maximum number of candidates. In a more crowded view, no word refers to a landmark.
pub const MOST_CANDIDATES: usize = 64;

/// A word for a landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Descriptor {
    /// The only candidate.
    Obvious,
    /// The candidate with the largest c-value.
    Isolated,
    /// The more distant dot of a pair of mutual closest neighbours. Among several pairs, the one whose c-value is largest counts.
    IsolatedPair,
    /// The more distant of exactly two candidates, which form a triple with the reference. The paper names this word without
    /// defining it.
    PlusPair,
    /// The only candidate that the last movement brought into the window.
    New,
    /// The closest of several candidates that are interchangeable.
    Confusable,
    /// The closest candidate, without further requirements.
    Any,
    /// The reference itself. This word is our own, and makes a robot drive from one side of a landmark to another.
    Same,
}

impl Descriptor {
    /// All words.
    pub const ALL: [Self; 8] = [
        Self::Obvious,
        Self::Isolated,
        Self::IsolatedPair,
        Self::PlusPair,
        Self::New,
        Self::Confusable,
        Self::Any,
        Self::Same,
    ];

    /// The words whose landmark can be determined from a single view.
    pub const DEFINITE: [Self; 4] = [Self::Obvious, Self::Isolated, Self::IsolatedPair, Self::PlusPair];

    /// Returns the word as it is written in custom maps.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Obvious => "Obvious",
            Self::Isolated => "Isol",
            Self::IsolatedPair => "IsolPair",
            Self::PlusPair => "PlusPair",
            Self::New => "New",
            Self::Confusable => "Confusable",
            Self::Any => "*",
            Self::Same => "Same",
        }
    }

    /// Returns the index of the candidate that the word refers to, or `None` if the view has no such landmark.
    ///
    /// For [`Descriptor::New`], pass only the new candidates. [`Descriptor::Same`] refers to none of them.
    pub fn pick(self, candidates: &[Point]) -> Option<usize> {
        if candidates.is_empty() || candidates.len() > MOST_CANDIDATES {
            return None;
        }
        let furthest = |a: &usize, b: &usize| by_distance(candidates[*a], candidates[*b]);
        let all = 0..candidates.len();
        match self {
            Self::Obvious | Self::New => (candidates.len() == 1).then_some(0),
            Self::Isolated => most_isolated(candidates),
            Self::IsolatedPair => isolated_pair(candidates),
            Self::PlusPair if candidates.len() == 2 => all.max_by(furthest),
            Self::PlusPair => None,
            Self::Confusable if candidates.len() < 2 => None,
            Self::Confusable | Self::Any => all.min_by(furthest),
            Self::Same => None,
        }
    }

    /// Returns the index of the position that the word refers to when the reference lies in a corner of a window with the given
    /// side. Positions are relative to the reference. If the quadrant is empty, its edges are moved outwards by `slack`, since a
    /// position error may have put the only candidate outside.
    pub fn pick_in(self, places: &[Point], corner: Corner, side: f64, slack: f64) -> Option<usize> {
        let shown = |slack: f64| -> Vec<usize> {
            (0..places.len()).filter(|&dot| corner.nearly_covers(places[dot], side, slack)).collect()
        };
        let within = shown(0.0);
        let candidates = if within.is_empty() { shown(slack) } else { within };
        let shown: Vec<Point> = candidates.iter().map(|&dot| places[dot]).collect();
        self.pick(&shown).map(|index| candidates[index])
    }
}

impl fmt::Display for Descriptor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A set of words, such as those that a navigator understands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Vocabulary(u8);

impl Vocabulary {
    /// Every word.
    pub const ALL: Self = Self(0xff);

    /// Creates a set of words.
    pub fn of(words: &[Descriptor]) -> Self {
        Self(words.iter().fold(0, |set, &word| set | 1 << word as u8))
    }

    /// Returns true if the set contains a word.
    pub fn has(self, word: Descriptor) -> bool {
        self.0 >> word as u8 & 1 == 1
    }
}

/// Compares two dots by distance from the reference, then from west to east, then from south to north.
fn by_distance(a: Point, b: Point) -> Ordering {
    a.norm_squared().total_cmp(&b.norm_squared()).then(a.x.total_cmp(&b.x)).then(a.y.total_cmp(&b.y))
}

fn most_isolated(candidates: &[Point]) -> Option<usize> {
    let score = |dot| c_value(candidates, dot);
    let better = |a: &(usize, Option<u32>), b: &(usize, Option<u32>)| {
        a.1.cmp(&b.1).then_with(|| by_distance(candidates[a.0], candidates[b.0]))
    };
    (0..candidates.len()).map(|dot| (dot, score(dot))).max_by(better).map(|(dot, _)| dot)
}

fn isolated_pair(candidates: &[Point]) -> Option<usize> {
    let mut best: Option<(u32, usize)> = None;
    for a in 0..candidates.len() {
        for b in a + 1..candidates.len() {
            if mutual_neighbourhood(candidates, a, b) > 2 {
                continue;
            }
            let score = c_value_of_pair(candidates, [a, b]).unwrap_or(u32::MAX);
            let further = if by_distance(candidates[a], candidates[b]).is_gt() { a } else { b };
            let is_better = best.is_none_or(|(most, dot)| {
                score.cmp(&most).then_with(|| by_distance(candidates[further], candidates[dot])).is_gt()
            });
            if is_better {
                best = Some((score, further));
            }
        }
    }
    best.map(|(_, dot)| dot)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(pairs: &[(f64, f64)]) -> Vec<Point> {
        pairs.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    #[test]
    fn one_candidate_is_obvious_and_isolated() {
        let one = points(&[(3.0, 4.0)]);
        assert_eq!(Descriptor::Obvious.pick(&one), Some(0));
        assert_eq!(Descriptor::Isolated.pick(&one), Some(0));
        assert_eq!(Descriptor::Any.pick(&one), Some(0));
        for word in [Descriptor::IsolatedPair, Descriptor::PlusPair, Descriptor::Confusable] {
            assert_eq!(word.pick(&one), None, "{word}");
        }
    }

    #[test]
    fn an_empty_view_and_an_overcrowded_one_have_no_landmark() {
        let crowd: Vec<_> = (0..=MOST_CANDIDATES).map(|i| Point::new(i as f64, 1.0)).collect();
        for word in Descriptor::ALL {
            assert_eq!(word.pick(&[]), None, "{word}");
            assert_eq!(word.pick(&crowd), None, "{word}");
        }
    }

    #[test]
    fn two_candidates_tie_and_the_further_one_is_isolated() {
        let two = points(&[(1.0, 1.0), (5.0, 5.0)]);
        assert_eq!(Descriptor::Isolated.pick(&two), Some(1));
        assert_eq!(Descriptor::PlusPair.pick(&two), Some(1));
        assert_eq!(Descriptor::IsolatedPair.pick(&two), Some(1));
        assert_eq!(Descriptor::Obvious.pick(&two), None);
        assert_eq!(Descriptor::Any.pick(&two), Some(0));
    }

    #[test]
    fn equal_distances_go_to_the_east_and_then_to_the_north() {
        assert_eq!(Descriptor::Isolated.pick(&points(&[(3.0, 4.0), (4.0, 3.0)])), Some(1));
        assert_eq!(Descriptor::Isolated.pick(&points(&[(4.0, -3.0), (4.0, 3.0)])), Some(1));
    }

    #[test]
    fn figure_20_has_a_isolated_and_b_with_c_as_the_pair() {
        // The reference lies south-west of all dots. B and C form a pair, and C is the more distant one.
        let figure = points(&[(1.0, 11.0), (7.0, 5.0), (9.0, 3.0), (12.0, 1.0)]);
        assert_eq!(Descriptor::Isolated.pick(&figure), Some(0));
        assert_eq!(Descriptor::IsolatedPair.pick(&figure), Some(2));
        assert_eq!(Descriptor::PlusPair.pick(&figure), None);
        assert_eq!(Descriptor::Confusable.pick(&figure), Some(1));
    }

    /// The camera's error moves the window, so that one dot crosses its edge and a different dot becomes the isolated one.
    #[test]
    fn a_dot_that_crosses_the_edge_of_the_quadrant_changes_what_is_isolated() {
        let picked = |dots: &[Point]| Descriptor::Isolated.pick_in(dots, Corner::Sw, 10.0, 1.0);
        let dots = points(&[(2.0, 3.0), (6.0, 7.0), (10.2, 9.0)]);
        assert_eq!(picked(&dots), Some(1));
        let moved: Vec<_> = dots.iter().map(|&dot| dot - Point::new(0.3, 0.0)).collect();
        assert_ne!(picked(&moved), Some(1), "the third dot has come in");
        // The only candidate is accepted from just outside the quadrant, but no farther.
        assert_eq!(picked(&points(&[(10.5, 5.0), (12.0, 5.0)])), Some(0));
        assert_eq!(picked(&points(&[(11.5, 5.0)])), None);
    }

    #[test]
    fn a_vocabulary_has_its_words_alone() {
        let two = Vocabulary::of(&[Descriptor::Isolated, Descriptor::Any]);
        let had: Vec<_> = Descriptor::ALL.into_iter().filter(|&word| two.has(word)).collect();
        assert_eq!(had, [Descriptor::Isolated, Descriptor::Any]);
        assert!(Descriptor::ALL.into_iter().all(|word| Vocabulary::ALL.has(word)));
    }
}
