//! Opens files named by the user, which can be anything. Opening a named pipe waits for its writer, opening a device may have side
//! effects, and reading either of them may never end.

use std::fs::{self, File, FileType, Metadata};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Prevents open(2) from waiting for the other end of a pipe. The value is the same on all Linux platforms on which Rust's standard
/// library is tested, except MIPS and SPARC. A test compares it with the C library's.
pub(crate) const O_NONBLOCK: i32 = 0o4000;

/// Opens a regular file for reading, without ever blocking. `what` is the expected kind of file, as used in errors: `a mission`.
///
/// # Errors
/// Any I/O error, and [`ErrorKind::IsADirectory`] or [`ErrorKind::InvalidInput`], which describes what was found, if `path` is not
/// a regular file.
pub fn open(path: impl AsRef<Path>, what: &str) -> io::Result<File> {
    open_plain(path.as_ref(), what).map_err(|error| match error.raw_os_error() {
        Some(_) if error.kind() == ErrorKind::NotFound => {
            io::Error::new(ErrorKind::NotFound, format!("expected {what}, found no such file"))
        }
        Some(_) => io::Error::new(error.kind(), format!("expected {what}: {error}")),
        None => error,
    })
}

fn open_plain(path: &Path, what: &str) -> io::Result<File> {
    // Anything other than a regular file is not even opened ...
    check(&fs::metadata(path)?, what)?;
    let file = File::options().read(true).custom_flags(O_NONBLOCK).open(path)?;
    // ... and anything that has replaced the file since then cannot block.
    check(&file.metadata()?, what)?;
    Ok(file)
}

fn check(found: &Metadata, what: &str) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    let kind = if found.is_dir() { ErrorKind::IsADirectory } else { ErrorKind::InvalidInput };
    let advice = if found.is_dir() { "" } else { "; copy its output into a file first" };
    let words = format!("expected {what}, found {}{advice}", name(found.file_type()));
    Err(io::Error::new(kind, words))
}

fn name(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "something other than a file"
    }
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;

    use nix::sys::stat::Mode;
    use nix::unistd::{mkfifo, pipe};

    use super::*;
    use crate::{DRAWING, MISSION, read, read_to_string};

    #[test]
    fn the_flag_equals_the_c_librarys() {
        assert_eq!(O_NONBLOCK, nix::libc::O_NONBLOCK);
    }

    /// Regression test: `info`, `--faults` and a drawing waited forever for the writer of a named pipe, and read `/dev/zero` up
    /// to the limit.
    #[test]
    fn anything_but_a_plain_file_is_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let [fifo, link, socket, file] =
            ["fifo", "link", "socket", "file"].map(|name| folder.path().join(name));
        mkfifo(&fifo, Mode::S_IRWXU).unwrap();
        symlink(&fifo, &link).unwrap();
        let _listener = UnixListener::bind(&socket).unwrap();
        let (end, _other) = pipe().unwrap();
        let substituted = format!("/proc/self/fd/{}", end.as_raw_fd()).into();
        for (path, found) in [
            (fifo, "a pipe; copy its output into a file first"),
            (link, "a pipe; copy its output into a file first"),
            (substituted, "a pipe; copy its output into a file first"),
            (socket, "a socket; copy its output into a file first"),
            ("/dev/zero".into(), "a device; copy its output into a file first"),
            ("/dev/tty".into(), "a device; copy its output into a file first"),
            (folder.path().to_path_buf(), "a folder"),
        ] {
            let error = open(&path, "a note").unwrap_err().to_string();
            assert_eq!(error, format!("expected a note, found {found}"), "{}", path.display());
            assert!(read(&path, DRAWING).unwrap_err().to_string().ends_with(&format!("found {found}")));
            assert!(
                read_to_string(&path, MISSION).unwrap_err().to_string().ends_with(&format!("found {found}"))
            );
        }
        fs::write(&file, "said").unwrap();
        assert_eq!(io::read_to_string(open(&file, "a note").unwrap()).unwrap(), "said");
        let error = open(folder.path().join("nowhere"), "a note").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotFound);
        assert_eq!(error.to_string(), "expected a note, found no such file");
    }
}
