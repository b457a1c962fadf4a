//! What a person means by a path, as one file: a recording of several files, as `run --split-size` and rosbag2 leave them, is put
//! together, and a file that zstd has packed is unpacked. That happens in a folder for temporary files, which goes away with the
//! command.

use std::fs::File;
use std::io::{BufWriter, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use sketchnav_recordings::copy::{self, Copy};
use sketchnav_recordings::foreign::Foreign;
use sketchnav_recordings::rosbag2::{self, Bag, METADATA};
use sketchnav_recordings::{Recording, series};
use tempfile::TempDir;

use super::rewrite::common_profile;
use crate::failure::{Failure, OrInput};
use crate::output::say;

/// How the names of files end that rosbag2 has packed.
const PACKED_MCAP: &str = ".mcap.zstd";

/// The recording that a person means by a path.
pub struct Whole {
    path: PathBuf,
    /// The files that it was made of.
    sources: Vec<PathBuf>,
    /// Where it was put together.
    _folder: Option<TempDir>,
}

impl Whole {
    /// A file is itself. `NAME.mcap` that is no file stands for `NAME_0.mcap` and so on, a folder for the one recording in it.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        Self::found(path).or_input()
    }

    /// The same of several.
    pub fn of_all(paths: &[PathBuf]) -> Result<(Vec<Self>, Vec<PathBuf>), Failure> {
        let all = paths.iter().map(|path| Self::of(path)).collect::<Result<Vec<_>, _>>()?;
        let paths = all.iter().map(|whole| whole.path.clone()).collect();
        Ok((all, paths))
    }

    /// A file by itself, unpacked where it is packed; others beside it do not matter.
    pub fn alone(path: &Path) -> Result<Self, Failure> {
        Self::of_files(path, &[path.to_owned()]).or_input()
    }

    /// A file that may be damaged: of one that is packed, what can be unpacked.
    pub fn as_far_as_it_goes(path: &Path) -> anyhow::Result<Self> {
        if !is_packed(path) {
            return Ok(Self::itself(path));
        }
        let folder = folder()?;
        let (unpacked, damage) = unpack(path, folder.path())?;
        if let Some(damage) = damage {
            say!("notice: {}: unpacked as far as it can be read: {damage}", path.display());
        }
        Ok(Self { path: unpacked, sources: vec![path.to_owned()], _folder: Some(folder) })
    }

    /// A file that holds all of it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files that it was made of.
    pub fn sources(&self) -> &[PathBuf] {
        &self.sources
    }

    fn itself(path: &Path) -> Self {
        Self { path: path.to_owned(), sources: vec![path.to_owned()], _folder: None }
    }

    fn found(path: &Path) -> anyhow::Result<Self> {
        if path.is_dir() {
            return match Bag::read(path)? {
                Some(bag) => Self::of_bag(path, &bag),
                None => Self::named(&only_one_in(path)?),
            };
        }
        Self::named(path)
    }

    fn named(named: &Path) -> anyhow::Result<Self> {
        if named.exists() {
            tell_of_the_others(named);
            return Self::of_files(named, &[named.to_owned()]);
        }
        let files = series::files(named).with_context(|| named.display().to_string())?;
        // Whoever opens one that is not there says what is wrong with it.
        if files.is_empty() { Ok(Self::itself(named)) } else { Self::of_files(named, &files) }
    }

    fn of_bag(folder: &Path, bag: &Bag) -> anyhow::Result<Self> {
        let files = files_of(folder, bag)?;
        missing(folder, bag).iter().for_each(|words| say!("notice: {words}"));
        let name =
            files.first().map_or_else(|| folder.to_owned(), |file| of_series(file).unwrap_or(file.clone()));
        let mut whole = Self::of_files(&name, &files)?;
        whole.sources.push(folder.join(METADATA));
        Ok(whole)
    }

    /// These files as one, of this name.
    fn of_files(named: &Path, files: &[PathBuf]) -> anyhow::Result<Self> {
        if let [file] = files
            && !is_packed(file)
        {
            return Ok(Self::itself(file));
        }
        let folder = folder()?;
        let mut plain = Vec::new();
        for file in files {
            plain.push(if is_packed(file) { unpack_whole(file, folder.path())? } else { file.clone() });
        }
        if let [path] = plain.as_slice() {
            let (path, sources) = (path.clone(), files.to_vec());
            return Ok(Self { path, sources, _folder: Some(folder) });
        }
        let whole = folder.path().join("whole").join(plain_name(named));
        let place = || whole.display().to_string();
        whole.parent().map_or(Ok(()), std::fs::create_dir_all).with_context(place)?;
        let sink = BufWriter::new(File::create(&whole).with_context(place)?);
        put_together(&plain, sink).with_context(|| format!("{}: its files", named.display()))?;
        Ok(Self { path: whole, sources: files.to_vec(), _folder: Some(folder) })
    }
}

