//! A custom map in English sentences, for people.

use std::fmt;

use super::{CustomMap, Direction, Entry, Recovery, Sign, Way};
use crate::custom_map::graph::{Edge, Node};
use crate::description::Descriptor;
use crate::geometry::Corner;
use crate::markers::{ANY_KIND, LandmarkKind};
use crate::signature::Signature;

impl CustomMap {
    /// Describes what the navigator does at each entry, in one paragraph per entry.
    pub fn in_words(&self) -> Vec<String> {
        (0..self.entries().len()).map(|entry| self.entry_in_words(entry)).collect()
    }

    fn entry_in_words(&self, number: usize) -> String {
        let entry = &self.entries()[number];
        let mut words = vec![sought(entry, number == 0)];
        if let Some(signs) = entry.verification {
            words.extend(signs.ways().map(|(sign, way)| clause(sign, way)));
        }
        words.extend(self.right(number).map(right));
        words.join(" ")
    }
}

/// Describes the landmark that the navigator seeks. The first entry has no reference, so the closest landmark is the one nearest to
/// the middle of the window.
fn sought(entry: &Entry, is_first: bool) -> String {
    let landmark = match (entry.word, entry.bearing_deg) {
        (Descriptor::Any, Some(_)) => format!("the {}", noun(entry.kind)),
        (word, _) => landmark(entry.kind, word),
    };
    let bearing =
        entry.bearing_deg.map_or(String::new(), |bearing| format!(" at a bearing of {bearing:03}°"));
    match entry.trajectory {
        None if is_first && entry.word == Descriptor::Any && bearing.is_empty() => {
            format!("Take the {} closest to the middle of the window.", noun(entry.kind))
        }
        None => format!("Seek {landmark}{bearing}."),
        Some(Direction::Forward) => {
            format!("Slide along the line towards {landmark}{bearing} until a new landmark comes in.")
        }
        Some(Direction::Backward) => {
            format!("Slide along the line away from {landmark}{bearing} until a new landmark comes in.")
        }
    }
}

/// Returns the words before and after the noun for the landmark of a word.
pub(super) const fn around_noun(word: Descriptor) -> [&'static str; 2] {
    match word {
        Descriptor::Obvious => ["the only", " in view"],
        Descriptor::Isolated => ["the most isolated", ""],
        Descriptor::IsolatedPair => ["the farther", " of the most isolated pair"],
        Descriptor::PlusPair => ["the farther", " of the two in view"],
        Descriptor::New => ["the only", " that has just come into view"],
        Descriptor::Confusable => ["any", " in view"],
        Descriptor::Any => ["the closest", ""],
        Descriptor::Same => ["the same", ""],
    }
}

/// Returns the noun for a landmark: its kind, if that matters.
fn noun(kind: Option<LandmarkKind>) -> String {
    kind.map_or(ANY_KIND.to_owned(), |kind| kind.to_string())
}

fn landmark(kind: Option<LandmarkKind>, word: Descriptor) -> String {
    let [before, after] = around_noun(word);
    format!("{before} {}{after}", noun(kind))
}

/// Describes what to do if the landmark has the given sign.
fn clause(sign: Sign, way: Way) -> String {
    // If there is no landmark, the navigator continues from the one at which the entry began.
    let it = if sign == Sign::Nothing { "the last landmark" } else { "it" };
    let condition = Condition(sign);
    match way {
        Way::Branch(branch) => {
            format!(
                "If {condition}, move {it} to the {} and go on at {}.",
                At(branch.corner),
                branch.entry + 1
            )
        }
        Way::Recover(Recovery { corner, word }) => {
            format!(
                "If {condition}, move {it} to the {} and seek {} from there.",
                At(corner),
                landmark(None, word)
            )
        }
    }
}

/// Describes what to do with the right landmark.
fn right(edge: Edge) -> String {
    let condition = edge.sign.map(|sign| format!("If {}, it is", Condition(sign)));
    let is = condition.as_deref().unwrap_or("It is");
    match (edge.corner, edge.to) {
        (Some(corner), Node::Entry(to)) => {
            let words = format!("ove it to the {} and go on at {}.", At(corner), to + 1);
            condition.map_or_else(|| format!("M{words}"), |is| format!("{is} the right one: m{words}"))
        }
        (Some(corner), Node::Goal) => format!("{is} the goal: move it to the {}.", At(corner)),
        (None, _) => format!("{is} the goal."),
    }
}

/// A corner of the window.
struct At(Corner);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} corner", corner_name(self.0))
    }
}

