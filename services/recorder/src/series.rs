//! Finishes a recording that was split into several files. Files that were truncated by a kill are completed,
//! and `metadata.yaml` lists all files, so that the folder is a rosbag2 bag.

use std::fs::File;
use std::io::{BufWriter, ErrorKind};
use std::path::{Path, PathBuf};

use anyhow::Context;
use sketchnav_recordings::copy::{Copy, PartFacts};
use sketchnav_recordings::info::info;
use sketchnav_recordings::records::Damage;
use sketchnav_recordings::series::{facts, mend};
use sketchnav_recordings::{Recording, RecordingError, rosbag2};

use crate::core::Report;

/// Closes the recording `path`, which consists of these files, and counts their messages.
pub(crate) fn close(path: &Path, files: Vec<PathBuf>, report: &mut Report) -> anyhow::Result<()> {
    let files = with_messages(files)?;
    for (file, next) in files.iter().zip(files.iter().skip(1).map(Some).chain([None])) {
        if Recording::open(file)?.index()?.is_cut_off() {
            give_end(file, next.map(PathBuf::as_path)).with_context(|| file.display().to_string())?;
        }
    }
    let facts_by_file = files.iter().map(|file| Ok((name(file), facts(file)?)));
    let facts_by_file = facts_by_file.collect::<Result<Vec<(String, PartFacts)>, RecordingError>>()?;
    if let Some(first) = files.first() {
        let yaml = rosbag2::metadata_yaml(&facts_by_file, &Recording::open(first)?.topics()?);
        let draft = path.with_file_name("metadata.unfinished");
        std::fs::write(&draft, yaml)?;
        std::fs::rename(&draft, path.with_file_name(rosbag2::METADATA))?;
    }
    report.messages = facts_by_file.iter().flat_map(|(_, part)| part.messages.values()).sum();
    report.missing = files.iter().map(|file| Ok(info(file)?.missing)).sum::<Result<u64, RecordingError>>()?;
    Ok(())
}

/// Removes files that are still empty because the recorder was killed, and returns the others.
fn with_messages(files: Vec<PathBuf>) -> anyhow::Result<Vec<PathBuf>> {
    let mut kept = Vec::new();
    for file in files {
        match Recording::open(&file) {
            Err(RecordingError::Damaged { source: Damage::Empty, .. }) => std::fs::remove_file(&file)?,
            // The file was in the checkpoint before it existed.
            Err(RecordingError::File { source, .. }) if source.kind() == ErrorKind::NotFound => {}
            _ => kept.push(file),
        }
    }
    Ok(kept)
}

fn give_end(file: &Path, next: Option<&Path>) -> anyhow::Result<()> {
    let draft = file.with_extension("mended");
    let mut copy = Copy::new(BufWriter::new(File::create(&draft)?))?;
    let next = next.map(Recording::open).transpose()?;
    mend(&Recording::open(file)?, next.as_ref(), &mut copy)?;
    copy.finish()?.get_ref().sync_data()?;
    Ok(std::fs::rename(&draft, file)?)
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
