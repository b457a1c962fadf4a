//! A child process of the supervisor.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child as StdChild, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::fcntl::{FallocateFlags, OFlag, fallocate};
use nix::libc;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::{SigSet, Signal, kill};
use nix::unistd::{Pid, getpid, getppid, pipe2};
use sketchnav_runtime::{ProcessState, pidfd};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::fault_plan::Starvation;

use crate::program::this_program;
use crate::restarts::{End, Restarts};
use crate::watchdog::{Alarm, Watchdog};
use crate::{Death, Error, Result};

/// Interval at which to check whether waiting has become urgent, since a signal may be delivered to a thread other than the waiting
/// one.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// `F_SETSIG` of `fcntl.h` (Linux), which the libc crate lacks. It selects a signal other than SIGIO.
const F_SETSIG: libc::c_int = 10;
/// Number of lines from the end of a log that an error shows. If the program's own error begins earlier, the excerpt begins there.
const LAST_LINES: usize = 12;
/// Maximum length of the excerpt from a log that an error shows, in bytes.
const EXCERPT_BYTES: usize = 8000;
/// Length of the end of a log that is read, in bytes. It has room for a backtrace after the excerpt.
const LAST_BYTES: u64 = 64 * 1024;
/// The line that precedes the frames of a backtrace. A panic prints a backtrace if `RUST_BACKTRACE` is set.
const BACKTRACE: &str = "\nstack backtrace:\n";
/// Space that a log reserves for the last words of its process, in bytes: one page of shared memory.
const RESERVED_BYTES: i64 = 4096;

/// How to start a process.
#[derive(Debug)]
pub struct ProcessLine {
    /// The process to start.
    pub process: Process,
    /// Command line of the process. The supervisor sets its input, output, process group and parent-death signal.
    pub command: Command,
    /// Whether the process resumes from its checkpoint after a restart. If it does, the system continues after the process has died.
    pub resumes: bool,
}

impl ProcessLine {
    /// Returns the line that starts this same program as `serve PROCESS --system NAME`.
    ///
    /// # Errors
    /// [`Error::Spawn`] if the path of this program is unknown.
    pub fn serve(process: Process, system: &str) -> Result<Self> {
        let mut command = this_program().map_err(|source| Error::Spawn {
            process,
            program: "this program".into(),
            source,
        })?;
        command.args(["serve", process.word(), "--system", system]);
        Ok(Self { process, command, resumes: true })
    }
}

/// A process of the system that has been started.
#[derive(Debug)]
pub(crate) struct Child {
    pub(crate) process: Process,
    line: ProcessLine,
    child: StdChild,
    born: Instant,
    log: PathBuf,
    /// How and when the process ended, if it has.
    ended: Option<(ExitStatus, Instant)>,
    restarts: Restarts,
    /// When to restart the process, if it is dead and not given up.
    due: Option<Instant>,
    /// When the process died, and its progress at that time. Cleared when its successor makes new progress.
    mourned: Option<(Instant, u32)>,
    watchdog: Watchdog,
    stopped_limit: Duration,
}

impl Child {
    /// Starts a process. `stopped_limit` is how long it may be stopped before it is killed.
    pub(crate) fn spawn(mut line: ProcessLine, log: PathBuf, stopped_limit: Duration) -> Result<Self> {
        let process = line.process;
        prepare(&mut line)?;
        let child = spawn(&mut line, &log)?;
        let (born, restarts) = (Instant::now(), Restarts::default());
        let watchdog = Watchdog::begin(0, born, stopped_limit);
        let (ended, due, mourned) = (None, None, None);
        Ok(Self { process, line, child, born, log, ended, restarts, due, mourned, watchdog, stopped_limit })
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Returns how and when the process ended, if it has.
    pub(crate) fn ended(&mut self) -> Result<Option<(ExitStatus, Instant)>> {
        if self.ended.is_none() {
            let status = self.child.try_wait().map_err(self.waiting())?;
            self.ended = status.map(|status| (status, Instant::now()));
        }
        Ok(self.ended)
    }

    /// Copies the output of the process to a file in `folder`, which is created if missing, and returns true. If the process has
    /// printed nothing, returns false.
    pub(crate) fn keep_log(&self, folder: &Path) -> io::Result<bool> {
        let mut log = match File::open(&self.log) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
            opened => opened?,
        };
        let has_lines = log.metadata()?.len() > 0;
        if has_lines {
            std::fs::create_dir_all(folder)?;
            let copy = folder.join(format!("{}.log", self.process.word()));
            io::copy(&mut log, &mut File::create(copy)?)?;
        }
        Ok(has_lines)
    }

