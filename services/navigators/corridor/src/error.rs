//! What can be wrong with a mission of this kind.

use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

/// Why a rule file is rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RulesError {
    /// No TOML, a key that is not known, a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A row of a rule set, from 1.
    #[error("set {set}, rule {rule}: {key}: expected {expected}, found {found:?}")]
    Row {
        /// Which set, from 1.
        set: usize,
        /// Which rule of it, from 1.
        rule: usize,
        /// The key.
        key: &'static str,
        /// What would be right.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A combination that no rule answers.
    #[error("set {set} ({calculus}): expected a rule for {missing}, found none")]
    Hole {
        /// Which set, from 1.
        set: usize,
        /// Its calculus.
        calculus: &'static str,
        /// The combination.
        missing: String,
    },
    /// A move that no robot makes.
    #[error("moves.{name}: expected at most {most_mps} m/s in each direction, found {found_mps}")]
    Speed {
        /// The move.
        name: String,
        /// Limit.
        most_mps: f64,
        /// The speed.
        found_mps: f64,
    },
    /// No set.
    #[error("expected one [[set]] or more, found none")]
    Empty,
}

/// Why a mission of this kind cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum CorridorError {
    /// The mission's keys.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// A sensor that the robot lacks.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The rule file.
    #[error("{file}: {cause}")]
    Rules {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: RulesError,
    },
    /// Reading the rule file failed.
    #[error("navigator.rules_file: {file}: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// A camera or a heartbeat so slow that no motion of a marker is seen.
    #[error("{key}: expected {least_hz} Hz or more for a method with rules, found {found_hz}")]
    Slow {
        /// The key of the robot's file.
        key: &'static str,
        /// Limit.
        least_hz: f64,
        /// The rate.
        found_hz: f64,
    },
    /// A robot that cannot move sideways, as rules want it to.
    #[error(
        "robot {robot:?}: expected drive = \"omnidirectional\" for a method with rules, found \"differential\""
    )]
    Drive {
        /// The robot's name.
        robot: String,
    },
    /// A floor without markers, for a method that goes by them.
    #[error(
        "world: expected a floor with two [[marker]] tables or more for method = {method:?}, found {found}; \
         method = \"corridor\" needs none"
    )]
    Unmarked {
        /// The method.
        method: &'static str,
        /// How many there are.
        found: usize,
    },
    /// A goal that is not there.
    #[error(
        "task {task} ({name}).marker: expected the number of a marker of the floor, found {found}; it has {known}"
    )]
    Marker {
        /// Which task, from 1.
        task: usize,
        /// Its name.
        name: String,
        /// The number.
        found: u32,
        /// Those that there are.
        known: String,
    },
    /// A robot with neither of the sensors that this method can drive by.
    #[error("robot {robot:?}: expected one of the sensors [laser] and [camera] in its file, found neither")]
    Blind {
        /// The robot's name.
        robot: String,
    },
}
