//! Errors of the runtime.

use std::path::PathBuf;

use sketchnav_schemas::codes::Process;

use crate::limits;

/// An error of the runtime. The message gives the location, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The name is not valid for a system.
    #[error(
        "system name {found:?}: expected 1 to {max} characters of a-z, 0-9 and '-', not starting with '-'"
    )]
    BadName {
        /// The invalid name.
        found: String,
        /// Maximum length of a name, in characters.
        max: usize,
    },
    /// The folder and the name together make paths too long for iceoryx2.
    #[error(
        "{}: too long by {excess} characters for a system called {name:?}; set XDG_RUNTIME_DIR to a shorter \
         folder, or choose a name that is shorter by half of that",
        root.display()
    )]
    PathTooLong {
        /// Folder of all systems.
        root: PathBuf,
        /// Name of the system.
        name: String,
        /// Number of excess characters in the path.
        excess: usize,
    },
    /// Other users can access the folder of all systems, or it belongs to another user.
    #[error(
        "{}: expected a folder owned by user {uid} and closed to all others (mode 0700, not a link), found {found}; \
         remove it or set XDG_RUNTIME_DIR",
        path.display()
    )]
    ForeignRoot {
        /// Path of the folder.
        path: PathBuf,
        /// Id of this user.
        uid: u32,
        /// What was found there.
        found: String,
    },
    /// Another user has put a file or a link among the files of a system.
    #[error("{}: expected a regular file owned by user {uid}, found {found}; remove it", path.display())]
    ForeignFile {
        /// Path of the file.
        path: PathBuf,
        /// Id of this user.
        uid: u32,
        /// What was found there.
        found: String,
    },
    /// Another process is taking too long to start, join or clear a system.
    #[error(
        "{}: expected the lock within {seconds} s, found it held by {holder}, which is starting, joining or clearing a system; \
         continue it if it is stopped (kill -CONT), or end it, and try again",
        path.display()
    )]
    Guarded {
        /// Path of the lock file.
        path: PathBuf,
        /// Description of the holder.
        holder: String,
        /// Time waited for the lock, in seconds.
        seconds: u64,
    },
    /// A leftover process of a dead system does not end, or cannot be reached from here.
    #[error(
        "{}: expected the process of a dead system to end within {seconds} s, found the file held by {holder}; end that \
         process where it runs, and try again",
        path.display()
    )]
    StillHeld {
        /// Path of the process's lock file.
        path: PathBuf,
        /// Description of the holder.
        holder: String,
        /// Time waited for the process, in seconds.
        seconds: f64,
    },
    /// A system with this name is already running.
    #[error("system {name:?} is running already (supervisor {pid}); choose another name or end that one")]
    AlreadyRunning {
        /// Name of the system.
        name: String,
        /// Process id of its supervisor, according to the lock file.
        pid: String,
    },
    /// No system with this name is running.
    #[error(
        "system {name:?} is not running (running: {running}); `sketchnav run` starts one, `sketchnav ps` lists them"
    )]
    NotRunning {
        /// Name of the system.
        name: String,
        /// Names of the running systems.
        running: String,
    },
    /// The folder does not belong to a dead system.
    #[error(
        "{}: expected the folder of a run whose supervisor was killed, found nothing to resume. A system \
         that ended by itself leaves nothing behind; starting another system clears what a killed one left behind",
        folder.display()
    )]
    NothingToResume {
        /// Path of the folder.
        folder: PathBuf,
    },
    /// Shared memory is full.
    #[error(
        "/dev/shm: expected room for {needed_mib} MiB, found {found_mib} MiB; remove unused files, \
         or enlarge it (docker: --shm-size)"
    )]
    NoRoom {
        /// Space that a system needs, in MiB.
        needed_mib: u64,
        /// Free space, in MiB.
        found_mib: u64,
    },
    /// The limit on a process's open files is too low.
    #[error(
        "expected a limit of {needed} open files or more for a process, found {found}: ulimit -n {needed}"
    )]
    FewFiles {
        /// Number of files that a process of a system needs.
        needed: u64,
        /// Hard limit of this process.
        found: u64,
    },
    /// The limit on the stack of the first thread is too low.
    #[error(
        "expected a limit of {needed_kib} KiB or more on the stack, found {found_kib} KiB: ulimit -s {needed_kib}"
    )]
    SmallStack {
        /// Stack that a program needs, in KiB.
        needed_kib: u64,
        /// Hard limit of this process, in KiB.
        found_kib: u64,
    },
    /// A process of a system was started a second time.
    #[error("{process} of system {system:?} is already running as process {pid}; end that one first")]
    ProcessRunsAlready {
        /// The process.
        process: Process,
        /// Name of the system.
        system: String,
        /// Process id of the first one, according to its lock file.
        pid: String,
    },
    /// The table of channels does not allow this access.
    #[error("{process} may not {verb} channel {channel:?}; the table of channels allows {allowed}")]
    Forbidden {
        /// The process that tried.
        process: Process,
        /// `read` or `write`.
        verb: &'static str,
        /// Name of the channel.
        channel: &'static str,
        /// The processes that have this access.
        allowed: String,
    },
    /// The channel already has a writer.
    #[error("channel {channel:?} of system {system:?} takes one writer and has one already: {owner}")]
    SecondWriter {
        /// Name of the channel.
        channel: &'static str,
        /// Name of the system.
        system: String,
        /// Description of the current writer.
        owner: String,
    },
    /// The channel has the maximum number of observers.
    #[error(
        "channel {channel:?} of system {system:?}: {max} observers read it already, which is the maximum; end one of them \
         (echo, hz, top) and try again"
    )]
    TooManyObservers {
        /// Name of the channel.
        channel: &'static str,
        /// Name of the system.
        system: String,
        /// Maximum number of observers.
        max: usize,
    },
    /// Two builds disagree about the layout of a message.
    #[error(
        "channel {channel:?} of system {system:?} carries {found}, this program expects {expected}: run the same build throughout the system"
    )]
    Mismatch {
        /// Name of the channel.
        channel: &'static str,
        /// Name of the system.
        system: String,
        /// Type name in this program.
        expected: String,
        /// Type name given by the channel's creator.
        found: String,
    },
    /// The cells are longer than the channel allows.
    #[error("channel {channel:?}: expected at most {max} bytes of cells after a message, found {found}")]
    SliceTooLong {
        /// Name of the channel.
        channel: &'static str,
        /// Maximum length, in bytes.
        max: usize,
        /// Requested length, in bytes.
        found: usize,
    },
    /// An operation on a file or folder of the system failed.
    #[error("{}: {doing}: {source}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// The operation that failed.
        doing: &'static str,
        /// The reason why it failed.
        source: std::io::Error,
    },
    /// `run.json` cannot be parsed.
    #[error("{}: expected the description of a run: {source}", path.display())]
    RunConfig {
        /// Path of the file.
        path: PathBuf,
        /// The reason why it cannot be parsed.
        source: serde_json::Error,
    },
    /// A signal could not be sent.
    #[error("{process}: sending process {pid} a signal: {source}")]
    Signal {
        /// The receiving process.
        process: Process,
        /// Process id of the receiver.
        pid: u32,
        /// The reason why sending failed.
        source: std::io::Error,
    },
    /// A checkpoint is unusable.
    #[error("{}: checkpoint refused: {why}", path.display())]
    BadCheckpoint {
        /// Path of the slot.
        path: PathBuf,
        /// What was expected and what was found.
        why: String,
    },
    /// iceoryx2 reported an error.
    #[error("{what}: {cause}")]
    SharedMemory {
        /// The operation that failed, and its channel.
        what: String,
        /// Explanation of iceoryx2's error.
        cause: String,
    },
}

