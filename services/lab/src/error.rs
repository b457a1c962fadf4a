//! What can go wrong with an experiment; a robot that does not arrive is no error.

use std::path::PathBuf;

use sketchnav_rehearsal::RehearsalError;
use sketchnav_sim::SimError;
use sketchnav_sketch::reading::SketchError;

use crate::judge::anchors::AnchorsError;
use crate::judge::homotopy::CorrespondenceError;
use crate::picture::PictureError;

/// Why a suite cannot be loaded or a trial not be driven.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// A suite that does not exist.
    #[error("suite {found:?}: expected one of {known}")]
    Suite {
        /// What was asked for.
        found: String,
        /// All that there are.
        known: String,
    },
    /// Data that are not part of the project.
    #[error(
        "suite {suite} needs {what}, which is not part of sketchnav: expected {file} in the folder that --data DIR or the variable SKETCHNAV_DATA names, found {found}"
    )]
    NoData {
        /// What was to be driven.
        suite: &'static str,
        /// What is missing.
        what: &'static str,
        /// Where it would lie.
        file: &'static str,
        /// What there is in its place.
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
    /// A line of a file that is not what it should be.
    #[error("{path}, line {line}: expected {expected}, found {found:?}")]
    Line {
        /// The file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What would be right.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// A marker of a page that cannot be filled.
    #[error("line {line}: expected {expected}, found {found:?}")]
    Marker {
        /// Which line of the page, from 1.
        line: usize,
        /// What would be right.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A data file of ours that is not what it should be.
    #[error("{what}: {cause}")]
    Data {
        /// Which.
        what: &'static str,
        /// Why.
        cause: toml::de::Error,
    },
    /// What a map-maker or a navigator by landmarks cannot do.
    #[error(transparent)]
    Directions(#[from] sketchnav_directions::Error),
    /// The world, the robot or a mission file.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A floor that cannot be drawn.
    #[error(transparent)]
    Deform(#[from] sketchnav_deform::DeformError),
    /// A drawing.
    #[error(transparent)]
    Sketch(#[from] SketchError),
    /// The file that says which places of drawings are which places of floors.
    #[error("{path}: {cause}")]
    Anchors {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: AnchorsError,
    },
    /// Places of a drawing and of its floor that do not fit together.
    #[error("{path}: {cause}")]
    Correspondence {
        /// The mission file.
        path: PathBuf,
        /// Why.
        cause: CorrespondenceError,
    },
    /// Tasks between which no way leads on the true floor.
    #[error("mission {mission}: expected ways between the places of its tasks, found none")]
    NoWay {
        /// Its name.
        mission: String,
    },
    /// A picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A trial that cannot begin.
    #[error("trial {trial}: {cause}")]
    Trial {
        /// Its name.
        trial: String,
        /// Why.
        cause: Box<RehearsalError>,
    },
}

/// Reads a file; the error names it.
pub(crate) fn read(path: &std::path::Path) -> Result<Vec<u8>, EvalError> {
    sketchnav_files::read(path, sketchnav_files::DRAWING)
        .map_err(|cause| EvalError::Io { path: path.to_path_buf(), cause })
}
