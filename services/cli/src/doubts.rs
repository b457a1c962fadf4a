//! Doubts about the files of a mission, which are raised before the robot drives by them.

use std::path::Path;

use anyhow::anyhow;
use sketchnav_files::Files;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::files::occupancy_map_in;
use sketchnav_stage::doubts::Doubts;

use crate::failure::{Failure, OrInput};
use crate::output::say;

/// Collects the doubts of the run's navigator about its files, unless its sketcher is run by hand, and the
/// doubts about unknown areas of the world's map.
///
/// # Errors
/// Returns the sketcher's error if a file cannot be read or is entirely invalid.
pub fn of(run: &RunConfig, files: &dyn Files) -> Result<Doubts, Failure> {
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let by_sketcher = navigator.doubts.filter(|_| !run.without.contains(&Process::Sketcher));
    let found = by_sketcher.map(|doubts| doubts(run, &sketchnav_navigators::read_from(files))).transpose();
    let mut found =
        found.map_err(|error| anyhow!("{}: {error}", Process::Sketcher)).or_input()?.unwrap_or_default();
    found.warnings.extend(of_map(run, files));
    Ok(found)
}

/// Returns a warning if part of the world's map is transparent. Any other problem with the map is reported by the world
/// itself.
fn of_map(run: &RunConfig, files: &dyn Files) -> Option<String> {
    let path = run.mission.world.map.as_deref().filter(|_| !run.without.contains(&Process::World))?;
    let share = occupancy_map_in(files, Path::new(path)).ok()?.transparent_share();
    (share > 0.0).then(|| {
        format!(
            "{path}: {:.1} % of the map's picture is transparent, which counts as unknown and solid; if it is floor, save the picture \
             with a white background",
            100.0 * share
        )
    })
}

/// Prints the doubts, and the places that goals were resolved to, to standard error.
pub fn print(doubts: &Doubts) {
    doubts.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    doubts.resolved.iter().for_each(|what| say!("notice: {what}"));
    doubts.left_out.iter().for_each(|what| say!("left out: {what}"));
}

#[cfg(test)]
mod tests;