impl Error {
    /// Returns true if choosing another name for the system would help.
    pub fn concerns_the_name(&self) -> bool {
        matches!(self, Self::BadName { .. } | Self::PathTooLong { .. } | Self::AlreadyRunning { .. })
    }

    /// Returns true if the system to resume is missing or already running.
    pub fn has_nothing_to_resume(&self) -> bool {
        matches!(self, Self::NothingToResume { .. } | Self::AlreadyRunning { .. })
    }

    /// Returns a closure for `map_err` on a file operation.
    pub(crate) fn file(path: impl Into<PathBuf>, doing: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, doing, source }
    }

    /// Returns a closure for `map_err` on an operation of iceoryx2.
    pub(crate) fn shared_memory<E: std::fmt::Debug>(what: impl Into<String>) -> impl FnOnce(E) -> Self {
        let what = what.into();
        move |cause| Self::SharedMemory { what, cause: explained(&format!("{cause:?}")) }
    }
}

/// Explains iceoryx2's name for an error, and how to fix the problem.
fn explained(cause: &str) -> String {
    if let Some(limit) = limits::exhausted_file_limit() {
        return format!(
            "this process has used up its limit of {limit} open files: ulimit -n raises it ({cause})"
        );
    }
    let advice = match cause {
        "InternalFailure" | "InternalError" => {
            "the shared memory library failed; is /dev/shm full, or was a file of the system removed?"
        }
        "DoesNotExist" => "it does not exist; is the system still running?",
        "InsufficientPermissions" => "its files belong to another user",
        "ServiceInCorruptedState" => "a file of the system is damaged; end the system and start it again",
        "HangsInCreation" => "the process creating it has died or is stopped; try again",
        "ExceedsMaxNumberOfNodes" => "too many processes have it open; end an observer",
        "ExceedsMaxSupportedSubscribers" => "all reader slots are taken; end an observer",
        "ExceedsMaxBorrows" => "too many samples are held at the same time",
        "UnableToCreatePortTag" | "UnableToCreateServiceTag" => {
            "it could not make a file in the system's folder; is that file system full?"
        }
        "OutOfMemory" => "there is no space in /dev/shm",
        _ => return format!("the shared memory library reported {cause}"),
    };
    format!("{advice} ({cause})")
}

