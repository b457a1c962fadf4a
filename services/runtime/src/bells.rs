//! Doorbells: how a process sleeps until a message arrives, and how the writer wakes it.
//!
//! There is one bell per process rather than one per channel, so a process sleeps in a single place no matter what it reads. A
//! writer wakes exactly those processes that the table lists as readers. The recorder and observers have no bell and poll every few
//! milliseconds, at no cost to the writers.
//!
//! A bell is a word in a page that all processes map, and a futex (`man 2 futex`). It cannot overflow, block
//! the writer or be left behind by a killed process, and ringing a process that is awake takes no system
//! call. The alternative was iceoryx2's event service, which uses a Unix socket per listener. The path of
//! such a socket must be short, stopping the process interrupts its wait, and the listener must be cleaned
//! up.

use std::fs::OpenOptions;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering::SeqCst};
use std::time::{Duration, Instant};

use nix::libc;
use nix::sys::mman::{MapFlags, ProtFlags, mmap};
use sketchnav_schemas::codes::Process;

use crate::{Error, Result};

/// Size of the page, in bytes.
pub(crate) const PAGE: usize = 4096;
/// One slot per process, indexed by its code.
const SLOTS: usize = 16;

// Two processes sharing a slot would wake each other and mix their counts.
const _: () = {
    let mut i = 0;
    while i < Process::ALL.len() {
        assert!((Process::ALL[i].code() as usize) < SLOTS);
        i += 1;
    }
};

/// The words of one process, on their own cache line.
#[repr(C, align(64))]
struct Slot {
    /// Number of times that the bell was rung.
    bell: AtomicU32,
    /// Non-zero while the process sleeps or is about to.
    sleeping: AtomicU32,
    /// Number of readers that have joined the process's channels.
    joined: AtomicU32,
    /// Amount of new work that the process has done.
    progress: AtomicU32,
    /// Number of heartbeats of the process.
    beats: AtomicU32,
}

/// The page of a system. It stays mapped until the process ends, since a signal may arrive at any time.
#[derive(Clone, Copy)]
pub(crate) struct Bells {
    slots: &'static [Slot; SLOTS],
}

impl Bells {
    /// Maps the page in `path`, a file of [`PAGE`] bytes.
    pub(crate) fn map(path: &Path) -> Result<Self> {
        let file =
            OpenOptions::new().read(true).write(true).open(path).map_err(Error::file(path, "opening"))?;
        let found = file.metadata().map_err(Error::file(path, "inspecting it"))?.len();
        if found < PAGE as u64 {
            let short = std::io::Error::other(format!("expected {PAGE} bytes, found {found}"));
            return Err(Error::file(path, "mapping")(short));
        }
        let length = NonZeroUsize::new(PAGE).expect("a page is not empty");
        let access = ProtFlags::PROT_READ | ProtFlags::PROT_WRITE;
        // SAFETY: a new mapping at an address of the kernel's choice touches no memory of ours.
        let page = unsafe { mmap(None, length, access, MapFlags::MAP_SHARED, &file, 0) }
            .map_err(|error| Error::file(path, "mapping")(error.into()))?;
        // SAFETY: the page is larger than the slots, aligned, zero or written by this code, and never unmapped; it is
        // only ever accessed through atomics.
        Ok(Self { slots: unsafe { page.cast::<[Slot; SLOTS]>().as_ref() } })
    }

