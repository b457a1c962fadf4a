//! The folder of a run. Each run gets a new one, so that no run overwrites another's recording. A command that fails
//! before its run begins leaves no folder behind.

use std::io::{self, ErrorKind};
use std::ops::Deref;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Maximum number of runs of one mission in one folder.
const MAX_RUNS: u32 = 9999;

/// Folders created by a command, innermost first.
#[derive(Debug)]
pub struct MadeFolders(Vec<PathBuf>);

impl MadeFolders {
    /// Creates a folder and any missing folders above it.
    pub fn with_parents(folder: &Path) -> io::Result<Self> {
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let missing = folder.ancestors().take_while(is_missing).map(Path::to_path_buf).collect();
        std::fs::create_dir_all(folder)?;
        Ok(Self(missing))
    }

    /// Removes the folders if they are empty. A folder that cannot be removed does no harm.
    pub fn discard(&self) {
        let _ = self.0.iter().try_for_each(std::fs::remove_dir);
    }
}

/// The folder of a new run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    above: MadeFolders,
}

impl Deref for RunFolder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl RunFolder {
    /// Removes the folder of a run that never began, with its contents.
    pub fn discard(&self) {
        // A folder that cannot be removed does no harm, since the next run gets a new one.
        let _ = std::fs::remove_dir_all(&self.path);
        self.above.discard();
    }

    /// Removes the folder of a run that never began, unless it contains something.
    pub fn discard_if_empty(&self) {
        if std::fs::remove_dir(&self.path).is_ok() {
            self.above.discard();
        }
    }
}

/// Creates the folder `NAME-001` in `out`, or the first one whose number is not taken yet.
pub fn create(out: &Path, name: &str) -> anyhow::Result<RunFolder> {
    let above = MadeFolders::with_parents(out)
        .with_context(|| format!("{}: expected a folder to write to", out.display()))?;
    for number in 1..=MAX_RUNS {
        let folder = out.join(format!("{name}-{number:03}"));
        match std::fs::create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => {
                made.with_context(|| format!("{}: cannot be created", folder.display()))?;
                let path = std::path::absolute(&folder).context("the current folder no longer exists")?;
                return Ok(RunFolder { path, above });
            }
        }
    }
    anyhow::bail!("{}: expected fewer than {MAX_RUNS} runs of {name}", out.display())
}

/// Converts a mission's name to lower-case letters, digits and hyphens, for use as a file name and a system's name.
pub fn plain_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = name.chars().map(plain).take(24).collect();
    let name = name.trim_matches('-');
    if name.is_empty() { "mission".into() } else { name.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_run_gets_its_own_folder() {
        let out = tempfile::tempdir().unwrap();
        let first = create(&out.path().join("results"), "lab").unwrap();
        let second = create(&out.path().join("results"), "lab").unwrap();
        assert!(first.ends_with("results/lab-001") && second.ends_with("results/lab-002"));
    }

    #[test]
    fn a_run_that_never_began_leaves_no_new_folder() {
        let out = tempfile::tempdir().unwrap();
        let create = || create(&out.path().join("some/results"), "lab").unwrap();
        let folder = create();
        std::fs::write(folder.join("mission.toml"), "").unwrap();
        folder.discard_if_empty();
        assert!(folder.exists());
        folder.discard();
        assert!(out.path().exists() && !out.path().join("some").exists());
        let (first, second) = (create(), create());
        first.discard();
        assert!(!first.exists() && second.exists());
    }

    #[test]
    fn any_name_becomes_a_valid_folder_name() {
        assert_eq!(plain_name("Büro 3, links"), "b-ro-3--links");
        assert_eq!(plain_name("…"), "mission");
    }
}
