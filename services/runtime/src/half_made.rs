//! Shared memory whose maker was killed while it made it.
//!
//! iceoryx2 0.10 makes a file that its owner may write and nobody read, gives it its size, fills it and makes it
//! readable at last. A process that is killed in between leaves one that nobody finishes. Whoever else needs it,
//! a living writer or the supervisor that clears up behind the dead, is refused it, or waits for it for ever where
//! it is root and the file still empty. So such a file goes when nobody has it open.

use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::Result;

/// How often the supervisor looks for such files, beside whatever it waits for itself.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Of a file that is not finished: its owner may write it, and that is all.
const UNFINISHED: u32 = 0o200;
const PERMISSIONS: u32 = 0o777;

/// Making one takes microseconds. (A maker in another container cannot be asked what it has open.)
const MAKING: Duration = Duration::from_millis(100);

/// The file, where it is one that its maker has not finished for longer than it should take.
pub(crate) fn unfinished(path: &Path) -> Option<Metadata> {
    let found = fs::metadata(path).ok()?;
    let age = found.modified().ok()?.elapsed().ok()?;
    (found.mode() & PERMISSIONS == UNFINISHED && age > MAKING).then_some(found)
}

/// Whether the process `pid` has the file open: its maker has, from the first moment on.
pub(crate) fn has_open(pid: u32, file: &Metadata) -> bool {
    let opened = fs::read_dir(format!("/proc/{pid}/fd")).into_iter().flatten().flatten();
    let mut opened = opened.filter_map(|entry| fs::metadata(entry.path()).ok());
    opened.any(|other| (other.dev(), other.ino()) == (file.dev(), file.ino()))
}

/// Has a system's files taken away that nobody finishes, for as long as it lives.
pub(crate) struct Sweeper {
    stop: mpsc::Sender<()>,
    thread: Option<JoinHandle<()>>,
}

impl Sweeper {
    /// `sweep` takes them away once.
    pub(crate) fn start(sweep: impl Fn() -> Result<()> + Send + 'static) -> Self {
        let (stop, stopped) = mpsc::channel();
        let thread = thread::spawn(move || {
            while stopped.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                // What cannot be taken away now is tried again.
                let _ = sweep();
            }
        });
        Self { stop, thread: Some(thread) }
    }
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        let _ = self.stop.send(());
        self.thread.take().map(JoinHandle::join);
    }
}
