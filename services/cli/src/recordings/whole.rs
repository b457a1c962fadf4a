//! Recordings of several files, as `run --split-size` leaves them, are read as one: they are put together in a folder for
//! temporary files first, and that goes away with the command.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sketchnav_recordings::series;
use tempfile::TempDir;

use crate::failure::{Failure, OrInput};
use crate::output::say;

/// The recording that a person means by a path.
pub struct Whole {
    path: PathBuf,
    /// Where it was put together.
    _folder: Option<TempDir>,
}

impl Whole {
    /// A file is itself. `NAME.mcap` that is no file stands for `NAME_0.mcap` and so on, a folder for the one recording in it.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let named = if path.is_dir() { &only_one_in(path).or_input()? } else { path };
        if named.exists() {
            tell_of_the_others(named);
            return Ok(Self { path: named.to_owned(), _folder: None });
        }
        let files = series::files(named).with_context(|| named.display().to_string()).or_input()?;
        if files.is_empty() {
            // Whoever opens it says what is wrong with it.
            return Ok(Self { path: named.to_owned(), _folder: None });
        }
        let folder = tempfile::tempdir().context("a folder for temporary files")?;
        let whole = folder.path().join(named.file_name().unwrap_or_default());
        let sink = BufWriter::new(File::create(&whole).with_context(|| whole.display().to_string())?);
        series::whole(&files, sink).with_context(|| format!("{}: its files", named.display())).or_input()?;
        Ok(Self { path: whole, _folder: Some(folder) })
    }

    /// The same of several.
    pub fn of_all(paths: &[PathBuf]) -> Result<(Vec<Self>, Vec<PathBuf>), Failure> {
        let all = paths.iter().map(|path| Self::of(path)).collect::<Result<Vec<_>, _>>()?;
        let paths = all.iter().map(|whole| whole.path.clone()).collect();
        Ok((all, paths))
    }

    /// A file that holds all of it.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The name of the recording of a folder that has one: of its files as one, where it was cut.
pub fn only_one_in(folder: &Path) -> anyhow::Result<PathBuf> {
    let place = || folder.display().to_string();
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(place)? {
        let path = entry.with_context(place)?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") {
            names.push(of_series(&path).unwrap_or(path));
        }
    }
    names.sort();
    names.dedup();
    match names.as_slice() {
        [name] => Ok(name.clone()),
        _ => Err(anyhow!("{}: expected a folder with one recording, found {}", place(), names.len())),
    }
}

/// `NAME.mcap` of a `NAME_3.mcap` that has others beside it.
fn of_series(file: &Path) -> Option<PathBuf> {
    let stem = file.file_stem()?.to_str()?;
    let name = file.with_file_name(format!("{}.mcap", stem.rsplit_once('_')?.0));
    series::number(&name, file.file_name()?.to_str()?)?;
    (!name.exists() && series::file(&name, 0).exists()).then_some(name)
}

fn tell_of_the_others(file: &Path) {
    let others = of_series(file).and_then(|name| Some((series::files(&name).ok()?.len(), name)));
    if let Some((count @ 2.., name)) = others {
        say!("notice: {} is one of {count} files; {} stands for all of them", file.display(), name.display());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_one_recording_stands_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
        assert!(only_one_in(folder.path()).unwrap_err().to_string().contains("found 0"));
        write("lab_0.mcap");
        write("lab_1.mcap");
        write("floor.svg");
        assert_eq!(only_one_in(folder.path()).unwrap(), folder.path().join("lab.mcap"));
        write("hall_b.mcap");
        assert!(only_one_in(folder.path()).unwrap_err().to_string().contains("found 2"));
    }

    #[test]
    fn a_file_that_happens_to_end_with_a_number_is_itself() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("floor_2.mcap");
        std::fs::write(&file, "").unwrap();
        assert_eq!(Whole::of(&file).unwrap().path(), file);
        assert_eq!(Whole::of(folder.path()).unwrap().path(), file);
        let nowhere = folder.path().join("nowhere.mcap");
        assert_eq!(Whole::of(&nowhere).unwrap().path(), nowhere);
    }
}
