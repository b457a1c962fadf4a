//! Errors of the runtime.

use std::path::PathBuf;

use sketchnav_schemas::codes::Process;

use crate::limits;

/// What went wrong: what was expected, what was found, and where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that no system can have.
    #[error("system name {found:?}: expected 1 to {max} characters of a-z, 0-9 and '-', the first no '-'")]
    BadName {
        /// The name.
        found: String,
        /// The maximum length, characters.
        max: usize,
    },
    /// A folder and a name that together make paths too long for iceoryx2.
    #[error(
        "{}: too long by {excess} characters for a system called {name:?}; set XDG_RUNTIME_DIR to a shorter \
         folder, or choose a name that is shorter by half of that",
        root.display()
    )]
    PathTooLong {
        /// The folder of all systems.
        root: PathBuf,
        /// The system.
        name: String,
        /// By how many characters the path is too long.
        excess: usize,
    },
    /// The folder of all systems does not belong to this user only.
    #[error(
        "{}: expected a folder owned by user {uid} and closed to all others (mode 0700, no link), found {found}; \
         remove it or set XDG_RUNTIME_DIR",
        path.display()
    )]
    ForeignRoot {
        /// The folder.
        path: PathBuf,
        /// This user.
        uid: u32,
        /// What was found there.
        found: String,
    },
    /// Another user has put a file or a link among those of a system.
    #[error("{}: expected a regular file owned by user {uid}, found {found}; remove it", path.display())]
    ForeignFile {
        /// The file.
        path: PathBuf,
        /// This user.
        uid: u32,
        /// What was found there.
        found: String,
    },
    /// Another process is starting, joining or clearing a system, and does not finish.
    #[error(
        "{}: expected the lock within {seconds} s, found it held by {holder}, which starts, joins or clears a system; \
         continue it if it is stopped (kill -CONT), or end it, and try again",
        path.display()
    )]
    Guarded {
        /// The lock's file.
        path: PathBuf,
        /// The holder, in words.
        holder: String,
        /// How long the lock was waited for, seconds.
        seconds: u64,
    },
    /// A process of a dead system does not end, or cannot be reached from here.
    #[error(
        "{}: expected the process of a dead system to end within {seconds} s, found the file held by {holder}; end that \
         process where it runs, and try again",
        path.display()
    )]
    StillHeld {
        /// The process's lock file.
        path: PathBuf,
        /// The holder, in words.
        holder: String,
        /// How long the process was waited for, seconds.
        seconds: f64,
    },
    /// A system of this name is running already.
    #[error("system {name:?} is running already (supervisor {pid}); choose another name or end that one")]
    AlreadyRunning {
        /// The system.
        name: String,
        /// Its supervisor's process id, as its file says.
        pid: String,
    },
    /// No system of this name is running.
    #[error(
        "system {name:?} is not running (running: {running}); `sketchnav run` starts one, `sketchnav ps` lists them"
    )]
    NotRunning {
        /// The system.
        name: String,
        /// The running systems.
        running: String,
    },
    /// The folder belongs to no dead system.
    #[error(
        "{}: expected the folder of a run whose supervisor was killed, found nothing to resume. A system \
         that ended by itself leaves nothing; starting another system clears what a killed one left",
        folder.display()
    )]
    NothingToResume {
        /// The folder.
        folder: PathBuf,
    },
    /// Shared memory is full.
    #[error(
        "/dev/shm: expected room for {needed_mib} MiB, found {found_mib} MiB; remove unused files, \
         or enlarge it (docker: --shm-size)"
    )]
    NoRoom {
        /// What a system needs, MiB.
        needed_mib: u64,
        /// What is free, MiB.
        found_mib: u64,
    },
    /// The limit on open files of a process is too low.
    #[error(
        "expected a limit of {needed} open files or more for a process, found {found}: ulimit -n {needed}"
    )]
    FewFiles {
        /// What a process of a system needs.
        needed: u64,
        /// The hard limit of this process.
        found: u64,
    },
    /// The limit on the stack of the first thread is too low.
    #[error(
        "expected a limit of {needed_kib} KiB or more on the stack, found {found_kib} KiB: ulimit -s {needed_kib}"
    )]
    SmallStack {
        /// What a program needs.
        needed_kib: u64,
        /// The hard limit of this process.
        found_kib: u64,
    },
    /// A process of a system is started a second time.
    #[error("{process} of system {system:?} is already running as process {pid}; end that one first")]
    ProcessRunsAlready {
        /// The process.
        process: Process,
        /// The system.
        system: String,
        /// The process id of the first one, as its file says.
        pid: String,
    },
    /// The table of channels does not allow this access.
    #[error("{process} may not {verb} channel {channel:?}; the table of channels allows {allowed}")]
    Forbidden {
        /// The process that tried.
        process: Process,
        /// `read` or `write`.
        verb: &'static str,
        /// The channel.
        channel: &'static str,
        /// The processes that may.
        allowed: String,
    },
    /// The channel already has its writer.
    #[error("channel {channel:?} of system {system:?} takes one writer and has one already: {owner}")]
    SecondWriter {
        /// The channel.
        channel: &'static str,
        /// The system.
        system: String,
        /// The current writer.
        owner: String,
    },
    /// The channel has the maximum number of observers.
    #[error(
        "channel {channel:?} of system {system:?}: {max} observers read it, and no more may; end one of them \
         (echo, hz, top) and try again"
    )]
    TooManyObservers {
        /// The channel.
        channel: &'static str,
        /// The system.
        system: String,
        /// The maximum.
        max: usize,
    },
    /// Two builds disagree about the layout of a message.
    #[error(
        "channel {channel:?} of system {system:?} carries {found}, this program expects {expected}: run the same build in the whole system"
    )]
    Mismatch {
        /// The channel.
        channel: &'static str,
        /// The system.
        system: String,
        /// The type name of this program.
        expected: String,
        /// The type name of the channel's creator.
        found: String,
    },
    /// Cells longer than the channel allows.
    #[error("channel {channel:?}: expected at most {max} bytes of cells after a message, found {found}")]
    SliceTooLong {
        /// The channel.
        channel: &'static str,
        /// The longest slice, bytes.
        max: usize,
        /// The requested length, bytes.
        found: usize,
    },
    /// An operation on a file or folder of the system failed.
    #[error("{}: {doing}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was being done to it.
        doing: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// `run.json` cannot be read.
    #[error("{}: expected the description of a run: {source}", path.display())]
    RunConfig {
        /// The file.
        path: PathBuf,
        /// Why it cannot be parsed.
        source: serde_json::Error,
    },
    /// A signal could not be sent.
    #[error("{process}: sending process {pid} a signal: {source}")]
    Signal {
        /// The receiver.
        process: Process,
        /// Its process id.
        pid: u32,
        /// Why sending failed.
        source: std::io::Error,
    },
    /// A checkpoint that cannot be used.
    #[error("{}: checkpoint refused: {why}", path.display())]
    BadCheckpoint {
        /// The slot.
        path: PathBuf,
        /// What was expected and what was found.
        why: String,
    },
    /// iceoryx2 reported an error.
    #[error("{what}: {cause}")]
    SharedMemory {
        /// What was being done, to which channel.
        what: String,
        /// iceoryx2's error.
        cause: String,
    },
}

