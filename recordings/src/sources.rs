//! The files of a run inside its recording: those of its navigator, and the map, floor plan or plane of the world. With these
//! files, a run can be repeated even if the original files are missing or have changed.
//!
//! A recording may come from anyone, and so may the paths in it. The files of a recorded run are therefore
//! only read through [`RecordedRun`]. Its mission uses the names that the files have inside the recording,
//! and its [`RecordedFiles`] contain no other files. Using a recording therefore reads nothing outside of it.
//!
//! The line `image:` in the YAML file of a map names its image, and the table `picture` in a plane file names its picture. If a
//! file cannot be read, it is left out, and the run is recorded without it.

use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};

use sketchnav_files::{Disk, Files, Limit};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::error::RecordingError;
use crate::reader::{Attachment, Recording};

/// The folders inside the recording.
const NAVIGATOR: &str = "navigator/";
const WORLD: &str = "world/";
/// Larger files are not included, since no navigator and no world reads them either.
const SOURCE: Limit = Limit { what: "a file of a run", bytes: 64 << 20 };

/// Returns true if an attachment with this name is one of the run's files.
pub fn is_source(name: &str) -> bool {
    name.starts_with(NAVIGATOR) || name.starts_with(WORLD)
}

/// Returns the files of a running system, which are inside the recording that it plays or on disk.
///
/// # Errors
/// Same errors as [`Recording::open`].
pub fn of_run(run: &RunConfig) -> Result<Box<dyn Files>, RecordingError> {
    Ok(match &run.files_of {
        Some(recording) => Box::new(RecordedFiles::of(&Recording::open(recording.as_ref())?)),
        None => Box::new(Disk),
    })
}

/// Returns the files of a running system for storing them in its recording.
///
/// # Errors
/// Same errors as [`of_run`].
pub fn to_record(run: &RunConfig) -> Result<Vec<Attachment>, RecordingError> {
    Ok(match &run.files_of {
        Some(recording) => of_recording(&Recording::open(recording.as_ref())?).cloned().collect(),
        None => read(&run.mission),
    })
}

/// Returns the files of a recorded run for storing them in a copy of its recording.
pub fn of_recording(recording: &Recording) -> impl Iterator<Item = &Attachment> {
    recording.attachments().values().filter(|file| is_source(&file.name))
}

/// Reads the files that a mission of this machine names by absolute paths.
pub fn read(mission: &Mission) -> Vec<Attachment> {
    let mut paths = BTreeMap::new();
    rename(&mut mission.clone(), |path, name| drop(paths.insert(name, PathBuf::from(path.as_str()))));
    let mut files: Vec<_> = paths.into_iter().filter_map(|(name, path)| file(name, &path)).collect();
    let world = &mission.world;
    let pictured: [(_, PictureOf); 2] = [(&world.map, picture_of), (&world.plane, picture_of_plane)];
    for (path, picture_of) in pictured {
        let Some(path) = path.as_ref().map(Path::new) else { continue };
        let picture = file(String::new(), path).and_then(|named| picture_of(&named.data));
        let read = |picture| file(format!("{WORLD}{picture}"), &path.with_file_name(&picture));
        files.extend(picture.and_then(read));
    }
    files
}

/// Visits the path of every file that a mission names, together with the file's name inside a recording.
fn rename(mission: &mut Mission, mut visit: impl FnMut(&mut String, String)) {
    let mut names = Names::default();
    for (_, path) in mission.navigator_files_mut() {
        let name = names.of(NAVIGATOR, path);
        visit(path, name);
    }
    let world = &mut mission.world;
    for path in [&mut world.floor_plan, &mut world.map, &mut world.plane].into_iter().flatten() {
        let name = names.of(WORLD, path);
        visit(path, name);
    }
}

/// The names given so far, with their paths. The names depend only on the mission, so files that were renamed once get the
/// same names again.
#[derive(Default)]
struct Names(BTreeMap<String, String>);

impl Names {
    /// Returns the name of a file. If a file in another folder already has the same name, a number is inserted.
    fn of(&mut self, folder: &str, path: &str) -> String {
        let own = Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or("unnamed");
        let mut name = format!("{folder}{own}");
        let mut number = 2;
        while self.0.get(&name).is_some_and(|other| other != path) {
            name = format!("{folder}{number}/{own}");
            number += 1;
        }
        self.0.insert(name.clone(), path.to_owned());
        name
    }
}

/// A function that finds the name of the picture in the content of a file.
type PictureOf = fn(&[u8]) -> Option<String>;

