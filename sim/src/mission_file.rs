//! Opens a mission file and finds what it names.

use std::path::Path;

use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;

use crate::error::SimError;
use crate::files;

/// Reads a mission and its robot; the mission's paths become absolute.
///
/// # Errors
/// [`SimError::InFile`] with the mission's file, the key, and what was expected there.
pub fn load(path: &Path) -> Result<(Mission, Robot), SimError> {
    read(path).map_err(|error| error.in_file(path))
}

fn read(path: &Path) -> Result<(Mission, Robot), SimError> {
    if path.exists() && !path.is_file() {
        return Err(SimError::Value {
            key: "mission".into(),
            expected: "a file",
            found: "something that is none".into(),
        });
    }
    let mut mission = Mission::parse(&std::fs::read_to_string(path)?)?;
    let folder = std::path::absolute(path)?.parent().map(Path::to_path_buf).unwrap_or_default();
    let robot_is_file = mission.robot.ends_with(".toml");
    let world = &mut mission.world;
    for (key, file) in [
        ("world.floor_plan", world.floor_plan.as_mut()),
        ("world.map", world.map.as_mut()),
        ("robot", robot_is_file.then_some(&mut mission.robot)),
    ] {
        let Some(file) = file else { continue };
        *file = resolve(&folder, key, file)?;
    }
    for (key, file) in mission.navigator_files_mut() {
        *file = resolve(&folder, &key, file)?;
    }
    let robot = files::robot(&mission.robot)?;
    Ok((mission, robot))
}

fn resolve(folder: &Path, key: &str, file: &str) -> Result<String, SimError> {
    let path = folder.join(file);
    let wrong = |expected, found: String| SimError::Value { key: key.to_owned(), expected, found };
    if !path.is_file() {
        return Err(wrong("an existing file", path.display().to_string()));
    }
    path.into_os_string().into_string().map_err(|path| wrong("a path in UTF-8", path.display().to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named_with_its_key() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        let text = include_str!("../missions/building/building-a.toml");
        std::fs::write(&path, text).unwrap();
        let error = load(&path).unwrap_err().to_string();
        assert!(error.contains("m.toml") && error.contains("world.floor_plan"), "{error}");
    }

    #[test]
    fn an_unknown_robot_is_answered_with_the_known_ones() {
        let folder = tempfile::tempdir().unwrap();
        for file in ["building.floor.toml", "sketch-a.svg"] {
            std::fs::write(folder.path().join(file), "").unwrap();
        }
        let path = folder.path().join("m.toml");
        let text = include_str!("../missions/building/building-a.toml").replace("robotino", "robotina");
        std::fs::write(&path, text).unwrap();
        let error = load(&path).unwrap_err().to_string();
        assert!(error.contains("robotina") && error.contains("turtlebot3"), "{error}");
    }
}
