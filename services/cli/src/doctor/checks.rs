//! The checks of `sketchnav doctor`.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::thread::{available_parallelism, sleep};
use std::time::{Duration, Instant};

use nix::sys::resource::{Resource, getrlimit};
use nix::sys::statvfs::statvfs;
use sketchnav_runtime::{NEEDED_FILES, Room, System};
use sketchnav_supervisor::{check_file_limit, this_program};

use super::{Finding, Level};

/// The folder of POSIX shared memory.
const SHARED_MEMORY: &str = "/dev/shm";
/// Length of the longest name that the program chooses itself: 24 characters of the mission's name, a hyphen, and a
/// process id.
const USUAL_NAME: usize = 32;
/// The version of Linux that introduced `pidfd_open`, which the supervisor uses to wait for its processes.
const OLDEST_KERNEL: (u32, u32) = (5, 3);
/// Disk space needed for a recording, about ten times the size of the demo's.
const NEEDED_DISK_MIB: u64 = 100;
/// If the median duration of a 1 ms sleep exceeds this, commands arrive late in runs in real time.
const LATE: Duration = Duration::from_millis(3);
/// The number of sleeps that are timed.
const NAPS: usize = 21;

/// Runs every check, in order.
pub fn all() -> impl Iterator<Item = Finding> {
    let checks: [fn() -> Finding; 12] = [
        version,
        kernel,
        shared_memory,
        shared_memory_kind,
        folder,
        name_length,
        file_size,
        open_files,
        processors,
        clock,
        disk,
        leftovers,
    ];
    checks.into_iter().map(|check| check()).chain(other_builds())
}