fn file(name: String, path: &Path) -> Option<Attachment> {
    let data = sketchnav_files::read(path, SOURCE).ok()?;
    Some(Attachment { name, media_type: media_type(path).to_owned(), data })
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => "image/png",
        Some("jpg" | "jpeg") => "image/jpeg",
        Some("svg") => "image/svg+xml",
        Some("json") => "application/json",
        Some("toml") => "application/toml",
        Some("yaml" | "yml") => "application/yaml",
        _ => "application/octet-stream",
    }
}

/// Returns the image named in the YAML file of a map, if it is in the same folder or below.
fn picture_of(yaml: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(yaml).ok()?;
    let line = text.lines().find_map(|line| line.trim().strip_prefix("image:"))?;
    let name = line.trim().trim_matches(['"', '\'']);
    is_below(Path::new(name)).then(|| name.to_owned())
}

/// Returns the picture named in a plane file, if it is in the same folder or below.
fn picture_of_plane(plane: &[u8]) -> Option<String> {
    let table: toml::Table = toml::from_str(std::str::from_utf8(plane).ok()?).ok()?;
    let name = table.get("picture")?.get("file")?.as_str()?;
    is_below(Path::new(name)).then(|| name.to_owned())
}

fn is_below(path: &Path) -> bool {
    let mut parts = path.components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// A recorded run. Its mission uses the names that the files have inside the recording, and `files` contains
/// these files.
#[derive(Debug, Clone)]
pub struct RecordedRun {
    /// The run.
    pub run: RunConfig,
    /// The files of the run.
    pub files: RecordedFiles,
}

impl RecordedRun {
    /// Returns the run of a recording.
    ///
    /// # Errors
    /// Same errors as [`Recording::run`].
    pub fn of(recording: &Recording) -> Result<Self, RecordingError> {
        let mut run = recording.run()?;
        rename(&mut run.mission, |path, name| *path = name);
        Ok(Self { run, files: RecordedFiles::of(recording) })
    }

    /// Checks that the recording contains every file that the mission names. Callers do this before they start processes
    /// that need the files.
    ///
    /// # Errors
    /// [`RecordingError::NotInside`] for the first missing file.
    pub fn check_files(&self) -> Result<(), RecordingError> {
        let mut missing = None;
        rename(&mut self.run.mission.clone(), |_, name| {
            if missing.is_none() && !self.files.held.contains_key(Path::new(&name)) {
                missing = Some(self.files.not_inside(Path::new(&name)));
            }
        });
        missing.map_or(Ok(()), Err)
    }
}

/// The files inside a recording, by the names that they have there.
#[derive(Debug, Clone)]
pub struct RecordedFiles {
    recording: PathBuf,
    held: BTreeMap<PathBuf, Vec<u8>>,
    /// The path of each file in `run.json`, for errors.
    called: BTreeMap<PathBuf, String>,
}

impl RecordedFiles {
    /// Returns the files of the run that was recorded.
    pub fn of(recording: &Recording) -> Self {
        let held =
            of_recording(recording).map(|file| (PathBuf::from(&file.name), file.data.clone())).collect();
        let mut called = BTreeMap::new();
        if let Ok(mut run) = recording.run() {
            rename(&mut run.mission, |path, name| drop(called.insert(PathBuf::from(name), path.clone())));
        }
        Self { recording: recording.path().to_owned(), held, called }
    }

    fn not_inside(&self, name: &Path) -> RecordingError {
        let called = self.called.get(name).map_or_else(|| name.display().to_string(), String::clone);
        RecordingError::NotInside { recording: self.recording.clone(), name: name.to_owned(), called }
    }
}

impl Files for RecordedFiles {
    fn read(&self, name: &Path, limit: Limit) -> io::Result<Vec<u8>> {
        let file = self.held.get(name).ok_or_else(|| io::Error::other(self.not_inside(name)))?;
        limit.check(file.len() as u64)?;
        Ok(file.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_maps_picture_is_found_without_opening_files_outside() {
        assert_eq!(picture_of(b"image: 'm.pgm'\nresolution: 1\n").as_deref(), Some("m.pgm"));
        assert_eq!(picture_of(b"resolution: 1\nimage: parts/m.png"), Some("parts/m.png".into()));
        for outside in ["image: /etc/passwd", "image: ../m.png", "image:", "resolution: 1"] {
            assert_eq!(picture_of(outside.as_bytes()), None, "{outside}");
        }
        let plane = b"picture = { file = 'dots.png', pixels_per_m = 100.0 }";
        assert_eq!(picture_of_plane(plane).as_deref(), Some("dots.png"));
        for outside in ["picture = { file = '../dots.png' }", "picture = 'dots.png'", "dots = [[0, 0]]"] {
            assert_eq!(picture_of_plane(outside.as_bytes()), None, "{outside}");
        }
    }
}