fn folder() -> anyhow::Result<TempDir> {
    tempfile::tempdir().context("a folder for temporary files")
}

/// Several files as one: those of a run of ours each message once, those of others one after the other.
fn put_together(files: &[PathBuf], sink: BufWriter<File>) -> anyhow::Result<()> {
    let first = files.first().context("expected a file, found none")?;
    if Recording::open(first)?.has_run() {
        series::whole(files, sink)?;
        return Ok(());
    }
    let recordings = files.iter().map(|file| Recording::open(file)).collect::<Result<Vec<_>, _>>()?;
    let mut copy = Copy::of_profile(sink, common_profile(&recordings))?;
    copy::merge(&recordings, &mut copy)?;
    copy.finish()?;
    Ok(())
}

fn is_packed(path: &Path) -> bool {
    path.is_file() && rosbag2::is_packed(path).unwrap_or(false)
}

/// The file's name without the ending that says that it is packed.
fn plain_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".zstd").or_else(|| name.strip_suffix(".zst")).unwrap_or(&name);
    if name.ends_with(".mcap") { name.to_owned() } else { format!("{name}.mcap") }
}

/// Unpacks a file into a folder; why not all of it, where that is so.
fn unpack(path: &Path, folder: &Path) -> anyhow::Result<(PathBuf, Option<std::io::Error>)> {
    let place = || path.display().to_string();
    let unpacked = folder.join(plain_name(path));
    let sink = BufWriter::new(File::create(&unpacked).with_context(place)?);
    let damage = rosbag2::unpack(path, sink).with_context(place)?.damage;
    Ok((unpacked, damage))
}

fn unpack_whole(path: &Path, folder: &Path) -> anyhow::Result<PathBuf> {
    match unpack(path, folder)? {
        (unpacked, None) => Ok(unpacked),
        (_, Some(damage)) => bail!(
            "{}: expected a whole file compressed by zstd, found one that is cut off or damaged ({damage}); \
             `sketchnav recover` copies what can be read",
            path.display()
        ),
    }
}

/// The files of a bag that are there, with those of the series that a recorder has begun since.
fn files_of(folder: &Path, bag: &Bag) -> anyhow::Result<Vec<PathBuf>> {
    bag.must_be_mcap(folder)?;
    ensure!(
        !bag.files.is_empty(),
        "{}: expected the files that {METADATA} lists, found none of them: {}",
        folder.display(),
        bag.missing.join(", ")
    );
    let series =
        bag.files.iter().find_map(|file| of_series(file)).map(|name| series::files(&name)).transpose()?;
    let has_all = |series: &Vec<PathBuf>| bag.files.iter().all(|file| series.contains(file));
    Ok(series.filter(has_all).unwrap_or_else(|| bag.files.clone()))
}

/// Names the files of a bag that are missing.
fn missing(folder: &Path, bag: &Bag) -> Vec<String> {
    let words = |name: &String| format!("{}: {METADATA} lists {name}, which is missing", folder.display());
    bag.missing.iter().map(words).collect()
}

/// The files of a folder that are recordings, or packed ones: those that its metadata list, else all by name.
///
/// # Errors
/// Where there are none, or none that are read here: what there is instead.
pub fn recordings_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    listed_in(folder).map(|(files, _)| files)
}

/// The same, and what there is to say of files that are missing.
///
/// # Errors
/// As [`recordings_in`].
pub fn listed_in(folder: &Path) -> anyhow::Result<(Vec<PathBuf>, Vec<String>)> {
    if let Some(bag) = Bag::read(folder)? {
        return Ok((files_of(folder, &bag)?, missing(folder, &bag)));
    }
    let files = named_in(folder)?;
    ensure!(
        !files.is_empty(),
        "{}: expected a recording (.mcap), found {}",
        folder.display(),
        others_in(folder)
    );
    Ok((files, Vec::new()))
}

fn named_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let place = || folder.display().to_string();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(place)? {
        let path = entry.with_context(place)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".mcap") || name.ends_with(PACKED_MCAP) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// What a folder without recordings has that one could be made of: the first such file, in a few words.
