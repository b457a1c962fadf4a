//! A file that a living process holds: the kernel lets go of it the moment the process dies.
//!
//! Open-file-description locks (`F_OFD_SETLK`). Unlike `flock` they can be queried without being taken. Unlike POSIX
//! locks they do not vanish when the process closes another descriptor of the file.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, fcntl};
use nix::libc;

/// The lock, held as long as this lives; the file stays.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
}

impl Lock {
    /// Takes the lock of the file, which is made where it is missing; `None` where another holds it.
    pub(crate) fn try_take(path: &Path) -> io::Result<Option<Self>> {
        match Self::of(open(path)?) {
            Ok(lock) => Ok(Some(lock)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Takes the lock of a file that is open.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] where another holds it.
    pub(crate) fn of(file: File) -> io::Result<Self> {
        match fcntl(&file, FcntlArg::F_OFD_SETLK(&whole_file())) {
            Ok(_) => Ok(Self { file }),
            Err(Errno::EAGAIN | Errno::EACCES) => Err(io::ErrorKind::WouldBlock.into()),
            Err(error) => Err(error.into()),
        }
    }

    /// Takes the lock of the file, and waits until its holder lets go.
    pub(crate) fn take(path: &Path) -> io::Result<Self> {
        let file = open(path)?;
        loop {
            match fcntl(&file, FcntlArg::F_OFD_SETLKW(&whole_file())) {
                Ok(_) => return Ok(Self { file }),
                Err(Errno::EINTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// As [`Lock::try_take`], and writes this process's id into the file.
    pub(crate) fn try_take_as_this_process(path: &Path) -> io::Result<Option<Self>> {
        let Some(mut lock) = Self::try_take(path)? else { return Ok(None) };
        lock.file.set_len(0)?;
        lock.file.write_all(std::process::id().to_string().as_bytes())?;
        Ok(Some(lock))
    }
}

/// Whether the lock of the file is held; that of a missing file is not.
pub(crate) fn is_held(path: &Path) -> io::Result<bool> {
    let file = match OpenOptions::new().read(true).write(true).custom_flags(libc::O_NOFOLLOW).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(error),
    };
    let mut lock = whole_file();
    fcntl(&file, FcntlArg::F_OFD_GETLK(&mut lock))?;
    Ok(lock.l_type != libc::F_UNLCK as libc::c_short)
}

/// The process id in a lock file; an empty text where there is none.
pub(crate) fn owner(path: &Path) -> String {
    let mut text = String::new();
    if let Ok(mut file) = File::open(path) {
        let _ = file.read_to_string(&mut text);
    }
    text
}

fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).mode(0o600);
    options.custom_flags(libc::O_NOFOLLOW).open(path)
}

fn whole_file() -> libc::flock {
    libc::flock {
        l_type: libc::F_WRLCK as libc::c_short,
        l_whence: libc::SEEK_SET as libc::c_short,
        l_start: 0,
        l_len: 0,
        l_pid: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_once_and_seen_from_outside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert!(!is_held(&path).unwrap());
        let lock = Lock::try_take_as_this_process(&path).unwrap().unwrap();
        assert!(is_held(&path).unwrap() && Lock::try_take(&path).unwrap().is_none());
        assert_eq!(owner(&path), std::process::id().to_string());
        drop(lock);
        assert!(!is_held(&path).unwrap());
    }
}
