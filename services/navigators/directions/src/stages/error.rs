//! What can be wrong with a mission of this kind.

use sketchnav_dots::DotsError;
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

use crate::error::Error;

/// Why a mission of this kind cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum DirectionsError {
    /// The mission's keys.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// A sensor that the robot lacks.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Reading a file failed.
    #[error("{key}: {file}: {reason}")]
    File {
        /// The key that names it.
        key: &'static str,
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// A custom map.
    #[error("{file}: {cause}")]
    Map {
        /// Its file.
        file: String,
        /// What is wrong with it.
        cause: Error,
    },
    /// A picture of the plane.
    #[error("{file}: {cause}")]
    Picture {
        /// Its file.
        file: String,
        /// What is wrong with it.
        cause: DotsError,
    },
    /// The calibration of the picture.
    #[error("navigator.calibration: {0}")]
    Calibration(DotsError),
    /// What the map-maker cannot plan.
    #[error("task {number} ({name}): {cause}{}", beside(notices))]
    Plan {
        /// The task, from 1.
        number: usize,
        /// Its name.
        name: String,
        /// Why.
        cause: Error,
        /// What was found wrong before, and may be the reason.
        notices: Vec<String>,
    },
    /// Invalid settings of the navigator.
    #[error("parameters.planner: {0}")]
    Settings(Error),
    /// More entries than the message about them holds.
    #[error("expected at most {limit} entries of all custom maps, found {found}")]
    TooLong {
        /// The most.
        limit: usize,
        /// How many there are.
        found: usize,
    },
}

fn beside(notices: &[String]) -> String {
    notices.iter().map(|notice| format!("; {notice}")).collect()
}
