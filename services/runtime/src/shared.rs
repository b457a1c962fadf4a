//! The files of a system in `/dev/shm`: their names and their ownership.
//!
//! Each name begins with the system's prefix, `sketchnav_<name>_<token>_`. The token is random and stored in
//! the system's folder, which no other user can enter. As a result, no process can prepare a file for a
//! system that has not started yet, and no system encounters the files of an earlier one with the same name.
//!
//! `<prefix>owner` is the first file to be created and the last to be removed. It contains the path of the system's folder, and
//! the supervisor holds its lock. Files whose owner is dead, and whose token is not in any folder, are orphans and are removed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use nix::fcntl::{AT_FDCWD, AtFlags, posix_fallocate};
use nix::libc;
use nix::unistd::{getuid, linkat};

use crate::lock::{self, Lock};
use crate::names::Names;
use crate::{Error, Result, half_made};

/// The folder of POSIX shared memory.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// Beginning of every file name.
const MARK: &str = "sketchnav_";
/// Name of the file in a system's folder that contains its token.
const TOKEN: &str = "token";
/// Length of a token, in hexadecimal digits.
const DIGITS: usize = 16;
/// Name of the file that identifies the owner of the others.
const OWNER: &str = "owner";
/// Unit of a file's blocks, in bytes.
const BLOCK: u64 = 512;
/// Maximum size of a file that counts as small in [`SharedFiles::reserve_small`], in bytes.
const SMALL_BYTES: u64 = 1 << 20;

/// The path of a file, and its metadata when it was looked at.
pub(crate) type Seen = (PathBuf, Metadata);

/// The files of one system.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SharedFiles {
    /// [`SHARED_MEMORY`], except in tests.
    folder: PathBuf,
    prefix: String,
}

impl SharedFiles {
    /// Returns the files of a system that is about to start. Writes a new token into its folder.
    pub(crate) fn create(name: &str, folder: &Path) -> Result<Self> {
        let random = || {
            let mut bytes = [0; DIGITS / 2];
            File::open("/dev/urandom")?.read_exact(&mut bytes)?;
            Ok(u64::from_ne_bytes(bytes))
        };
        let token = format!("{:016x}", random().map_err(Error::file("/dev/urandom", "reading"))?);
        let path = folder.join(TOKEN);
        let write = || private(&path)?.write_all(token.as_bytes());
        write().map_err(Error::file(&path, "writing"))?;
        Ok(Self::with_token(name, &token))
    }

    /// Returns the files of the system in `folder`, or `None` if the folder does not contain a token.
    pub(crate) fn of(name: &str, folder: &Path) -> Result<Option<Self>> {
        Ok(token(folder)?.map(|token| Self::with_token(name, &token)))
    }

    fn with_token(name: &str, token: &str) -> Self {
        Self { folder: SHARED_MEMORY.into(), prefix: format!("{MARK}{name}_{token}_") }
    }

    /// Returns the files of the system that a file in `folder` belongs to, judging by its name.
    fn of_name(folder: &Path, name: &str) -> Option<Self> {
        let (system, rest) = name.strip_prefix(MARK)?.split_once('_')?;
        let (token, _) = rest.split_once('_')?;
        is_token(token).then(|| Self { folder: folder.into(), ..Self::with_token(system, token) })
    }

    /// Returns the prefix of the files' names.
    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Returns the path of a file.
    pub(crate) fn path(&self, file: &str) -> PathBuf {
        self.folder.join(format!("{}{file}", self.prefix))
    }

    /// Returns the names of the files, which are kept up to date.
    pub(crate) fn names(&self) -> Names {
        Names::new(&self.folder, &self.prefix)
    }

    /// Makes this process the owner of the files for the lifetime of the lock. Returns `None` if another process owns them.
    pub(crate) fn own(&self, folder: &Path) -> Result<Option<Lock>> {
        let path = self.path(OWNER);
        match make_owner(&path, folder) {
            Ok(lock) => Ok(Some(lock)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                check(&path)?;
                Lock::try_take(&path).map_err(Error::file(path, "locking"))
            }
            Err(error) => Err(Error::file(path, "creating it")(error)),
        }
    }