impl Error {
    /// Whether choosing another name for the system would help.
    pub fn is_about_the_name(&self) -> bool {
        matches!(self, Self::BadName { .. } | Self::PathTooLong { .. } | Self::AlreadyRunning { .. })
    }

    /// Whether the system to resume is missing or already running.
    pub fn is_about_what_to_resume(&self) -> bool {
        matches!(self, Self::NothingToResume { .. } | Self::AlreadyRunning { .. })
    }

    /// For `map_err` on a file operation.
    pub(crate) fn file(path: impl Into<PathBuf>, doing: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, doing, source }
    }

    /// For `map_err` on an operation of iceoryx2.
    pub(crate) fn shared_memory<E: std::fmt::Debug>(what: impl Into<String>) -> impl FnOnce(E) -> Self {
        let what = what.into();
        move |cause| Self::SharedMemory { what, cause: explained(&format!("{cause:?}")) }
    }
}

/// What iceoryx2's name for an error means to people, and what they can do about it.
fn explained(cause: &str) -> String {
    if let Some(limit) = limits::files_are_used_up() {
        return format!(
            "this process has used up its limit of {limit} open files: ulimit -n raises it ({cause})"
        );
    }
    let advice = match cause {
        "InternalFailure" | "InternalError" => {
            "the shared memory library failed; is /dev/shm full, or was a file of the system removed?"
        }
        "DoesNotExist" => "it is not there; does the system still run?",
        "InsufficientPermissions" => "its files belong to another user",
        "ServiceInCorruptedState" => "a file of the system is damaged; end the system and start it again",
        "HangsInCreation" => "the process creating it has died or is stopped; try again",
        "ExceedsMaxNumberOfNodes" => "too many processes have it open; end an observer",
        "ExceedsMaxSupportedSubscribers" => "all places of readers are taken; end an observer",
        "ExceedsMaxBorrows" => "too many samples are held at the same time",
        "UnableToCreatePortTag" | "UnableToCreateServiceTag" => {
            "it could not make a file in the system's folder; is that file system full?"
        }
        "OutOfMemory" => "there is no room in /dev/shm",
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

    /// A user once saw nothing but `ExceedsMaxSupportedSubscribers` when eight observers had taken all places.
    #[test]
    fn what_the_shared_memory_library_says_is_explained() {
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
    fn other_words_are_passed_on() {
        assert_eq!(explained("Interrupt"), "the shared memory library reported Interrupt");
    }
}
