//! Process limits (getrlimit(2)) that some shells set lower than a system needs.
//!
//! A soft limit is raised as far as the hard limit allows, and children inherit it. If the hard limit is too
//! low, the process reports that when it starts, instead of failing later at the first operation that exceeds
//! the limit.

use std::fs;

use nix::errno::Errno;
use nix::sys::resource::{Resource, getrlimit, setrlimit};

use crate::{Error, Result};

/// Number of files that a process may need to have open: twice as many as the supervisor of the demo.
pub const NEEDED_FILES: u64 = 256;
/// The usual soft limit on open files.
const USUAL_FILES: u64 = 1024;
/// Stack of a process's first thread, in bytes. This is several times what its deepest calls need. (Other threads have their
/// own stacks, regardless of the limit.)
const NEEDED_STACK: u64 = 2 << 20;
/// The usual soft limit on the stack, in bytes.
const USUAL_STACK: u64 = 8 << 20;
/// Number of files that a failed call may have had open and that are closed by the time its error is explained.
const CLOSED_AGAIN: usize = 8;

/// Ensures that this process may open as many files as a process of a system needs.
///
/// # Errors
/// [`Error::FewFiles`] if the hard limit is too low.
pub fn provide_files() -> Result<()> {
    let found = |found| Error::FewFiles { needed: NEEDED_FILES, found };
    provide(Resource::RLIMIT_NOFILE, NEEDED_FILES, USUAL_FILES).map_err(found)
}

/// Ensures that the first thread's stack is large enough. Must be called before anything else.
///
/// # Errors
/// [`Error::SmallStack`] if the hard limit is too low.
pub fn provide_stack() -> Result<()> {
    let found = |found| Error::SmallStack { needed_kib: NEEDED_STACK >> 10, found_kib: found >> 10 };
    provide(Resource::RLIMIT_STACK, NEEDED_STACK, USUAL_STACK).map_err(found)
}

/// Returns the limit on open files if this process has (almost) used it up.
pub(crate) fn exhausted_file_limit() -> Option<u64> {
    let (soft, _) = getrlimit(Resource::RLIMIT_NOFILE).ok()?;
    let is_used_up = match fs::read_dir("/proc/self/fd") {
        Ok(open) => (open.count() + CLOSED_AGAIN) as u64 >= soft,
        Err(error) => error.raw_os_error() == Some(Errno::EMFILE as i32),
    };
    is_used_up.then_some(soft)
}

fn provide(resource: Resource, needed: u64, usual: u64) -> Result<(), u64> {
    // A limit that cannot be queried cannot be reported either.
    let Ok((soft, hard)) = getrlimit(resource) else { return Ok(()) };
    match raised(soft, hard, needed, usual)? {
        Some(limit) => setrlimit(resource, limit, hard).map_err(|_| soft),
        None => Ok(()),
    }
}

/// Returns the soft limit to set, or `None` if the current one is high enough.
///
/// # Errors
/// The hard limit, if it is too low.
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

    /// Regression test: `ulimit -n 64` led to an error that blamed `/dev/shm`, and `ulimit -s 64` to a stack overflow.
    #[test]
    fn a_limit_is_raised_if_allowed_and_reported_otherwise() {
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