    /// Returns the word that the process sleeps on.
    pub(crate) fn word(&self, process: Process) -> &'static AtomicU32 {
        &self.slot(process).bell
    }

    /// Returns the count of the process's bell.
    pub(crate) fn rings(&self, process: Process) -> u32 {
        self.slot(process).bell.load(SeqCst)
    }

    /// Wakes the process, or keeps it from falling asleep.
    pub(crate) fn ring(&self, process: Process) {
        let slot = self.slot(process);
        slot.bell.fetch_add(1, SeqCst);
        // The sleeper announces itself before it checks the bell for the last time, so at least one side sees the other.
        if slot.sleeping.load(SeqCst) != 0 {
            wake(&slot.bell);
        }
    }

    /// Notifies the writer of a channel that a reader has joined and wants the history.
    pub(crate) fn announce_reader(&self, writer: Process) {
        self.slot(writer).joined.fetch_add(1, SeqCst);
        self.ring(writer);
    }

    /// Returns the number of readers that have joined the process's channels.
    pub(crate) fn readers_joined(&self, process: Process) -> u32 {
        self.slot(process).joined.load(SeqCst)
    }

    /// Counts a unit of new work that the process, or its predecessor, has done.
    pub(crate) fn note_progress(&self, process: Process) {
        self.slot(process).progress.fetch_add(1, SeqCst);
    }

    /// Returns the amount of new work that the process and its predecessors have done.
    pub(crate) fn progress(&self, process: Process) -> u32 {
        self.slot(process).progress.load(SeqCst)
    }

    /// Counts a heartbeat of the process.
    pub(crate) fn beat(&self, process: Process) {
        self.slot(process).beats.fetch_add(1, SeqCst);
    }

    /// Returns a number that changes whenever the process or its successor does anything.
    pub(crate) fn signs_of_life(&self, process: Process) -> u32 {
        let slot = self.slot(process);
        slot.beats.load(SeqCst).wrapping_add(slot.progress.load(SeqCst))
    }

    /// Sleeps until the count of the process's bell differs from `seen`. Returns the new count, or `None` after `timeout`.
    pub(crate) fn wait(&self, process: Process, seen: u32, timeout: Duration) -> Option<u32> {
        let slot = self.slot(process);
        slot.sleeping.store(1, SeqCst);
        let rung = sleep_until_changed(&slot.bell, seen, timeout);
        slot.sleeping.store(0, SeqCst);
        rung.then(|| self.rings(process))
    }

    fn slot(&self, process: Process) -> &'static Slot {
        &self.slots[process.code() as usize]
    }
}

/// Sleeps until `word` no longer holds `value`, or until the timeout has passed. Returns true if the word has changed. A signal
/// that is handled elsewhere (such as SIGCONT) does not end the sleep.
pub(crate) fn sleep_until_changed(word: &AtomicU32, value: u32, timeout: Duration) -> bool {
    if word.load(SeqCst) != value {
        return true;
    }
    let end = Instant::now() + timeout;
    let mut left = timeout;
    while !left.is_zero() {
        sleep(word, value, left);
        if word.load(SeqCst) != value {
            return true;
        }
        left = end.saturating_duration_since(Instant::now());
    }
    false
}

/// Sleeps while `word` equals `value`, for at most `timeout`. May return early.
fn sleep(word: &AtomicU32, value: u32, timeout: Duration) {
    let timeout = libc::timespec {
        tv_sec: timeout.as_secs().min(i32::MAX as u64) as libc::time_t,
        tv_nsec: timeout.subsec_nanos() as libc::c_long,
    };
    // SAFETY: both pointers are valid for the call; the kernel compares and sleeps, it writes nothing.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAIT, value, &raw const timeout) };
}

/// Wakes all threads that sleep on `word`. Safe to call from a signal handler.
pub(crate) fn wake(word: &AtomicU32) {
    // SAFETY: a plain system call on a valid address; errno is not read afterwards.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAKE, i32::MAX) };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> (tempfile::TempDir, Bells) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bells");
        std::fs::write(&path, [0; PAGE]).unwrap();
        let bells = Bells::map(&path).unwrap();
        (folder, bells)
    }

    /// Regression test: an observer that joined while the system was being created used to be killed by SIGBUS.
    #[test]
    fn a_file_without_its_page_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bells");
        std::fs::write(&path, []).unwrap();
        let error = Bells::map(&path).err().unwrap().to_string();
        assert!(error.ends_with("bells: mapping: expected 4096 bytes, found 0"), "{error}");
    }

    #[test]
    fn a_signal_before_the_wait_is_not_lost() {
        let (_folder, bells) = page();
        bells.ring(Process::Planner);
        assert_eq!(bells.wait(Process::Planner, 0, Duration::from_secs(600)), Some(1));
        assert_eq!(bells.wait(Process::Planner, 1, Duration::from_millis(1)), None);
    }

    #[test]
    fn a_sleeper_is_woken_through_another_mapping() {
        let (folder, bells) = page();
        let other = Bells::map(&folder.path().join("bells")).unwrap();
        let sleeper = std::thread::spawn(move || bells.wait(Process::World, 0, Duration::from_secs(600)));
        other.ring(Process::Localizer);
        other.ring(Process::World);
        assert_eq!(sleeper.join().unwrap(), Some(1));
    }
}
