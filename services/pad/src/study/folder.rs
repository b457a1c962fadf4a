//! The folder of a study. Only this module accesses its files.
//!
//! ```text
//! DIR/study.json  place.svg  participants.csv  index.html  recordings/…
//! DIR/CODE/participant.json  drawing-1.json  path-1.json  drive.json  answers.json  outcome.json  index.html  …
//! ```
//! A participant's folder is created with its first file, and each of its records is written once. The
//! records that exist show how far a participant has come, so a study can be interrupted at any time and
//! resumed.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::fs::Permissions;
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use sketchnav_files::Limit;
use tempfile::Builder;

use super::StudyError;
use super::record::{Answers, Drive, Facts, Kept, Orientation, Outcome, Participant, Record};
use crate::draft;

/// What the folder of a study contains in addition to participants.
pub const OWN: [&str; 5] = ["study.json", "place.svg", "participants.csv", "index.html", "recordings"];
/// The floor as participants see it before they draw.
pub const PLACE: &str = OWN[1];
/// A line for each participant.
pub const TABLE: &str = OWN[2];
/// The page of the study, and of each participant.
pub const PAGE: &str = OWN[3];
/// The recordings of the drives.
pub const RECORDINGS: &str = OWN[4];
/// A record of a participant, or the picture of the floor.
const LIMIT: Limit = Limit { what: "a file of a study", bytes: 4 << 20 };
/// The mode of any other new folder, before the user's mask.
const MODE: u32 = 0o777;

/// The folder of a study.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    facts: Facts,
}

/// All participants, and what could not be read.
#[derive(Debug, Clone, Default)]
pub struct Everyone {
    /// The participants whose files can be read, by code.
    pub kept: Vec<Kept>,
    /// The participants who are left out, each with the file, what was expected and what was found.
    pub left_out: Vec<String>,
}

impl Folder {
    /// Opens the folder of this study, or creates it if there is nothing yet.
    ///
    /// # Errors
    /// [`StudyError::NotWritable`], [`StudyError::Foreign`], [`StudyError::Other`], and any error of
    /// [`Folder::open`].
    pub fn create(path: &Path, facts: &Facts) -> Result<Self, StudyError> {
        let not_writable = |source| StudyError::NotWritable { path: path.into(), source };
        fs::create_dir_all(path).map_err(not_writable)?;
        drop(draft::of(path, b"").map_err(not_writable)?);
        check_own(path)?;
        let file = path.join(Facts::FILE);
        match read::<Facts>(&file)? {
            None => put_new(&file, facts.text().as_bytes())?,
            Some(found) if found == *facts => {}
            Some(found) => {
                let (expected, found) = match (facts.words(), found.words()) {
                    (a, b) if a == b => {
                        (format!("{a} with this start, goal and view"), "another of them".into())
                    }
                    words => words,
                };
                return Err(StudyError::Other { path: file, expected, found });
            }
        }
        Ok(Self { path: path.into(), facts: facts.clone() })
    }

    /// The folder of an existing study.
    ///
    /// # Errors
    /// [`StudyError::NoStudy`], [`StudyError::Foreign`], [`StudyError::Record`], or [`StudyError::File`].
    pub fn open(path: &Path) -> Result<Self, StudyError> {
        let facts =
            read(&path.join(Facts::FILE))?.ok_or_else(|| StudyError::NoStudy { path: path.into() })?;
        check_own(path)?;
        Ok(Self { path: path.into(), facts })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is studied.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Returns the picture of the floor, or `None` if participants are not shown one.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn place(&self) -> Result<Option<Vec<u8>>, StudyError> {
        if !self.facts.shows_floor {
            return Ok(None);
        }
        let path = self.path.join(PLACE);
        sketchnav_files::read(&path, LIMIT).map(Some).map_err(|source| StudyError::File { path, source })
    }

    /// Returns the codes of all participants, in order.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn codes(&self) -> Result<Vec<String>, StudyError> {
        let names = entries(&self.path)?.into_iter().filter(|path| path.join(Participant::FILE).is_file());
        let mut codes: Vec<_> =
            names.filter_map(|path| path.file_name()?.to_str().map(str::to_owned)).collect();
        codes.sort();
        Ok(codes)
    }

