//! Identifies the process named in a lock file, so that no other process is mistaken for it.
//!
//! A process id alone is not enough, because the kernel reuses ids, and the same id refers to different processes in different PID
//! namespaces, while containers may share the folders of systems. A lock file therefore also contains the process's start time, its
//! PID namespace and the boot id of the machine. Signals are sent through a pidfd, which never refers to another process.

use std::fmt::{Display, Formatter};
use std::fs;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::fs::MetadataExt;

use nix::errno::Errno;
use nix::libc;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::watch::{ProcessState, stat_field};

/// Identity of a process, which stays unique even after the process id is reused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity {
    /// Process id in the process's own PID namespace.
    pub(crate) pid: u32,
    /// Start time of the process, in clock ticks since boot.
    started: u64,
    /// Inode of the process's PID namespace.
    namespace: u64,
    /// Boot id of the machine.
    boot: String,
}

/// A process that can be sent signals.
#[derive(Debug)]
pub(crate) struct Handle {
    pid: Pid,
    /// Descriptor of the process, or `None` if the kernel has no pidfd (before Linux 5.3).
    pidfd: Option<OwnedFd>,
}

impl Identity {
    /// Returns the identity of this process.
    pub(crate) fn own() -> io::Result<Self> {
        let pid = std::process::id();
        let started = started(pid).ok_or_else(|| io::Error::other("/proc/self/stat has no start time"))?;
        let namespace = fs::metadata("/proc/self/ns/pid")?.ino();
        let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id")?.trim().to_owned();
        Ok(Self { pid, started, namespace, boot })
    }

    /// Parses the identity in the text of a lock file.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut words = text.split_whitespace();
        let pid = words.next()?.parse().ok()?;
        let [started, namespace] = [words.next()?, words.next()?].map(str::parse);
        Some(Self { pid, started: started.ok()?, namespace: namespace.ok()?, boot: words.next()?.into() })
    }

    /// Returns a handle for sending signals to the process, if it is alive and can be reached from this process.
    ///
    /// # Errors
    /// The reason why the process cannot be reached.
    pub(crate) fn handle(&self) -> Result<Handle, String> {
        let own =
            Self::own().map_err(|error| format!("{self}; this process cannot identify itself: {error}"))?;
        if self.boot != own.boot {
            return Err(format!("process {} of another machine, or from before the last boot", self.pid));
        }
        if self.namespace != own.namespace {
            return Err(format!(
                "process {} of another PID namespace (a container), {}",
                self.pid, self.namespace
            ));
        }
        // The order matters: the start time is read after the descriptor has been opened, so it belongs to the descriptor's
        // process.
        let pid =
            Pid::from_raw(i32::try_from(self.pid).map_err(|_| format!("{self}, which is not a process id"))?);
        let pidfd = match pidfd(self.pid) {
            Ok(pidfd) => Some(pidfd),
            Err(Errno::ENOSYS) => None,
            Err(error) => return Err(format!("{self}, which cannot be reached: {error}")),
        };
        if started(self.pid) != Some(self.started) {
            return Err(format!("{self}, which has ended: its id now belongs to another process"));
        }
        Ok(Handle { pid, pidfd })
    }
}

impl Display for Identity {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "process {}", self.pid)
    }
}

/// Returns the text that [`Identity::parse`] reads.
pub(crate) fn text(identity: &Identity) -> String {
    let Identity { pid, started, namespace, boot } = identity;
    format!("{pid} {started} {namespace} {boot}")
}

/// Describes the holder of a lock file for an error message: its process id and its state.
pub(crate) fn described(text: &str) -> String {
    let Some(identity) = Identity::parse(text) else { return "an unidentified process".into() };
    match identity.handle() {
        Ok(_) => format!("{identity} ({})", ProcessState::of(identity.pid).word()),
        Err(words) => words,
    }
}

impl Handle {
    /// Sends a signal.
    pub(crate) fn send(&self, signal: Signal) -> io::Result<()> {
        let Some(pidfd) = &self.pidfd else { return Ok(kill(self.pid, signal)?) };
        let (pidfd, number, null) =
            (pidfd.as_raw_fd(), signal as libc::c_int, std::ptr::null::<libc::siginfo_t>());
        // SAFETY: a system call whose only pointer may be null.
        Errno::result(unsafe { libc::syscall(libc::SYS_pidfd_send_signal, pidfd, number, null, 0) })?;
        Ok(())
    }
}

/// Returns a descriptor of the process that currently has the given id. The descriptor becomes readable when the process ends.
///
/// # Errors
/// `ESRCH` if there is no such process, `ENOSYS` before Linux 5.3.
pub fn pidfd(pid: u32) -> nix::Result<OwnedFd> {
    // SAFETY: a system call without pointers.
    let fd = Errno::result(unsafe { libc::syscall(libc::SYS_pidfd_open, pid, 0) })?;
    // SAFETY: the kernel has just created the descriptor, and only we own it.
    Ok(unsafe { OwnedFd::from_raw_fd(fd as i32) })
}

/// Returns the start time of the process that currently has the given id, in clock ticks since boot. This is field 22 of
/// proc_pid_stat(5).
fn started(pid: u32) -> Option<u64> {
    stat_field(pid, 22)?.parse().ok()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::process::{Child, Command};

    use super::*;

    /// Returns a process that sleeps until it is killed, and its identity.
    pub(crate) fn sleeper() -> (Child, Identity) {
        let child = Command::new("sleep").arg("1000").spawn().unwrap();
        let identity = Identity::of_child(child.id());
        (child, identity)
    }

    impl Identity {
        pub(crate) fn of_child(pid: u32) -> Self {
            Self { pid, started: started(pid).unwrap(), ..Self::own().unwrap() }
        }
    }

    /// Returns the identities of other processes with the same id.
    pub(crate) fn imposters(identity: &Identity) -> [Identity; 3] {
        [
            Identity { started: identity.started - 1, ..identity.clone() },
            Identity { namespace: identity.namespace + 1, ..identity.clone() },
            Identity { boot: "11111111-2222-3333-4444-555555555555".into(), ..identity.clone() },
        ]
    }

    #[test]
    fn an_identity_round_trips() {
        let own = Identity::own().unwrap();
        assert_eq!(Identity::parse(&text(&own)), Some(own));
        for wrong in ["", "17", "17 x 1 b", "17 1 2", "-17 1 2 b"] {
            assert_eq!(Identity::parse(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn a_signal_never_reaches_another_process_with_the_same_id() {
        let (mut child, identity) = sleeper();
        for imposter in imposters(&identity) {
            assert!(imposter.handle().is_err(), "{imposter:?}");
        }
        assert!(described(&text(&identity)).starts_with(&format!("process {} (", identity.pid)));
        let handle = identity.handle().unwrap();
        handle.send(Signal::SIGKILL).unwrap();
        child.wait().unwrap();
        assert_eq!(handle.send(Signal::SIGKILL).unwrap_err().raw_os_error(), Some(libc::ESRCH));
        assert!(identity.handle().is_err());
    }
}
