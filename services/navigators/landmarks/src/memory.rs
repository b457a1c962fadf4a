//! A local memory of objects: returns of the sensors, kept where odometry has them, until the robot is far from them.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::numbers;
use crate::plane::{self, At};

/// How many places are remembered.
pub const PLACES: usize = 48;
/// How many markers are remembered.
pub const MARKERS: usize = 32;

/// How places are remembered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Remembering {
    /// Returns that are nearer to each other are of one place, in metres.
    pub apart_m: f64,
    /// Returns from farther are not taken in, in metres: a sonar's cone is wide there.
    pub reach_m: f64,
    /// A place is forgotten after the robot went so far, in metres: odometry drifts, and drawings are right nearby only.
    pub keep_m: f64,
}

impl Default for Remembering {
    fn default() -> Self {
        Self { apart_m: 0.3, reach_m: 4.0, keep_m: 3.0 }
    }
}

impl Remembering {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        let Self { apart_m, reach_m, keep_m } = *self;
        numbers::from_0_on(&[("apart_m", apart_m), ("reach_m", reach_m), ("keep_m", keep_m)])
    }
}

/// Where something is, seen from the robot's centre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    /// How far ahead, in metres.
    pub ahead_m: f64,
    /// How far to the left, in metres.
    pub left_m: f64,
}

impl Relation {
    /// By the direction from the heading, left positive, and the distance.
    pub fn polar(direction_rad: f64, distance_m: f64) -> Self {
        let (sin, cos) = direction_rad.sin_cos();
        Self { ahead_m: distance_m * cos, left_m: distance_m * sin }
    }

    /// The direction, in radians from the heading, left positive.
    pub fn direction_rad(self) -> f64 {
        self.left_m.atan2(self.ahead_m)
    }

    /// The distance, in metres.
    pub fn distance_m(self) -> f64 {
        self.ahead_m.hypot(self.left_m)
    }
}

/// A marker that the camera sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenMarker {
    /// Its number.
    pub marker: u32,
    /// The number of its object among those with markers.
    pub object: usize,
    /// Where it is.
    pub relation: Relation,
}

/// A marker in the frame of the odometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct MarkedPlace {
    marker: u32,
    object: usize,
    place: Place,
}

/// A place in the frame of the odometry, and how far the robot had gone when it was seen last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Place {
    at: At,
    seen_at_m: f64,
}

/// The robot in the frame of the odometry.
#[derive(Debug, Clone, Copy)]
struct Frame {
    at: At,
    sin: f64,
    cos: f64,
}

impl Frame {
    fn place(self, Relation { ahead_m, left_m }: Relation) -> At {
        let Self { at, sin, cos } = self;
        [at[0] + ahead_m * cos - left_m * sin, at[1] + ahead_m * sin + left_m * cos]
    }

    fn relation(self, place: At) -> Relation {
        let Self { at, sin, cos } = self;
        let [x, y] = [place[0] - at[0], place[1] - at[1]];
        Relation { ahead_m: x * cos + y * sin, left_m: y * cos - x * sin }
    }
}

/// What the robot remembers of its surroundings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    settings: Remembering,
    at: At,
    heading_rad: f64,
    gone_m: f64,
    places: Vec<Place>,
    relations: Vec<Relation>,
    marked_places: Vec<MarkedPlace>,
    marked: Vec<(usize, Relation)>,
}

impl Memory {
    /// Nothing yet.
    pub fn new(settings: Remembering) -> Self {
        let (places, relations) = (Vec::with_capacity(PLACES), Vec::with_capacity(PLACES));
        let (marked_places, marked) = (Vec::with_capacity(MARKERS), Vec::with_capacity(MARKERS));
        Self {
            settings,
            at: [0.0; 2],
            heading_rad: 0.0,
            gone_m: 0.0,
            places,
            relations,
            marked_places,
            marked,
        }
    }

    /// Room for all places: a checkpoint keeps values, not room.
    pub fn reserve(&mut self) {
        self.places.reserve_exact(PLACES.saturating_sub(self.places.len()));
        self.relations.reserve_exact(PLACES.saturating_sub(self.relations.len()));
        self.marked_places.reserve_exact(MARKERS.saturating_sub(self.marked_places.len()));
        self.marked.reserve_exact(MARKERS.saturating_sub(self.marked.len()));
    }

