//! Errors in drawings, routes in words, and robots.

use sketchnav_schemas::geometry::{self, Point};
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

use crate::route::Command;

/// A position in a drawing, in pixels of its canvas, with x to the right and y up.
pub type Pixel = Point<geometry::Sketch>;

/// Why input is rejected. Each message says where the fault is, what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number in a drawing or a parameter is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Number {
        /// Name of the number.
        what: String,
        /// Description of the valid range.
        expected: &'static str,
        /// The number found.
        found: f64,
    },
    /// The file does not contain strokes in JSON.
    #[error("expected strokes in JSON: {0}")]
    Json(String),
    /// A label in a mission matches no object of the sketch or of the route in words, or more than one.
    #[error("navigator.markers.{label}: expected one object with this label in the sketch or the words, found {found}{}", nearest.as_ref().map_or(String::new(), |word| format!("; did you mean {word:?}?")))]
    Label {
        /// The label in the mission.
        label: String,
        /// Number of objects with this label.
        found: usize,
        /// The label in the sketch that is most similar.
        nearest: Option<String>,
    },
    /// The words are not valid UTF-8.
    #[error("byte {}: expected UTF-8, found something else", at + 1)]
    Text {
        /// Number of valid bytes before the fault.
        at: usize,
    },
    /// No stroke of the drawing qualifies as the route.
    #[error("expected an open line as the route, found {objects} objects and {stray} stray marks")]
    NoRoute {
        /// Number of objects found.
        objects: usize,
        /// Number of marks discarded as stray.
        stray: usize,
    },
    /// More than one stroke qualifies as the route.
    #[error(
        "expected one route, found a second one: stroke {second} at ({:.0}, {:.0}) besides stroke {first}", at.x, at.y
    )]
    SeveralRoutes {
        /// Number of the longer stroke, from 1.
        first: usize,
        /// Number of the other stroke, from 1.
        second: usize,
        /// Start of the other stroke.
        at: Pixel,
    },
    /// A drawing from the pad has goals instead of a route.
    #[error(
        "expected a path past the objects, found none and {found} goals; draw a path to the object at which to stop"
    )]
    Goals {
        /// Number of goals.
        found: usize,
    },
    /// The drawing has no landmarks.
    #[error("expected at least one closed outline as a landmark, found none")]
    NoObjects,
    /// The outline of an object crosses itself.
    #[error("{object}: expected an outline that does not cross itself, found a crossing at ({:.0}, {:.0})", at.x, at.y)]
    OutlineCrossesItself {
        /// Name of the object.
        object: String,
        /// Position of the crossing.
        at: Pixel,
    },
    /// Two objects overlap.
    #[error("expected separate objects, found that {first} and {second} cross at ({:.0}, {:.0})", at.x, at.y)]
    ObjectsCross {
        /// Name of one object.
        first: String,
        /// Name of the other object.
        second: String,
        /// Position where the objects meet.
        at: Pixel,
    },
    /// The route passes through an object.
    #[error("expected a route past objects, found one that enters {object} at ({:.0}, {:.0})", at.x, at.y)]
    RouteThroughObject {
        /// Name of the object.
        object: String,
        /// Position where the route enters the object.
        at: Pixel,
    },
    /// The robot has to turn at a place where no object is in view.
    #[error(
        "step {step} at ({:.0}, {:.0}): expected an object within {radius_m:.1} m where the robot is to {command}",
        at.x,
        at.y
    )]
    NothingInView {
        /// Number of the step along the route, from 1.
        step: usize,
        /// Position of the step in the drawing.
        at: Pixel,
        /// Command to be carried out at the step.
        command: Command,
        /// Range of the robot's sensors.
        radius_m: f64,
    },
    /// A route in words cannot be read.
    #[error("line {line}, {place}: expected {expected}, found {found:?}{}", nearest.as_ref().map_or(String::new(), |word| format!("; did you mean {word:?}?")))]
    Word {
        /// Number of the line, from 1.
        line: usize,
        /// Position in the line.
        place: WordPlace,
        /// Description of what was expected.
        expected: String,
        /// The word found, or an empty string at the end.
        found: String,
        /// The most similar known word.
        nearest: Option<String>,
    },
    /// A route has too few states, or an invalid one.
    #[error("expected {expected}, found {found}")]
    States {
        /// Description of a valid route.
        expected: &'static str,
        /// Description of what was found.
        found: String,
    },
    /// The method cannot use a sensor of the robot.
    #[error("expected {expected}, found {found}")]
    Sensor {
        /// Description of a usable sensor.
        expected: &'static str,
        /// Description of what was found.
        found: String,
    },
}

/// Position of a fault in a line of a route in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordPlace {
    /// At the word with this number, from 1.
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

/// Why a `landmarks` mission cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum LandmarksError {
    /// A key of the mission is invalid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The robot lacks a sensor.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The robot does not have a sensor that sees objects.
    #[error("robot {robot:?}: expected one of the sensors [sonar] and [laser] in its file, found neither")]
    Blind {
        /// Name of the robot.
        robot: String,
    },
    /// The mission names a marker that does not exist in the world.
    #[error("navigator.markers.{label}: expected a marker of the world, which has {count}, found {found}")]
    Marker {
        /// Label of the object that the marker is supposed to be on.
        label: String,
        /// Number of the marker.
        found: u32,
        /// Number of markers in the world.
        count: usize,
    },
    /// The robot has too few sonars.
    #[error("robot {robot:?}: sonar.sonars: expected 8 or more, found {found}")]
    Sonars {
        /// Name of the robot.
        robot: String,
        /// Number of sonars in the ring.
        found: u32,
    },
    /// The file of a sketch or of a route in words cannot be read.
    #[error("{key}: {file}: {reason}")]
    File {
        /// Key that names the file.
        key: &'static str,
        /// Name of the file.
        file: String,
        /// Why reading failed.
        reason: String,
    },
    /// A sketch or a route in words is invalid.
    #[error("{file}: {cause}")]
    Input {
        /// Name of the file.
        file: String,
        /// The fault in the file.
        cause: Error,
    },
    /// The instructions were not written by a sketcher of this build.
    #[error("landmark_route: {0}")]
    Instructions(String),
}
