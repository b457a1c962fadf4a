//! The names of a system's files in shared memory, kept up to date without reading the folder over and over
//! again.
//!
//! `/dev/shm` belongs to all users, and another user may have put any number of files there. The folder is
//! therefore read only once. After that, the kernel reports new names (inotify), and the names of other
//! systems are dropped without looking at the files. The folder is read again only if the kernel cannot
//! report names, or has dropped reports because there were too many, and then at most every [`READ_EVERY`].

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::sys::inotify::{AddWatchFlags, InitFlags, Inotify, InotifyEvent};

use crate::Result;
use crate::shared::{Seen, look, names_that};

/// Interval between reads of the folder while reports are missing. Reading 200,000 names takes about 50 ms.
const READ_EVERY: Duration = Duration::from_secs(2);
/// Maximum number of times that reports are read in one look, which is more than the kernel queues. The rest, if any, is read at
/// the next look.
const READS: usize = 1024;

/// The names in a folder that begin with a prefix.
pub(crate) struct Names {
    folder: PathBuf,
    prefix: String,
    /// Source of reports, or `None` if the kernel cannot report names.
    reports: Option<Inotify>,
    known: BTreeSet<PathBuf>,
    /// When the folder was last read.
    read_at: Option<Instant>,
    /// Whether names may be missing.
    is_behind: bool,
}

impl Names {
    /// Watches the names in `folder` that begin with `prefix`.
    pub(crate) fn new(folder: &Path, prefix: &str) -> Self {
        Self::with_reports(folder, prefix, reports(folder).ok())
    }

    fn with_reports(folder: &Path, prefix: &str, reports: Option<Inotify>) -> Self {
        let known = BTreeSet::new();
        Self { folder: folder.into(), prefix: prefix.into(), reports, known, read_at: None, is_behind: true }
    }

    /// Returns the files that exist now, ordered by name.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the folder cannot be read.
    pub(crate) fn look(&mut self, now: Instant) -> Result<Vec<Seen>> {
        self.take_reports();
        let is_due = self.read_at.is_none_or(|at| now.saturating_duration_since(at) >= READ_EVERY);
        if self.is_behind && is_due {
            self.known = names_that(&self.folder, |name| name.starts_with(&self.prefix))?.collect();
            (self.read_at, self.is_behind) = (Some(now), self.reports.is_none());
        }
        let seen: Vec<_> =
            self.known.iter().filter_map(|path| Some((path.clone(), look(path).ok()?))).collect();
        if seen.len() < self.known.len() {
            self.known = seen.iter().map(|(path, _)| path.clone()).collect();
        }
        Ok(seen)
    }

    fn take_reports(&mut self) {
        let Some(reports) = &self.reports else { return };
        for _ in 0..READS {
            match reports.read_events() {
                Ok(events) => {
                    self.is_behind |= events.iter().any(reports_were_dropped);
                    let names = events.iter().filter_map(|event| event.name.as_ref()?.to_str());
                    let own = names.filter(|name| name.starts_with(&self.prefix));
                    self.known.extend(own.map(|name| self.folder.join(name)));
                }
                Err(Errno::EINTR) => {}
                Err(Errno::EAGAIN) => return,
                Err(_) => {
                    (self.reports, self.is_behind) = (None, true);
                    return;
                }
            }
        }
    }
}

/// Makes the kernel report new names. Removed files need no report, because they are noticed when they are looked at.
fn reports(folder: &Path) -> nix::Result<Inotify> {
    let reports = Inotify::init(InitFlags::IN_NONBLOCK | InitFlags::IN_CLOEXEC)?;
    reports.add_watch(folder, AddWatchFlags::IN_CREATE | AddWatchFlags::IN_MOVED_TO)?;
    Ok(reports)
}

fn reports_were_dropped(event: &InotifyEvent) -> bool {
    event.mask.contains(AddWatchFlags::IN_Q_OVERFLOW)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::shared::calls;

    fn names(seen: &[Seen]) -> Vec<&str> {
        seen.iter().filter_map(|(path, _)| path.file_name()?.to_str()).collect()
    }

    /// Regression test: 200,000 files of another user raised the load of a running supervisor from 4 to 83 % of a core, because it
    /// read the folder twice in 50 ms.
    #[test]
    fn names_of_other_systems_cost_nothing_after_the_first_read() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| fs::write(folder.path().join(name), "").unwrap();
        for foreign in [100, 400] {
            (0..foreign).for_each(|i| make(&format!("foreign_{i}")));
            make("own_a");
            let mut watched = Names::new(folder.path(), "own_");
            watched.look(Instant::now()).unwrap();
            let (seen, calls) = calls(|| watched.look(Instant::now()).unwrap());
            assert_eq!((names(&seen), calls), (vec!["own_a"], 1), "beside {foreign} names");
        }
    }

    #[test]
    fn created_names_appear_and_removed_ones_disappear() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for reports in [reports(folder.path()).ok(), None] {
            let has_reports = reports.is_some();
            fs::write(path("own_a"), "").unwrap();
            let mut watched = Names::with_reports(folder.path(), "own_", reports);
            let now = Instant::now();
            assert_eq!(names(&watched.look(now).unwrap()), ["own_a"]);
            fs::write(path("own_b"), "").unwrap();
            fs::write(path("other"), "").unwrap();
            fs::rename(path("other"), path("own_c")).unwrap();
            fs::remove_file(path("own_a")).unwrap();
            let soon: &[_] = if has_reports { &["own_b", "own_c"] } else { &[] };
            assert_eq!(names(&watched.look(now).unwrap()), soon);
            assert_eq!(names(&watched.look(now + READ_EVERY).unwrap()), ["own_b", "own_c"]);
            fs::remove_file(path("own_b")).unwrap();
            fs::write(path("own_b"), "again").unwrap();
            assert_eq!(watched.look(now + READ_EVERY).unwrap()[0].1.len(), 5, "the new one of that name");
            for name in ["own_b", "own_c"] {
                fs::remove_file(path(name)).unwrap();
            }
        }
    }

    /// The kernel only queues a limited number of reports and drops the rest.
    #[test]
    fn names_whose_reports_were_dropped_are_found_by_reading() {
        let most: usize =
            fs::read_to_string("/proc/sys/fs/inotify/max_queued_events").unwrap().trim().parse().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut watched = Names::new(folder.path(), "own_");
        let now = Instant::now();
        watched.look(now).unwrap();
        let (a, b) = (folder.path().join("foreign_a"), folder.path().join("foreign_b"));
        fs::write(&a, "").unwrap();
        for _ in 0..=most / 2 {
            fs::rename(&a, &b).unwrap();
            fs::rename(&b, &a).unwrap();
        }
        fs::write(folder.path().join("own_a"), "").unwrap();
        assert!(watched.look(now).unwrap().is_empty(), "its report was dropped");
        assert_eq!(names(&watched.look(now + READ_EVERY).unwrap()), ["own_a"]);
    }
}
