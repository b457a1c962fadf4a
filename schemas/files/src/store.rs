//! Where the files of a run are: on disk, or elsewhere under names of their own.

use std::io;
use std::path::Path;

use crate::{Limit, read, text};

/// A place that files are read from, by the names that a mission has for them.
///
/// A store that is not the disk, such as a recording, knows its own files and no others. Whoever reads through it cannot
/// reach the file system, whatever the names are.
pub trait Files {
    /// Reads the whole file.
    ///
    /// # Errors
    /// Where there is no such file, or it cannot be read; [`io::ErrorKind::FileTooLarge`] with the limit.
    fn read(&self, name: &Path, limit: Limit) -> io::Result<Vec<u8>>;

    /// Reads the whole file as text.
    ///
    /// # Errors
    /// As [`Files::read`], and where it is not UTF-8.
    fn read_to_string(&self, name: &Path, limit: Limit) -> io::Result<String> {
        text(self.read(name, limit)?)
    }
}

/// The file system: names are paths.
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, name: &Path, limit: Limit) -> io::Result<Vec<u8>> {
        read(name, limit)
    }
}
