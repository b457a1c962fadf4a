//! Errors of experiments. If a robot fails to arrive, that is a result and not an error.

use std::path::PathBuf;

use sketchnav_recordings::carmen::CarmenError;
use sketchnav_rehearsal::RehearsalError;
use sketchnav_sim::SimError;
use sketchnav_sketch::learned::LearnError;
use sketchnav_sketch::localizer::LocalizerError;
use sketchnav_sketch::reading::SketchError;

use crate::judge::anchors::AnchorsError;
use crate::judge::homotopy::CorrespondenceError;
use crate::picture::PictureError;

/// Why a suite cannot be loaded or a trial cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The suite does not exist.
    #[error("suite {found:?}: expected one of {known}")]
    Suite {
        /// The requested name.
        found: String,
        /// The names of all suites.
        known: String,
    },
    /// The suite needs data that is not part of the repository.
    #[error(
        "suite {suite} needs {what}, which is not shipped with sketchnav: expected {file} in the folder given by --data DIR or SKETCHNAV_DATA, found {found}"
    )]
    NoData {
        /// The suite that needs the data.
        suite: &'static str,
        /// A description of the data.
        what: &'static str,
        /// Path of the file in the data folder.
        file: &'static str,
        /// What was found instead.
        found: String,
    },
    /// A file cannot be read.
    #[error("{path}: {cause}")]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// The cause of the failure.
        cause: std::io::Error,
    },
    /// A line of a file is malformed.
    #[error("{path}, line {line}: expected {expected}, found {found:?}")]
    Line {
        /// Path of the file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A marker in a page cannot be filled in.
    #[error("line {line}: expected {expected}, found {found:?}")]
    Marker {
        /// Line number of the marker in the page, from 1.
        line: usize,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A data file of this project cannot be parsed.
    #[error("{what}: {cause}")]
    Data {
        /// A description of the file's contents.
        what: &'static str,
        /// The cause of the failure.
        cause: toml::de::Error,
    },
    /// Nothing can be learned from a drive, although the trial requires it.
    #[error("trial {trial}: {cause}")]
    Learn {
        /// Name of the trial.
        trial: String,
        /// The cause of the failure.
        cause: LearnError,
    },
    /// The map-maker or the navigator `directions` failed.
    #[error(transparent)]
    Directions(#[from] sketchnav_directions::Error),
    /// The world, the robot or the mission file is invalid.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The floor cannot be drawn.
    #[error(transparent)]
    Deform(#[from] sketchnav_deform::DeformError),
    /// The drawing cannot be read.
    #[error(transparent)]
    Sketch(#[from] SketchError),
    /// The file that matches positions in drawings with positions on floors is invalid.
    #[error("{path}: {cause}")]
    Anchors {
        /// Path of the file.
        path: PathBuf,
        /// The cause of the failure.
        cause: AnchorsError,
    },
    /// The positions marked in a drawing contradict those on its floor.
    #[error("{path}: {cause}")]
    Correspondence {
        /// Path of the mission file.
        path: PathBuf,
        /// The cause of the failure.
        cause: CorrespondenceError,
    },
    /// A log of a robot cannot be read.
    #[error("{path}: {cause}")]
    Log {
        /// Path of the log.
        path: PathBuf,
        /// The cause of the failure.
        cause: CarmenError,
    },
    /// A log contains no poses to compare with.
    #[error("{path}: expected scans with corrected poses, found none")]
    NoReference {
        /// Path of the log.
        path: PathBuf,
    },
    /// No map can be built from a log.
    #[error("map of {log}: {cause}")]
    Mapping {
        /// Name of the log.
        log: String,
        /// The cause of the failure.
        cause: sketchnav_mapping::Error,
    },
    /// The localizer cannot start in a drawing.
    #[error("drawing of {drawing}: {cause}")]
    Localizer {
        /// Name of the drawing.
        drawing: String,
        /// The cause of the failure.
        cause: LocalizerError,
    },
    /// No path on the true floor connects the goals of the tasks.
    #[error("mission {mission}: expected a path between the places of its tasks, found none")]
    NoWay {
        /// Name of the mission.
        mission: String,
    },
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The trial cannot start.
    #[error("trial {trial}: {cause}")]
    Trial {
        /// Name of the trial.
        trial: String,
        /// The cause of the failure.
        cause: Box<RehearsalError>,
    },
}

/// Reads a file. Errors name it.
pub(crate) fn read(path: &std::path::Path) -> Result<Vec<u8>, EvalError> {
    sketchnav_files::read(path, sketchnav_files::DRAWING)
        .map_err(|cause| EvalError::Io { path: path.to_path_buf(), cause })
}