    /// Returns all files, ordered by name except for the owner file, which comes last. This reads the whole folder, which all
    /// users share, so it should only be called once by a process that starts or clears a system.
    pub(crate) fn all(&self) -> Result<Vec<PathBuf>> {
        let mut files: Vec<_> = names_that(&self.folder, |name| name.starts_with(&self.prefix))?.collect();
        self.sort(&mut files);
        Ok(files)
    }

    fn sort(&self, files: &mut [PathBuf]) {
        let owner = self.path(OWNER);
        files.sort_by(|a, b| (*a == owner, a).cmp(&(*b == owner, b)));
    }

    /// Returns the files that this process has mapped, without reading the folder.
    fn mapped(&self) -> Result<BTreeSet<PathBuf>> {
        const MAPS: &str = "/proc/self/maps";
        let maps = fs::read(MAPS).map_err(Error::file(MAPS, "reading"))?;
        let maps = String::from_utf8_lossy(&maps);
        let begin = self.path("");
        let begin = begin.to_string_lossy();
        let path = |line: &str| line.find(&*begin).map(|at| PathBuf::from(&line[at..]));
        Ok(maps.lines().filter_map(path).collect())
    }

    /// Checks that no other user has put a file among those of the system.
    ///
    /// # Errors
    /// [`Error::ForeignFile`] for the first such file.
    pub(crate) fn check(&self) -> Result<()> {
        self.all()?.iter().try_for_each(|path| check(path))
    }

    /// Withdraws other users' access to the files that this process has mapped, since iceoryx2 0.10 creates
    /// one of its files with read and write access for everyone.
    ///
    /// # Errors
    /// [`Error::File`] if the mode of a file cannot be changed.
    pub(crate) fn keep_others_out(&self) -> Result<()> {
        let look = |path: PathBuf| look(&path).ok().map(|found| (path, found));
        keep_others_out(&self.mapped()?.into_iter().filter_map(look).collect::<Vec<_>>())
    }

    /// Allocates the memory of the small files that this process has mapped. A process that runs out of memory later would be
    /// killed, and the supervisor has to survive a shortage. (The large files are sized for the worst case.)
    pub(crate) fn reserve_small(&self) -> Result<()> {
        for path in self.mapped()? {
            let Ok(found) = look(&path) else { continue };
            let is_reserved = found.blocks() * BLOCK >= found.len();
            if is_own(&found) && !is_reserved && found.len() <= SMALL_BYTES {
                let reserve = || {
                    let file = OpenOptions::new().write(true).custom_flags(libc::O_NOFOLLOW).open(&path)?;
                    posix_fallocate(&file, 0, found.len() as libc::off_t).map_err(std::io::Error::from)
                };
                unless_gone(&path, reserve())?;
            }
        }
        Ok(())
    }

    /// Removes the files, except for those whose names continue with one of `keep` after the prefix.
    pub(crate) fn remove_but(&self, keep: &[&str]) -> Result<()> {
        for path in self.all()? {
            let rest = &name_of(&path)[self.prefix.len()..];
            if !keep.iter().any(|kept| rest.starts_with(kept)) {
                remove(&path)?;
            }
        }
        Ok(())
    }

    /// Removes the files that belong to this user.
    pub(crate) fn remove_own(&self) -> Result<()> {
        for path in self.all()? {
            if look(&path).is_ok_and(|found| is_own(&found)) {
                unless_gone(&path, fs::remove_file(&path))?;
            }
        }
        Ok(())
    }

    /// Returns the folder named in the owner file, or `None` if there is no such file or it belongs to another user.
    fn owner_folder(&self) -> Option<PathBuf> {
        let path = self.path(OWNER);
        check(&path).ok()?;
        Some(PathBuf::from(fs::read_to_string(path).ok()?))
    }

    /// Returns true if no supervisor holds the files, and their token is not in any folder.
    fn is_orphaned(&self) -> bool {
        if look(&self.path(OWNER)).is_ok_and(|found| !is_own(&found)) {
            return false;
        }
        let token = self.prefix.trim_end_matches('_').rsplit('_').next();
        let known =
            self.owner_folder().is_some_and(|folder| self::token(&folder).ok().flatten().as_deref() == token);
        !known && !lock::is_held(&self.path(OWNER)).unwrap_or(true)
    }
}

