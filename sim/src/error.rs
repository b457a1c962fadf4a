//! What can be wrong with a world.

use std::path::PathBuf;

use sketchnav_schemas::bounds::{self, Bound, shown};
use sketchnav_schemas::codes::BodyKind;
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;

/// Why a world cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// An invalid value.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key, or the place in the file.
        key: String,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// Not YAML, a missing key, or a value of the wrong type.
    #[error("{0}")]
    Yaml(String),
    /// Not a picture that can be read.
    #[error("expected a picture, PGM, PNG or BMP: {0}")]
    Picture(#[from] image::ImageError),
    /// Dots, or a picture of them.
    #[error("{0}")]
    Dots(#[from] sketchnav_dots::DotsError),
    /// An invalid robot file.
    #[error("{0}")]
    Robot(#[from] RobotError),
    /// An invalid mission file.
    #[error("{0}")]
    Mission(#[from] MissionError),
    /// A file that cannot be opened or read.
    #[error("{0}")]
    Read(#[from] std::io::Error),
    /// The robot does not fit where it is to start.
    #[error(
        "start at ({x_m:.3}, {y_m:.3}) m: expected {needed_m} m of free floor around it, found a {kind} {distance_m:.3} m away"
    )]
    Start {
        /// Where it was to start.
        x_m: f64,
        /// Where it was to start.
        y_m: f64,
        /// The robot's radius.
        needed_m: f64,
        /// What is in the way.
        kind: BodyKind,
        /// Its distance from the robot's centre; 0 if the centre is inside it.
        distance_m: f64,
    },
    /// One of the above, in a file.
    #[error("{}: {what}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        what: Box<SimError>,
    },
}

impl SimError {
    /// The same error, with the file that it was found in.
    pub fn in_file(self, path: impl Into<PathBuf>) -> Self {
        Self::InFile { path: path.into(), what: Box::new(self) }
    }
}

/// `Ok` if `holds`, otherwise an error with what was expected of `key`.
pub(crate) fn check(
    holds: bool,
    key: impl Into<String>,
    expected: &'static str,
    found: impl std::fmt::Debug,
) -> Result<(), SimError> {
    if holds {
        Ok(())
    } else {
        Err(SimError::Value { key: key.into(), expected, found: format!("{found:?}") })
    }
}

/// `Ok` if all of `values` are within `bound`; the error shows the first that is not.
pub(crate) fn check_within(key: impl Into<String>, bound: Bound, values: &[f64]) -> Result<(), SimError> {
    let wrong = values.iter().find(|value| !bound.holds(**value));
    wrong.map_or(Ok(()), |value| {
        Err(SimError::Value { key: key.into(), expected: bound.words, found: shown(*value) })
    })
}

/// Checks that a robot's start is within bounds, in any world.
pub(crate) fn check_start(start: &Pose<World>) -> Result<(), SimError> {
    check_within("start", bounds::COORDINATE_M, &[start.x, start.y])?;
    check_within("start heading", bounds::ANGLE_DEG, &[start.yaw_rad.to_degrees()])
}
