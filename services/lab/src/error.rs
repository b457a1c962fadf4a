//! What can go wrong with an experiment; a robot that does not arrive is not an error.

use std::path::PathBuf;

use sketchnav_rehearsal::RehearsalError;
use sketchnav_sim::SimError;
use sketchnav_sketch::reading::SketchError;

use crate::judge::anchors::AnchorsError;
use crate::judge::homotopy::CorrespondenceError;
use crate::picture::PictureError;

/// Why a suite cannot be loaded or a trial cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// A suite that does not exist.
    #[error("suite {found:?}: expected one of {known}")]
    Suite {
        /// The name that was asked for.
        found: String,
        /// All suites.
        known: String,
    },
    /// Data that are not part of the project are missing.
    #[error(
        "suite {suite} needs {what}, which is not shipped with sketchnav: expected {file} in the folder given by --data DIR or SKETCHNAV_DATA, found {found}"
    )]
    NoData {
        /// The suite.
        suite: &'static str,
        /// The data.
        what: &'static str,
        /// The file's place in the folder of the data.
        file: &'static str,
        /// What was found instead.
        found: String,
    },
    /// A file that cannot be read.
    #[error("{path}: {cause}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A line of a file that is not as expected.
    #[error("{path}, line {line}: expected {expected}, found {found:?}")]
    Line {
        /// The file.
        path: PathBuf,
        /// The line's number, from 1.
        line: usize,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A marker of a page that cannot be filled.
    #[error("line {line}: expected {expected}, found {found:?}")]
    Marker {
        /// The line's number in the page, from 1.
        line: usize,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A data file of this project that cannot be parsed.
    #[error("{what}: {cause}")]
    Data {
        /// The file's contents.
        what: &'static str,
        /// Why.
        cause: toml::de::Error,
    },
    /// A failure of a map-maker or of a navigator by landmarks.
    #[error(transparent)]
    Directions(#[from] sketchnav_directions::Error),
    /// The world, the robot or the mission file is faulty.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A floor that cannot be drawn.
    #[error(transparent)]
    Deform(#[from] sketchnav_deform::DeformError),
    /// The drawing cannot be read.
    #[error(transparent)]
    Sketch(#[from] SketchError),
    /// The file that says which places of drawings correspond to which places of floors is faulty.
    #[error("{path}: {cause}")]
    Anchors {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: AnchorsError,
    },
    /// The places of a drawing and of its floor do not fit together.
    #[error("{path}: {cause}")]
    Correspondence {
        /// The mission file.
        path: PathBuf,
        /// Why.
        cause: CorrespondenceError,
    },
    /// No path leads between the places of the tasks on the true floor.
    #[error("mission {mission}: expected a path between the places of its tasks, found none")]
    NoWay {
        /// The mission's name.
        mission: String,
    },
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A trial that cannot start.
    #[error("trial {trial}: {cause}")]
    Trial {
        /// The trial's name.
        trial: String,
        /// Why.
        cause: Box<RehearsalError>,
    },
}

/// Reads a file; errors name it.
pub(crate) fn read(path: &std::path::Path) -> Result<Vec<u8>, EvalError> {
    sketchnav_files::read(path, sketchnav_files::DRAWING)
        .map_err(|cause| EvalError::Io { path: path.to_path_buf(), cause })
}