/// Removes a file. In a folder with the sticky bit, a file of another user cannot always be removed, and is left alone.
fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(_) if check(path).is_err() => Ok(()),
        removed => unless_gone(path, removed),
    }
}

/// Checks that none of the files belongs to another user.
///
/// # Errors
/// [`Error::ForeignFile`] for the first one that does.
pub(crate) fn check_seen(seen: &[Seen]) -> Result<()> {
    seen.iter().try_for_each(|(path, found)| check_found(path, found))
}

/// Makes this user's files private, if others may read or write them.
pub(crate) fn keep_others_out(seen: &[Seen]) -> Result<()> {
    for (path, found) in seen.iter().filter(|(_, found)| is_own(found) && found.mode() & 0o077 != 0) {
        // In a folder with the sticky bit, no other user can replace one of our files by a link.
        let private = fs::Permissions::from_mode(found.mode() & 0o700);
        unless_gone(path, fs::set_permissions(path, private))?;
    }
    Ok(())
}

/// Removes files that no running process will finish. `living` returns the ids of the system's running processes.
pub(crate) fn clear_half_made(
    seen: &[Seen],
    ages: &mut half_made::Ages,
    living: impl Fn() -> Result<Vec<u32>>,
) -> Result<()> {
    for (path, file) in ages.unfinished(seen).into_iter().filter(|(_, file)| is_own(file)) {
        let is_held = living()?.into_iter().any(|pid| half_made::has_open(pid, &file));
        // The maker may have finished the file and ended in the meantime.
        if !is_held && look(&path).is_ok_and(|now| half_made::is_unfinished(&now)) {
            unless_gone(&path, fs::remove_file(&path))?;
        }
    }
    Ok(())
}

/// This user's files in shared memory, by system. The folder is read once and each file of another user is looked at once,
/// however many there are.
#[derive(Debug)]
pub(crate) struct Survey(BTreeMap<SharedFiles, Vec<PathBuf>>);

impl Survey {
    /// Surveys `/dev/shm`.
    pub(crate) fn now() -> Result<Self> {
        Self::of(Path::new(SHARED_MEMORY), getuid().as_raw())
    }

    fn of(folder: &Path, uid: u32) -> Result<Self> {
        let mut systems = BTreeMap::<_, Vec<_>>::new();
        for path in names_that(folder, |name| name.starts_with(MARK))? {
            let Some(files) = SharedFiles::of_name(folder, &name_of(&path)) else { continue };
            if look(&path).is_ok_and(|found| complaint(&found, uid).is_none()) {
                systems.entry(files).or_default().push(path);
            }
        }
        systems.iter_mut().for_each(|(files, paths)| files.sort(paths));
        Ok(Self(systems))
    }

    /// Returns the files of dead systems whose folders are gone.
    fn orphaned(self) -> impl Iterator<Item = (SharedFiles, Vec<PathBuf>)> {
        self.0.into_iter().filter(|(files, _)| files.is_orphaned())
    }

    /// Returns the prefixes of the files of dead systems whose folders are gone.
    pub(crate) fn orphans(self) -> Vec<String> {
        self.orphaned().map(|(files, _)| files.prefix).collect()
    }

    /// Removes the files of dead systems whose folders are gone. Returns their prefixes.
    pub(crate) fn clear_orphans(self) -> Result<Vec<String>> {
        let mut cleared = Vec::new();
        for (files, paths) in self.orphaned() {
            let mut any = false;
            for path in paths {
                let removed = fs::remove_file(&path);
                any |= removed.is_ok();
                unless_gone(&path, removed)?;
            }
            cleared.extend(any.then_some(files.prefix));
        }
        Ok(cleared)
    }

    /// Returns the files under a system's name that belong to `folder`, or that belong to this user and have no owner file.
    pub(crate) fn under_name(self, name: &str, folder: &Path) -> Result<Vec<PathBuf>> {
        let begin = format!("{MARK}{name}_");
        let mut found = Vec::new();
        for (files, own) in self.0.into_iter().filter(|(files, _)| files.prefix.starts_with(&begin)) {
            let has_owner = look(&files.path(OWNER)).is_ok();
            match files.owner_folder() {
                Some(owner) if owner == folder => found.extend(files.all()?),
                // These belong to a system in another folder, or to another user's system.
                _ if has_owner => {}
                _ => found.extend(own),
            }
        }
        Ok(found)
    }
}