fn others_in(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    paths.sort();
    let kind = |path: &PathBuf| {
        let mut begin = Vec::new();
        File::open(path).ok()?.take(64).read_to_end(&mut begin).ok()?;
        let found = Foreign::of(&begin);
        let is_recording = !matches!(found, Foreign::Text | Foreign::Unknown | Foreign::Zip);
        is_recording.then(|| format!("{}: {found}", path.file_name().unwrap_or_default().to_string_lossy()))
    };
    paths.iter().find_map(kind).unwrap_or_else(|| "none".to_owned())
}

/// The name of the recording of a folder that has one: of its files as one, where it was cut.
pub fn only_one_in(folder: &Path) -> anyhow::Result<PathBuf> {
    let mut names: Vec<_> =
        named_in(folder)?.into_iter().map(|path| of_series(&path).unwrap_or(path)).collect();
    names.sort();
    names.dedup();
    match names.as_slice() {
        [name] => Ok(name.clone()),
        [] => bail!(
            "{}: expected a folder with one recording, found 0 ({})",
            folder.display(),
            others_in(folder)
        ),
        _ => {
            Err(anyhow!("{}: expected a folder with one recording, found {}", folder.display(), names.len()))
        }
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
    use sketchnav_recordings::samples::{self, SampleForm, recording};

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

    fn bag(folder: &Path, storage: &str, files: &[&str]) {
        let files: String = files.iter().map(|file| format!("    - {file}\n")).collect();
        let text = format!(
            "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: {storage}\n  relative_file_paths:\n{files}"
        );
        std::fs::write(folder.join(METADATA), text).unwrap();
    }

    fn points(count: u64) -> Vec<u8> {
        recording(SampleForm::default(), &[samples::points("/ball", count, false)])
    }

    fn count(whole: &Whole) -> u64 {
        sketchnav_recordings::info::info_of_messages(whole.path()).unwrap().messages
    }

    /// `filter`, `relations` and others wanted a run.json of a folder with two files.
    #[test]
    fn a_bag_of_others_is_one_recording_and_a_missing_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        bag(path, "mcap", &["b_0.mcap", "b_1.mcap", "b_2.mcap"]);
        std::fs::write(path.join("b_0.mcap"), points(12)).unwrap();
        std::fs::write(path.join("b_1.mcap"), points(20)).unwrap();
        let whole = Whole::of(path).unwrap();
        assert_eq!(count(&whole), 32);
        assert!(whole.sources().ends_with(&[path.join("b_1.mcap"), path.join(METADATA)]));
        let (files, missing) = listed_in(path).unwrap();
        assert_eq!(files.len(), 2);
        assert!(missing.len() == 1 && missing[0].contains("lists b_2.mcap, which is missing"), "{missing:?}");
        std::fs::remove_file(path.join("b_0.mcap")).unwrap();
        assert_eq!(count(&Whole::of(path).unwrap()), 20);
        std::fs::remove_file(path.join("b_1.mcap")).unwrap();
        let error = format!("{:?}", Whole::of(path).err().unwrap());
        assert!(error.contains("b_0.mcap, b_1.mcap, b_2.mcap"), "{error}");
    }

    #[test]
    fn packed_files_are_read_and_a_cut_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let packed = samples::packed("zstd", &points(12));
        bag(path, "mcap", &["b_0.mcap.zstd"]);
        let file = path.join("b_0.mcap.zstd");
        std::fs::write(&file, &packed).unwrap();
        for named in [path, &file] {
            let whole = Whole::of(named).unwrap();
            assert_eq!((count(&whole), whole.sources()[0].as_path()), (12, file.as_path()));
        }
        std::fs::remove_file(path.join(METADATA)).unwrap();
        assert_eq!(count(&Whole::of(path).unwrap()), 12);
        std::fs::write(&file, &packed[..packed.len() - 4]).unwrap();
        let error = format!("{:?}", Whole::of(&file).err().unwrap());
        assert!(error.contains("cut off or damaged") && error.contains("sketchnav recover"), "{error}");
        assert!(Whole::as_far_as_it_goes(&file).is_ok());
    }

    #[test]
    fn other_storages_are_named_with_what_converts_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        std::fs::write(path.join("b_0.db3"), b"SQLite format 3\0 and so on").unwrap();
        let without = format!("{:?}", Whole::of(path).err().unwrap());
        bag(path, "sqlite3", &["b_0.db3"]);
        let with = format!("{:?}", Whole::of(path).err().unwrap());
        for error in [without, with, format!("{:?}", listed_in(path).unwrap_err())] {
            assert!(error.contains("b_0.db3") && error.contains("ros2 bag convert"), "{error}");
        }
    }
}
