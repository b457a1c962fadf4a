//! A route as landmark states: when the robot sees these objects so, it does that (Chronis 2007, 4.3.5).
//!
//! A state is a condition and a command. The condition joins relations of one object by OR and those of different objects
//! by AND (figure 4.23).

use std::fmt;

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::hof::Surround;

use crate::drawn::DrawnMetres;
use crate::error::Error;

/// An inch, in metres: the constants of Chronis 2007 are in inches.
pub const INCH_M: f64 = 0.0254;

/// How many directions there are around the robot; 0 is in front, 4 left, 8 behind, 12 right (Chronis 2007, figure 4.5).
pub const DIRECTIONS: u8 = 16;

/// The greatest number of relations in a state, so that what is met fits into one word of a state.
pub const MAX_RELATIONS: usize = 64;

/// What the robot does once it has matched a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// Moves straight on.
    Forward,
    /// Turns left while it moves.
    Left,
    /// Turns right while it moves.
    Right,
    /// Stops.
    Stop,
}

impl Command {
    /// The numeric value for the fusion formula (Chronis 2007, figure 4.27): 1 for left, −1 for right.
    pub const fn value(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
            Self::Forward | Self::Stop => 0.0,
        }
    }

    /// Whether the robot turns.
    pub const fn is_turn(self) -> bool {
        matches!(self, Self::Left | Self::Right)
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Forward => "move forward",
            Self::Left => "turn left",
            Self::Right => "turn right",
            Self::Stop => "stop",
        })
    }
}

/// Where an object is, seen from the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// In one of [`DIRECTIONS`].
    Direction(u8),
    /// Around the robot (Chronis 2007, 4.5.2).
    Surrounds(Surround),
}

impl Place {
    /// The direction, if it is one.
    pub const fn direction(self) -> Option<u8> {
        match self {
            Self::Direction(direction) => Some(direction),
            Self::Surrounds(_) => None,
        }
    }
}

/// How many directions lie between two, from 0 to 8.
pub const fn between(a: u8, b: u8) -> u8 {
    let off = a.abs_diff(b) % DIRECTIONS;
    if off > DIRECTIONS / 2 { DIRECTIONS - off } else { off }
}

/// A range of numbers, both ends in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Its lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Range {
    /// Around a number, not below 0.
    pub fn around(middle: f64, tolerance: f64) -> Self {
        Self { low: (middle - tolerance).max(0.0), high: middle + tolerance }
    }

    /// Whether a number is in it.
    pub fn contains(self, number: f64) -> bool {
        self.low <= number && number <= self.high
    }

    /// Its middle.
    pub fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }
}

/// A condition on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    /// The object, by its place in [`Route::objects`].
    pub object: usize,
    /// Where it is.
    pub place: Place,
    /// How far it is, in metres; `None` for any distance.
    pub proximity_m: Option<Range>,
    /// The width of its histogram, from 0 to 180 for a full turn; `None` for any.
    pub width: Option<Range>,
}

/// The greatest distance in a relation, in metres: "at least 2 m away" goes up to it.
pub const MOST_M: f64 = 10_000.0;

/// Why a state is in the route.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Where the route begins.
    Start,
    /// Where the command changes.
    Change,
    /// In the middle of a turn (Chronis 2007, 4.6.2).
    Additional,
    /// Where the route ends.
    End,
}

/// A landmark state with its command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Why it is there.
    pub kind: Kind,
    /// What is to be seen. Relations of one object follow each other.
    pub relations: Vec<Relation>,
    /// What the robot does then.
    pub command: Command,
    /// How far it is from the state before along the route; `None` where nobody drew or said it.
    pub after: Option<DrawnMetres>,
}

impl State {
    /// The relations of each object: one of each has to hold.
    pub fn groups(&self) -> impl Iterator<Item = &[Relation]> {
        self.relations.chunk_by(|a, b| a.object == b.object)
    }
}

/// A route: its landmarks and its states, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// The names of the landmarks.
    pub objects: Vec<String>,
    /// The states, from start to end.
    pub states: Vec<State>,
}

impl Route {
    /// How far each state is from the start along the route, in metres; `None` from where it is not known on.
    pub fn along(&self) -> Vec<Option<DrawnMetres>> {
        let mut along = Some(DrawnMetres::default());
        let mut add = |state: &State| {
            if state.kind != Kind::Start {
                along = along.zip(state.after).map(|(along, after)| along + after);
            }
            along
        };
        self.states.iter().map(&mut add).collect()
    }

    /// The same route with its objects in the order in which states mention them; the others are left out.
    pub fn normalized(&self) -> Self {
        let mut order: Vec<usize> = Vec::new();
        for relation in self.states.iter().flat_map(|state| &state.relations) {
            if !order.contains(&relation.object) {
                order.push(relation.object);
            }
        }
        let mut route = self.clone();
        route.objects = order.iter().map(|object| self.objects[*object].clone()).collect();
        for relation in route.states.iter_mut().flat_map(|state| &mut state.relations) {
            relation.object = order.iter().position(|object| *object == relation.object).unwrap_or(0);
        }
        route
    }

    /// `Ok` where the route can be driven.
    ///
    /// # Errors
    /// [`Error::States`]: fewer than two states; a last command that is not the only stop. Between start and end: a
    /// state with no relation, or with too many; a relation that names no object.
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |expected, found: String| Err(Error::States { expected, found });
        let [_, middle @ .., last] = &self.states[..] else {
            return wrong("a start and an end", format!("{} states", self.states.len()));
        };
        if last.command != Command::Stop {
            return wrong("\"stop\" as the last command", last.command.to_string());
        }
        for (i, state) in self.states.iter().enumerate() {
            if state.relations.iter().any(|relation| relation.object >= self.objects.len()) {
                return wrong(
                    "relations of objects that are listed",
                    format!("another one in state {}", i + 1),
                );
            }
            if state.relations.len() > MAX_RELATIONS {
                return wrong(
                    "at most 64 relations",
                    format!("{} in state {}", state.relations.len(), i + 1),
                );
            }
        }
        if let Some(i) = middle.iter().position(|state| state.relations.is_empty()) {
            return wrong("an object in each state", format!("none in state {}", i + 2));
        }
        match self.states[..self.states.len() - 1].iter().position(|state| state.command == Command::Stop) {
            Some(i) => wrong("\"stop\" as the last command only", format!("it in state {}", i + 1)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_around_the_robot() {
        assert_eq!([between(15, 1), between(1, 15), between(0, 8), between(3, 3)], [2, 2, 8, 0]);
    }
}
