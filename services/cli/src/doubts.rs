//! Doubts about a mission's files, before a robot is driven by them.

use anyhow::anyhow;
use sketchnav_files::Files;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::Doubts;

use crate::failure::{Failure, OrInput};
use crate::output::say;

/// The navigator's doubts about the files of a run; none if the sketcher is not started by this program.
///
/// # Errors
/// The sketcher's error, if a file cannot be read or is entirely wrong.
pub fn of(run: &RunConfig, files: &dyn Files) -> Result<Doubts, Failure> {
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let Some(doubts) = navigator.doubts.filter(|_| !run.without.contains(&Process::Sketcher)) else {
        return Ok(Doubts::default());
    };
    let found = doubts(run, &sketchnav_navigators::read_from(files));
    found.map_err(|error| anyhow!("{}: {error}", Process::Sketcher)).or_input()
}

/// Prints them to standard error.
pub fn tell(doubts: &Doubts) {
    doubts.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    doubts.left_out.iter().for_each(|what| say!("left out: {what}"));
}

#[cfg(test)]
mod tests;
