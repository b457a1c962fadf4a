//! A recording that was split into several files while it grew: `NAME_0.mcap`, `NAME_1.mcap` and so on, as rosbag2 names
//! them.
//!
//! Each file is a recording by itself. `NAME.mcap` then refers to all of them without being a file, and
//! [`whole`] creates it. After a kill, the recorder continues in a new file, starting a little before the end
//! of the previous one, so a message may be in two files but never in none.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use sketchnav_schemas::channels::has_many_writers;

use crate::copy::{Copy, PartFacts, describe, topic_names};
use crate::error::RecordingError;
use crate::join::join;
use crate::reader::{RawMessage, Recording};
use crate::selection::Selection;
use crate::writer::RECORDER_METADATA;

/// Returns the path of the file with this number, counted from 0, of the recording `NAME.mcap`.
pub fn file(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{number}.mcap"))
}

/// Returns the number of a file of the recording `NAME.mcap`, or `None` if the file does not belong to it.
pub fn number(path: &Path, name: &str) -> Option<u32> {
    let stem = path.file_stem()?.to_str()?;
    let number = name.strip_prefix(stem)?.strip_prefix('_')?.strip_suffix(".mcap")?;
    let is_plain = number == "0" || (!number.starts_with('0') && number.bytes().all(|b| b.is_ascii_digit()));
    is_plain.then(|| number.parse().ok())?
}

/// Returns the existing files of the recording `NAME.mcap`, by number. A kill may leave a number out.
///
/// # Errors
/// Any I/O error. A folder that does not exist is not an error and contains no files.
pub fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = match std::fs::read_dir(folder) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(Vec::new());
        }
        entries => entries?,
    };
    let mut found = BTreeMap::new();
    for entry in entries {
        let name = entry?.file_name();
        found.extend(name.to_str().and_then(|name| number(path, name)).map(|n| (n, file(path, n))));
    }
    Ok(found.into_values().collect())
}

/// Returns the numbers missing before the last of these files of the recording `NAME.mcap`, as the first and last number of
/// each gap.
pub fn gaps(path: &Path, files: &[PathBuf]) -> Vec<(u32, u32)> {
    let names = files.iter().filter_map(|file| file.file_name()?.to_str());
    let numbers: BTreeSet<u32> = names.filter_map(|name| number(path, name)).collect();
    let (mut next, mut gaps) = (0, Vec::new());
    for found in numbers {
        if found > next {
            gaps.push((next, found - 1));
        }
        next = found.saturating_add(1);
    }
    gaps
}

/// Writes one recording with the messages of all files, each message once.
///
/// # Errors
/// [`RecordingError`] if a file is damaged, if the first does not identify its run, or if the sink fails. A file that is merely
/// truncated is not an error.
pub fn whole<W: Write>(files: &[PathBuf], sink: W) -> Result<W, RecordingError> {
    let Some(first) = files.first() else {
        let reason = "expected a file of the recording, found none".to_owned();
        return Err(RecordingError::Run { what: "files", reason });
    };
    let mut writer = join(files, &Recording::open(first)?.run()?, sink)?;
    let restarts = files.iter().filter_map(|file| restarts(file).ok()?).max();
    writer.survived(restarts.unwrap_or(0));
    writer.finish()
}

/// Returns the number of restarts of the recorder before it wrote this file, if given in the file.
fn restarts(file: &Path) -> Result<Option<u32>, RecordingError> {
    let facts = Recording::open(file)?.index()?.metadata(file, RECORDER_METADATA)?;
    Ok(facts.and_then(|facts| facts.get("restarts")?.parse().ok()))
}

/// Copies a file that was cut off by a kill into one with a proper end. Messages that are also in `next`, the
/// file after it, are left out.
///
/// # Errors
/// [`RecordingError`] if a file cannot be read or the copy cannot be written.
pub fn mend<W: Write>(
    recording: &Recording,
    next: Option<&Recording>,
    copy: &mut Copy<W>,
) -> Result<(), RecordingError> {
    describe(recording, copy)?;
    recording.topics()?.iter().try_for_each(|topic| copy.declare(topic).map(drop))?;
    copy.begins_late(topic_names(recording)?);
    let first = next.map(first_numbers).transpose()?.unwrap_or_default();
    let is_there_too =
        |message: &RawMessage| first.get(&message.topic.name).is_some_and(|first| message.sequence >= *first);
    for message in recording.select(Selection::default())? {
        let message = message?;
        if !is_there_too(&message) {
            copy.message(&message)?;
        }
    }
    Ok(())
}

/// Returns the first sequence number in the recording, by topic. Topics with many writers are left out, because their numbers
/// mean nothing.
fn first_numbers(recording: &Recording) -> Result<BTreeMap<String, u32>, RecordingError> {
    let mut first = BTreeMap::new();
    for message in recording.select(Selection::default())? {
        let message = message?;
        if !has_many_writers(&message.topic.name) && !first.contains_key(&message.topic.name) {
            first.insert(message.topic.name.clone(), message.sequence);
        }
    }
    Ok(first)
}

/// Returns the facts about a file that rosbag2's `metadata.yaml` needs.
///
/// # Errors
/// Same errors as [`crate::info::info`].
pub fn facts(file: &Path) -> Result<PartFacts, RecordingError> {
    let info = crate::info::info(file)?;
    let (first_ns, last_ns) = Recording::open(file)?.index()?.span_ns().unwrap_or_default();
    let messages = info.topics.into_iter().filter(|topic| topic.messages > 0);
    let messages = messages.map(|topic| (topic.topic, topic.messages)).collect();
    Ok(PartFacts { first_ns, last_ns, messages, ..PartFacts::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbered_files_belong_to_a_series() {
        let folder = tempfile::tempdir().unwrap();
        let names =
            ["a_10.mcap", "a_2.mcap", "a_0.mcap", "a_01.mcap", "a.mcap", "a_x.mcap", "ab_1.mcap", "a_1.txt"];
        for name in names {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = files(&folder.path().join("a.mcap")).unwrap();
        let found: Vec<_> = found.iter().map(|file| file.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(found, ["a_0.mcap", "a_2.mcap", "a_10.mcap"]);
        let path = folder.path().join("a.mcap");
        assert_eq!(gaps(&path, &files(&path).unwrap()), [(1, 1), (3, 9)]);
        assert_eq!(gaps(&path, &files(&path).unwrap()[1..2]), [(0, 1)]);
        assert_eq!(files(&folder.path().join("nowhere/a.mcap")).unwrap(), Vec::<PathBuf>::new());
    }

    #[test]
    fn a_recording_without_files_is_refused() {
        assert!(whole(&[], Vec::new()).unwrap_err().to_string().contains("expected a file"));
    }
}
