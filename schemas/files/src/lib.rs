//! Reads the files that people provide, such as missions, robots, floors, drawings and tables, each up to a
//! [`Limit`]. Files are written by [`draft`], which never replaces a file with an incomplete one.
//!
//! The size of a file is checked before the file is read. If the file grows in the meantime, reading stops one byte beyond the
//! limit. An 8 GB file that is named by mistake is therefore never loaded into memory, and the error gives the limit. [`open`]
//! refuses named pipes, devices and anything else that is not a regular file, before they can block.

pub mod draft;
mod open;
mod store;

use std::io::{self, ErrorKind, Read};
use std::path::Path;

pub use draft::write;
pub use open::open;
pub use store::{Disk, Files};

/// Kind of file, with its maximum size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// The kind of file, as used in errors: `a mission`.
    pub what: &'static str,
    /// Maximum size, in bytes.
    pub bytes: u64,
}

const MIB: u64 = 1 << 20;

/// A mission. 64 tasks with 8192 points take about 200 kB.
pub const MISSION: Limit = Limit { what: "a mission", bytes: 4 * MIB };
/// A robot, which is a page of text.
pub const ROBOT: Limit = Limit { what: "a robot", bytes: MIB };
/// A floor plan. 20,000 corners of walls take about 500 kB.
pub const FLOOR_PLAN: Limit = Limit { what: "a floor plan", bytes: 4 * MIB };
/// The YAML file of a map, which has a few lines.
pub const MAP: Limit = Limit { what: "a map's YAML", bytes: MIB };
/// The image of a map. An ASCII PGM takes four bytes per pixel.
pub const MAP_PICTURE: Limit = Limit { what: "a map's picture", bytes: 64 * MIB };
/// A plane of dots. 20,000 positions take about 800 kB.
pub const PLANE: Limit = Limit { what: "a plane of dots", bytes: 4 * MIB };
/// A drawing, such as a photograph of 50 megapixels, or another file for a navigator.
pub const DRAWING: Limit = Limit { what: "a drawing", bytes: 64 * MIB };
/// The description of a run in JSON. It includes a mission of up to the maximum size, with one indented line per number.
pub const RUN: Limit = Limit { what: "the description of a run", bytes: 64 * MIB };
/// A table of places or rooms for evaluating runs.
pub const TABLE: Limit = Limit { what: "a table", bytes: 4 * MIB };
/// A table of positions over time, with up to a few million rows.
pub const POSITIONS: Limit = Limit { what: "a table of positions", bytes: 256 * MIB };
/// A plan of faults. Ten thousand faults take about 800 kB.
pub const FAULT_PLAN: Limit = Limit { what: "a plan of faults", bytes: 4 * MIB };
/// A page of documentation with figures, or the figures themselves. The results of all experiments take about
/// 300 kB.
pub const PAGE: Limit = Limit { what: "a page or its figures", bytes: 16 * MIB };
/// The outcomes of one job of an experiment, with a few hundred bytes per task.
pub const PART: Limit = Limit { what: "a part of an experiment", bytes: 16 * MIB };

impl Limit {
    /// Checks that a file of this size is within the limit.
    ///
    /// # Errors
    /// [`ErrorKind::FileTooLarge`], which gives the limit, if it is not.
    pub fn check(&self, bytes: u64) -> io::Result<()> {
        if bytes > self.bytes { Err(self.error(bytes)) } else { Ok(()) }
    }

    fn error(&self, found: impl std::fmt::Display) -> io::Error {
        let words = format!("expected {} of at most {} bytes, found {found}", self.what, self.bytes);
        io::Error::new(ErrorKind::FileTooLarge, words)
    }
}

/// Reads the whole file.
///
/// # Errors
/// Any error of [`open`], and [`ErrorKind::FileTooLarge`], which gives the limit.
pub fn read(path: impl AsRef<Path>, limit: Limit) -> io::Result<Vec<u8>> {
    let file = open(path, limit.what)?;
    limit.check(file.metadata()?.len())?;
    read_from(file, limit)
}

/// Reads the whole file as text.
///
/// # Errors
/// Any error of [`read`], and [`ErrorKind::InvalidData`] if the file is not UTF-8.
pub fn read_to_string(path: impl AsRef<Path>, limit: Limit) -> io::Result<String> {
    text(read(path, limit)?)
}

/// Converts the bytes that were read into text.
fn text(bytes: Vec<u8>) -> io::Result<String> {
    let text = String::from_utf8(bytes);
    text.map_err(|_| io::Error::new(ErrorKind::InvalidData, "expected UTF-8, found other bytes"))
}

/// Reads everything from a reader.
///
/// # Errors
/// Any error of the reader, and [`ErrorKind::FileTooLarge`], which gives the limit.
pub fn read_from(reader: impl Read, limit: Limit) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(limit.bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit.bytes { Err(limit.error("more")) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use proptest::prelude::*;

    use super::*;

    const FEW: Limit = Limit { what: "a note", bytes: 10 };

    /// Regression test: a sparse file of 8 GB was read into memory without first checking its size.
    #[test]
    fn an_oversized_file_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        File::create(&path).unwrap().set_len(8 << 30).unwrap();
        let error = read(&path, DRAWING).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        assert_eq!(error.to_string(), "expected a drawing of at most 67108864 bytes, found 8589934592");
        let error = read_to_string(&path, MISSION).unwrap_err().to_string();
        assert!(error.starts_with("expected a mission of at most 4194304 bytes"), "{error}");
    }

    #[test]
    fn other_errors_are_those_of_the_system() {
        let error = read("/nowhere", FEW).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotFound);
        assert_eq!(error.to_string(), "expected a note, found no such file");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bytes");
        std::fs::write(&path, [0xff]).unwrap();
        assert_eq!(read_to_string(&path, FEW).unwrap_err().to_string(), "expected UTF-8, found other bytes");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_file_of_exactly_the_limit_is_read_and_a_larger_one_is_not(length in 0..30_usize) {
            let bytes = vec![b'a'; length];
            let read = read_from(bytes.as_slice(), FEW);
            prop_assert_eq!(read.ok(), (length <= 10).then_some(bytes));
        }
    }
}
