//! The folder of all systems of a user. It is never a folder that another user could have prepared.

use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::unistd::getuid;

use crate::lock::{self, Lock};
use crate::shared::SHARED_MEMORY;
use crate::{Error, Result};

/// Maximum time to wait for the guard. Starting or clearing a system takes a fraction of a second, and each process that does
/// not end when asked to adds a second.
const GUARDED: Duration = Duration::from_secs(15);

/// Returns the folder, which is `$XDG_RUNTIME_DIR/sketchnav` or `/dev/shm/sketchnav-<uid>`. It is created if it is missing.
///
/// Both are in memory. iceoryx2 syncs every file that describes a channel, along with its folder, so starting a system involves
/// about 300 syncs, which would take longer on a disk than the rest of the start.
pub(crate) fn of_this_user() -> Result<PathBuf> {
    let root = match std::env::var_os("XDG_RUNTIME_DIR").filter(|v| !v.is_empty()) {
        Some(runtime) => PathBuf::from(runtime).join("sketchnav"),
        None => Path::new(SHARED_MEMORY).join(format!("sketchnav-{}", getuid())),
    };
    private_folder(&root)?;
    Ok(root)
}

/// Acquires the lock that is held while a system starts or is cleared, so that a system that is being created is not mistaken for a
/// dead one.
///
/// # Errors
/// [`Error::Guarded`] if another process holds the lock for too long.
pub(crate) fn guard(root: &Path) -> Result<Lock> {
    guard_within(root, GUARDED)
}

fn guard_within(root: &Path, limit: Duration) -> Result<Lock> {
    let path = root.join(".guard");
    let taken = Lock::take_within(&path, limit).map_err(Error::file(&path, "locking"))?;
    taken.ok_or_else(|| Error::Guarded { holder: lock::holder(&path), path, seconds: limit.as_secs() })
}

/// Creates the folder with mode 0700, or checks that only this user may access it.
pub(crate) fn private_folder(path: &Path) -> Result<()> {
    match DirBuilder::new().mode(0o700).create(path) {
        Ok(()) => return Ok(()),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        Err(error) => return Err(Error::file(path, "creating the folder")(error)),
    }
    let found = fs::symlink_metadata(path).map_err(Error::file(path, "inspecting it"))?;
    let uid = getuid().as_raw();
    let complaint = if found.file_type().is_symlink() {
        "a link".to_string()
    } else if !found.is_dir() {
        "a file".to_string()
    } else if found.uid() != uid {
        format!("a folder of user {}", found.uid())
    } else if found.mode() & 0o077 != 0 {
        format!("mode {:04o}", found.mode() & 0o7777)
    } else {
        return Ok(());
    };
    Err(Error::ForeignRoot { path: path.into(), uid, found: complaint })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    /// Regression test: a `run` that was stopped while starting made every later one wait silently.
    #[test]
    fn a_guard_that_stays_locked_is_reported_with_its_holder() {
        let root = tempfile::tempdir().unwrap();
        let held = guard(root.path()).unwrap();
        let error = guard_within(root.path(), Duration::from_millis(20)).unwrap_err().to_string();
        let holder = format!("process {} (", std::process::id());
        assert!(error.contains(".guard: ") && error.contains(&holder), "{error}");
        drop(held);
        guard_within(root.path(), Duration::ZERO).unwrap();
    }

    #[test]
    fn a_root_is_private_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("root");
        private_folder(&root).unwrap();
        assert_eq!(fs::metadata(&root).unwrap().mode() & 0o777, 0o700);
        private_folder(&root).unwrap();

        let link = folder.path().join("link");
        symlink(&root, &link).unwrap();
        assert!(private_folder(&link).unwrap_err().to_string().contains("found a link"));

        fs::set_permissions(&root, fs::Permissions::from_mode(0o755)).unwrap();
        assert!(private_folder(&root).unwrap_err().to_string().contains("found mode 0755"));
    }
}
