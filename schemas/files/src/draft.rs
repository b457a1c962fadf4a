//! Writes files that appear under their names only once they are complete. Until then, an earlier file with
//! that name stays in place, even if it is the very file being read. Pipes and devices are written directly.
//!
//! Every command that writes a file uses this module.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use crate::open::O_NONBLOCK;

/// The error that open(2) returns for a pipe without a reader, which has the same number on all Linux platforms.
const ENXIO: i32 = 6;

/// Buffered writer of a draft.
pub type Sink = BufWriter<File>;

/// Maximum number of leftover drafts with one name. Killed processes leave them.
const MAX_DRAFTS: u32 = 1000;

/// A file that is renamed to its final name once it is complete, or removed if it is dropped before that.
#[derive(Debug)]
pub struct Draft {
    path: PathBuf,
    /// The unfinished file, or `None` if a pipe or a device is written directly.
    draft: Option<PathBuf>,
}

impl Draft {
    /// Creates a new version of `path` in a file `path.unfinished` in the same folder. If `path` is a link, this is the folder of
    /// the link's target. Never blocks.
    ///
    /// # Errors
    /// Any I/O error, and [`ErrorKind::NotConnected`] for a named pipe without a reader.
    pub fn begin(path: &Path) -> io::Result<(Self, Sink)> {
        if let Some(there) = std::fs::metadata(path).ok().filter(|there| !there.is_file()) {
            // Renaming a draft over a device would replace the device. Directories are refused as well.
            let file = if there.file_type().is_fifo() { open_pipe(path) } else { open_to_write(path) }?;
            return Ok((Self { path: path.to_owned(), draft: None }, BufWriter::new(file)));
        }
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let (draft, file) = create_beside(&path)?;
        Ok((Self { path, draft: Some(draft) }, BufWriter::new(file)))
    }

    /// Returns the path of the file that the draft will replace.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the unfinished file, so that the caller can check the content before the file is renamed. `None` for
    /// a pipe or a device.
    pub fn written(&self) -> Option<&Path> {
        self.draft.as_deref()
    }

    /// Moves the draft to its final name. Its sink must have been flushed. The file keeps the permissions of
    /// the one it replaces.
    ///
    /// # Errors
    /// Any I/O error, in which case the earlier file is still there.
    pub fn finish(self) -> io::Result<()> {
        let Some(draft) = &self.draft else { return Ok(()) };
        let file = File::open(draft)?;
        if let Ok(earlier) = std::fs::metadata(&self.path) {
            file.set_permissions(earlier.permissions())?;
        }
        file.sync_data()?;
        std::fs::rename(draft, &self.path)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(draft) = &self.draft {
            // After `finish` the draft no longer exists, and removing it fails harmlessly.
            let _ = std::fs::remove_file(draft);
        }
    }
}

fn open_to_write(path: &Path) -> io::Result<File> {
    File::options().write(true).open(path)
}

/// Opens a named pipe for writing. The first open does not block and fails if there is no reader, whereas a
/// plain open would wait for one, possibly forever.
fn open_pipe(path: &Path) -> io::Result<File> {
    let looked = File::options().write(true).custom_flags(O_NONBLOCK).open(path);
    // This stays open until the end: if it were closed as the pipe's only writer, the reader would see the end of the file.
    let _looked = looked.map_err(|error| match error.raw_os_error() {
        Some(ENXIO) => {
            let words =
                "expected a file, or a pipe with a reader, found a pipe without one; start its reader first";
            io::Error::new(ErrorKind::NotConnected, words)
        }
        _ => error,
    })?;
    open_to_write(path)
}

/// Creates a new file next to `path`. If a file with the draft's name exists, it may be somebody else's, so it is left alone and
/// the next number is tried.
fn create_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    for number in 1..=MAX_DRAFTS {
        let mut draft = OsString::from(path);
        draft.push(if number == 1 { ".unfinished".to_owned() } else { format!(".unfinished-{number}") });
        match File::options().write(true).create_new(true).open(&draft) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) if error.kind() == ErrorKind::NotFound => return Err(no_folder(path, error)),
            created => return Ok((draft.into(), created?)),
        }
    }
    let words = format!("expected fewer than {MAX_DRAFTS} files named {}.unfinished", path.display());
    Err(io::Error::new(ErrorKind::AlreadyExists, words))
}

