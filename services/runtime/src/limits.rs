//! Process limits (getrlimit(2)) that a system needs to be higher than some shells set them.
//!
//! A soft limit is raised if the hard one allows it, and children inherit it. If it does not, the process reports that
//! when it starts, rather than failing at whatever first hits the limit.

use std::fs;

use nix::errno::Errno;
use nix::sys::resource::{Resource, getrlimit, setrlimit};

use crate::{Error, Result};

/// Files that a process has open: twice as many as the demo's supervisor.
pub const NEEDED_FILES: u64 = 256;
/// The usual soft limit on open files.
const USUAL_FILES: u64 = 1024;
/// The stack of a process's first thread, bytes: several times what its deepest calls take. (Other threads have their
/// own stacks, regardless of the limit.)
const NEEDED_STACK: u64 = 2 << 20;
/// The usual soft limit on the stack, bytes.
const USUAL_STACK: u64 = 8 << 20;
/// Files that a call may have had open when it failed, and that are closed by the time its error is explained.
const CLOSED_AGAIN: usize = 8;

/// Ensures that this process may have as many files open as a process of a system needs.
///
/// # Errors
/// [`Error::FewFiles`].
pub fn provide_files() -> Result<()> {
    let found = |found| Error::FewFiles { needed: NEEDED_FILES, found };
    provide(Resource::RLIMIT_NOFILE, NEEDED_FILES, USUAL_FILES).map_err(found)
}

/// Ensures that the first thread's stack is large enough. To be called before anything else.
///
/// # Errors
/// [`Error::SmallStack`].
pub fn provide_stack() -> Result<()> {
    let found = |found| Error::SmallStack { needed_kib: NEEDED_STACK >> 10, found_kib: found >> 10 };
    provide(Resource::RLIMIT_STACK, NEEDED_STACK, USUAL_STACK).map_err(found)
}

/// The limit on open files, if this process has used it up or nearly so.
pub(crate) fn files_are_used_up() -> Option<u64> {
    let (soft, _) = getrlimit(Resource::RLIMIT_NOFILE).ok()?;
    let is_used_up = match fs::read_dir("/proc/self/fd") {
        Ok(open) => (open.count() + CLOSED_AGAIN) as u64 >= soft,
        Err(error) => error.raw_os_error() == Some(Errno::EMFILE as i32),
    };
    is_used_up.then_some(soft)
}

fn provide(resource: Resource, needed: u64, usual: u64) -> Result<(), u64> {
    // If the limit cannot be queried, there is none to report.
    let Ok((soft, hard)) = getrlimit(resource) else { return Ok(()) };
    match raised(soft, hard, needed, usual)? {
        Some(limit) => setrlimit(resource, limit, hard).map_err(|_| soft),
        None => Ok(()),
    }
}

/// The soft limit to set, if the current one is too low.
///
/// # Errors
/// The hard limit, if it is too low as well.
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
