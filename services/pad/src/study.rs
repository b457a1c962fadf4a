//! The user study of Boniardi et al. 2016, section V-A. A participant draws a place and a path, the robot
//! drives once, and the participant rates statements about it.
//!
//! - [`record`]: the records of a participant, as JSON. [`tables`]: the figures that the paper reports, next
//!   to the same figures here. Both are pure.
//! - [`folder`]: the study's folder. Files made by a participant are never replaced.
//! - [`sitting`]: the participant at the page, and which steps the study allows.
//!
//! The program that serves the page judges the drives and writes the pages. This module does not read the
//! truth.

pub mod folder;
pub mod record;
pub mod sitting;
pub mod tables;

use std::io;
use std::path::PathBuf;

pub use folder::Folder;
pub use record::RecordError;
pub use sitting::Sitting;

/// An error of a study's folder.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The folder cannot be created or written to.
    #[error("{}: expected a folder that can be written to: {source}", path.display())]
    NotWritable {
        /// The folder.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// There is no study in it.
    #[error("{}: expected the folder of a study; start one with: sketchnav pad --study DIR", path.display())]
    NoStudy {
        /// The folder.
        path: PathBuf,
    },
    /// The folder contains something that was not written by a study.
    #[error(
        "{}: expected only what a study writes (participants' folders, {}), found something else, which stays as it is: \
         choose another folder",
        path.display(), folder::OWN.join(", ")
    )]
    Foreign {
        /// What it contains.
        path: PathBuf,
    },
    /// It belongs to another study.
    #[error("{}: expected a study with {expected}, found one with {found}: choose another folder", path.display())]
    Other {
        /// Its description.
        path: PathBuf,
        /// The subject of the study.
        expected: String,
        /// What it studies.
        found: String,
    },
    /// There is already a participant with that code.
    #[error("{}: expected a new participant, found a folder, which stays as it is", path.display())]
    Taken {
        /// The participant's folder.
        path: PathBuf,
    },
    /// A file in it is invalid.
    #[error("{}: {source}", path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: RecordError,
    },
    /// A file in the folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}
