//! A system: a name, a folder, and a running supervisor.
//!
//! ```text
//! <root>/<name>/supervisor.lock   locked by the supervisor for its lifetime
//!               run.json          the run, as given to every process
//!               iceoryx2.toml     root-path and prefix of the shared memory
//!               bells             a page that every process maps
//!               faults            exists if faults are planned; fault-N once the N-th has happened
//!               notices           what processes and tools ask the supervisor to publish
//!               processes/<process>   locked by the process for its lifetime; contains its identity
//!               logs/<process>.log
//!               token             the random part of the prefix of its files in shared memory
//!               shared/           iceoryx2's files
//! /dev/shm/<prefix>owner          locked by the supervisor for its lifetime; names the folder
//!          <prefix>*              the messages
//!          <prefix>history_<channel>, <prefix>checkpoint_<process>_<slot>   what successors resume from
//! ```
//! No two systems share a file, see [`shared`](crate::shared).

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::sys::signal::Signal;
use sketchnav_files::RUN;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;

use crate::lock::{self, Lock};
use crate::shared::{self, Seen, SharedFiles, listed, unless_gone};
use crate::survey::Room;
use crate::{Error, Result, half_made, root};

/// Prefixes of the names of the files that successors resume from, without the prefix of the system.
const SUCCESSORS: [&str; 3] = ["history_", "checkpoint_", "owner"];
const MAX_NAME: usize = 32;
/// Maximum length of the root plus twice the name, in bytes. iceoryx2 0.10 builds paths of at most 255 bytes from the system's
/// folder and the prefix, both of which contain the name, and panics if they are longer (measured).
const MAX_ROOT_AND_NAMES: usize = 102;
/// Time that a process has to end by itself when its system is removed.
const LAST_WORD: Duration = Duration::from_secs(1);
/// Time that the kernel has to end a killed process, which may first have to wait for a slow disk.
const DEATH: Duration = Duration::from_secs(10);

/// The folder of a system, and everything that belongs to it.
#[derive(Debug)]
pub struct System {
    name: String,
    root: PathBuf,
    folder: PathBuf,
    /// Looked up when first needed, since a system that is being created does not have them yet.
    shared: OnceCell<SharedFiles>,
    /// The locks of the folder and of the shared memory, held if this process is the system's supervisor.
    ownership: Option<[Lock; 2]>,
}

impl System {
    /// Creates the system `run.system`, owned by this process until [`System::remove`] or its death. First removes the remains of
    /// dead systems of any name.
    ///
    /// # Errors
    /// If the name is invalid, a system with that name is running, or the root does not belong to this user.
    pub fn create(run: &RunConfig) -> Result<Self> {
        Self::create_in(root::of_this_user()?, run)
    }

    pub(crate) fn create_in(root: PathBuf, run: &RunConfig) -> Result<Self> {
        check_name(&run.system)?;
        check_length(&root, &run.system)?;
        let mut system = Self::at(root, &run.system);
        let (swept, _guard) = sweep(&system.root)?;
        Room::now()?.check()?;
        if system.folder.exists() {
            return Err(swept.why_left(&system.name).unwrap_or_else(|| system.already_running()));
        }
        system.make_folders()?;
        SharedFiles::create(&system.name, &system.folder)?;
        system.own()?;
        system.write_files(run)?;
        Ok(system)
    }

    fn own(&mut self) -> Result<()> {
        let path = self.supervisor_lock();
        let folder = Lock::try_take_as_this_process(&path).map_err(Error::file(&path, "locking"))?;
        let folder = folder.ok_or_else(|| self.already_running())?;
        let shared = self.shared()?.own(&self.folder)?.ok_or_else(|| self.already_running())?;
        self.ownership = Some([folder, shared]);
        Ok(())
    }

