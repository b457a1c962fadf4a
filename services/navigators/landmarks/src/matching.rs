//! Decides whether the robot is in the next landmark state of its route (Chronis 2007, 4.6.3 and 4.6.4).
//!
//! The rules are numbered as in the thesis. Rules 1 and 2 (the first and the last state) are implemented by
//! [`crate::follower`], and so are the minimum turn and the minimum distance between matches.

use serde::{Deserialize, Serialize};

use crate::perception::Seen;
use crate::route::{DIRECTIONS, Place, Relation, State};

/// Features that are used for matching (Chronis 2007, table 5.1, adds them one by one).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Features {
    /// The proximity must be within its range (rule 7).
    pub proximity: bool,
    /// The width must be within its range (rule 8).
    pub width: bool,
    /// Objects in both neighbouring directions count as one object in the direction between them (4.6.4).
    pub neighbours: bool,
    /// A relation that was met in each of the three preceding cycles still counts (4.6.4).
    pub temporal: bool,
}

impl Default for Features {
    fn default() -> Self {
        Self { proximity: true, width: true, neighbours: true, temporal: true }
    }
}

/// Which relations of a state were met in each of the last three cycles, as one bit per relation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecentMatches {
    met: [u64; 3],
}

impl RecentMatches {
    /// Processes the objects in view. Returns true if the state is matched (rule 4), that is, if at least one relation of each
    /// object is met.
    ///
    /// A relation is met if it holds now or, with temporal matching, if it held in each of the three
    /// preceding cycles. At least one must hold now. Objects that the state does not mention are ignored
    /// (rule 5). An object in view may be any of the state's objects, unless the robot has recognized it by a marker.
    pub fn matches(&mut self, state: &State, seen: &[Seen], features: Features) -> bool {
        let mut now = 0;
        for (i, relation) in state.relations.iter().enumerate() {
            now |= u64::from(is_met(relation, seen, features)) << i;
        }
        let before = if features.temporal { self.met.iter().fold(u64::MAX, |all, met| all & met) } else { 0 };
        self.met = [now, self.met[0], self.met[1]];
        let known = now | before;
        let mut begin = 0;
        now != 0
            && state.groups().all(|group| {
                let of_group = (u64::MAX >> (64 - group.len())) << begin;
                begin += group.len();
                known & of_group != 0
            })
    }
}

/// Returns true if a relation holds (rules 6 to 8).
pub fn is_met(relation: &Relation, seen: &[Seen], features: Features) -> bool {
    let is_at = |place: Place| {
        seen.iter()
            .any(|seen| seen.place == place && may_be(relation, seen) && has_size(relation, seen, features))
    };
    match relation.place {
        Place::Direction(direction) => {
            let beside = |turn: u8| is_at(Place::Direction((direction + turn) % DIRECTIONS));
            is_at(relation.place) || features.neighbours && beside(1) && beside(DIRECTIONS - 1)
        }
        Place::Surrounds(_) => seen.iter().any(|seen| seen.place == relation.place && may_be(relation, seen)),
    }
}

/// Returns the objects that satisfy a state, as pairs of the index of a relation in the state and the index of an object in `seen`.
/// Earlier cycles and neighbouring directions are not taken into account.
pub fn witnesses<'a>(
    state: &'a State,
    seen: &'a [Seen],
    features: Features,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let features = Features { neighbours: false, ..features };
    state.relations.iter().enumerate().flat_map(move |(i, relation)| {
        let objects = seen.iter().enumerate();
        objects
            .filter(move |(_, one)| is_met(relation, std::slice::from_ref(one), features))
            .map(move |(j, _)| (i, j))
    })
}

/// Returns false if the robot has recognized what it sees as an object other than the one that the relation refers to. Sonars see a
/// large object in several pieces, and a marker is on only one of them, so unrecognized objects may be any object.
fn may_be(relation: &Relation, seen: &Seen) -> bool {
    seen.landmark.is_none() || seen.landmark == relation.landmark
}

