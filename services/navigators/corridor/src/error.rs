//! Errors in missions for the navigator `corridor`.

use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;
use sketchnav_schemas::toml_text::TomlError;

/// Why a rule file is rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RulesError {
    /// The text is not TOML, or has an unknown key or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// A rule has an invalid value, or the same combination as another rule.
    #[error("set {set}, rule {rule}: {key}: expected {expected}, found {found:?}")]
    Row {
        /// Number of the rule set, from 1.
        set: usize,
        /// Number of the rule in its set, from 1.
        rule: usize,
        /// The key with the invalid value.
        key: &'static str,
        /// Description of a valid value.
        expected: String,
        /// The value found.
        found: String,
    },
    /// No rule of a set applies to a combination of relations.
    #[error("set {set} ({calculus}): expected a rule for {missing}, found none")]
    Hole {
        /// Number of the rule set, from 1.
        set: usize,
        /// Calculus of the set.
        calculus: &'static str,
        /// The combination without a rule.
        missing: String,
    },
    /// A move is faster than any robot.
    #[error("moves.{name}: expected at most {most_mps} m/s in each direction, found {found_mps}")]
    Speed {
        /// Name of the move.
        name: String,
        /// Maximum speed in each direction, in metres per second.
        most_mps: f64,
        /// Speed of the move, in metres per second.
        found_mps: f64,
    },
    /// The file contains no rule set.
    #[error("expected one [[set]] or more, found none")]
    Empty,
}

/// Why a `corridor` mission cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum CorridorError {
    /// A key of the mission is invalid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The robot lacks a sensor.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The rule file is invalid.
    #[error("{file}: {cause}")]
    Rules {
        /// Name of the rule file.
        file: String,
        /// The fault in the file.
        cause: RulesError,
    },
    /// The rule file could not be read.
    #[error("navigator.rules_file: {file}: {reason}")]
    File {
        /// Name of the rule file.
        file: String,
        /// Why reading failed.
        reason: String,
    },
    /// The camera or the tick is too slow to see the motion of a marker.
    #[error("{key}: expected {least_hz} Hz or more for a method with rules, found {found_hz}")]
    Slow {
        /// Key in the robot's file.
        key: &'static str,
        /// Minimum rate, in hertz.
        least_hz: f64,
        /// Rate found, in hertz.
        found_hz: f64,
    },
    /// The rules require sideways motion, which the robot is not capable of.
    #[error(
        "robot {robot:?}: expected drive = \"omnidirectional\" for a method with rules, found \"differential\""
    )]
    Drive {
        /// Name of the robot.
        robot: String,
    },
    /// The floor has fewer than two markers, and the method depends on them.
    #[error(
        "world: expected a floor with two [[marker]] tables or more for method = {method:?}, found {found}; \
         method = \"corridor\" needs none"
    )]
    Unmarked {
        /// Name of the method.
        method: &'static str,
        /// Number of markers on the floor.
        found: usize,
    },
    /// The goal of a task is a marker that does not exist on the floor.
    #[error(
        "task {task} ({name}).marker: expected the number of a marker of the floor, found {found}; it has {known}"
    )]
    Marker {
        /// Number of the task, from 1.
        task: usize,
        /// Name of the task.
        name: String,
        /// Number of the missing marker.
        found: u32,
        /// Numbers of the floor's markers, as a list.
        known: String,
    },
    /// The robot has neither of the sensors that this method can use.
    #[error("robot {robot:?}: expected one of the sensors [laser] and [camera] in its file, found neither")]
    Blind {
        /// Name of the robot.
        robot: String,
    },
}