    /// Takes over the dead system whose recording is in `folder`. From now on, it is owned by this process.
    /// Anything that its processes need in order to resume is kept, and the rest is cleared.
    ///
    /// # Errors
    /// - [`Error::NothingToResume`] if there is no such system, or if another system cleared it when it
    ///   started.
    /// - [`Error::AlreadyRunning`] if its supervisor is alive.
    pub fn resume(folder: &Path) -> Result<(Self, RunConfig)> {
        Self::resume_in(root::of_this_user()?, folder)
    }

    pub(crate) fn resume_in(root: PathBuf, folder: &Path) -> Result<(Self, RunConfig)> {
        let _guard = root::guard(&root)?;
        let nothing = || Error::NothingToResume { folder: folder.into() };
        let wanted = fs::canonicalize(folder).map_err(|_| nothing())?;
        let recorded_there = |run: &RunConfig| {
            let recording = run.recording.as_ref().map(Path::new);
            recording.and_then(Path::parent).and_then(|path| path.canonicalize().ok()).as_ref()
                == Some(&wanted)
        };
        let mut dead_or_alive =
            all(&root)?.into_iter().filter_map(|system| system.run_config().ok().map(|run| (system, run)));
        let (mut system, run) = dead_or_alive.find(|(_, run)| recorded_there(run)).ok_or_else(nothing)?;
        system.own()?;
        system.shared()?.check()?;
        system.clear_for_successors(&run)?;
        Ok((system, run))
    }

    /// Opens the system with that name, if its supervisor is alive.
    ///
    /// # Errors
    /// [`Error::NotRunning`], which lists the names of the running systems.
    pub fn open(name: &str) -> Result<Self> {
        check_name(name)?;
        let system = Self::at(root::of_this_user()?, name);
        if system.is_alive()? {
            return Ok(system);
        }
        Err(system.not_running())
    }

    fn not_running(&self) -> Error {
        let names = |systems: Vec<Self>| systems.into_iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
        let running = Self::list().map(names).ok().filter(|names| !names.is_empty());
        Error::NotRunning { name: self.name.clone(), running: running.unwrap_or_else(|| "none".into()) }
    }

    /// Lists this user's systems whose supervisor is alive, ordered by name.
    pub fn list() -> Result<Vec<Self>> {
        Self::list_with(true)
    }

    /// Lists this user's systems whose supervisor was killed, and which have not been cleared or resumed since, ordered by
    /// name.
    pub fn list_dead() -> Result<Vec<Self>> {
        Self::list_with(false)
    }

    fn list_with(is_alive: bool) -> Result<Vec<Self>> {
        let root = root::of_this_user()?;
        let mut found = Vec::new();
        for system in all(&root)? {
            if system.is_alive()? == is_alive {
                found.push(system);
            }
        }
        Ok(found)
    }

    /// Clears what systems with a dead supervisor have left behind: processes, folders and shared memory. This user's shared memory
    /// that no longer belongs to any folder is cleared as well. Returns the names of the systems, and then the prefixes of the
    /// files.
    ///
    /// # Errors
    /// [`Error::StillHeld`] if a process of one system won't end. The other systems are cleared anyway.
    pub fn sweep_dead() -> Result<Vec<String>> {
        let (swept, _guard) = sweep(&root::of_this_user()?)?;
        match swept.left.into_values().next() {
            Some(error) => Err(error),
            None => Ok(swept.cleared),
        }
    }

    /// Returns the files of the system `name`, whether it is alive or not.
    ///
    /// # Errors
    /// [`Error::File`] if the folders cannot be read.
    pub fn leftovers(name: &str) -> Result<Vec<PathBuf>> {
        check_name(name)?;
        let system = Self::at(root::of_this_user()?, name);
        let mut found = shared::Survey::now()?.under_name(name, &system.folder)?;
        found.extend(system.folder.exists().then(|| system.folder.clone()));
        Ok(found)
    }

