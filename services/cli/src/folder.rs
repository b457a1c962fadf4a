//! The folder of a run, a new one each time, so that no run overwrites another's recording.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Maximum number of runs of one mission in one folder.
const MAX_RUNS: u32 = 9999;

/// Creates `out/name-001`, or the first free number.
pub fn create(out: &Path, name: &str) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("{}: expected a folder to write to", out.display()))?;
    for number in 1..=MAX_RUNS {
        let folder = out.join(format!("{name}-{number:03}"));
        match std::fs::create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => {
                made.with_context(|| format!("{}: cannot be created", folder.display()))?;
                return std::path::absolute(&folder).context("the current folder is gone");
            }
        }
    }
    anyhow::bail!("{}: expected fewer than {MAX_RUNS} runs of {name}", out.display())
}

/// The mission's name as a file name and as a system's name: lower case, digits and hyphens.
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
    fn a_second_run_gets_a_folder_of_its_own() {
        let out = tempfile::tempdir().unwrap();
        let first = create(&out.path().join("results"), "lab").unwrap();
        let second = create(&out.path().join("results"), "lab").unwrap();
        assert!(first.ends_with("results/lab-001") && second.ends_with("results/lab-002"));
    }

    #[test]
    fn any_name_becomes_a_plain_one() {
        assert_eq!(plain_name("Büro 3, links"), "b-ro-3--links");
        assert_eq!(plain_name("…"), "mission");
    }
}
