//! Prints the landmark states of a mission's sketch, or writes the sketch with a smoother route.

use std::path::Path;

use anyhow::{Context, anyhow};
use sketchnav_landmarks::instructions::Instructions;
use sketchnav_landmarks::mission::KIND;
use sketchnav_landmarks::{doubts, file, language, sketcher};
use sketchnav_schemas::mission::Mission;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output;

/// Prints the landmark states in words or as a table.
pub fn print(path: &Path, table: bool) -> Result<Outcome, Failure> {
    let (_, instructions) = load(path)?;
    let route = instructions.route().map_err(|error| in_file(path, &error.to_string())).or_input()?;
    match route {
        Some(route) if table => output::lines(language::table(&route).trim_end())?,
        Some(_) => output::lines(instructions.words.trim_end())?,
        None => {
            let reason = "expected an object in view at each turn, found a turn without one; \
                method \"chronis-2007\" says which";
            return Err(in_file(path, reason)).or_input();
        }
    }
    Ok(Outcome::Success)
}

/// Writes the sketch of a mission with a smoother route.
pub fn smooth(path: &Path, output: &Path) -> Result<Outcome, Failure> {
    let (mut mission, instructions) = load(path)?;
    let (Some(sketch), Some(canvas)) = (instructions.sketch, instructions.canvas) else {
        return Err(in_file(path, "--smooth: expected a mission with a sketch, found a route in words"))
            .or_input();
    };
    let drawings = mission.navigator_files_mut().map(|(_, file)| Path::new(file));
    sketchnav_files::draft::refuse_to_overwrite(drawings.chain([path]), output).or_input()?;
    sketchnav_files::write(output, file::write(&doubts::smoothed(&sketch), canvas))
        .with_context(|| output.display().to_string())
        .or_input()?;
    Ok(Outcome::Success)
}

fn load(path: &Path) -> Result<(Mission, Instructions), Failure> {
    let (mission, robot) = sketchnav_sim::mission_file::load(path).or_input()?;
    let kind = mission.navigator_kind();
    if kind != KIND {
        return Err(in_file(path, &format!("navigator.kind: expected {KIND:?}, found {kind:?}"))).or_input();
    }
    let instructions = sketcher::understand(&mission, &robot, &sketchnav_navigators::read_file);
    let instructions = instructions.map_err(|error| in_file(path, &error.to_string())).or_input()?;
    Ok((mission, instructions))
}

fn in_file(path: &Path, reason: &str) -> anyhow::Error {
    anyhow!("{}: {reason}", path.display())
}
