//! Handles SIGTERM, SIGINT and SIGHUP, which ask a process to end, by setting a flag that every wait checks.
//!
//! The handler changes the words on which the process may sleep, so that a signal between the last check and
//! the sleep is not lost. SIGBUS means that shared memory has no space for pages that were promised. In that
//! case, the process prints a message before it ends, instead of ending silently. iceoryx2's own handlers
//! stay off, because they deliver a request to only one waiter and mistake SIGCONT for an interrupt.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering::SeqCst};

use nix::libc;
use nix::sys::signal::{SaFlags, SigAction, SigHandler, SigSet, Signal, sigaction};

use crate::bells::wake;

/// Number of these signals that have arrived.
static REQUESTED: AtomicU32 = AtomicU32::new(0);
/// Bell of the node that was joined last. It is never unmapped.
static BELL: AtomicPtr<AtomicU32> = AtomicPtr::new(null_mut());

const SIGNALS: [Signal; 3] = [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP];

/// Catches the signals, makes them ring `bell` as well, and delivers those that were blocked until now. The supervisor starts
/// each process with SIGTERM blocked, so that it cannot be ended before it listens.
pub(crate) fn install(bell: &'static AtomicU32) {
    install_last_words();
    BELL.store(std::ptr::from_ref(bell).cast_mut(), SeqCst);
    let action = SigAction::new(SigHandler::Handler(on_signal), SaFlags::empty(), SigSet::empty());
    for signal in SIGNALS {
        // SAFETY: the handler only uses atomics and futex calls, which are async-signal-safe. The
        // call can only fail for invalid signals.
        let _ = unsafe { sigaction(signal, &action) };
    }
    // This, too, can only fail for an invalid set.
    let _ = SigSet::from_iter(SIGNALS).thread_unblock();
}

/// Makes a process that gets no memory for a page of `/dev/shm` report that before it ends.
fn install_last_words() {
    let action = SigAction::new(SigHandler::Handler(on_bus_error), SaFlags::empty(), SigSet::empty());
    // SAFETY: the handler makes three system calls, which are async-signal-safe, and does not return.
    let _ = unsafe { sigaction(Signal::SIGBUS, &action) };
}

/// Printed by a process that gets no memory.
const FULL: &str = "shared memory is full: /dev/shm has no space for a message (SIGBUS)\n";
/// Printed by a process that got no page of a mapped file, although there is space by now.
const CUT: &str = "could not get a page of a mapped file: /dev/shm was full for a moment, one of its files was truncated, \
                   or a disk failed (SIGBUS)\n";
/// Page size, in bytes. With less than that free, `/dev/shm` is full.
const PAGE: u64 = 4096;
/// Exit code for everything but success and bad input.
pub(crate) const FAILED: libc::c_int = 3;

extern "C" fn on_bus_error(_: libc::c_int) {
    // SAFETY: `statfs` is a system call that writes to its argument, the texts are static, and nothing else of the process is
    // used any more.
    unsafe {
        let mut found: libc::statfs = std::mem::zeroed();
        let is_known = libc::statfs(c"/dev/shm".as_ptr(), &raw mut found) == 0;
        let free = if is_known { (found.f_bavail as u64).saturating_mul(found.f_bsize as u64) } else { 0 };
        let words = last_words(free);
        libc::write(libc::STDERR_FILENO, words.as_ptr().cast(), words.len());
        libc::_exit(FAILED);
    }
}

/// Returns the reason why a page was missing, given the number of free bytes in `/dev/shm`.
fn last_words(free_bytes: u64) -> &'static str {
    if free_bytes < PAGE { FULL } else { CUT }
}

/// Returns true if one of the signals has arrived.
pub(crate) fn end_requested() -> bool {
    requests() != 0
}

/// Returns the number of signals that have arrived.
pub(crate) fn requests() -> u32 {
    REQUESTED.load(SeqCst)
}

/// Returns the word that is zero until one of the signals arrives.
pub(crate) fn word() -> &'static AtomicU32 {
    &REQUESTED
}

extern "C" fn on_signal(_: libc::c_int) {
    let errno = nix::errno::Errno::last_raw();
    REQUESTED.fetch_add(1, SeqCst);
    wake(&REQUESTED);
    // SAFETY: null, or a word in a page that is never unmapped.
    if let Some(bell) = unsafe { BELL.load(SeqCst).as_ref() } {
        bell.fetch_add(1, SeqCst);
        wake(bell);
    }
    nix::errno::Errno::set_raw(errno);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_page_was_never_allocated_or_was_truncated() {
        assert_eq!(last_words(PAGE - 1), FULL);
        assert_eq!(last_words(PAGE), CUT);
    }
}
