//! The user study of Boniardi et al. 2016, section V-A: a participant draws a place and a path, the robot drives once, and the
//! participant rates statements about it.
//!
//! - [`record`]: what is kept of a participant, as JSON. [`tables`]: what the paper reports, next to the same figures here.
//!   Both are pure.
//! - [`folder`]: the study's folder. Nothing in it that a participant has made is ever replaced.
//! - [`sitting`]: the participant at the page, and which steps the study allows.
//!
//! The program that serves the page judges the drives and writes the pages; nothing here reads the truth.

pub mod folder;
pub mod record;
pub mod sitting;
pub mod tables;

use std::io;
use std::path::PathBuf;

pub use folder::Folder;
pub use record::RecordError;
pub use sitting::Sitting;

/// What is wrong with a study's folder.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// It cannot be created or written to.
    #[error("{}: expected a folder that can be written to: {source}", path.display())]
    NotWritable {
        /// The folder.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// There is no study in it.
    #[error("{}: expected the folder of a study; start one with: sketchnav pad --study DIR", path.display())]
    NoStudy {
        /// The folder.
        path: PathBuf,
    },
    /// It contains something that no study has written.
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
        /// What is to be studied.
        expected: String,
        /// What it studies.
        found: String,
    },
    /// A participant has that code already.
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
    /// A file in it cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}
