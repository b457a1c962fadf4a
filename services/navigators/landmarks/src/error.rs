//! What can be wrong with a drawing, a route in words, or a robot.

use sketchnav_schemas::geometry::{self, Point};
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

use crate::route::Command;

/// A place in a drawing, in pixels of its canvas: x to the right, y up.
pub type Pixel = Point<geometry::Sketch>;

/// Why input was rejected. Each variant names the place, what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number of a drawing or a parameter that is out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Number {
        /// Which number.
        what: String,
        /// What was expected.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A file that is no strokes in JSON.
    #[error("expected strokes in JSON: {0}")]
    Json(String),
    /// A label of a mission that no object of the sketch has, or several.
    #[error("navigator.markers.{label}: expected one object with this label in the sketch, found {found}{}", nearest.as_ref().map_or(String::new(), |word| format!("; did you mean {word:?}?")))]
    Label {
        /// The label.
        label: String,
        /// How many objects have it.
        found: usize,
        /// The label that is nearest to it.
        nearest: Option<String>,
    },
    /// Words in a file that is no text.
    #[error("byte {}: expected UTF-8, found something else", at + 1)]
    Text {
        /// How many bytes before it are text.
        at: usize,
    },
    /// No stroke of the drawing is a route.
    #[error("expected an open line as the route, found {objects} objects and {stray} stray marks")]
    NoRoute {
        /// How many objects there are.
        objects: usize,
        /// How many marks were taken as stray.
        stray: usize,
    },
    /// More than one stroke may be the route.
    #[error(
        "expected one route, found a second one: stroke {second} at ({:.0}, {:.0}) besides stroke {first}", at.x, at.y
    )]
    SeveralRoutes {
        /// The number of the longer stroke, from 1.
        first: usize,
        /// The number of the other one.
        second: usize,
        /// Where the other one begins.
        at: Pixel,
    },
    /// A drawing without landmarks.
    #[error("expected at least one closed outline as a landmark, found none")]
    NoObjects,
    /// The outline of an object crosses itself.
    #[error("{object}: expected an outline that does not cross itself, it does at ({:.0}, {:.0})", at.x, at.y)]
    OutlineCrossesItself {
        /// The name of the object.
        object: String,
        /// Where.
        at: Pixel,
    },
    /// Two objects overlap.
    #[error("expected objects apart, {first} and {second} cross at ({:.0}, {:.0})", at.x, at.y)]
    ObjectsCross {
        /// The name of one.
        first: String,
        /// The name of the other.
        second: String,
        /// Where.
        at: Pixel,
    },
    /// The route goes through an object.
    #[error("expected a route past objects, it enters {object} at ({:.0}, {:.0})", at.x, at.y)]
    RouteThroughObject {
        /// The name of the object.
        object: String,
        /// Where the route enters.
        at: Pixel,
    },
    /// The robot has to turn, and there is nothing to see.
    #[error(
        "step {step} at ({:.0}, {:.0}): expected an object within {radius_m:.1} m where the robot is to {command}",
        at.x,
        at.y
    )]
    NothingInView {
        /// The number of the step along the route, from 1.
        step: usize,
        /// Where the step is in the drawing.
        at: Pixel,
        /// What the robot is to do there.
        command: Command,
        /// How far its sensors reach.
        radius_m: f64,
    },
    /// Reading a route in words failed.
    #[error("line {line}, {place}: expected {expected}, found {found:?}{}", nearest.as_ref().map_or(String::new(), |word| format!("; did you mean {word:?}?")))]
    Word {
        /// The number of the line, from 1.
        line: usize,
        /// Which word of the line, from 1, or its end.
        place: WordPlace,
        /// What was expected.
        expected: String,
        /// The word, or "" at the end.
        found: String,
        /// The known word that is nearest to it.
        nearest: Option<String>,
    },
    /// A route that has too few or wrong states.
    #[error("expected {expected}, found {found}")]
    States {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A robot whose sensor the method cannot use.
    #[error("expected {expected}, found {found}")]
    Sensor {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
}

/// Where in a line of a route in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordPlace {
    /// The word with this number, from 1.
    Word(usize),
    /// After the last word.
    End,
}

impl std::fmt::Display for WordPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Word(number) => write!(f, "word {number}"),
            Self::End => f.write_str("end of line"),
        }
    }
}

/// Why a mission of this kind cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum LandmarksError {
    /// The mission's keys.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// A sensor that the robot lacks.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A robot without a sensor that sees objects.
    #[error("robot {robot:?}: expected one of the sensors [sonar] and [laser] in its file, found neither")]
    Blind {
        /// The robot's name.
        robot: String,
    },
    /// A marker of a mission that the world does not have.
    #[error("navigator.markers.{label}: expected a marker of the world, which has {count}, found {found}")]
    Marker {
        /// The label of its object.
        label: String,
        /// Its number.
        found: u32,
        /// How many markers the world has.
        count: usize,
    },
    /// A ring of too few sonars.
    #[error("robot {robot:?}: sonar.sonars: expected 8 or more, found {found}")]
    Sonars {
        /// The robot's name.
        robot: String,
        /// How many there are.
        found: u32,
    },
    /// Reading the file of a sketch or of words failed.
    #[error("{key}: {file}: {reason}")]
    File {
        /// The key.
        key: &'static str,
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// What is wrong with a sketch or with words.
    #[error("{file}: {cause}")]
    Input {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: Error,
    },
    /// Instructions that no sketcher of this build has sent.
    #[error("landmark_route: {0}")]
    Instructions(String),
}