    /// The robot moved and turned.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        let (sin, cos) = (self.heading_rad + turned_rad / 2.0).sin_cos();
        self.at = [self.at[0] + moved_m * cos, self.at[1] + moved_m * sin];
        self.heading_rad += turned_rad;
        self.gone_m += moved_m.abs();
    }

    /// Takes returns in: angles from the heading, and distances from the robot's centre. Places that were seen too long
    /// ago are forgotten.
    pub fn see(&mut self, returns: impl Iterator<Item = Relation>) {
        let Remembering { keep_m, reach_m, .. } = self.settings;
        let gone_m = self.gone_m;
        self.places.retain(|place| gone_m - place.seen_at_m <= keep_m);
        for one in returns.filter(|one| one.distance_m() <= reach_m) {
            self.add(self.place(one));
        }
        let frame = self.frame();
        self.relations.clear();
        self.relations.extend(self.places.iter().map(|place| frame.relation(place.at)));
    }

    /// Takes markers in, as [`Self::see`] does returns. Each is remembered once, where it was seen last.
    pub fn see_markers(&mut self, seen: impl Iterator<Item = SeenMarker>) {
        let (gone_m, keep_m) = (self.gone_m, self.settings.keep_m);
        self.marked_places.retain(|marked| gone_m - marked.place.seen_at_m <= keep_m);
        for SeenMarker { marker, object, relation } in seen {
            let new = MarkedPlace { marker, object, place: self.place(relation) };
            if let Some(known) = self.marked_places.iter_mut().find(|known| known.marker == marker) {
                *known = new;
            } else if self.marked_places.len() < MARKERS {
                self.marked_places.push(new);
            } else if let Some(oldest) =
                (self.marked_places.iter_mut()).min_by(|a, b| a.place.seen_at_m.total_cmp(&b.place.seen_at_m))
            {
                *oldest = new;
            }
        }
        let frame = self.frame();
        self.marked.clear();
        self.marked
            .extend(self.marked_places.iter().map(|marked| (marked.object, frame.relation(marked.place.at))));
    }

    fn frame(&self) -> Frame {
        let (sin, cos) = self.heading_rad.sin_cos();
        Frame { at: self.at, sin, cos }
    }

    /// Where something is that is seen now.
    fn place(&self, relation: Relation) -> Place {
        Place { at: self.frame().place(relation), seen_at_m: self.gone_m }
    }

    /// A place takes the one of an older sight of it; where there is no room, that of the oldest.
    fn add(&mut self, place: Place) {
        let apart_m = self.settings.apart_m;
        if let Some(near) = self.places.iter_mut().find(|near| plane::distance(near.at, place.at) < apart_m) {
            *near = place;
        } else if self.places.len() < PLACES {
            self.places.push(place);
        } else if let Some(oldest) = self.places.iter_mut().min_by(|a, b| a.seen_at_m.total_cmp(&b.seen_at_m))
        {
            *oldest = place;
        }
    }

    /// Where markers are that are remembered: each with the number of its object among those with markers.
    pub fn marked(&self) -> &[(usize, Relation)] {
        &self.marked
    }

    /// Where everything is that is remembered.
    pub fn relations(&self) -> &[Relation] {
        &self.relations
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn see(memory: &mut Memory, returns: &[(f64, f64)]) {
        memory
            .see(returns.iter().map(|(degrees, distance)| Relation::polar(degrees.to_radians(), *distance)));
    }

    #[test]
    fn what_was_in_front_is_beside_the_robot_that_went_on() {
        let mut memory = Memory::new(Remembering::default());
        see(&mut memory, &[(45.0, 8_f64.sqrt())]);
        memory.moved(2.0, 0.0);
        see(&mut memory, &[]);
        let [one] = memory.relations() else { panic!() };
        assert!(
            (one.direction_rad().to_degrees() - 90.0).abs() < 1e-9 && (one.distance_m() - 2.0).abs() < 1e-9
        );
        memory.moved(0.0, 90_f64.to_radians());
        see(&mut memory, &[]);
        assert!(memory.relations()[0].direction_rad().abs() < 1e-9);
        memory.moved(1.1, 0.0);
        see(&mut memory, &[]);
        assert_eq!(memory.relations(), [], "3.1 m on it is forgotten");
    }

    #[test]
    fn a_marker_is_remembered_once_where_it_was_seen_last() {
        let mut memory = Memory::new(Remembering::default());
        let seen =
            |marker, ahead_m| SeenMarker { marker, object: 7, relation: Relation { ahead_m, left_m: 0.0 } };
        memory.see_markers([seen(1, 2.0), seen(2, 3.0)].into_iter());
        memory.moved(1.0, 0.0);
        memory.see_markers([seen(1, 1.1)].into_iter());
        let ahead_m =
            |memory: &Memory| memory.marked().iter().map(|(_, one)| one.ahead_m).collect::<Vec<_>>();
        assert_eq!(ahead_m(&memory), [1.1, 2.0]);
        memory.moved(2.5, 0.0);
        memory.see_markers(std::iter::empty());
        assert!((ahead_m(&memory)[0] + 1.4).abs() < 1e-9, "the second one is forgotten");
        memory.see_markers((0..99).map(|i| seen(i, 1.0)));
        assert_eq!(memory.marked().len(), MARKERS);
    }

    #[test]
    fn one_place_is_remembered_once_and_no_more_than_fit() {
        let mut memory = Memory::new(Remembering::default());
        see(&mut memory, &[(0.0, 2.0), (1.0, 2.0), (0.0, 9.0)]);
        assert_eq!(memory.relations().len(), 1);
        for i in 0..200 {
            memory.moved(0.01, 0.0);
            see(&mut memory, &[(f64::from(i) * 37.0, 1.0 + f64::from(i % 7) * 0.4)]);
        }
        assert_eq!(memory.relations().len(), PLACES);
    }
}
