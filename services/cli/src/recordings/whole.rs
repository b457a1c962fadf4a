//! Finds the recording that a path refers to, as one file. A recording in several files, as written by
//! `run --split-size` and rosbag2, is joined, and a file compressed with zstd is decompressed. This happens
//! in a temporary folder, which is removed when the command ends.

use std::fs::File;
use std::io::{BufWriter, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use sketchnav_recordings::copy::{self, Copy};
use sketchnav_recordings::foreign::Foreign;
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::rosbag2::{self, Bag, METADATA};
use sketchnav_recordings::{Recording, series};
use tempfile::TempDir;

use super::rewrite::common_profile;
use crate::failure::{Failure, OrInput, story};
use crate::output::say;

/// Extensions of the names of recordings, including those of files packed by rosbag2 or zstd.
const NAMES: [&str; 3] = [".mcap", ".mcap.zstd", ".mcap.zst"];

/// What a recording, or a copy of one, lacks compared with the original content of its files.
#[derive(Debug, Default)]
pub struct Lacks {
    /// The files that end before their writers had finished.
    pub cut_off: Vec<String>,
    /// The damaged messages that were left out.
    pub left_out: Rejections,
}

impl Lacks {
    /// Returns true if nothing is missing.
    pub fn is_empty(&self) -> bool {
        self.cut_off.is_empty() && self.left_out.is_empty()
    }

    /// Adds the losses of another recording.
    pub fn extend(&mut self, other: &Self) {
        self.cut_off.extend_from_slice(&other.cut_off);
        self.left_out.extend(&other.left_out);
    }
}

/// The recording that a path refers to.
pub struct Whole {
    path: PathBuf,
    /// The path that the user gave.
    named: PathBuf,
    /// The files that the recording consists of.
    sources: Vec<PathBuf>,
    /// The losses that were noticed, and printed, when the recording was joined from several files.
    lacks: Lacks,
    /// The temporary folder that contains the file, if it was decompressed or joined.
    _folder: Option<TempDir>,
}

impl Whole {
    /// Finds the recording that a path refers to. A file refers to itself. `NAME.mcap` refers to `NAME_0.mcap` and so
    /// on, if there is no file with that name itself. A folder refers to the only recording in it.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        Self::found(path).map(|whole| whole.named_by(path)).or_input()
    }

    /// Like [`Whole::of`], but for several paths.
    pub fn of_all(paths: &[PathBuf]) -> Result<Vec<Self>, Failure> {
        paths.iter().map(|path| Self::of(path)).collect()
    }

    /// Opens a single file and decompresses it if necessary. Other files next to it are ignored.
    pub fn alone(path: &Path) -> Result<Self, Failure> {
        Self::of_files(path, &[path.to_owned()]).map(|whole| whole.named_by(path)).or_input()
    }

    /// Opens a file that may be damaged. If it is compressed, as much as possible of it is decompressed.
    pub fn best_effort(path: &Path) -> anyhow::Result<Self> {
        if !is_packed(path) {
            return Ok(Self::itself(path));
        }
        let folder = folder()?;
        let (unpacked, damage) = unpack(path, folder.path())?;
        if let Some(damage) = damage {
            say!("notice: {}: unpacked as far as it can be read: {damage}", path.display());
        }
        Ok(Self::made(unpacked, path, &[path.to_owned()], folder))
    }

    /// Returns the path of the single file that contains the whole recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the name that the user knows: the file or, if that is temporary, the path that the user gave.
    pub fn name(&self) -> &Path {
        if self._folder.is_some() { &self.named } else { &self.path }
    }

    /// Returns the files that the recording consists of.
    pub fn sources(&self) -> &[PathBuf] {
        &self.sources
    }

    /// Returns the losses that were noticed when the recording was joined from several files. They have
    /// already been printed.
    pub fn lacks(&self) -> &Lacks {
        &self.lacks
    }

    /// Makes errors name the path that the user gave instead of a temporary file.
    pub fn known<T>(&self, result: Result<T, Failure>) -> Result<T, Failure> {
        result.map_err(|failure| match failure {
            Failure::Input(error) => Failure::Input(self.known_error(error)),
            Failure::Plain(error) => Failure::Plain(self.known_error(error)),
            Failure::Other(error) => Failure::Other(self.known_error(error)),
            Failure::Reported(error) => Failure::Reported(self.known_error(error)),
            Failure::Incomplete(error) => Failure::Incomplete(self.known_error(error)),
        })
    }

    /// Makes an error name the path that the user gave instead of a temporary file.
    pub fn known_error(&self, error: anyhow::Error) -> anyhow::Error {
        in_place_of(&[(self.path.as_path(), self.name())], error)
    }

    fn itself(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            named: path.to_owned(),
            sources: vec![path.to_owned()],
            lacks: Lacks::default(),
            _folder: None,
        }
    }

    fn made(path: PathBuf, named: &Path, sources: &[PathBuf], folder: TempDir) -> Self {
        Self {
            path,
            named: named.to_owned(),
            sources: sources.to_vec(),
            lacks: Lacks::default(),
            _folder: Some(folder),
        }
    }

    fn named_by(self, path: &Path) -> Self {
        Self { named: path.to_owned(), ..self }
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
            report_other_recordings(named);
            return Self::of_files(named, &[named.to_owned()]);
        }
        let files = series::files(named).with_context(|| named.display().to_string())?;
        gaps(named, &files).iter().for_each(|words| say!("notice: {words}"));
        // Opening the missing file produces the right error.
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

    /// Puts files together as one recording with the name `named`.
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
            return Ok(Self::made(path.clone(), named, files, folder));
        }
        let whole = folder.path().join("whole").join(plain_name(named));
        let place = || whole.display().to_string();
        whole.parent().map_or(Ok(()), std::fs::create_dir_all).with_context(place)?;
        let sink = BufWriter::new(File::create(&whole).with_context(place)?);
        let parts: Vec<_> =
            plain.iter().zip(files).map(|(plain, file)| (plain.as_path(), file.as_path())).collect();
        let left_out = put_together(&plain, sink)
            .map_err(|error| in_place_of(&parts, error))
            .with_context(|| format!("{}: its files", named.display()))?;
        let lacks = Lacks { cut_off: cut_off(&parts), left_out };
        print_losses(named, &lacks);
        Ok(Self { lacks, ..Self::made(whole, named, files, folder) })
    }
}