pub(super) fn corner_name(corner: Corner) -> &'static str {
    match corner {
        Corner::Se => "south-east",
        Corner::Sw => "south-west",
        Corner::Ne => "north-east",
        Corner::Nw => "north-west",
    }
}

/// The surroundings of a landmark, as a condition.
struct Condition(Sign);

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Sign::Count(0) => write!(f, "none of its quadrants holds a landmark"),
            Sign::Count(1) => write!(f, "one of its quadrants holds landmarks"),
            Sign::Count(count) => write!(f, "{count} of its quadrants hold landmarks"),
            Sign::Panorama(seen) => write!(f, "it has {}", around(seen)),
            Sign::Other => write!(f, "it looks different"),
            Sign::Nothing => write!(f, "there is none"),
        }
    }
}

/// Names of the quadrants around a landmark, clockwise from the north-west.
pub(super) const AROUND: [&str; 4] = ["north-west", "north-east", "south-east", "south-west"];
/// Words for the number of landmarks in a quadrant.
pub(super) const DOTS: [&str; 4] = ["no", "one", "two", "more than two"];

fn around(seen: Signature) -> String {
    let quadrants = Corner::ROUND.into_iter().zip(AROUND);
    let held: Vec<String> = quadrants
        .filter_map(|(quadrant, name)| {
            let dots = DOTS[usize::from(seen.dots(quadrant))];
            seen.has(quadrant).then(|| format!("{dots} to the {name}"))
        })
        .collect();
    match held.split_last() {
        None => "no landmark around it".to_owned(),
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(map: &str) -> Vec<String> {
        map.parse::<CustomMap>().unwrap().in_words()
    }

    #[test]
    fn a_straight_map_is_said_in_sentences() {
        assert_eq!(
            words("(*, SW)\n(Isol, 053, (2, SE, IsolPair), (3, -), NE)\n(IsolPair, Trajp, (0, -), -)"),
            [
                "Take the landmark closest to the middle of the window. Move it to the south-west corner and go on at 2.",
                "Seek the most isolated landmark at a bearing of 053°. If 2 of its quadrants hold landmarks, move it to the \
                 south-east corner and seek the farther landmark of the most isolated pair from there. If 3 of its quadrants \
                 hold landmarks, it is the right one: move it to the north-east corner and go on at 3.",
                "Slide along the line towards the farther landmark of the most isolated pair until a new landmark comes in. If \
                 none of its quadrants holds a landmark, it is the goal.",
            ]
        );
    }

    #[test]
    fn a_landmark_known_by_its_bearing_is_not_the_closest() {
        assert_eq!(
            words("(*, SW)\n(*, 053, -)")[1],
            "Seek the landmark at a bearing of 053°. It is the goal."
        );
    }

    #[test]
    fn a_kind_takes_the_place_of_the_landmark() {
        assert_eq!(
            words("(door, *, SW)\n(stairs, *, 053, SW)\n(door, PlusPair, SW)\n(machine, Obvious, -)"),
            [
                "Take the door closest to the middle of the window. Move it to the south-west corner and go on at 2.",
                "Seek the stairs at a bearing of 053°. Move it to the south-west corner and go on at 3.",
                "Seek the farther door of the two in view. Move it to the south-west corner and go on at 4.",
                "Seek the only machine in view. It is the goal.",
            ]
        );
    }

    #[test]
    fn the_landmark_at_hand_is_the_same() {
        assert_eq!(
            words("(*, SW)\n(Same, NE)\n(*, 053, -)")[1],
            "Seek the same landmark. Move it to the north-east corner and go on at 3."
        );
    }

    #[test]
    fn branches_and_panoramas_are_said_in_sentences() {
        let all = words(
            "(*, SW)\n(Isol, (point+none+group+pair, NE, 3), (-, SE, 3), (none+point+none+none, -), SW)\n\
             (New, Trajn, (*, SE, 2), (none+none+none+none, -), -)",
        );
        assert_eq!(
            all[1],
            "Seek the most isolated landmark. If it has one to the north-west, more than two to the south-east and two to \
             the south-west, move it to the north-east corner and go on at 3. If there is none, move the last landmark to \
             the south-east corner and go on at 3. If it has one to the north-east, it is the right one: move it to the \
             south-west corner and go on at 3."
        );
        assert_eq!(
            all[2],
            "Slide along the line away from the only landmark that has just come into view until a new landmark comes in. \
             If it looks different, move it to the south-east corner and go on at 2. If it has no landmark around it, it is \
             the goal."
        );
    }
}
