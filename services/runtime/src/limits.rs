//! Limits of a process (getrlimit(2)) that a system needs more of than some shells give.
//!
//! A soft limit is raised where the hard one allows it, and children inherit that. Where it does not, the process says so at
//! its start, and not by a failure of whatever comes first to the limit.

use std::fs;

use nix::errno::Errno;
use nix::sys::resource::{Resource, getrlimit, setrlimit};

use crate::{Error, Result};

/// Files that a process has open: twice what the supervisor of the demo has.
pub const NEEDED_FILES: u64 = 256;
/// What a soft limit on open files usually is.
const USUAL_FILES: u64 = 1024;
/// The stack of a process's first thread, bytes: several times what its deepest calls take. (Other threads have their own,
/// whatever the limit is.)
const NEEDED_STACK: u64 = 2 << 20;
/// What a soft limit on that usually is, bytes.
const USUAL_STACK: u64 = 8 << 20;
/// Files that a call may have had open when it failed, and that are closed when its error is explained.
const CLOSED_AGAIN: usize = 8;

/// Provides for as many open files as a process of a system needs.
///
/// # Errors
/// [`Error::FewFiles`].
pub fn provide_files() -> Result<()> {
    let found = |found| Error::FewFiles { needed: NEEDED_FILES, found };
    provide(Resource::RLIMIT_NOFILE, NEEDED_FILES, USUAL_FILES).map_err(found)
}

/// Provides for a stack that the first thread of a program does not overflow: the first thing that a program does.
///
/// # Errors
/// [`Error::SmallStack`].
pub fn provide_stack() -> Result<()> {
    let found = |found| Error::SmallStack { needed_kib: NEEDED_STACK >> 10, found_kib: found >> 10 };
    provide(Resource::RLIMIT_STACK, NEEDED_STACK, USUAL_STACK).map_err(found)
}

/// Whether this process has used up the files that it may have open, or nearly.
pub(crate) fn files_are_used_up() -> Option<u64> {
    let (soft, _) = getrlimit(Resource::RLIMIT_NOFILE).ok()?;
    let is_used_up = match fs::read_dir("/proc/self/fd") {
        Ok(open) => (open.count() + CLOSED_AGAIN) as u64 >= soft,
        Err(error) => error.raw_os_error() == Some(Errno::EMFILE as i32),
    };
    is_used_up.then_some(soft)
}

fn provide(resource: Resource, needed: u64, usual: u64) -> Result<(), u64> {
    // Where it cannot be asked for there is none to be told.
    let Ok((soft, hard)) = getrlimit(resource) else { return Ok(()) };
    match raised(soft, hard, needed, usual)? {
        Some(limit) => setrlimit(resource, limit, hard).map_err(|_| soft),
        None => Ok(()),
    }
}

/// The soft limit to be set, where the one that there is will not do.
///
/// # Errors
/// The hard limit, where it will not do either.
fn raised(soft: u64, hard: u64, needed: u64, usual: u64) -> Result<Option<u64>, u64> {
    match (soft >= needed, hard >= needed) {
        (true, _) => Ok(None),
        (false, true) => Ok(Some(hard.min(usual))),
        (false, false) => Err(hard),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ulimit -n 64` blamed `/dev/shm`, and `ulimit -s 64` overflowed the stack.
    #[test]
    fn a_limit_is_raised_as_far_as_it_may_be_or_named() {
        const NO: u64 = u64::MAX;
        for (soft, hard, raised_to) in [
            (1024, NO, Ok(None)),
            (256, 256, Ok(None)),
            (64, NO, Ok(Some(1024))),
            (64, 300, Ok(Some(300))),
            (64, 64, Err(64)),
            (64, 255, Err(255)),
        ] {
            assert_eq!(raised(soft, hard, 256, 1024), raised_to, "{soft} {hard}");
        }
    }
}