    /// Returns the participants who have answered.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn finished(&self) -> Result<BTreeSet<String>, StudyError> {
        let codes = self.codes()?.into_iter();
        Ok(codes.filter(|code| self.of(code).join(Answers::FILE).exists()).collect())
    }

    /// Returns the group for the next participant, which is the smaller one, or landscape if both are equal.
    ///
    /// # Errors
    /// [`StudyError::File`] or [`StudyError::Record`].
    pub fn next_sheet(&self) -> Result<Orientation, StudyError> {
        let mut counts = [0, 0];
        for code in self.codes()? {
            if let Some(participant) = self.read::<Participant>(&code)? {
                counts[usize::from(participant.sheet == Orientation::Portrait)] += 1;
            }
        }
        Ok(Orientation::ALL[usize::from(counts[0] > counts[1])])
    }

    /// The folder of a participant.
    pub fn of(&self, code: &str) -> PathBuf {
        self.path.join(code)
    }

    /// Creates the folder of a new participant.
    ///
    /// # Errors
    /// [`StudyError::Taken`] or [`StudyError::File`].
    pub fn begin(&self, participant: &Participant) -> Result<(), StudyError> {
        let path = self.of(&participant.code);
        let failed = |source| StudyError::File { path: path.clone(), source };
        let mut builder = Builder::new();
        let draft = builder.prefix(".").permissions(Permissions::from_mode(MODE)).tempdir_in(&self.path);
        let draft = draft.map_err(failed)?;
        put_new(&draft.path().join(Participant::FILE), participant.text().as_bytes())?;
        // It replaces nothing, because the folder of a participant is never empty.
        fs::rename(draft.path(), &path).map_err(|source| match source.kind() {
            ErrorKind::DirectoryNotEmpty | ErrorKind::AlreadyExists | ErrorKind::NotADirectory => {
                StudyError::Taken { path: path.clone() }
            }
            _ => failed(source),
        })
    }

    /// Reads a record of a participant. Returns `None` if it does not exist yet.
    ///
    /// # Errors
    /// [`StudyError::Record`] or [`StudyError::File`].
    pub fn read<T: Record>(&self, code: &str) -> Result<Option<T>, StudyError> {
        read(&self.of(code).join(T::FILE))
    }

    /// Writes a record of a participant, which must not exist yet.
    ///
    /// # Errors
    /// [`StudyError::Taken`] or [`StudyError::File`].
    pub fn write<T: Record>(&self, code: &str, record: &T) -> Result<(), StudyError> {
        put_new(&self.of(code).join(T::FILE), record.text().as_bytes())
    }

    /// Writes the next file of a series, such as `drawing-1.json`, `drawing-2.json` and so on.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn write_next(
        &self,
        code: &str,
        series: &str,
        extension: &str,
        bytes: &[u8],
    ) -> Result<(), StudyError> {
        let number = self.last(code, series)?.map_or(0, |(number, _)| number) + 1;
        put_new(&self.of(code).join(format!("{series}-{number}.{extension}")), bytes)
    }

    /// Returns the number and the name of the last file of a series.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn last(&self, code: &str, series: &str) -> Result<Option<(u32, String)>, StudyError> {
        let numbered = |path: PathBuf| {
            let name = path.file_name()?.to_str()?;
            let number = name.strip_prefix(series)?.strip_prefix('-')?.split('.').next()?;
            Some((number.parse().ok()?, name.to_owned()))
        };
        Ok(entries(&self.of(code))?.into_iter().filter_map(numbered).max())
    }

    /// Reads everything that can be read, and lists the rest.
    ///
    /// # Errors
    /// [`StudyError::File`] for the folder itself.
    pub fn everyone(&self) -> Result<Everyone, StudyError> {
        let mut everyone = Everyone::default();
        for code in self.codes()? {
            match self.kept(&code) {
                Ok(kept) => everyone.kept.extend(kept),
                Err(error) => everyone.left_out.push(error.to_string()),
            }
        }
        Ok(everyone)
    }

    /// All records of a participant; `None` without one.
    fn kept(&self, code: &str) -> Result<Option<Kept>, StudyError> {
        let Some(participant) = self.read::<Participant>(code)? else { return Ok(None) };
        let (drive, answers) = (self.read::<Drive>(code)?, self.read::<Answers>(code)?);
        Ok(Some(Kept { participant, drive, answers, outcome: self.read::<Outcome>(code)? }))
    }
}