/// Returns the token of the system in `folder`.
fn token(folder: &Path) -> Result<Option<String>> {
    let path = folder.join(TOKEN);
    match fs::read_to_string(&path) {
        Ok(token) => Ok(Some(token).filter(|token| is_token(token))),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
        Err(error) => Err(Error::file(path, "reading")(error)),
    }
}

fn is_token(text: &str) -> bool {
    text.len() == DIGITS && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Creates the owner file. It is complete and locked before another process can see it.
fn make_owner(path: &Path, folder: &Path) -> std::io::Result<Lock> {
    let unnamed = || {
        let mut options = OpenOptions::new();
        let parent = path.parent().unwrap_or(Path::new(SHARED_MEMORY));
        options.read(true).write(true).mode(0o600).custom_flags(libc::O_TMPFILE).open(parent)
    };
    let mut file = unnamed()?;
    file.write_all(folder.as_os_str().as_encoded_bytes())?;
    let named = format!("/proc/self/fd/{}", file.as_raw_fd());
    let lock = Lock::of(file)?;
    linkat(AT_FDCWD, named.as_str(), AT_FDCWD, path, AtFlags::AT_SYMLINK_FOLLOW)?;
    Ok(lock)
}

/// Creates a file that only this user may read and write.
pub(crate) fn private(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true).mode(0o600).open(path)
}

/// Opens an existing file of this user. Links are not followed.
///
/// # Errors
/// [`Error::ForeignFile`] if it is a link or belongs to another user.
pub(crate) fn open_own(path: &Path) -> Result<File> {
    let mut options = OpenOptions::new();
    // If another user has put a pipe there, opening it must not block.
    options.read(true).write(true).custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
    let file = match options.open(path) {
        Ok(file) => file,
        Err(error) => {
            check(path)?;
            return Err(Error::file(path, "opening")(error));
        }
    };
    let found = file.metadata().map_err(Error::file(path, "inspecting it"))?;
    check_found(path, &found).map(|()| file)
}

/// Checks that a file belongs to this user and is not a link. A missing file passes.
fn check(path: &Path) -> Result<()> {
    look(path).map_or(Ok(()), |found| check_found(path, &found))
}

fn check_found(path: &Path, found: &Metadata) -> Result<()> {
    complaint(found, getuid().as_raw()).map_or(Ok(()), |found| Err(foreign(path, found)))
}

fn is_own(found: &Metadata) -> bool {
    complaint(found, getuid().as_raw()).is_none()
}

/// Describes the problem with a file that must belong to this user only, if there is one. (Its mode is chosen by iceoryx2 and
/// corrected later.)
fn complaint(found: &Metadata, uid: u32) -> Option<String> {
    let kind = found.file_type();
    if kind.is_symlink() {
        Some("a link".into())
    } else if !kind.is_file() {
        Some("not a regular file".into())
    } else if found.uid() != uid {
        Some(format!("a file of user {}", found.uid()))
    } else if found.nlink() > 1 {
        Some(format!("a file with {} names", found.nlink()))
    } else {
        None
    }
}

fn foreign(path: &Path, found: String) -> Error {
    Error::ForeignFile { path: path.into(), uid: getuid().as_raw(), found }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the entries of a folder, ordered by name, or nothing if it is missing.
pub(crate) fn listed(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut paths: Vec<_> = names_that(folder, |_| true)?.collect();
    paths.sort();
    Ok(paths)
}

/// Returns the entries of a folder whose names satisfy `is_so`, in any order, or nothing if the folder is missing. Other names
/// are not stored.
pub(crate) fn names_that<'a>(
    folder: &'a Path,
    is_so: impl Fn(&str) -> bool + 'a,
) -> Result<impl Iterator<Item = PathBuf> + 'a> {
    let found = match fs::read_dir(folder) {
        Ok(found) => Some(found),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(Error::file(folder, "listing")(error)),
    };
    let names = found.into_iter().flatten().filter_map(|entry| Some(entry.ok()?.file_name()));
    let names = names.inspect(|_| count_call());
    Ok(names.filter(move |name| is_so(&name.to_string_lossy())).map(move |name| folder.join(name)))
}

