//! Establishes the correspondence between drawings and their floors from the file `anchors.toml` next to their missions.

use std::path::Path;

use sketchnav_schemas::mission::Mission;
use sketchnav_sketch::reading::DrawnMap;

use crate::error::{EvalError, read};
use crate::judge::anchors::{Anchors, AnchorsError};
use crate::judge::homotopy::Correspondence;

/// Reads the anchors of a folder of missions.
///
/// # Errors
/// [`EvalError`] if the file is missing or malformed.
pub fn anchors(folder: &Path) -> Result<Anchors, EvalError> {
    let path = folder.join("anchors.toml");
    let text = String::from_utf8_lossy(&read(&path)?).into_owned();
    Anchors::parse(&text).map_err(|cause| in_file(&path, cause))
}

/// Establishes the correspondence between the drawing of a mission and its floor. `file` is the mission's file. In the anchors, the
/// drawing has the name of the mission, and the floor that of the floor plan or the map.
///
/// # Errors
/// [`EvalError`] if the anchors do not include the drawing and the floor.
pub fn join(
    anchors: &Anchors,
    file: &Path,
    mission: &Mission,
    paper: &DrawnMap,
) -> Result<Correspondence, EvalError> {
    let world = mission.world.floor_plan.as_deref().or(mission.world.map.as_deref());
    let world = world.map(Path::new).and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    let floor = world.split('.').next().unwrap_or_default();
    let places = anchors.of(&mission.name, floor, |at| paper.from_image(at));
    let places = places.map_err(|cause| in_file(file, cause))?;
    Correspondence::new(&places)
        .map_err(|cause| EvalError::Correspondence { path: file.to_path_buf(), cause })
}

fn in_file(path: &Path, cause: AnchorsError) -> EvalError {
    EvalError::Anchors { path: path.to_path_buf(), cause }
}