    /// Returns true if the process resumes from its checkpoint when it is restarted.
    pub(crate) fn resumes(&self) -> bool {
        self.line.resumes
    }

    /// Returns true if the process is dead and to be restarted.
    pub(crate) fn is_due(&self) -> bool {
        self.due.is_some()
    }

    /// Returns the restarts of the process.
    pub(crate) fn restarts(&self) -> &Restarts {
        &self.restarts
    }

    /// Schedules a restart after a death. Returns false if the process has failed for good. `progress` is its progress across all
    /// restarts.
    pub(crate) fn schedule(&mut self, status: ExitStatus, progress: u32) -> bool {
        let now = Instant::now();
        // Clearing a dead process's remains in shared memory is part of its recovery.
        let died = self.ended.map_or(now, |(_, when)| when);
        self.mourned.get_or_insert((died, progress));
        let pause = self.restarts.pause_after_death(self.end(status), progress);
        self.due = pause.map(|pause| now + pause);
        self.due.is_some()
    }

    fn end(&self, status: ExitStatus) -> End {
        let signal = status.signal().and_then(|signal| Signal::try_from(signal).ok());
        let is_by_others = matches!(
            signal,
            Some(Signal::SIGKILL | Signal::SIGTERM | Signal::SIGINT | Signal::SIGHUP | Signal::SIGQUIT)
        );
        match (self.hung(), is_by_others) {
            (true, _) => End::Hung,
            (false, true) => End::Killed { after: self.born.elapsed() },
            (false, false) => End::Failed,
        }
    }

    /// Restarts the process if that is due. Returns true if it was restarted.
    pub(crate) fn start_if_due(&mut self, signs_of_life: u32) -> Result<bool> {
        let is_due = self.due.is_some_and(|due| due <= Instant::now());
        if is_due {
            self.child = spawn(&mut self.line, &self.log)?;
            (self.born, self.ended, self.due) = (Instant::now(), None, None);
            self.watchdog = Watchdog::begin(signs_of_life, self.born, self.stopped_limit);
        }
        Ok(is_due)
    }

    /// Returns the time from the death of the process until it made new progress. It is returned once, when that happens.
    pub(crate) fn recovery(&mut self, progress: u32) -> Option<Duration> {
        let (died, _) = self.mourned.take_if(|(_, before)| *before != progress)?;
        Some(died.elapsed())
    }

    /// Checks whether the process has shown signs of life since the last check.
    pub(crate) fn watch(&mut self, signs_of_life: u32) -> Alarm {
        let pid = self.child.id();
        self.watchdog.look(signs_of_life, Instant::now(), || ProcessState::of(pid))
    }

    /// Tolerates that the process is slow from now on, because it is being starved.
    pub(crate) fn bear(&mut self, starvation: Starvation) {
        self.watchdog.bear(starvation, Instant::now());
    }

    /// Returns true if the process is being starved.
    pub(crate) fn is_starved(&self) -> bool {
        self.watchdog.is_starved(Instant::now())
    }

    /// Returns true if the process was responsive at the last check.
    pub(crate) fn is_responsive(&self) -> bool {
        self.watchdog.is_quiet()
    }

    /// Returns true if the process is being killed, or was killed, because it hangs.
    pub(crate) fn hung(&self) -> bool {
        self.watchdog.hangs()
    }