/// Replaces the names of temporary files in an error by the names that the user knows. `names` contains pairs of the
/// two.
fn in_place_of(names: &[(&Path, &Path)], error: anyhow::Error) -> anyhow::Error {
    let message = story(&error);
    let in_place_of = |words: String, (temporary, known): &(&Path, &Path)| match temporary == known {
        true => words,
        false => words.replace(&temporary.display().to_string(), &known.display().to_string()),
    };
    let words = names.iter().fold(message.clone(), in_place_of);
    if words == message { error } else { anyhow!(words) }
}

/// Returns the names of files that end before their writers had finished. `parts` contains pairs of a readable file and
/// the name that the user knows.
fn cut_off(parts: &[(&Path, &Path)]) -> Vec<String> {
    let is_cut_off =
        |path: &Path| Recording::open(path).and_then(|part| part.index().map(|index| index.is_cut_off()));
    // A file that cannot be opened was skipped, so it counts as cut off before its first message.
    let cut = parts.iter().filter(|(plain, _)| is_cut_off(plain).unwrap_or(true));
    cut.map(|(_, file)| file.display().to_string()).collect()
}

/// Prints the losses of a recording that was put together from several files.
fn print_losses(named: &Path, lacks: &Lacks) {
    lacks.cut_off.iter().for_each(super::tell_cut_off);
    for left_out in lacks.left_out.list() {
        say!("notice: {}: left out {left_out}", named.display());
    }
}

fn folder() -> anyhow::Result<TempDir> {
    tempfile::tempdir().context("a folder for temporary files")
}

/// Writes several files as one. If they belong to one of our runs, each message is written once. Files by
/// other software are simply joined, and damaged messages are dropped and counted.
fn put_together(files: &[PathBuf], sink: BufWriter<File>) -> anyhow::Result<Rejections> {
    let first = files.first().context("expected a file, found none")?;
    if Recording::open(first)?.has_run() {
        series::whole(files, sink)?;
        return Ok(Rejections::default());
    }
    let recordings = files.iter().map(|file| Recording::open(file)).collect::<Result<Vec<_>, _>>()?;
    let mut copy = Copy::of_profile(sink, common_profile(&recordings))?;
    copy::merge(&recordings, &mut copy)?;
    let left_out = copy.left_out().clone();
    copy.finish()?;
    Ok(left_out)
}

