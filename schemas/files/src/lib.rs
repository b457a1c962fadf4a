//! Reads the files that people provide: missions, robots, floors, drawings, tables. None is read beyond its [`Limit`]. Results
//! never replace a file before they are complete: [`draft`].
//!
//! A file's size is checked before it is read; one that grows meanwhile is read up to one byte beyond the limit. A file of 8 GB
//! that was named by mistake therefore takes no memory, and its error says what is allowed. Anything but a plain file (a named
//! pipe, a device) is refused by [`open`] before it can block.

pub mod draft;
mod open;
mod store;

use std::io::{self, ErrorKind, Read};
use std::path::Path;

pub use draft::write;
pub use open::open;
pub use store::{Disk, Files};

/// How large a file may be, and what kind it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// What kind of file it is, for errors: `a mission`.
    pub what: &'static str,
    /// Most bytes of it.
    pub bytes: u64,
}

const MIB: u64 = 1 << 20;

/// A mission: 64 tasks with 8192 points take some 200 kB.
pub const MISSION: Limit = Limit { what: "a mission", bytes: 4 * MIB };
/// A robot: a page of text.
pub const ROBOT: Limit = Limit { what: "a robot", bytes: MIB };
/// A floor plan: 20,000 corners of walls take some 500 kB.
pub const FLOOR_PLAN: Limit = Limit { what: "a floor plan", bytes: 4 * MIB };
/// The YAML of a map: a few lines.
pub const MAP: Limit = Limit { what: "a map's YAML", bytes: MIB };
/// The picture of a map: PGM as text takes four bytes per pixel.
pub const MAP_PICTURE: Limit = Limit { what: "a map's picture", bytes: 64 * MIB };
/// A plane of dots: 20,000 places take some 800 kB.
pub const PLANE: Limit = Limit { what: "a plane of dots", bytes: 4 * MIB };
/// A drawing, or another file for a navigator: a photograph of 50 megapixels.
pub const DRAWING: Limit = Limit { what: "a drawing", bytes: 64 * MIB };
/// The description of a run, JSON: a mission as large as its file may be, with an indented line for each number.
pub const RUN: Limit = Limit { what: "the description of a run", bytes: 64 * MIB };
/// A table of places or rooms, for judging.
pub const TABLE: Limit = Limit { what: "a table", bytes: 4 * MIB };
/// A table of positions over time: some million lines.
pub const POSITIONS: Limit = Limit { what: "a table of positions", bytes: 256 * MIB };
/// A plan of faults: ten thousand of them take some 800 kB.
pub const FAULT_PLAN: Limit = Limit { what: "a plan of faults", bytes: 4 * MIB };
/// A page of documentation with figures in it, or the figures themselves: results of all experiments take some 300 kB.
pub const PAGE: Limit = Limit { what: "a page or its figures", bytes: 16 * MIB };
/// Outcomes of a job of an experiment: some hundred bytes per task.
pub const PART: Limit = Limit { what: "a part of an experiment", bytes: 16 * MIB };

impl Limit {
    /// Checks that this many bytes are allowed.
    ///
    /// # Errors
    /// [`ErrorKind::FileTooLarge`] with the limit.
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
/// As [`open`]; [`ErrorKind::FileTooLarge`] with the limit.
pub fn read(path: impl AsRef<Path>, limit: Limit) -> io::Result<Vec<u8>> {
    let file = open(path, limit.what)?;
    limit.check(file.metadata()?.len())?;
    read_from(file, limit)
}

/// Reads the whole file as text.
///
/// # Errors
/// As [`read`], and if it is not UTF-8.
pub fn read_to_string(path: impl AsRef<Path>, limit: Limit) -> io::Result<String> {
    text(read(path, limit)?)
}

/// What was read, as text.
fn text(bytes: Vec<u8>) -> io::Result<String> {
    let text = String::from_utf8(bytes);
    text.map_err(|_| io::Error::new(ErrorKind::InvalidData, "expected UTF-8, found other bytes"))
}

/// Reads everything from a reader.
///
/// # Errors
/// As [`read`].
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

    /// A sparse file of 8 GB was read into memory before its size was checked.
    #[test]
    fn a_file_that_is_too_large_is_refused_before_it_is_read() {
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
    fn other_errors_are_the_systems() {
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
        fn as_much_as_the_limit_is_read_and_no_more(length in 0..30_usize) {
            let bytes = vec![b'a'; length];
            let read = read_from(bytes.as_slice(), FEW);
            prop_assert_eq!(read.ok(), (length <= 10).then_some(bytes));
        }
    }
}
