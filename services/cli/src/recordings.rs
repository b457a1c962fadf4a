//! The tools for recordings, a subcommand each.

pub mod args;
mod draft;
mod import;
mod judge;
mod replay;
pub mod report;
mod rerun;
mod rewrite;
pub mod snapshot;
pub mod whole;

use std::path::Path;

use anyhow::anyhow;
use sketchnav_recordings::{Recording, RecordingError};

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::say;
use args::Tool;
use whole::Whole;

/// Does what the subcommand says.
pub fn dispatch(tool: Tool) -> Result<Outcome, Failure> {
    match tool {
        Tool::Replay { file, options } => replay::replay(Whole::of(&file)?.path(), &options),
        Tool::Rerun { file, options } => rerun::rerun(Whole::of(&file)?.path(), &options),
        Tool::Judge { files, options } => judge::judge(&Whole::of_all(&files)?.1, &options),
        Tool::Report { file, output, rooms, json } => {
            report::report(Whole::of(&file)?.path(), &output, rooms.as_deref(), json)
        }
        Tool::Import { log, options } => import::import(&log, &options),
        Tool::Recover { file, output, json } => rewrite::recover(&file, &output, json),
        Tool::Filter { file, options } => rewrite::filter(Whole::of(&file)?.path(), &options),
        Tool::Merge { files, output, json } => rewrite::merge(&Whole::of_all(&files)?.1, &output, json),
        Tool::Split { file, options } => rewrite::split(Whole::of(&file)?.path(), &options),
    }
}

/// Refuses to write over what is read. What is written by way of a draft needs no such care, but where it
/// is something else than a recording.
fn refuse_to_overwrite(input: &Path, output: &Path) -> Result<(), Failure> {
    let is_same =
        input.canonicalize().ok().is_some_and(|input| output.canonicalize().is_ok_and(|o| o == input));
    if is_same {
        return Err(Failure::Input(anyhow!("{}: expected another file than the input", output.display())));
    }
    Ok(())
}

/// The names of those of the recordings that `info` calls cut off.
pub fn cut_off<'a>(
    recordings: impl IntoIterator<Item = &'a Recording>,
) -> Result<Vec<String>, RecordingError> {
    let mut names = Vec::new();
    for recording in recordings {
        if recording.index()?.is_cut_off() {
            names.push(recording.path().display().to_string());
        }
    }
    Ok(names)
}

/// Warns that the recording is cut off, so that it covers a part of the run only.
pub fn tell_cut_off(name: impl std::fmt::Display) {
    say!("notice: {name} is cut off; what is there is whole");
}

fn open(path: &Path) -> Result<Recording, Failure> {
    Recording::open(path).or_input()
}