    /// Describes the death of the process.
    pub(crate) fn death(&self, status: ExitStatus) -> Death {
        let (pid, hung) = (self.child.id(), self.hung());
        Death { process: self.process, pid, status, hung, last_lines: last_lines(&self.log) }
    }

    pub(crate) fn signal(&mut self, signal: Signal) -> Result<()> {
        if self.ended()?.is_none() {
            // The process has not been waited for yet, so the process id still belongs to it.
            let _ = kill(Pid::from_raw(self.child.id() as i32), signal);
        }
        Ok(())
    }

    /// Waits for the process to end. Returns true if it ended before `limit`, and before a signal made `is_urgent` return true.
    pub(crate) fn wait_until(&mut self, limit: Instant, is_urgent: impl Fn() -> bool) -> Result<bool> {
        if self.ended()?.is_some() {
            return Ok(true);
        }
        let pidfd = pidfd(self.child.id()).map_err(|error| self.waiting()(error.into()))?;
        loop {
            let left = limit.saturating_duration_since(Instant::now());
            let timeout = PollTimeout::try_from(left.min(LOOK_EVERY)).unwrap_or(PollTimeout::MAX);
            match poll(&mut [PollFd::new(std::os::fd::AsFd::as_fd(&pidfd), PollFlags::POLLIN)], timeout) {
                Ok(_) | Err(Errno::EINTR) => {}
                Err(error) => return Err(self.waiting()(error.into())),
            }
            if self.ended()?.is_some() {
                return Ok(true);
            }
            if left.is_zero() || is_urgent() {
                return Ok(false);
            }
        }
    }

    /// Kills the process and waits for it to end.
    pub(crate) fn kill(&mut self) -> Result<()> {
        self.signal(Signal::SIGKILL)?;
        let status = self.child.wait().map_err(self.waiting())?;
        self.ended.get_or_insert((status, Instant::now()));
        Ok(())
    }

    fn waiting(&self) -> impl FnOnce(io::Error) -> Error + use<> {
        let process = self.process;
        move |source| Error::Wait { process, source }
    }
}

/// Sets what all starts of the process have in common.
fn prepare(line: &mut ProcessLine) -> Result<()> {
    let (supervisor, process) = (getpid(), line.process);
    // The recorder may still close its file, while the other processes have nothing to save.
    let is_recorder = process == Process::Recorder;
    let last = if is_recorder { Signal::SIGTERM } else { Signal::SIGKILL };
    let lifeline = is_recorder.then(|| pipe2(OFlag::O_CLOEXEC)).transpose();
    let lifeline = lifeline.map_err(|error| Error::Wait { process, source: error.into() })?;
    line.command.stdin(Stdio::null()).process_group(0);
    let term = SigSet::from(Signal::SIGTERM);
    // SAFETY: between fork and exec, the closure only makes a few system calls.
    unsafe {
        line.command.pre_exec(move || {
            // SIGTERM stays blocked until the process has joined the system and listens.
            term.thread_block()?;
            set_pdeathsig(last)?;
            if let Some((end, _)) = &lifeline {
                wake_on_hang_up(end)?;
            }
            // The supervisor may have died before the parent-death signal was set.
            if getppid() == supervisor { Ok(()) } else { Err(Errno::ESRCH.into()) }
        });
    }
    Ok(())
}

/// Makes the kernel send SIGCONT to this process when the other end of the pipe closes, as it does when the supervisor dies.
/// Otherwise, a process that is stopped at that time would not notice that it has been asked to end.
fn wake_on_hang_up(end: &OwnedFd) -> io::Result<()> {
    let settings = [
        (libc::F_SETFD, 0),
        (F_SETSIG, libc::SIGCONT),
        (libc::F_SETOWN, getpid().as_raw()),
        (libc::F_SETFL, libc::O_ASYNC),
    ];
    for (command, value) in settings {
        // SAFETY: this changes settings of our own descriptor, without pointers.
        Errno::result(unsafe { libc::fcntl(end.as_raw_fd(), command, value) })?;
    }
    Ok(())
}

