//! Prints the landmark states of a mission's sketch.

use std::path::Path;

use anyhow::anyhow;
use sketchnav_landmarks::mission::KIND;
use sketchnav_landmarks::{language, sketcher};

use crate::failure::{Failure, OrInput, Outcome};
use crate::output;

/// Prints the landmark states in words or as a table.
pub fn print(path: &Path, table: bool) -> Result<Outcome, Failure> {
    let (mission, robot) = sketchnav_sim::mission_file::load(path).or_input()?;
    let in_file = |reason: String| anyhow!("{}: {reason}", path.display());
    let kind = mission.navigator_kind();
    if kind != KIND {
        return Err(in_file(format!("navigator.kind: expected {KIND:?}, found {kind:?}"))).or_input();
    }
    let instructions = sketcher::understand(&mission, &robot, &sketchnav_navigators::read_file);
    let instructions = instructions.map_err(|error| in_file(error.to_string())).or_input()?;
    let route = instructions.route().map_err(|error| in_file(error.to_string())).or_input()?;
    match route {
        Some(route) if table => output::lines(language::table(&route).trim_end())?,
        Some(_) => output::lines(instructions.words.trim_end())?,
        None => {
            let reason = "expected an object in view at each turn, found a turn without one; \
                method \"chronis-2007\" says which";
            return Err(in_file(reason.to_owned())).or_input();
        }
    }
    Ok(Outcome::Success)
}