    /// Returns the system's files in shared memory.
    ///
    /// # Errors
    /// [`Error::File`] if the system's folder is gone.
    pub(crate) fn shared(&self) -> Result<&SharedFiles> {
        if let Some(shared) = self.shared.get() {
            return Ok(shared);
        }
        let gone = || Error::file(&self.folder, "looking up its token")(std::io::ErrorKind::NotFound.into());
        let shared = SharedFiles::of(&self.name, &self.folder)?.ok_or_else(gone)?;
        Ok(self.shared.get_or_init(|| shared))
    }

    /// Removes the system: its remaining processes, its shared memory and its folder. The supervisor calls this when its
    /// processes have ended.
    pub fn remove(mut self) -> Result<()> {
        // If the root has been removed, there is no folder to guard, but there is still memory to be cleared.
        let _guard = root::guard(&self.root).ok();
        self.ownership = None;
        self.clear()
    }

    /// Returns the system's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the system's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the path of a process's log.
    pub fn log_path(&self, process: Process) -> PathBuf {
        self.folder.join("logs").join(format!("{process}.log"))
    }

    /// Returns the run that the supervisor gave to every process.
    ///
    /// # Errors
    /// - [`Error::File`] if `run.json` cannot be read or is too large;
    /// - [`Error::RunConfig`] if it cannot be parsed.
    pub fn run_config(&self) -> Result<RunConfig> {
        let path = self.folder.join("run.json");
        let bytes = sketchnav_files::read(&path, RUN).map_err(Error::file(&path, "reading"))?;
        serde_json::from_slice(&bytes).map_err(|source| Error::RunConfig { path, source })
    }

    /// Returns the name and the process id of each running process of the system, ordered by name except for the supervisor,
    /// which comes first. Each observer is listed separately.
    pub fn processes(&self) -> Result<Vec<(String, u32)>> {
        let mut found = Vec::new();
        if self.is_alive()? {
            found.extend(named_owner("supervisor", &self.supervisor_lock()));
        }
        for path in self.process_locks()? {
            if lock::is_held(&path).map_err(Error::file(&path, "locking it"))? {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                found.extend(named_owner(&name, &path));
            }
        }
        Ok(found)
    }

    /// Takes a lock that keeps other processes from removing the system.
    ///
    /// # Errors
    /// [`Error::NotRunning`] if the system is already gone.
    pub(crate) fn hold(&self) -> Result<Lock> {
        let guard = root::guard(&self.root)?;
        if self.is_alive()? { Ok(guard) } else { Err(self.not_running()) }
    }

    pub(crate) fn iceoryx2_config(&self) -> PathBuf {
        self.folder.join("iceoryx2.toml")
    }

    /// Returns the path of a file of the system in shared memory. The file is removed with the system.
    pub(crate) fn shared_memory(&self, name: &str) -> Result<PathBuf> {
        Ok(self.shared()?.path(name))
    }

    pub(crate) fn notices(&self) -> PathBuf {
        self.folder.join("notices")
    }

    /// Removes the system's files in shared memory that no running process will finish. The caller keeps `ages` between calls.
    pub(crate) fn clear_half_made(&self, seen: &[Seen], ages: &mut half_made::Ages) -> Result<()> {
        let living = || Ok(self.processes()?.into_iter().map(|(_, pid)| pid).collect());
        shared::clear_half_made(seen, ages, living)
    }

    /// Returns another handle of the same system, for another thread. The handle does not own the system.
    pub(crate) fn view(&self) -> Self {
        Self { shared: self.shared.clone(), ..Self::at(self.root.clone(), &self.name) }
    }

    /// Returns the path of the file that exists if faults are planned for the run. Every writer looks for it once.
    pub(crate) fn faults_file(&self) -> PathBuf {
        self.folder.join("faults")
    }

    pub(crate) fn bells(&self) -> PathBuf {
        self.folder.join("bells")
    }