/// Returns a file's metadata. Links are not followed.
pub(crate) fn look(path: &Path) -> std::io::Result<Metadata> {
    count_call();
    fs::symlink_metadata(path)
}

#[cfg(not(test))]
fn count_call() {}

#[cfg(test)]
thread_local! {
    static CALLS: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}

#[cfg(test)]
fn count_call() {
    CALLS.set(CALLS.get() + 1);
}

/// Returns the result of `work`, and how many names it has read and files it has looked at.
#[cfg(test)]
pub(crate) fn calls<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = CALLS.get();
    (work(), CALLS.get() - before)
}

/// Passes on a result, except that a missing file is not an error.
pub(crate) fn unless_gone(path: &Path, result: std::io::Result<()>) -> Result<()> {
    match result {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(Error::file(path, "removing, reserving or changing it")(error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Regression test: another user created `checkpoint_localizer_0` under a name that was derived from a hash, and could read the
    /// scans of a mission.
    #[test]
    fn no_two_systems_have_the_same_prefix() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let files = folders.each_ref().map(|folder| SharedFiles::create("lab", folder.path()).unwrap());
        assert_ne!(files[0], files[1]);
        assert_eq!(SharedFiles::of("lab", folders[0].path()).unwrap().as_ref(), Some(&files[0]));
        assert!(!files[0].prefix.starts_with(&files[1].prefix));
    }

    #[test]
    fn anything_but_a_plain_file_of_this_user_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let files = SharedFiles::create("foreign", folder.path()).unwrap();
        let victim = folder.path().join("victim");
        fs::write(&victim, "precious").unwrap();
        let link = files.path("history_scan");
        symlink(&victim, &link).unwrap();
        for error in [files.check().unwrap_err(), open_own(&link).map(drop).unwrap_err()] {
            let text = error.to_string();
            assert!(text.starts_with(&link.display().to_string()) && text.contains("found a link"), "{text}");
        }
        files.remove_but(&[]).unwrap();
        assert_eq!(
            (fs::read_to_string(&victim).unwrap().as_str(), files.check().is_ok()),
            ("precious", true)
        );
        fs::hard_link(&victim, folder.path().join("second")).unwrap();
        assert!(open_own(&victim).map(drop).unwrap_err().to_string().contains("found a file with 2 names"));
    }

    /// Regression test: a system of another user with the same name used to be counted among the user's own leftovers.
    #[test]
    fn a_system_has_only_files_of_its_own_user() {
        let folder = tempfile::tempdir().unwrap();
        let under_name = || Survey::now().unwrap().under_name("shared-name", folder.path()).unwrap();
        // The owner file comes first, since another test may clear files without an owner at any time.
        let begin = |owner: Option<&Path>| {
            let of_a_run = tempfile::tempdir().unwrap();
            let files = SharedFiles::create("shared-name", of_a_run.path()).unwrap();
            let lock = owner.map(|owner| files.own(owner).unwrap());
            private(&files.path("history_command")).unwrap();
            (files, lock)
        };
        let (own, _own_lock) = begin(Some(folder.path()));
        let (elsewhere, _lock) = begin(Some(Path::new("/elsewhere")));
        let [(nobodys, _), (foreign, _)] = [(); 2].map(|()| begin(None));
        for path in [foreign.path(OWNER), nobodys.path("history_scan")] {
            private(&path).unwrap();
            give_away(&path);
        }
        let mut found = under_name();
        for files in [&own, &nobodys, &foreign, &elsewhere] {
            files.all().unwrap().iter().for_each(|path| unless_gone(path, fs::remove_file(path)).unwrap());
        }
        // Another test may have cleared it.
        found.retain(|path| *path != nobodys.path("history_command"));
        assert_eq!(found, [own.path("history_command"), own.path(OWNER)]);
    }

    /// Gives a file to another user, or replaces it by a link if that is not permitted.
    fn give_away(path: &Path) {
        if std::os::unix::fs::chown(path, Some(65534), Some(65534)).is_err() {
            fs::remove_file(path).unwrap();
            symlink("/elsewhere", path).unwrap();
        }
    }

    /// Regression test: with 4,000 empty files of another user, a run took 29 s to start, because the folder was read again for
    /// each file.
    #[test]
    fn each_file_of_another_user_is_looked_at_once() {
        let (uid, folder) = (getuid().as_raw(), tempfile::tempdir().unwrap());
        for many in [50, 100, 200] {
            let folder = folder.path().join(many.to_string());
            fs::create_dir(&folder).unwrap();
            for i in 0..many {
                private(&folder.join(format!("sketchnav_x{i}_0123456789abcdef_z"))).unwrap();
            }
            let another_users = || Survey::of(&folder, uid + 1).unwrap();
            let (found, calls) = calls(|| another_users().clear_orphans().unwrap());
            assert_eq!((found.len(), calls), (0, 2 * many), "a name and a look for each");
            let (found, calls) = self::calls(|| another_users().under_name("x1", &folder).unwrap());
            assert_eq!((found.len(), calls), (0, 2 * many));
            let begin = SharedFiles { folder: folder.clone(), prefix: "sketchnav_own_".into() };
            let (found, calls) = self::calls(|| begin.all().unwrap());
            assert_eq!((found.len(), calls), (0, many), "a name each");
        }
    }

    /// This user's own leftovers must also be cleared in time that grows linearly with the number of files.
    #[test]
    fn clearing_orphans_takes_linear_time() {
        let per_file = [20, 40, 80].map(|many: u64| {
            let folder = tempfile::tempdir().unwrap();
            for i in 0..many {
                private(&folder.path().join(format!("sketchnav_x{i}_0123456789abcdef_z"))).unwrap();
            }
            let clear = || Survey::of(folder.path(), getuid().as_raw()).unwrap().clear_orphans().unwrap();
            let (cleared, calls) = calls(clear);
            assert_eq!(cleared.len() as u64, many);
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
            calls as f64 / many as f64
        });
        assert!(per_file.iter().all(|calls| *calls == per_file[0] && *calls <= 5.0), "{per_file:?}");
    }

    /// Regression test: each process reserves the memory of the files that it uses. To find them, it used to search the whole
    /// folder for each channel that it opened.
    #[test]
    fn mapped_files_are_found_without_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let files = SharedFiles::create("mapped", folder.path()).unwrap();
        let _lock = files.own(folder.path()).unwrap();
        let path = files.path("history_scan");
        let _mapping = crate::mapping::Mapping::open(&path, 8).unwrap();
        private(&files.path("history_truth")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o666)).unwrap();
        let (mapped, calls) = calls(|| files.mapped().unwrap());
        assert_eq!((mapped, calls), ([path.clone()].into(), 0));
        files.keep_others_out().unwrap();
        files.reserve_small().unwrap();
        assert_eq!(fs::metadata(path).unwrap().mode() & 0o777, 0o600);
        files.remove_but(&[]).unwrap();
    }

    /// Regression test: after a cleaner had removed the folder, the next system with that name resumed the tasks of the previous
    /// one.
    #[test]
    fn files_without_an_owner_or_a_folder_are_removed() {
        let root = tempfile::tempdir().unwrap();
        let begin = |name: &str| {
            let folder = root.path().join(name);
            fs::create_dir(&folder).unwrap();
            let files = SharedFiles::create(name, &folder).unwrap();
            let lock = files.own(&folder).unwrap().unwrap();
            private(&files.path("history_command")).unwrap();
            (folder, files, lock)
        };
        let (folder, living, lock) = begin("living");
        let (_, dead, _) = begin("dead");
        let (folder_of_gone, gone, _) = begin("gone");
        fs::remove_dir_all(&folder).unwrap();
        fs::remove_dir_all(folder_of_gone).unwrap();
        assert!(living.own(&folder).unwrap().is_none(), "it has its owner");
        // Another test may clear them first.
        Survey::now().unwrap().clear_orphans().unwrap();
        assert_eq!([&living, &dead, &gone].map(|files| files.all().unwrap().len()), [2, 2, 0]);
        drop(lock);
        fs::remove_file(dead.path(OWNER)).unwrap();
        Survey::now().unwrap().clear_orphans().unwrap();
        assert_eq!([&living, &dead].map(|files| files.all().unwrap().len()), [0, 0], "nobody owns them");
    }
}