#[cfg(test)]
mod tests {
    use iceoryx2::node::NodeCreationFailure;
    use iceoryx2::port::LoanError;
    use iceoryx2::port::ReceiveError;
    use iceoryx2::port::publisher::PublisherCreateError;
    use iceoryx2::port::subscriber::SubscriberCreateError;
    use iceoryx2::service::builder::publish_subscribe::{
        PublishSubscribeCreateError, PublishSubscribeOpenError,
    };

    use super::explained;

    /// Regression test: the only output was `ExceedsMaxSupportedSubscribers` when eight observers had taken all places.
    #[test]
    fn errors_of_the_shared_memory_library_are_explained() {
        let said = [
            format!("{:?}", NodeCreationFailure::InternalError),
            format!("{:?}", NodeCreationFailure::InsufficientPermissions),
            format!("{:?}", PublishSubscribeCreateError::InternalFailure),
            format!("{:?}", PublisherCreateError::UnableToCreatePortTag),
            format!("{:?}", PublishSubscribeOpenError::DoesNotExist),
            format!("{:?}", PublishSubscribeOpenError::ServiceInCorruptedState),
            format!("{:?}", PublishSubscribeOpenError::HangsInCreation),
            format!("{:?}", PublishSubscribeOpenError::ExceedsMaxNumberOfNodes),
            format!("{:?}", SubscriberCreateError::ExceedsMaxSupportedSubscribers),
            format!("{:?}", ReceiveError::ExceedsMaxBorrows),
            format!("{:?}", LoanError::OutOfMemory),
        ];
        for word in said {
            let words = explained(&word);
            assert!(words.ends_with(&format!(" ({word})")), "{words}");
        }
    }

    #[test]
    fn other_errors_are_passed_on() {
        assert_eq!(explained("Interrupt"), "the shared memory library reported Interrupt");
    }
}
