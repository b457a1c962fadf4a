//! Routes as landmark states: conditions on what the robot sees, each with what the robot does when it holds (Chronis 2007, 4.3.5).
//!
//! A state is a condition and a command. The condition joins relations of the same object with OR, and those
//! of different objects with AND (figure 4.23).

use std::fmt;

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::hof::Surround;

use crate::drawn::DrawnMetres;
use crate::error::Error;

/// An inch, in metres. The constants of Chronis 2007 are in inches.
pub const INCH_M: f64 = 0.0254;

/// Number of directions around the robot. 0 is in front, 4 left, 8 behind and 12 right (Chronis 2007, figure 4.5).
pub const DIRECTIONS: u8 = 16;

/// Maximum number of relations in a state, so that one machine word holds a bit for each of them.
pub const MAX_RELATIONS: usize = 64;

/// What the robot does after it has matched a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// Move straight on.
    Forward,
    /// Turn left while moving.
    Left,
    /// Turn right while moving.
    Right,
    /// Stop.
    Stop,
}

impl Command {
    /// Returns the command's value in the fusion formula (Chronis 2007, figure 4.27): 1 for left, −1 for right, and 0 otherwise.
    pub const fn value(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
            Self::Forward | Self::Stop => 0.0,
        }
    }

    /// Returns true if the command is a turn.
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

/// Place of an object relative to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// In one of the [`DIRECTIONS`].
    Direction(u8),
    /// Around the robot (Chronis 2007, 4.5.2).
    Surrounds(Surround),
}

impl Place {
    /// Returns the direction, or `None` if the object is around the robot.
    pub const fn direction(self) -> Option<u8> {
        match self {
            Self::Direction(direction) => Some(direction),
            Self::Surrounds(_) => None,
        }
    }
}

/// Returns the number of steps between two directions, from 0 to 8.
pub const fn between(a: u8, b: u8) -> u8 {
    let off = a.abs_diff(b) % DIRECTIONS;
    if off > DIRECTIONS / 2 { DIRECTIONS - off } else { off }
}

/// A closed range of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Lower end of the range.
    pub low: f64,
    /// Upper end of the range.
    pub high: f64,
}

impl Range {
    /// Creates the range around a number, with a lower bound of at least 0.
    pub fn around(middle: f64, tolerance: f64) -> Self {
        Self { low: (middle - tolerance).max(0.0), high: middle + tolerance }
    }

    /// Returns true if the number is in the range, including its ends.
    pub fn contains(self, number: f64) -> bool {
        self.low <= number && number <= self.high
    }

    /// Returns the middle of the range.
    pub fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }
}

/// A condition on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    /// Index of the object in [`Route::objects`].
    pub object: usize,
    /// Required place of the object.
    pub place: Place,
    /// Required distance of the object, in metres, or `None` for any distance.
    pub proximity_m: Option<Range>,
    /// Required width of the object's histogram, from 0 to 180 for a full turn, or `None` for any width.
    pub width: Option<Range>,
    /// Index of the object among the landmarks with markers ([`crate::instructions::Marked`]), or `None` if it has no markers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub landmark: Option<usize>,
}

/// Maximum distance in a relation, in metres. The upper end of "at least 2 m away".
pub const MOST_M: f64 = 10_000.0;

/// Why a state is part of a route.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The route begins here.
    Start,
    /// The command changes here.
    Change,
    /// The robot is in the middle of a turn here (Chronis 2007, 4.6.2).
    Additional,
    /// The route ends here.
    End,
}

/// A landmark state and its command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Why the state is part of the route.
    pub kind: Kind,
    /// What the robot must see. Relations of the same object follow each other.
    pub relations: Vec<Relation>,
    /// What the robot does once it has matched the state.
    pub command: Command,
    /// Distance from the previous state along the route, or `None` if it was neither drawn nor stated.
    pub after: Option<DrawnMetres>,
}

impl State {
    /// Returns the relations in groups, one per object. At least one relation of each group has to hold.
    pub fn groups(&self) -> impl Iterator<Item = &[Relation]> {
        self.relations.chunk_by(|a, b| a.object == b.object)
    }
}

/// A route: its landmarks, and its states in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// Names of the landmarks.
    pub objects: Vec<String>,
    /// States, from start to end.
    pub states: Vec<State>,
}

impl Route {
    /// Returns the distance of each state from the start along the route, or `None` for all states from the first one whose
    /// distance is unknown.
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

    /// Returns the same route with its objects in the order in which the states mention them. Objects that no
    /// state mentions are dropped.
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

    /// Checks that the route can be driven.
    ///
    /// # Errors
    /// [`Error::States`] in the following cases:
    /// - There are fewer than two states.
    /// - The last command is not a stop, or another command is.
    /// - A state has too many relations, or one between start and end has none.
    /// - A relation refers to no object of the route.
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
                    "relations of listed objects",
                    format!("an unlisted object in state {}", i + 1),
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
            Some(i) => wrong("\"stop\" only as the last command", format!("it in state {}", i + 1)),
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