/// Checks that everything in the folder was written by a study.
///
/// # Errors
/// [`StudyError::Foreign`], which names what else is there, or [`StudyError::File`].
pub fn check_own(path: &Path) -> Result<(), StudyError> {
    let is_known = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        OWN.iter().any(|own| OsStr::new(own) == name)
            || is_unfinished(name)
            || path.join(Participant::FILE).is_file()
    };
    match entries(path)?.into_iter().find(|path| !is_known(path)) {
        Some(path) => Err(StudyError::Foreign { path }),
        None => Ok(()),
    }
}

/// Returns true for files that a kill may leave unfinished.
fn is_unfinished(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.starts_with('.') || name.contains(".unfinished")
}

/// What is in a folder, in order.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, StudyError> {
    let failed = |source| StudyError::File { path: folder.into(), source };
    let listed: io::Result<Vec<_>> =
        fs::read_dir(folder).and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect());
    let mut listed = listed.map_err(failed)?;
    listed.sort();
    Ok(listed)
}

fn read<T: Record>(path: &Path) -> Result<Option<T>, StudyError> {
    let bytes = match sketchnav_files::read(path, LIMIT) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        read => read.map_err(|source| StudyError::File { path: path.into(), source })?,
    };
    T::parse(&bytes).map(Some).map_err(|source| StudyError::Record { path: path.into(), source })
}

