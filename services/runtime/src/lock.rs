//! A file lock held by a running process. The kernel releases the lock as soon as the process dies.
//!
//! These are open-file-description locks (`F_OFD_SETLK`). Unlike `flock`, they can be queried without being taken.
//! Unlike POSIX locks, they do not vanish when the process closes another descriptor of the file.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, fcntl};
use nix::libc;

use crate::identity::{self, Identity};

/// Interval between attempts to take a lock that another process holds.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// A lock, held for the lifetime of this value. The file is not removed.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
}

impl Lock {
    /// Acquires the lock of the file, creating the file if it is missing. Returns `None` if another process holds the lock.
    pub(crate) fn try_take(path: &Path) -> io::Result<Option<Self>> {
        match Self::of(open(path)?) {
            Ok(lock) => Ok(Some(lock)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Acquires the lock of an open file.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if another process holds it.
    pub(crate) fn of(file: File) -> io::Result<Self> {
        match fcntl(&file, FcntlArg::F_OFD_SETLK(&whole_file())) {
            Ok(_) => Ok(Self { file }),
            Err(Errno::EAGAIN | Errno::EACCES) => Err(io::ErrorKind::WouldBlock.into()),
            Err(error) => Err(error.into()),
        }
    }

    /// Like [`Lock::try_take`], but also writes this process's identity into the file.
    pub(crate) fn try_take_as_this_process(path: &Path) -> io::Result<Option<Self>> {
        let Some(mut lock) = Self::try_take(path)? else { return Ok(None) };
        lock.file.set_len(0)?;
        lock.file.write_all(identity::text(&Identity::own()?).as_bytes())?;
        Ok(Some(lock))
    }

    /// Like [`Lock::try_take_as_this_process`], but waits up to `limit` for the holder to release the lock. Returns `None` if
    /// it does not.
    pub(crate) fn take_within(path: &Path, limit: Duration) -> io::Result<Option<Self>> {
        let end = Instant::now() + limit;
        loop {
            let taken = Self::try_take_as_this_process(path)?;
            if taken.is_some() || Instant::now() >= end {
                return Ok(taken);
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

/// Waits until no process holds the lock of the file. Returns true if that happened within `limit`.
pub(crate) fn is_free_within(path: &Path, limit: Duration) -> io::Result<bool> {
    let end = Instant::now() + limit;
    while is_held(path)? {
        if Instant::now() >= end {
            return Ok(false);
        }
        std::thread::sleep(LOOK_EVERY);
    }
    Ok(true)
}

/// Returns true if the lock of the file is held. If the file is missing, it is not held.
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

/// Returns the process that a lock file names, or `None` if it names none.
pub(crate) fn owner(path: &Path) -> Option<Identity> {
    Identity::parse(&text(path))
}

/// Describes the holder of a lock file.
pub(crate) fn holder(path: &Path) -> String {
    identity::described(&text(path))
}

fn text(path: &Path) -> String {
    let mut text = String::new();
    if let Ok(file) = File::open(path) {
        let _ = file.take(1024).read_to_string(&mut text);
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
    fn a_lock_has_one_holder_and_is_visible_to_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert!(!is_held(&path).unwrap());
        let lock = Lock::try_take_as_this_process(&path).unwrap().unwrap();
        assert!(is_held(&path).unwrap() && Lock::try_take(&path).unwrap().is_none());
        assert_eq!(owner(&path), Some(Identity::own().unwrap()));
        assert!(!is_free_within(&path, Duration::ZERO).unwrap());
        assert!(Lock::take_within(&path, Duration::ZERO).unwrap().is_none());
        drop(lock);
        assert!(!is_held(&path).unwrap() && is_free_within(&path, Duration::ZERO).unwrap());
    }
}
