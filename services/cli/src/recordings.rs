//! The tools for recordings, a subcommand each.

pub mod args;
mod import;
mod judge;
mod replay;
mod report;
mod rerun;
mod rewrite;

use std::path::Path;

use sketchnav_recordings::Recording;

use crate::failure::{Failure, OrInput, Outcome};
use args::Tool;

/// Does what the subcommand says.
pub fn dispatch(tool: Tool) -> Result<Outcome, Failure> {
    match tool {
        Tool::Replay { file, options } => replay::replay(&file, &options),
        Tool::Rerun { file, options } => rerun::rerun(&file, &options),
        Tool::Judge { files, options } => judge::judge(&files, &options),
        Tool::Report { file, output, rooms } => report::report(&file, &output, rooms.as_deref()),
        Tool::Import { log, options } => import::import(&log, &options),
        Tool::Recover { file, output, json } => rewrite::recover(&file, &output, json),
        Tool::Filter { file, options } => rewrite::filter(&file, &options),
        Tool::Merge { files, output } => rewrite::merge(&files, &output),
        Tool::Split { file, options } => rewrite::split(&file, &options),
    }
}

fn open(path: &Path) -> Result<Recording, Failure> {
    Recording::open(path).or_input()
}
