//! Errors in building a world.

use std::path::PathBuf;

use sketchnav_schemas::bounds::{self, Bound, shown};
use sketchnav_schemas::codes::BodyKind;
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::robot::RobotError;
use sketchnav_schemas::toml_text::TomlError;

/// Why a world cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// A value is invalid.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The key, or the position in the file.
        key: String,
        /// Description of a valid value.
        expected: &'static str,
        /// The value found.
        found: String,
    },
    /// The TOML is invalid, a key is unknown, or a value has the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// The YAML is invalid, a key is missing, or a value has the wrong type.
    #[error("{0}")]
    Yaml(String),
    /// The picture cannot be decoded.
    #[error("expected a picture, PGM, PNG or BMP: {0}")]
    Picture(#[from] image::ImageError),
    /// Dots, or a picture of them, are invalid.
    #[error("{0}")]
    Dots(#[from] sketchnav_dots::DotsError),
    /// A robot file is invalid.
    #[error("{0}")]
    Robot(#[from] RobotError),
    /// A mission file is invalid.
    #[error("{0}")]
    Mission(#[from] MissionError),
    /// A file cannot be opened or read.
    #[error("{0}")]
    Read(#[from] std::io::Error),
    /// The robot does not fit at its start.
    #[error(
        "start at ({x_m:.3}, {y_m:.3}) m: expected {needed_m} m of free floor around it, found a {kind} {distance_m:.3} m away"
    )]
    Start {
        /// Start of the robot along x, in metres.
        x_m: f64,
        /// Start of the robot along y, in metres.
        y_m: f64,
        /// Radius of the robot, in metres.
        needed_m: f64,
        /// Kind of body that is in the way.
        kind: BodyKind,
        /// Distance of this body from the robot's centre, in metres. 0 if the centre is inside the body.
        distance_m: f64,
    },
    /// An error in a file.
    #[error("{}: {what}", path.display())]
    InFile {
        /// Path of the file.
        path: PathBuf,
        /// The error.
        #[source]
        what: Box<SimError>,
    },
}

impl SimError {
    /// Wraps the error with the path of the file that it was found in.
    pub fn in_file(self, path: impl Into<PathBuf>) -> Self {
        Self::InFile { path: path.into(), what: Box::new(self) }
    }
}

/// Returns an error that gives the expected value of `key`, unless `holds` is true.
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

/// Returns an error for the first of `values` that is not within `bound`, if there is one.
pub(crate) fn check_within(key: impl Into<String>, bound: Bound, values: &[f64]) -> Result<(), SimError> {
    let wrong = values.iter().find(|value| !bound.holds(**value));
    wrong.map_or(Ok(()), |value| {
        Err(SimError::Value { key: key.into(), expected: bound.words, found: shown(*value) })
    })
}

/// Checks that a robot's start is within the bounds of any world.
pub(crate) fn check_start(start: &Pose<World>) -> Result<(), SimError> {
    check_within("start", bounds::COORDINATE_M, &[start.x, start.y])?;
    check_within("start heading", bounds::ANGLE_DEG, &[start.yaw_rad.to_degrees()])
}