/// Writes a file that must not be there yet.
fn put_new(path: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    let folder = path.parent().unwrap_or(path);
    let failed = |source: io::Error| match source.kind() {
        ErrorKind::AlreadyExists => StudyError::Taken { path: path.into() },
        _ => StudyError::File { path: path.into(), source },
    };
    draft::of(folder, bytes).and_then(|draft| Ok(draft.persist_noclobber(path)?)).map(drop).map_err(failed)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::record::tests::{answers, measures};
    use super::*;

    /// A study of an arbitrary mission.
    pub fn facts() -> Facts {
        Facts {
            version: super::super::record::VERSION,
            mission: "court".into(),
            method: "best".into(),
            start_heading_deg: 90.0,
            goal: Default::default(),
            shows_floor: false,
        }
    }

    fn person(code: &str, sheet: Orientation) -> Participant {
        Participant { code: code.into(), age: Some(30), sheet }
    }

    #[test]
    fn a_study_goes_on_where_it_was_interrupted() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a/study");
        let folder = Folder::create(&path, &facts()).unwrap();
        assert_eq!(folder.next_sheet().unwrap(), Orientation::Landscape);
        folder.begin(&person("p-1", Orientation::Landscape)).unwrap();
        assert_eq!(folder.next_sheet().unwrap(), Orientation::Portrait);
        for bytes in [b"first", b"other"] {
            folder.write_next("p-1", "drawing", "json", bytes).unwrap();
        }
        assert_eq!(folder.last("p-1", "drawing").unwrap(), Some((2, "drawing-2.json".into())));
        assert_eq!(folder.last("p-1", "path").unwrap(), None);

        let again = Folder::create(&path, &facts()).unwrap();
        assert_eq!((again.codes().unwrap(), again.finished().unwrap().len()), (vec!["p-1".to_owned()], 0));
        again.write("p-1", &answers(4, "")).unwrap();
        assert!(again.finished().unwrap().contains("p-1"));
        assert_eq!(again.read::<Drive>("p-1").unwrap(), None);
        let everyone = Folder::open(&path).unwrap().everyone().unwrap();
        assert_eq!((everyone.kept.len(), everyone.left_out.len()), (1, 0));
        assert_eq!(everyone.kept[0].answers, Some(answers(4, "")));
    }

    #[test]
    fn nothing_that_a_participant_has_made_is_replaced() {
        let place = tempfile::tempdir().unwrap();
        let folder = Folder::create(place.path(), &facts()).unwrap();
        folder.begin(&person("p-1", Orientation::Landscape)).unwrap();
        let words = folder.begin(&person("p-1", Orientation::Portrait)).unwrap_err().to_string();
        assert!(words.contains("p-1: expected a new participant"), "{words}");
        folder.write("p-1", &answers(4, "")).unwrap();
        assert!(matches!(folder.write("p-1", &answers(1, "")), Err(StudyError::Taken { .. })));
        assert_eq!(folder.read("p-1").unwrap(), Some(answers(4, "")));
        assert_eq!(folder.read("p-1").unwrap(), Some(person("p-1", Orientation::Landscape)));
        let left = entries(place.path()).unwrap();
        assert_eq!(left.len(), 2, "no draft is left: {left:?}");
    }

    /// If the wrong folder is given, nothing in it is lost.
    #[test]
    fn a_folder_with_anything_else_in_it_is_refused() {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("thesis.tex"), "by hand").unwrap();
        let words = Folder::create(place.path(), &facts()).unwrap_err().to_string();
        assert!(words.contains("thesis.tex: expected only what a study writes"), "{words}");
        assert_eq!(entries(place.path()).unwrap().len(), 1);
        let words = Folder::open(place.path()).unwrap_err().to_string();
        assert!(words.contains("expected the folder of a study"), "{words}");
        let below = place.path().join("thesis.tex/study");
        assert!(matches!(Folder::create(&below, &facts()), Err(StudyError::NotWritable { .. })));
    }

    #[test]
    fn a_study_has_one_mission() {
        let place = tempfile::tempdir().unwrap();
        Folder::create(place.path(), &facts()).unwrap();
        let error = |facts: Facts| Folder::create(place.path(), &facts).unwrap_err().to_string();
        let words = error(Facts { mission: "screens".into(), ..facts() });
        assert!(words.contains("expected a study with the mission \"screens\""), "{words}");
        assert!(words.contains("found one with the mission \"court\""), "{words}");
        let words = error(Facts { start_heading_deg: 0.0, ..facts() });
        assert!(words.contains("with this start, goal and view, found one with another of them"), "{words}");
    }

    #[test]
    fn a_participant_whose_files_are_damaged_is_named_and_the_others_count() {
        let place = tempfile::tempdir().unwrap();
        let folder = Folder::create(place.path(), &facts()).unwrap();
        for code in ["p-1", "p-2", "p-3"] {
            folder.begin(&person(code, Orientation::Landscape)).unwrap();
            folder.write(code, &answers(5, "")).unwrap();
        }
        fs::write(folder.of("p-1").join(Answers::FILE), "{\"ratings\": {}}").unwrap();
        fs::write(folder.of("p-2").join(Drive::FILE), "{").unwrap();
        let everyone = folder.everyone().unwrap();
        assert_eq!(everyone.kept.len(), 1);
        let [first, second] = &everyone.left_out[..] else { panic!("{everyone:?}") };
        assert!(
            first.contains("p-1/answers.json: ratings.intuitive: expected 1 to 5, found none"),
            "{first}"
        );
        assert!(second.contains("p-2/drive.json: expected a drive in JSON"), "{second}");
        let drive = Drive {
            drawing: "drawing-1.json".into(),
            path: "path-1.json".into(),
            recording: "recordings/a.mcap".into(),
            measures: measures(60.0),
        };
        folder.write("p-3", &drive).unwrap();
        assert_eq!(folder.everyone().unwrap().kept[0].drive, Some(drive));
    }
}
