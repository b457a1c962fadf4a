//! Handles files in shared memory whose creator was killed while creating them.
//!
//! iceoryx2 0.10 creates a file that its owner may write and no process may read, sets its size, fills it, and only then makes it
//! readable. A process that is killed in between leaves a file that will never be finished. Any other process that needs the file,
//! such as a running writer or the supervisor cleaning up after the dead process, is denied access or, if it runs as root and the
//! file is still empty, waits forever. Such a file is therefore removed once no process has it open.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::names::Names;
use crate::shared::{self, Seen};
use crate::{Error, Result, System, signals};

/// Interval between the supervisor's searches for such files, regardless of what else it is waiting for.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Mode of an unfinished file, which only its owner may write and no one may read.
const UNFINISHED: u32 = 0o200;
const PERMISSIONS: u32 = 0o777;

/// Time after which an unfinished file counts as abandoned. Creating one takes microseconds. (The files that a creator in another
/// container has open cannot be determined.)
const MAKING: Duration = Duration::from_millis(100);
/// If the supervisor has not asked for complaints for this long, it must be hanging in shared memory. Normally, it asks several
/// times a second.
const PATIENCE: Duration = Duration::from_secs(3);

/// Returns true if the file's creator has not finished it.
pub(crate) fn is_unfinished(file: &Metadata) -> bool {
    file.mode() & PERMISSIONS == UNFINISHED
}

/// Time for which each file has been unfinished.
#[derive(Debug)]
pub(crate) struct Ages {
    patience: Duration,
    /// When each file was first seen, by device and inode.
    seen: BTreeMap<(u64, u64), Instant>,
}

impl Default for Ages {
    fn default() -> Self {
        Self::with_patience(MAKING)
    }
}

impl Ages {
    /// Sets how long a file must have been unfinished to count as abandoned.
    pub(crate) fn with_patience(patience: Duration) -> Self {
        Self { patience, seen: BTreeMap::new() }
    }

    /// Returns the files among `seen` that have been unfinished for too long. Must be called repeatedly.
    pub(crate) fn unfinished(&mut self, seen: &[Seen]) -> Vec<Seen> {
        let now = Instant::now();
        let unfinished: Vec<_> = seen.iter().filter(|(_, file)| is_unfinished(file)).cloned().collect();
        let before = std::mem::take(&mut self.seen);
        let since = |file: &Metadata| before.get(&(file.dev(), file.ino())).copied().unwrap_or(now);
        self.seen = unfinished.iter().map(|(_, file)| ((file.dev(), file.ino()), since(file))).collect();
        unfinished.into_iter().filter(|(_, file)| now - since(file) >= self.patience).collect()
    }
}

/// Returns true if the process `pid` has the file open, as its creator does from the beginning.
pub(crate) fn has_open(pid: u32, file: &Metadata) -> bool {
    let opened = fs::read_dir(format!("/proc/{pid}/fd")).into_iter().flatten().flatten();
    let mut opened = opened.filter_map(|entry| fs::metadata(entry.path()).ok());
    opened.any(|other| (other.dev(), other.ino()) == (file.dev(), file.ino()))
}

/// Watches the files of a system in a separate thread, until it is dropped. It removes files that will never be finished.
///
/// The supervisor has one, which also reports files of other users. If the supervisor is killed, its processes die with it, perhaps
/// while creating files. Processes that live on for a while (the recorder, which still closes its file, and observers) would wait
/// forever for these files. Each of them therefore has one as well, which becomes active once the supervisor is dead.
pub(crate) struct Sweeper {
    stop: mpsc::Sender<()>,
    complaint: Arc<Mutex<Complaint>>,
    thread: Option<JoinHandle<()>>,
}

/// A file of another user, pending until the supervisor asks for it.
#[derive(Debug, Default)]
enum Complaint {
    #[default]
    None,
    Waits(Instant, Error),
    Reported,
}

impl Complaint {
    fn found(&mut self, error: Error) {
        if matches!(self, Self::None) {
            *self = Self::Waits(Instant::now(), error);
        }
    }

