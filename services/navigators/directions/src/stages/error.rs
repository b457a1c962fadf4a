//! Errors in a mission of this kind.

use sketchnav_dots::DotsError;
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

use crate::error::Error;

/// The reason why a mission of this kind cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum DirectionsError {
    /// The mission's keys are invalid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The robot lacks a sensor.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A file cannot be read, or its contents are invalid.
    #[error("{key}: {file}: {reason}")]
    File {
        /// The mission key that names the file.
        key: &'static str,
        /// Name of the file.
        file: String,
        /// Description of the error.
        reason: String,
    },
    /// A custom map or the dots of a plane are invalid.
    #[error("{file}: {cause}")]
    Map {
        /// Name of the file.
        file: String,
        /// The error in the file.
        cause: Error,
    },
    /// A picture of the plane is unusable.
    #[error("{file}: {cause}")]
    Picture {
        /// Name of the file.
        file: String,
        /// The error in the picture.
        cause: DotsError,
    },
    /// The calibration of the picture is unusable.
    #[error("navigator.calibration: {0}")]
    Calibration(DotsError),
    /// The map-maker cannot plan a task.
    #[error("task {number} ({name}): {cause}{}", beside(notices))]
    Plan {
        /// Number of the task, from 1.
        number: usize,
        /// Name of the task.
        name: String,
        /// The reason why planning failed.
        cause: Error,
        /// Earlier findings about the files of the run, which may explain the failure.
        notices: Vec<String>,
    },
    /// The settings of the navigator are invalid.
    #[error("parameters.planner: {0}")]
    Settings(Error),
    /// The custom maps have more entries than the message about them can hold.
    #[error("expected at most {limit} entries of all custom maps, found {found}")]
    TooLong {
        /// Maximum number of entries.
        limit: usize,
        /// Number of entries found.
        found: usize,
    },
}

fn beside(notices: &[String]) -> String {
    notices.iter().map(|notice| format!("; {notice}")).collect()
}