    /// Registers this process as `process` of the system for the lifetime of the lock. The supervisor does not need this, since
    /// it holds the system's own lock.
    pub(crate) fn enter(&self, process: Process) -> Result<Option<Lock>> {
        let file = match process {
            Process::Supervisor => return Ok(None),
            Process::Observer => format!("observer-{}", std::process::id()),
            _ => process.word().to_string(),
        };
        let path = self.folder.join("processes").join(file);
        match Lock::try_take_as_this_process(&path).map_err(Error::file(&path, "locking"))? {
            Some(lock) => Ok(Some(lock)),
            // A process may observe through several nodes.
            None if process == Process::Observer => Ok(None),
            None => {
                Err(Error::ProcessRunsAlready { process, system: self.name.clone(), pid: owner_pid(&path) })
            }
        }
    }

    fn at(root: PathBuf, name: &str) -> Self {
        let folder = root.join(name);
        Self { name: name.into(), root, folder, shared: OnceCell::new(), ownership: None }
    }

    fn supervisor_lock(&self) -> PathBuf {
        self.folder.join("supervisor.lock")
    }

    /// Returns true if the system's supervisor is alive.
    pub(crate) fn is_alive(&self) -> Result<bool> {
        let path = self.supervisor_lock();
        lock::is_held(&path).map_err(Error::file(path, "locking it"))
    }

    fn already_running(&self) -> Error {
        Error::AlreadyRunning { name: self.name.clone(), pid: owner_pid(&self.supervisor_lock()) }
    }

    fn make_folders(&self) -> Result<()> {
        root::private_folder(&self.folder)?;
        for part in ["processes", "logs", "shared"] {
            root::private_folder(&self.folder.join(part))?;
        }
        Ok(())
    }

    fn write_files(&self, run: &RunConfig) -> Result<()> {
        // Other processes find each file complete or not at all, and a process that has an earlier one open keeps it.
        // Otherwise, an observer that maps a page of a file that is still empty would be killed by SIGBUS.
        let write = |path: PathBuf, bytes: &[u8]| {
            let new = path.with_extension("new");
            let written = fs::write(&new, bytes).and_then(|()| fs::rename(&new, &path));
            written.map_err(Error::file(path, "writing"))
        };
        let path = self.folder.join("run.json");
        let wrong = |source| Error::RunConfig { path: path.clone(), source };
        if !run.faults.is_empty() {
            write(self.faults_file(), &[])?;
        }
        let run = serde_json::to_vec_pretty(run).map_err(wrong)?;
        RUN.check(run.len() as u64).map_err(Error::file(&path, "writing"))?;
        write(path, &run)?;
        write(self.bells(), &[0; crate::bells::PAGE])?;
        write(self.notices(), &[])?;
        let shared = self.folder.join("shared");
        let (folder, prefix) = (shared.to_string_lossy(), self.shared()?.prefix());
        let config = format!("[global]\nroot-path = {folder:?}\nprefix = {prefix:?}\n");
        write(self.iceoryx2_config(), config.as_bytes())
    }

    /// Ends processes that are still alive, and removes the files that no run resumes from.
    fn clear_for_successors(&self, run: &RunConfig) -> Result<()> {
        self.end_processes()?;
        self.shared()?.remove_but(&SUCCESSORS)?;
        for part in ["processes", "shared"].map(|part| self.folder.join(part)) {
            unless_gone(&part, fs::remove_dir_all(&part))?;
        }
        self.make_folders()?;
        self.write_files(run)
    }

    fn end_processes(&self) -> Result<()> {
        self.process_locks()?.iter().try_for_each(|path| end_owner(path, LAST_WORD))
    }

    /// Returns the path of the lock file of a process that exists once per system.
    pub(crate) fn process_lock(&self, process: Process) -> PathBuf {
        self.folder.join("processes").join(process.word())
    }

    fn process_locks(&self) -> Result<Vec<PathBuf>> {
        listed(&self.folder.join("processes"))
    }

