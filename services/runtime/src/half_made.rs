//! Shared memory whose maker was killed while it made it.
//!
//! iceoryx2 0.10 makes a file that its owner may write and nobody read, gives it its size, fills it and makes it
//! readable at last. A process that is killed in between leaves one that nobody finishes. Whoever else needs it, a
//! living writer or the supervisor that clears up behind the dead, is refused. As root, and with the file still empty,
//! it waits for ever. So such a file is removed when no process has it open.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::names::Names;
use crate::shared::{self, Seen};
use crate::{Error, Result, System, signals};

/// How often the supervisor looks for such files, beside whatever it waits for itself.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Of a file that is not finished: its owner may write it, and that is all.
const UNFINISHED: u32 = 0o200;
const PERMISSIONS: u32 = 0o777;

/// Making one takes microseconds. (A maker in another container cannot be asked what it has open.)
const MAKING: Duration = Duration::from_millis(100);
/// A supervisor asks for complaints several times a second: one that does not ask for so long hangs in shared memory.
const PATIENCE: Duration = Duration::from_secs(3);

/// Whether its maker has not finished a file.
pub(crate) fn is_unfinished(file: &Metadata) -> bool {
    file.mode() & PERMISSIONS == UNFINISHED
}

/// For how long each file has been seen unfinished.
#[derive(Debug)]
pub(crate) struct Ages {
    patience: Duration,
    /// By device and inode.
    seen: BTreeMap<(u64, u64), Instant>,
}

impl Default for Ages {
    fn default() -> Self {
        Self::with_patience(MAKING)
    }
}

impl Ages {
    /// A file is unfinished for too long after `patience`.
    pub(crate) fn with_patience(patience: Duration) -> Self {
        Self { patience, seen: BTreeMap::new() }
    }

    /// Those of `seen` that have been unfinished for longer than it should take. To be asked again and again.
    pub(crate) fn unfinished(&mut self, seen: &[Seen]) -> Vec<Seen> {
        let now = Instant::now();
        let unfinished: Vec<_> = seen.iter().filter(|(_, file)| is_unfinished(file)).cloned().collect();
        let before = std::mem::take(&mut self.seen);
        let since = |file: &Metadata| before.get(&(file.dev(), file.ino())).copied().unwrap_or(now);
        self.seen = unfinished.iter().map(|(_, file)| ((file.dev(), file.ino()), since(file))).collect();
        unfinished.into_iter().filter(|(_, file)| now - since(file) >= self.patience).collect()
    }
}

/// Whether the process `pid` has the file open: its maker has, from the first moment on.
pub(crate) fn has_open(pid: u32, file: &Metadata) -> bool {
    let opened = fs::read_dir(format!("/proc/{pid}/fd")).into_iter().flatten().flatten();
    let mut opened = opened.filter_map(|entry| fs::metadata(entry.path()).ok());
    opened.any(|other| (other.dev(), other.ino()) == (file.dev(), file.ino()))
}

/// Watches a system's files for as long as it lives: those go that nobody finishes, those of others are complained about.
pub(crate) struct Sweeper {
    stop: mpsc::Sender<()>,
    complaint: Arc<Mutex<Complaint>>,
    thread: Option<JoinHandle<()>>,
}

/// A file of somebody else's, until the supervisor asks.
#[derive(Debug, Default)]
enum Complaint {
    #[default]
    None,
    Waits(Instant, Error),
    Told,
}

impl Complaint {
    fn found(&mut self, error: Error) {
        if matches!(self, Self::None) {
            *self = Self::Waits(Instant::now(), error);
        }
    }

    fn take(&mut self) -> Option<Error> {
        match std::mem::replace(self, Self::Told) {
            Self::Waits(_, error) => Some(error),
            other => {
                *self = other;
                None
            }
        }
    }

    /// The error, where nobody has asked for `patience`.
    fn overdue(&mut self, patience: Duration) -> Option<Error> {
        let is_overdue = matches!(self, Self::Waits(since, _) if since.elapsed() > patience);
        is_overdue.then(|| self.take()).flatten()
    }
}

impl Sweeper {
    /// Begins to watch.
    ///
    /// # Errors
    /// Where the system's folder is gone.
    pub(crate) fn start(system: System) -> Result<Self> {
        let mut names = system.shared()?.names();
        let (stop, stopped) = mpsc::channel();
        let complaint: Arc<Mutex<Complaint>> = Arc::default();
        let shared = complaint.clone();
        let thread = thread::spawn(move || {
            let mut ages = Ages::default();
            while stopped.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                let looked = look(&system, &mut names, &mut ages);
                let Ok(mut complaint) = shared.lock() else { return };
                if let Err(error @ Error::ForeignFile { .. }) = looked {
                    complaint.found(error);
                }
                if let Some(error) = complaint.overdue(PATIENCE) {
                    end_for_good(&system, &error);
                }
            }
        });
        Ok(Self { stop, complaint, thread: Some(thread) })
    }

    /// What it has found, once.
    pub(crate) fn complaint(&self) -> Option<Error> {
        self.complaint.lock().ok()?.take()
    }
}

/// Ends the supervisor's process when it does not ask any more. iceoryx2 0.10 waits for ever for whoever makes a file
/// of the name that it needs itself. The kernel ends the other processes when the supervisor has gone.
fn end_for_good(system: &System, error: &Error) -> ! {
    system.abandon();
    sketchnav_schemas::say!("{error}");
    std::process::exit(signals::FAILED)
}

/// Looks at each file once. What cannot be taken away or made private now is tried again.
///
/// # Errors
/// [`Error::ForeignFile`].
fn look(system: &System, names: &mut Names, ages: &mut Ages) -> Result<()> {
    let seen = names.look(Instant::now())?;
    let _ = system.clear_half_made(&seen, ages);
    let _ = shared::keep_others_out(&seen);
    shared::check_seen(&seen)
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        let _ = self.stop.send(());
        self.thread.take().map(JoinHandle::join);
    }
}
