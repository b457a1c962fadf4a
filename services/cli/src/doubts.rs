//! Doubts about a mission's files, before a robot is driven by them.

use std::path::Path;

use anyhow::anyhow;
use sketchnav_files::Files;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::files::occupancy_map_in;
use sketchnav_stage::doubts::Doubts;

use crate::failure::{Failure, OrInput};
use crate::output::say;

/// What the navigator of a run doubts about its files, where its sketcher is not somebody else's, and what of the world is not
/// known.
///
/// # Errors
/// The sketcher's error, if a file cannot be read or is entirely wrong.
pub fn of(run: &RunConfig, files: &dyn Files) -> Result<Doubts, Failure> {
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let by_sketcher = navigator.doubts.filter(|_| !run.without.contains(&Process::Sketcher));
    let found = by_sketcher.map(|doubts| doubts(run, &sketchnav_navigators::read_from(files))).transpose();
    let mut found =
        found.map_err(|error| anyhow!("{}: {error}", Process::Sketcher)).or_input()?.unwrap_or_default();
    found.warnings.extend(of_map(run, files));
    Ok(found)
}

/// How much of the world's map is transparent. What else may be wrong with it the world says.
fn of_map(run: &RunConfig, files: &dyn Files) -> Option<String> {
    let path = run.mission.world.map.as_deref().filter(|_| !run.without.contains(&Process::World))?;
    let share = occupancy_map_in(files, Path::new(path)).ok()?.transparent_share();
    (share > 0.0).then(|| {
        format!(
            "{path}: {:.1} % of the map's picture is transparent: that is unknown, and solid; if it is floor, save the picture \
             with a white background",
            100.0 * share
        )
    })
}

/// Prints them to standard error.
pub fn tell(doubts: &Doubts) {
    doubts.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    doubts.left_out.iter().for_each(|what| say!("left out: {what}"));
}

#[cfg(test)]
mod tests;
