//! Reads the files of floors to draw.

use std::path::Path;

use sketchnav_schemas::toml_text;
use sketchnav_sim::{SimError, files};

use crate::error::DeformError;
use crate::floor::Floor;

/// Reads a floor plan in the project's own format (TOML), or a map in the format of map_server (YAML).
///
/// # Errors
/// [`DeformError`], which names the file and the fault in it.
pub fn floor(path: &Path) -> Result<Floor, DeformError> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => {
            let text = sketchnav_files::read_to_string(path, sketchnav_files::FLOOR_PLAN)
                .map_err(|error| SimError::from(error).in_file(path))?;
            let plan = toml_text::read(&text).map_err(|error| SimError::from(error).in_file(path))?;
            Floor::of_plan(&plan).map_err(|error| in_file(error, path))
        }
        Some("yaml" | "yml") => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            Floor::of_map(&files::occupancy_map(path)?, &name)
        }
        _ => Err(DeformError::Kind { path: path.to_owned() }),
    }
}

fn in_file(error: DeformError, path: &Path) -> DeformError {
    match error {
        DeformError::World(error) => error.in_file(path).into(),
        other => other,
    }
}