fn spawn(line: &mut ProcessLine, log: &Path) -> Result<StdChild> {
    let open = || {
        let log = OpenOptions::new().append(true).create(true).mode(0o600).open(log)?;
        reserve(&log);
        Ok((log.try_clone()?, log))
    };
    let started = open().and_then(|(out, err)| line.command.stdout(out).stderr(err).spawn());
    started.map_err(|source| {
        let program = line.command.get_program().to_string_lossy().into_owned();
        Error::Spawn { process: line.process, program, source }
    })
}

/// Reserves space after the end of a log. Logs are often in shared memory themselves, so a process that dies because shared memory
/// is full can still report that. If there is no space, or the file system cannot reserve any, the process starts without it.
fn reserve(log: &File) {
    if let Ok(length) = log.metadata().map(|found| found.len()) {
        let _ = fallocate(log, FallocateFlags::FALLOC_FL_KEEP_SIZE, length as i64, RESERVED_BYTES);
    }
}

/// Returns the last lines of a log, with all of the error in which the program ended, or an empty string if the log cannot be read.
fn last_lines(log: &Path) -> String {
    let text = last_bytes(log).unwrap_or_default();
    let text = String::from_utf8_lossy(&text);
    // The frames of a backtrace would push the message of the panic out of the excerpt.
    let text = text.rsplit_once(BACKTRACE).map_or(&*text, |(before, _)| before).trim_end();
    let from = text.ceil_char_boundary(text.len().saturating_sub(EXCERPT_BYTES));
    let lines: Vec<_> = text[from..].lines().collect();
    let last = lines.len().saturating_sub(LAST_LINES);
    let error = lines.iter().rposition(|line| line.starts_with("error: ")).unwrap_or(last);
    lines[last.min(error)..].join("\n")
}

fn last_bytes(log: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(log)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LAST_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(LAST_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use super::*;

    /// Regression test: the line that named an exception was lost if more than eleven lines followed.
    #[test]
    fn the_last_lines_of_a_log_include_the_whole_error() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("planner.log");
        let calls: String = (1..=40).map(|i| format!("  call {i}\n")).collect();
        let printed: String = (1..=40).map(|i| format!("printed {i}\n")).collect();
        let error = format!("error: no wall\n{calls}");
        std::fs::write(&log, format!("error: an earlier one\n{printed}{error}")).unwrap();
        assert_eq!(last_lines(&log), error.trim_end());
        std::fs::write(&log, &printed).unwrap();
        assert_eq!(last_lines(&log), printed.trim_end().lines().skip(28).collect::<Vec<_>>().join("\n"));
        std::fs::write(&log, format!("error: no wall\n{}", printed.repeat(100))).unwrap();
        assert_eq!(last_lines(&log).lines().count(), LAST_LINES);
    }

    /// Regression test: with `RUST_BACKTRACE=1`, the last lines were frames of the backtrace.
    #[test]
    fn the_last_lines_of_a_panic_are_its_message() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("planner.log");
        let frames: String =
            (0..300).map(|i| format!("  {i}: core::ops::function::FnOnce::call_once\n")).collect();
        let panic = "thread 'main' panicked at src/main.rs:7:9:\ntoo late";
        std::fs::write(&log, format!("begun\n{panic}\nstack backtrace:\n{frames}")).unwrap();
        assert_eq!(last_lines(&log), format!("begun\n{panic}"));
    }

    /// Regression test: if a process died because shared memory was full, the error said that it had "printed nothing", because its
    /// log was in that memory.
    #[test]
    fn a_full_log_keeps_space_for_the_final_lines() {
        let folder = tempfile::tempdir_in("/dev/shm").unwrap();
        let log = folder.path().join("planner.log");
        let mut command = Command::new("sleep");
        command.arg("0");
        let mut line = ProcessLine { process: Process::Planner, command, resumes: true };
        assert!(spawn(&mut line, &log).unwrap().wait().unwrap().success());
        let found = std::fs::metadata(&log).unwrap();
        assert_eq!(found.len(), 0);
        assert!(found.blocks() * 512 >= RESERVED_BYTES as u64);
    }
}