fn version() -> Finding {
    let program = this_program().map_or_else(
        |_| "?".into(),
        |command| {
            let words = std::iter::once(command.get_program()).chain(command.get_args());
            words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
        },
    );
    Finding::fine("version", format!("{} {} ({program})", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")))
}

fn kernel() -> Finding {
    let release = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    kernel_finding(release.trim())
}

fn kernel_finding(release: &str) -> Finding {
    let mut numbers = release.split(|c: char| !c.is_ascii_digit()).map(|number| number.parse().ok());
    let found = numbers.next().flatten().zip(numbers.next().flatten());
    let (major, minor) = OLDEST_KERNEL;
    let advice =
        format!("use Linux {major}.{minor} or later: the supervisor waits for its processes by pidfd_open");
    match found {
        Some(found) if found >= OLDEST_KERNEL => Finding::fine("kernel", format!("Linux {release}")),
        Some(_) => Finding::of("kernel", Level::Error, format!("Linux {release}"), advice),
        None => Finding::of("kernel", Level::Warning, "unknown version", advice),
    }
}

fn shared_memory() -> Finding {
    let check = "shared memory";
    let room = match Room::now() {
        Ok(room) => room,
        Err(error) => {
            return Finding::of(
                check,
                Level::Error,
                error.to_string(),
                "mount a tmpfs on /dev/shm, mode 1777",
            );
        }
    };
    let Room { needed_mib, free_mib } = room;
    let found = format!("{free_mib} MiB free in {SHARED_MEMORY}, {needed_mib} needed");
    let advice = "run `sketchnav clean`, remove files of others, or enlarge it: `mount -o remount,size=256M /dev/shm`, \
                  for a container `docker run --shm-size=256m`";
    if room.check().is_err() {
        return Finding::of(check, Level::Error, found, advice);
    }
    let probe = Path::new(SHARED_MEMORY).join(format!("sketchnav-doctor-{}", std::process::id()));
    // The name must not be guessable, since somebody could create a link of that name first.
    let made = fs::File::options().write(true).create_new(true).open(&probe);
    let written = made.and_then(|mut file| file.write_all(&[0; 4096]));
    let _ = fs::remove_file(&probe);
    match written {
        Ok(()) => Finding::fine(check, found),
        Err(error) => {
            let found = format!("{SHARED_MEMORY} cannot be written: {error}");
            Finding::of(
                check,
                Level::Error,
                found,
                "give /dev/shm the mode 1777, or run as a user who may write there",
            )
        }
    }
}

/// Checks that shared memory is not on a disk, to which all messages would then be written.
fn shared_memory_kind() -> Finding {
    let mounts = fs::read_to_string("/proc/mounts").unwrap_or_default();
    let kind = mounts.lines().rev().find_map(|line| {
        let mut words = line.split(' ').skip(1);
        (words.next() == Some(SHARED_MEMORY)).then(|| words.next().unwrap_or_default().to_owned())
    });
    match kind.as_deref() {
        Some(kind @ ("tmpfs" | "ramfs" | "shm")) => {
            Finding::fine("mount", format!("{SHARED_MEMORY} is a {kind}"))
        }
        kind => {
            let found = format!("{SHARED_MEMORY} is {}", kind.unwrap_or("a folder of another file system"));
            Finding::of(
                "mount",
                Level::Warning,
                found,
                "mount a tmpfs there: `mount -t tmpfs -o mode=1777 shm /dev/shm`",
            )
        }
    }
}

fn folder() -> Finding {
    let variable = std::env::var("XDG_RUNTIME_DIR").ok().filter(|value| !value.is_empty());
    match System::root_folder() {
        // The error itself explains what to do.
        Err(error) => Finding::of(
            "folder",
            Level::Error,
            error.to_string(),
            "set XDG_RUNTIME_DIR to a folder that you own (mode 0700), such as /run/user/1000",
        ),
        Ok(root) if variable.is_none() => {
            let found = format!("{}, since XDG_RUNTIME_DIR is not set", root.display());
            let advice = "set XDG_RUNTIME_DIR to a folder that you own (mode 0700), such as /run/user/1000, the same in every shell: \
                          a shell with a different folder does not see your systems";
            Finding::of("folder", Level::Warning, found, advice)
        }
        Ok(root) => Finding::fine("folder", root.display().to_string()),
    }
}

fn name_length() -> Finding {
    // If the folder is unusable, the previous check has reported that.
    let longest = System::longest_name().unwrap_or(USUAL_NAME);
    let found = format!("names of systems may have {longest} characters");
    if longest >= USUAL_NAME {
        return Finding::fine("names", found);
    }
    let level = if longest == 0 { Level::Error } else { Level::Warning };
    Finding::of("names", level, found, "set XDG_RUNTIME_DIR to a shorter path, or name systems by --system")
}

fn file_size() -> Finding {
    match check_file_limit() {
        Ok(()) => Finding::fine("file size", "files may be as large as the largest channel"),
        Err(error) => Finding::of("file size", Level::Error, error.to_string(), "run `ulimit -f unlimited`"),
    }
}

fn open_files() -> Finding {
    // A process that needs more raises its own soft limit.
    let hard = getrlimit(Resource::RLIMIT_NOFILE).map_or(u64::MAX, |(_, hard)| hard);
    let found = format!("{hard} open files a process at most, {NEEDED_FILES} needed");
    if hard >= NEEDED_FILES {
        return Finding::fine("open files", found);
    }
    Finding::of("open files", Level::Error, found, format!("run `ulimit -n {NEEDED_FILES}`"))
}

fn processors() -> Finding {
    let cores = available_parallelism().map_or(1, usize::from);
    let found = format!("{cores} for this program");
    if cores >= 2 {
        return Finding::fine("processors", found);
    }
    let advice =
        "expect late commands in real time: world, localizer and planner share one; lockstep is not affected";
    Finding::of("processors", Level::Warning, found, advice)
}

fn clock() -> Finding {
    let mut naps: Vec<_> = (0..NAPS).map(|_| nap()).collect();
    naps.sort_unstable();
    let median = naps[NAPS / 2];
    let found = format!("a sleep of 1 ms takes {:.2} ms", median.as_secs_f64() * 1e3);
    if median <= LATE {
        return Finding::fine("clock", found);
    }
    let advice = "stop other busy programs, or give it more processors: in real time commands arrive late";
    Finding::of("clock", Level::Warning, found, advice)
}

fn nap() -> Duration {
    let began = Instant::now();
    sleep(Duration::from_millis(1));
    began.elapsed()
}

fn disk() -> Finding {
    let here = std::env::current_dir().unwrap_or_else(|_| ".".into());
    let Ok(found) = statvfs(&here) else {
        return Finding::of(
            "disk",
            Level::Error,
            "the current folder no longer exists",
            "change to another folder",
        );
    };
    let free_mib = (found.blocks_available() * found.fragment_size()) >> 20;
    let found = format!("{free_mib} MiB free in {}", here.display());
    if free_mib >= NEEDED_DISK_MIB {
        return Finding::fine("disk", found);
    }
    let advice =
        "free some space, or write elsewhere with --out DIR: on a full disk, the recording is incomplete";
    Finding::of("disk", Level::Warning, found, advice)
}

fn leftovers() -> Finding {
    match System::dead() {
        Ok(dead) if dead.is_empty() => Finding::fine("leftovers", "none"),
        Ok(dead) => {
            let advice =
                "run `sketchnav clean`; to continue one of them, first run `sketchnav run --resume DIR`";
            Finding::of("leftovers", Level::Warning, format!("of dead systems: {}", dead.join(", ")), advice)
        }
        Err(error) => Finding::of("leftovers", Level::Warning, error.to_string(), "see the checks above"),
    }
}

/// Finds systems whose processes run a different program from this one, since the layouts of their messages may differ.
fn other_builds() -> Option<Finding> {
    let own = identity("/proc/self/exe")?;
    let is_other = |pid: u32| identity(&format!("/proc/{pid}/exe")).is_some_and(|found| found != own);
    let mut others = BTreeSet::new();
    for system in System::list().ok()? {
        let processes = system.processes().unwrap_or_default();
        // Drivers and observers may be other programs, so only the supervisor is compared.
        let supervisor = processes.iter().find(|(name, _)| name == "supervisor");
        if supervisor.is_some_and(|(_, pid)| is_other(*pid)) {
            others.insert(system.name().to_owned());
        }
    }
    if others.is_empty() {
        return None;
    }
    let names = others.into_iter().collect::<Vec<_>>().join(", ");
    let advice = "look at them with the program that started them, or end them: builds with other layouts cannot connect";
    Some(Finding::of("other builds", Level::Warning, format!("another program runs {names}"), advice))
}

/// Identifies the file of a program, which may have been replaced on disk since the program started.
fn identity(path: &str) -> Option<(u64, u64)> {
    let found = fs::metadata(path).ok()?;
    Some((found.dev(), found.ino()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_kernel_is_reported() {
        let level = |release| kernel_finding(release).level;
        assert_eq!(level("5.3.0-generic"), Level::Fine);
        assert_eq!(level("6.1"), Level::Fine);
        assert_eq!(level("4.19.0"), Level::Error);
        assert_eq!(level("5.2.99"), Level::Error);
        assert_eq!(level("odd"), Level::Warning);
    }

    #[test]
    fn every_problem_comes_with_a_remedy() {
        for finding in all() {
            assert_eq!(finding.level == Level::Fine, finding.advice.is_none(), "{finding:?}");
        }
    }
}