/// Returns true if the file as a whole is compressed by zstd.
pub fn is_packed(path: &Path) -> bool {
    path.is_file() && rosbag2::is_packed(path).unwrap_or(false)
}

/// Returns the file's name without the extension of a packed file.
fn plain_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".zstd").or_else(|| name.strip_suffix(".zst")).unwrap_or(&name);
    if name.ends_with(".mcap") { name.to_owned() } else { format!("{name}.mcap") }
}

/// Unpacks a file into a folder. If that was only possible in part, also returns the reason.
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
            "{}: expected a whole file compressed with zstd, found one that is cut off or damaged ({damage}); \
             `sketchnav recover` copies what can be read",
            path.display()
        ),
    }
}

/// Returns the existing files of a bag, including those that its recorder has begun since it wrote the metadata.
fn files_of(folder: &Path, bag: &Bag) -> anyhow::Result<Vec<PathBuf>> {
    bag.must_be_mcap(folder)?;
    let missing = if bag.missing.is_empty() { "it lists none".to_owned() } else { bag.missing.join(", ") };
    ensure!(
        !bag.files.is_empty(),
        "{}: expected the files that {METADATA} lists, found none of them: {missing}",
        folder.display()
    );
    let series =
        bag.files.iter().find_map(|file| of_series(file)).map(|name| series::files(&name)).transpose()?;
    let has_all = |series: &Vec<PathBuf>| bag.files.iter().all(|file| series.contains(file));
    Ok(series.filter(has_all).unwrap_or_else(|| bag.files.clone()))
}

/// Returns remarks on the files that a bag's metadata lists but that are missing.
fn missing(folder: &Path, bag: &Bag) -> Vec<String> {
    let words = |name: &String| format!("{}: {METADATA} lists {name}, which is missing", folder.display());
    bag.missing.iter().map(words).collect()
}

/// Returns remarks on the files that are missing from the series of `NAME.mcap`.
fn gaps(named: &Path, files: &[PathBuf]) -> Vec<String> {
    let name = |number: u32| {
        series::file(named, number).file_name().unwrap_or_default().to_string_lossy().into_owned()
    };
    let words = |(first, last): (u32, u32)| match first == last {
        true => format!("{}: {} is missing", named.display(), name(first)),
        false => format!("{}: {} to {} are missing", named.display(), name(first), name(last)),
    };
    series::gaps(named, files).into_iter().map(words).collect()
}

/// Returns the recordings in a folder, compressed or not, ordered by name: those listed in its metadata or,
/// if it has none, all of them.
///
/// # Errors
/// If there are none, or none in a supported format. The error describes the contents of the folder.
pub fn recordings_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    listed_in(folder).map(|(files, _)| files)
}

/// Like [`recordings_in`], but also returns remarks on missing files.
///
/// # Errors
/// Those of [`recordings_in`].
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
    let mut series: Vec<_> = files.iter().filter_map(|file| of_series(file)).collect();
    series.dedup();
    let missing = series.iter().flat_map(|name| gaps(name, &files)).collect();
    Ok((files, missing))
}

fn named_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let place = || folder.display().to_string();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(place)? {
        let path = entry.with_context(place)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if NAMES.iter().any(|end| name.ends_with(end)) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Describes the first file in a folder that is a recording in another format, or returns "none" if there is none.
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

/// Returns the name of the only recording in a folder. A recording that was split has one name for all of its files.
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

/// Returns `NAME.mcap` for a file such as `NAME_3.mcap` that belongs to a split recording.
fn of_series(file: &Path) -> Option<PathBuf> {
    let stem = file.file_stem()?.to_str()?;
    let name = file.with_file_name(format!("{}.mcap", stem.rsplit_once('_')?.0));
    series::number(&name, file.file_name()?.to_str()?)?;
    (!name.exists() && series::file(&name, 0).exists()).then_some(name)
}

fn report_other_recordings(file: &Path) {
    let others = of_series(file).and_then(|name| Some((series::files(&name).ok()?.len(), name)));
    if let Some((count @ 2.., name)) = others {
        say!(
            "notice: {} is one of {count} files; pass {} to read all of them",
            file.display(),
            name.display()
        );
    }
}

#[cfg(test)]
mod tests;