/// Writes a whole file. If this fails, the earlier file stays in place.
///
/// # Errors
/// Any I/O error.
pub fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    let (draft, mut sink) = Draft::begin(path.as_ref())?;
    sink.write_all(bytes.as_ref())?;
    sink.flush()?;
    draft.finish()
}

/// Returns true if two paths refer to the same existing file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Refuses to overwrite an input with the output.
///
/// # Errors
/// [`ErrorKind::AlreadyExists`] if `output` is one of `inputs`.
pub fn refuse_to_overwrite<'a>(inputs: impl IntoIterator<Item = &'a Path>, output: &Path) -> io::Result<()> {
    match inputs.into_iter().any(|input| is_same(input, output)) {
        true => {
            let words = format!("{}: expected a file other than the input", output.display());
            Err(io::Error::new(ErrorKind::AlreadyExists, words))
        }
        false => Ok(()),
    }
}

/// Returns an error that names the folder of `path` if there is no such folder, and otherwise `error`.
fn no_folder(path: &Path, error: io::Error) -> io::Error {
    match path.parent() {
        Some(folder) if !folder.is_dir() => {
            let words = format!("expected a file in an existing folder, found none: {}", folder.display());
            io::Error::new(ErrorKind::NotFound, words)
        }
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn the_earlier_file_stays_until_the_draft_is_complete() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        std::fs::write(&path, "old").unwrap();
        let mut reading = File::open(&path).unwrap();
        let (draft, mut sink) = Draft::begin(&path).unwrap();
        sink.write_all(b"new").unwrap();
        sink.flush().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        draft.finish().unwrap();
        let mut text = String::new();
        reading.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), std::fs::read(&path).unwrap().as_slice()), ("old", &b"new"[..]));
        drop(Draft::begin(&path).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// Regression test: a source named `a.mcap.unfinished` was truncated when `a.mcap` was made from it.
    #[test]
    fn an_existing_file_with_the_drafts_name_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let [path, source] = ["a.mcap", "a.mcap.unfinished"].map(|name| folder.path().join(name));
        std::fs::write(&source, "source").unwrap();
        write(&path, "result").unwrap();
        assert_eq!(std::fs::read(&source).unwrap(), b"source");
        assert_eq!(std::fs::read(&path).unwrap(), b"result");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn permissions_are_kept_and_inputs_are_recognised() {
        let folder = tempfile::tempdir().unwrap();
        let [path, link, other] = ["a", "link", "other"].map(|name| folder.path().join(name));
        std::fs::write(&path, "old").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write(&link, "new").unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(refuse_to_overwrite([other.as_path(), &path], &link).is_err());
        assert!(refuse_to_overwrite([path.as_path()], &other).is_ok());
    }

    /// Regression test: the error was `No such file or directory (os error 2)`.
    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing");
        let error = write(missing.join("a.learned"), "new").unwrap_err().to_string();
        assert_eq!(
            error,
            format!("expected a file in an existing folder, found none: {}", missing.display())
        );
        assert!(!missing.exists());
    }

    /// Regression test: running with `-o /dev/null` as root replaced the device with a file.
    #[test]
    fn devices_and_pipes_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link, file] = ["pipe", "link", "file"].map(|name| folder.path().join(name));
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        // A command with `-o pipe` waited forever.
        assert_eq!(ENXIO, nix::libc::ENXIO);
        let error = Draft::begin(&pipe).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::NotConnected);
        assert!(error.to_string().ends_with("found a pipe without one; start its reader first"), "{error}");
        let mut reader = File::options().read(true).custom_flags(O_NONBLOCK).open(&pipe).unwrap();
        let (draft, mut sink) = Draft::begin(&pipe).unwrap();
        assert_eq!(draft.written(), None);
        sink.write_all(b"said").unwrap();
        sink.flush().unwrap();
        drop(sink);
        draft.finish().unwrap();
        let mut said = Vec::new();
        reader.read_to_end(&mut said).unwrap();
        assert_eq!(said, b"said");
        assert!(!std::fs::metadata(&pipe).unwrap().is_file());
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        Draft::begin(&link).unwrap().0.finish().unwrap();
        assert!(link.is_symlink() && std::fs::read(&file).unwrap().is_empty());
        let error = Draft::begin(folder.path()).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::IsADirectory);
    }
}