    fn take(&mut self) -> Option<Error> {
        match std::mem::replace(self, Self::Reported) {
            Self::Waits(_, error) => Some(error),
            other => {
                *self = other;
                None
            }
        }
    }

    /// Returns the error if it has been pending for longer than `patience`.
    fn overdue(&mut self, patience: Duration) -> Option<Error> {
        let is_overdue = matches!(self, Self::Waits(since, _) if since.elapsed() > patience);
        is_overdue.then(|| self.take()).flatten()
    }
}

impl Sweeper {
    /// Starts the supervisor's sweeper.
    ///
    /// # Errors
    /// [`Error::File`] if the system's folder is gone.
    pub(crate) fn of_supervisor(system: System) -> Result<Self> {
        let mut names = system.shared()?.names();
        Ok(Self::start(move |stopped, shared| {
            let mut ages = Ages::default();
            while should_continue(stopped) {
                let looked = look(&system, &mut names, &mut ages);
                let Ok(mut complaint) = shared.lock() else { return };
                if let Err(error @ Error::ForeignFile { .. }) = looked {
                    complaint.found(error);
                }
                if let Some(error) = complaint.overdue(PATIENCE) {
                    end_for_good(&system, &error);
                }
            }
        }))
    }

    /// Starts the sweeper of a process that may outlive the supervisor.
    ///
    /// # Errors
    /// [`Error::File`] if the system's folder is gone.
    pub(crate) fn of_survivor(system: System) -> Result<Self> {
        let mut names = system.shared()?.names();
        Ok(Self::start(move |stopped, _| {
            let mut ages = Ages::default();
            while should_continue(stopped) {
                // A file that cannot be removed now is tried again the next time.
                let _ = look_if_orphaned(&system, &mut names, &mut ages);
            }
        }))
    }

    fn start(sweep: impl FnOnce(&Receiver<()>, &Mutex<Complaint>) + Send + 'static) -> Self {
        let (stop, stopped) = mpsc::channel();
        let complaint: Arc<Mutex<Complaint>> = Arc::default();
        let shared = complaint.clone();
        let thread = thread::spawn(move || sweep(&stopped, &shared));
        Self { stop, complaint, thread: Some(thread) }
    }

    /// Returns the first foreign file found, as an error. It is returned once.
    pub(crate) fn complaint(&self) -> Option<Error> {
        self.complaint.lock().ok()?.take()
    }
}

/// Waits until it is time to look again. Returns false if the sweeper has been stopped.
fn should_continue(stopped: &Receiver<()>) -> bool {
    stopped.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout)
}

/// Ends the supervisor's process when it stops asking for complaints. If another user has created a file
/// under a name that iceoryx2 0.10 needs, iceoryx2 waits forever for that file to be finished, so the
/// supervisor hangs. Once it is gone, the kernel ends the other processes.
fn end_for_good(system: &System, error: &Error) -> ! {
    system.abandon();
    sketchnav_schemas::say!("{error}");
    std::process::exit(signals::FAILED)
}

/// Checks each file once. A file that cannot be removed or made private now is tried again the next time.
///
/// # Errors
/// [`Error::ForeignFile`] if a file belongs to another user.
fn look(system: &System, names: &mut Names, ages: &mut Ages) -> Result<()> {
    let seen = names.look(Instant::now())?;
    let _ = system.clear_half_made(&seen, ages);
    let _ = shared::keep_others_out(&seen);
    shared::check_seen(&seen)
}

/// If the supervisor is dead, removes the files that will never be finished.
pub(crate) fn look_if_orphaned(system: &System, names: &mut Names, ages: &mut Ages) -> Result<()> {
    if system.is_alive()? {
        return Ok(());
    }
    let seen = names.look(Instant::now())?;
    system.clear_half_made(&seen, ages)
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        let _ = self.stop.send(());
        self.thread.take().map(JoinHandle::join);
    }
}