    fn clear(&self) -> Result<()> {
        self.end_processes()?;
        // If the token has been read before, the files are known even if the folder has been removed.
        if let Ok(shared) = self.shared() {
            shared.remove_but(&[])?;
        }
        unless_gone(&self.folder, fs::remove_dir_all(&self.folder))
    }

    /// Removes this user's files before the supervisor's process ends abruptly. A foreign file is left, because a process that
    /// waits for it would continue if it were removed.
    pub(crate) fn abandon(&self) {
        let _ = self.shared().and_then(SharedFiles::remove_own);
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Returns the length of the longest name that [`check_length`] accepts.
pub(crate) fn longest_name(root: &Path) -> usize {
    (MAX_ROOT_AND_NAMES.saturating_sub(root.as_os_str().len()) / 2).min(MAX_NAME)
}

fn check_length(root: &Path, name: &str) -> Result<()> {
    let excess = (root.as_os_str().len() + 2 * name.len()).saturating_sub(MAX_ROOT_AND_NAMES);
    if excess == 0 {
        return Ok(());
    }
    Err(Error::PathTooLong { root: root.to_path_buf(), name: name.into(), excess })
}

fn check_name(name: &str) -> Result<()> {
    let known = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.is_empty() || name.len() > MAX_NAME || name.starts_with('-') || !name.chars().all(known) {
        return Err(Error::BadName { found: name.into(), max: MAX_NAME });
    }
    Ok(())
}

/// Returns all systems of the root, whether they are running or dead, ordered by name.
fn all(root: &Path) -> Result<Vec<System>> {
    let names = listed(root)?.into_iter().filter(|path| path.is_dir());
    let names = names.filter_map(|path| Some(path.file_name()?.to_str()?.to_string()));
    Ok(names.filter(|name| check_name(name).is_ok()).map(|name| System::at(root.into(), &name)).collect())
}

/// Returns the names of the dead systems of the root.
pub(crate) fn dead(root: &Path) -> Result<Vec<String>> {
    let mut dead = Vec::new();
    for system in all(root)? {
        if !system.is_alive()? {
            dead.push(system.name);
        }
    }
    Ok(dead)
}

/// Result of clearing dead systems.
#[derive(Debug, Default)]
struct Swept {
    /// Names of the systems that were cleared, followed by prefixes of files in shared memory.
    cleared: Vec<String>,
    /// Systems, by name, that were not cleared because one of their processes won't end.
    left: BTreeMap<String, Error>,
}

impl Swept {
    fn why_left(mut self, name: &str) -> Option<Error> {
        self.left.remove(name)
    }
}

/// Clears what systems with a dead supervisor have left behind. Returns the guard, which stays locked. Shared memory is surveyed
/// before the guard is taken, since another user may have filled it, and no other process should have to wait for that.
fn sweep(root: &Path) -> Result<(Swept, Lock)> {
    let survey = shared::Survey::now()?;
    let guard = root::guard(root)?;
    let mut swept = Swept::default();
    for system in all(root)? {
        if !system.is_alive()? {
            match system.clear() {
                Ok(()) => swept.cleared.push(system.name),
                // This happens if a container shares the folder. The system is swept again at the next start.
                Err(error @ Error::StillHeld { .. }) => drop(swept.left.insert(system.name, error)),
                Err(error) => return Err(error),
            }
        }
    }
    swept.cleared.extend(survey.clear_orphans()?);
    Ok((swept, guard))
}

/// Ends the process that holds the lock file, if there is one, and waits until it has ended. It is first asked to end, since an
/// observer may have something left to print.
///
/// # Errors
/// [`Error::StillHeld`] if the process won't end, or cannot be reached because the process id in the file may mean another
/// process here.
fn end_owner(path: &Path, last_word: Duration) -> Result<()> {
    let asking = || Error::file(path, "locking it");
    let mut waited = Duration::ZERO;
    for (signal, patience) in [(Signal::SIGTERM, last_word), (Signal::SIGKILL, DEATH)] {
        if !lock::is_held(path).map_err(asking())? {
            return Ok(());
        }
        let handle = lock::owner(path).and_then(|owner| owner.handle().ok());
        // The process may have ended by itself a moment ago.
        let is_reached = handle.is_some_and(|handle| handle.send(signal).is_ok());
        if lock::is_free_within(path, patience).map_err(asking())? {
            return Ok(());
        }
        waited += patience;
        if !is_reached {
            break;
        }
    }
    Err(Error::StillHeld { path: path.into(), holder: lock::holder(path), seconds: waited.as_secs_f64() })
}

/// Returns the id of the process that a lock file names, or an empty string if it names none.
fn owner_pid(path: &Path) -> String {
    lock::owner(path).map_or_else(String::new, |owner| owner.pid.to_string())
}

fn named_owner(name: &str, path: &Path) -> Option<(String, u32)> {
    Some((name.into(), lock::owner(path)?.pid))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::OpenOptionsExt;
    use std::process::{Command, Stdio};
    use std::time::Instant;

    use super::*;
    use crate::identity::tests::{imposters, sleeper};
    use crate::identity::{self, Identity};

    #[test]
    fn names_are_checked() {
        for good in ["a", "demo", "demo-2", "0"] {
            check_name(good).unwrap();
        }
        for bad in ["", "-a", "A", "a/b", "..", "a_b", "ä", &"x".repeat(33)] {
            assert!(check_name(bad).is_err(), "{bad}");
        }
    }

    /// Regression test: every process reads this file, and used to read all of it, no matter how large it was.
    #[test]
    fn the_description_of_a_run_is_limited_in_size() {
        let root = tempfile::tempdir().unwrap();
        let mut run: RunConfig = serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        run.system = "large".into();
        let system = System::create_in(root.path().into(), &run).unwrap();
        assert_eq!(system.run_config().unwrap(), run);
        let file = fs::File::options().write(true).open(system.folder.join("run.json")).unwrap();
        file.set_len(8 << 30).unwrap();
        let said = "run.json: reading: expected the description of a run of at most 67108864 bytes, found 8589934592";
        let error = system.run_config().unwrap_err().to_string();
        assert!(error.ends_with(said), "{error}");
        system.remove().unwrap();
        run.mission.name = "x".repeat(65 << 20);
        let error = System::create_in(root.path().into(), &run).unwrap_err().to_string();
        assert!(error.contains("run.json: writing: expected the description of a run of at most"), "{error}");
        assert_eq!(sweep(root.path()).unwrap().0.cleared, ["large"]);
    }

    /// Regression test: a lock file from a container that shared the folder contained the process id 4711. On this machine, an
    /// unrelated process had that id. It was killed, and its lock was then waited for forever.
    #[test]
    fn processes_of_another_namespace_are_neither_killed_nor_awaited_forever() {
        let root = tempfile::tempdir().unwrap();
        let run: RunConfig = serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        let mut system = System::create_in(root.path().into(), &run).unwrap();
        let path = system.process_lock(Process::Planner);
        let _held = system.enter(Process::Planner).unwrap();
        let (mut victim, identity) = sleeper();
        for imposter in imposters(&identity) {
            fs::write(&path, identity::text(&imposter)).unwrap();
            let error = end_owner(&path, Duration::from_millis(5)).unwrap_err().to_string();
            let words = format!(
                "processes/planner: expected the process of a dead system to end within 0.005 s, found the file held \
                                 by process {}",
                identity.pid
            );
            assert!(error.contains(&words), "{error}");
            assert!(victim.try_wait().unwrap().is_none(), "{imposter:?}");
        }
        // The old system is left as it is. A new one with its name fails with that reason, while others can start.
        system.ownership = None;
        let error = System::create_in(root.path().into(), &run).unwrap_err().to_string();
        assert!(error.contains("processes/planner: expected the process of a dead system to end"), "{error}");
        let other = RunConfig { system: "other".into(), ..run };
        System::create_in(root.path().into(), &other).unwrap().remove().unwrap();
        assert!(victim.try_wait().unwrap().is_none());
        victim.kill().unwrap();
        victim.wait().unwrap();
        drop(_held);
        assert_eq!(sweep(root.path()).unwrap().0.cleared, [system.name.clone()]);
    }

    #[test]
    fn the_process_that_holds_a_lock_is_ended() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("planner");
        // A process that inherits the open file holds its lock until it ends.
        let file = fs::File::options().read(true).write(true).create_new(true).open(&path).unwrap();
        let lock = Lock::of(file.try_clone().unwrap()).unwrap();
        let mut child = Command::new("sleep").arg("1000").stdin(Stdio::from(file)).spawn().unwrap();
        drop(lock);
        fs::write(&path, identity::text(&Identity::of_child(child.id()))).unwrap();
        end_owner(&path, Duration::from_secs(60)).unwrap();
        assert!(child.wait().unwrap().code().is_none(), "by a signal");
        end_owner(&path, Duration::ZERO).unwrap();
    }

    #[test]
    fn abandoned_files_are_removed_and_growing_ones_kept() {
        let root = tempfile::tempdir().unwrap();
        let run = serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        let system = System::create_in(root.path().into(), &run).unwrap();
        let make = |name: &str, mode, bytes| {
            let path = system.shared_memory(name).unwrap();
            let file = fs::OpenOptions::new().write(true).create_new(true).mode(mode).open(&path).unwrap();
            file.set_len(bytes).unwrap();
            (path, file)
        };
        let (empty, maker_of_empty) = make("empty", 0o200, 0);
        let (sized, maker_of_sized) = make("sized", 0o200, 4096);
        let (finished, _) = make("finished", 0o600, 4096);
        let seen = || system.shared().unwrap().names().look(Instant::now()).unwrap();
        let others = || {
            let mut all = system.shared().unwrap().all().unwrap();
            all.retain(|path| !path.to_string_lossy().ends_with("_owner"));
            all
        };
        let mut ages = half_made::Ages::with_patience(Duration::ZERO);
        system.clear_half_made(&seen(), &mut ages).unwrap();
        assert_eq!(others(), [&empty, &finished, &sized].map(PathBuf::clone));
        drop((maker_of_empty, maker_of_sized));
        system.clear_half_made(&seen(), &mut half_made::Ages::default()).unwrap();
        assert_eq!(others().len(), 3, "seen for the first time: its maker may be another container's");
        system.clear_half_made(&seen(), &mut ages).unwrap();
        assert_eq!(others(), [finished]);
        system.remove().unwrap();
    }

    /// Regression test: if the supervisor was killed while its processes were creating files, the recorder once waited for such
    /// a file forever. It had been asked to end, but did not look, and the dead system could not be resumed.
    #[test]
    fn a_surviving_process_does_not_wait_for_an_unfinished_file() {
        let root = tempfile::tempdir().unwrap();
        let run = serde_json::from_str(include_str!("../tests/run.json")).unwrap();
        let mut system = System::create_in(root.path().into(), &run).unwrap();
        let path = system.shared_memory("empty").unwrap();
        drop(fs::OpenOptions::new().write(true).create_new(true).mode(0o200).open(&path).unwrap());
        let (mut names, mut ages) =
            (system.shared().unwrap().names(), half_made::Ages::with_patience(Duration::ZERO));
        half_made::look_if_orphaned(&system, &mut names, &mut ages).unwrap();
        assert!(path.exists(), "the living supervisor has a sweeper of its own");
        system.ownership = None;
        half_made::look_if_orphaned(&system, &mut names, &mut ages).unwrap();
        assert!(!path.exists());
        system.remove().unwrap();
    }
}
