//! What is doubted about the files of a mission before a robot is driven by them.

use anyhow::anyhow;
use sketchnav_files::Files;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::Doubts;

use crate::failure::{Failure, OrInput};
use crate::output::say;

/// What the navigator of a run doubts about its files; nothing where its sketcher is somebody else's.
///
/// # Errors
/// As the sketcher says, where a file cannot be read or nothing could be right in it.
pub fn of(run: &RunConfig, files: &dyn Files) -> Result<Doubts, Failure> {
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let Some(doubts) = navigator.doubts.filter(|_| !run.without.contains(&Process::Sketcher)) else {
        return Ok(Doubts::default());
    };
    let found = doubts(run, &sketchnav_navigators::read_from(files));
    found.map_err(|error| anyhow!("{}: {error}", Process::Sketcher)).or_input()
}

/// Says them on standard error.
pub fn tell(doubts: &Doubts) {
    doubts.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    doubts.left_out.iter().for_each(|what| say!("left out: {what}"));
}

#[cfg(test)]
mod tests;