fn has_size(relation: &Relation, seen: &Seen, features: Features) -> bool {
    let proximity = relation.proximity_m.filter(|_| features.proximity);
    let width = relation.width.filter(|_| features.width);
    proximity.is_none_or(|range| range.contains(seen.proximity_m))
        && width.is_none_or(|range| range.contains(seen.width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::{Command, Kind, Range};

    fn relation(object: usize, direction: u8) -> Relation {
        let place = Place::Direction(direction);
        Relation { object, place, proximity_m: None, width: None, landmark: None }
    }

    fn state(relations: &[Relation]) -> State {
        State { kind: Kind::Change, relations: relations.to_vec(), command: Command::Forward, after: None }
    }

    fn seen(direction: u8) -> Seen {
        let place = Place::Direction(direction);
        Seen { place, proximity_m: 2.0, width: 30.0, beams: [0, 1], landmark: None }
    }

    fn matches(state: &State, cycles: &[&[u8]]) -> bool {
        let mut recent = RecentMatches::default();
        let cycle =
            |directions: &&[u8]| directions.iter().map(|direction| seen(*direction)).collect::<Vec<_>>();
        let mut last = false;
        for directions in cycles {
            last = recent.matches(state, &cycle(directions), Features::default());
        }
        last
    }

    #[test]
    fn objects_are_joined_by_and_and_their_places_by_or() {
        let state = state(&[relation(0, 5), relation(0, 6), relation(1, 12)]);
        assert!(
            matches(&state, &[&[5, 12]])
                && matches(&state, &[&[6, 12]])
                && matches(&state, &[&[6, 12, 0, 8]])
        );
        assert!(!matches(&state, &[&[5, 6]]) && !matches(&state, &[&[12]]) && !matches(&state, &[&[]]));
    }

    #[test]
    fn a_direction_has_to_be_exact_or_between_two_neighbours() {
        // Chronis 2007, figure 4.24c: 11 and 13 together count as 12, but neither does on its own.
        let state = state(&[relation(0, 12)]);
        assert!(matches(&state, &[&[11, 13]]));
        assert!(!matches(&state, &[&[11]]) && !matches(&state, &[&[13]]) && !matches(&state, &[&[10, 14]]));
        let front = self::state(&[relation(0, 0)]);
        assert!(matches(&front, &[&[15, 1]]));
        let strict = Features { neighbours: false, ..Features::default() };
        assert!(!is_met(&relation(0, 0), &[seen(15), seen(1)], strict));
    }

    #[test]
    fn ranges_have_to_hold_where_they_count() {
        let near = Relation { proximity_m: Some(Range { low: 0.0, high: 1.0 }), ..relation(0, 4) };
        let wide = Relation { width: Some(Range { low: 60.0, high: 90.0 }), ..relation(0, 4) };
        let all = Features::default();
        assert!(!is_met(&near, &[seen(4)], all) && !is_met(&wide, &[seen(4)], all));
        assert!(is_met(&near, &[seen(4)], Features { proximity: false, ..all }));
        assert!(is_met(&wide, &[seen(4)], Features { width: false, ..all }));
        // The neighbours must be at the required distance, too.
        assert!(!is_met(&near, &[seen(3), seen(5)], all));
    }

    #[test]
    fn an_object_that_was_recognized_is_no_other() {
        let desk = Relation { landmark: Some(3), ..relation(0, 4) };
        let is = |landmark, direction| Seen { landmark, ..seen(direction) };
        let is_met = |relation, seen: &[Seen]| is_met(relation, seen, Features::default());
        assert!(is_met(&desk, &[is(Some(3), 4)]), "the desk");
        assert!(is_met(&desk, &[is(None, 4)]), "perhaps the desk");
        assert!(!is_met(&desk, &[is(Some(1), 4)]), "another object");
        assert!(is_met(&desk, &[is(Some(3), 3), is(Some(3), 5)]));
        assert!(!is_met(&desk, &[is(Some(3), 3), is(Some(1), 5)]));
        assert!(!is_met(&relation(0, 4), &[is(Some(1), 4)]), "an object without markers has none");
    }

    #[test]
    fn witnesses_are_the_objects_that_make_a_state_true() {
        let state = state(&[relation(0, 5), relation(1, 12), relation(1, 13)]);
        let found: Vec<_> = witnesses(&state, &[seen(12), seen(0), seen(5)], Features::default()).collect();
        assert_eq!(found, [(0, 2), (1, 0)]);
    }

    #[test]
    fn what_was_seen_three_cycles_long_is_remembered_for_one() {
        // Chronis 2007, figure 4.24: the object on the right has disappeared when the one on the left appears.
        let state = state(&[relation(0, 4), relation(1, 12)]);
        assert!(matches(&state, &[&[12], &[12], &[12], &[4]]));
        assert!(!matches(&state, &[&[], &[12], &[12], &[4]]), "too short: noise");
        assert!(!matches(&state, &[&[12], &[12], &[12], &[], &[4]]), "too long ago");
        let mut recent = RecentMatches::default();
        let without = Features { temporal: false, ..Features::default() };
        for _ in 0..3 {
            assert!(!recent.matches(&state, &[seen(12)], without));
        }
        assert!(!recent.matches(&state, &[seen(4)], without));
    }
}
