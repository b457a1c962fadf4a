//! Sources of a run's files: the disk, or a store that contains them under its own names.

use std::io;
use std::path::Path;

use crate::{Limit, read, text};

/// A source of files, which are read by the names used in a mission.
///
/// A store other than the disk, such as a recording, contains nothing but its own files. Reading through it
/// cannot reach the file system, no matter what the names are.
pub trait Files {
    /// Reads the whole file.
    ///
    /// # Errors
    /// An error if there is no such file or it cannot be read, and [`io::ErrorKind::FileTooLarge`], which
    /// gives the limit.
    fn read(&self, name: &Path, limit: Limit) -> io::Result<Vec<u8>>;

    /// Reads the whole file as text.
    ///
    /// # Errors
    /// Any error of [`Files::read`], and [`io::ErrorKind::InvalidData`] if the file is not UTF-8.
    fn read_to_string(&self, name: &Path, limit: Limit) -> io::Result<String> {
        text(self.read(name, limit)?)
    }
}

/// The file system, where names are paths.
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, name: &Path, limit: Limit) -> io::Result<Vec<u8>> {
        read(name, limit)
    }
}
