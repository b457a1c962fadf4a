//! Reads mission files, and finds the files that they name.

use std::path::Path;

use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;

use crate::error::SimError;
use crate::files;

/// Reads a mission and its robot. The paths in the mission become absolute.
///
/// # Errors
/// [`SimError::InFile`], which names the mission's file, the key, and what was expected.
pub fn load(path: &Path) -> Result<(Mission, Robot), SimError> {
    read(path).map_err(|error| error.in_file(path))
}

fn read(path: &Path) -> Result<(Mission, Robot), SimError> {
    let mut mission = Mission::parse(&sketchnav_files::read_to_string(path, sketchnav_files::MISSION)?)?;
    let folder = std::path::absolute(path)?.parent().map(Path::to_path_buf).unwrap_or_default();
    let robot_is_file = mission.robot.ends_with(".toml");
    let world = &mut mission.world;
    for (key, file) in [
        ("world.floor_plan", world.floor_plan.as_mut()),
        ("world.map", world.map.as_mut()),
        ("world.plane", world.plane.as_mut()),
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
        let what = if path.exists() { "something else" } else { "none" };
        return Err(wrong("a file", format!("{what} at {}", path.display())));
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
        assert!(
            error.contains("m.toml") && error.contains("world.floor_plan: expected a file, found none at "),
            "{error}"
        );
    }

    /// Empty files of 8 GB, and text with a list as long as the memory, used to be read completely before they were parsed. Now,
    /// any file that a mission names is rejected if it exceeds the size limit, which the error states.
    #[test]
    fn every_file_of_a_mission_has_a_limit() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let sparse = |name: &str| std::fs::File::create(file(name)).unwrap().set_len(8 << 30).unwrap();
        let world = |map: &str| match map {
            "" => sketchnav_schemas::mission::WorldSource {
                floor_plan: Some(file("floor.toml").display().to_string()),
                ..Default::default()
            },
            map => sketchnav_schemas::mission::WorldSource {
                map: Some(file(map).display().to_string()),
                ..Default::default()
            },
        };
        for name in ["mission.toml", "robot.toml", "floor.toml", "map.yaml", "m.pgm"] {
            sparse(name);
        }
        let yaml = "image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 0.6\nfree_thresh: 0.2\n";
        std::fs::write(file("small.yaml"), yaml).unwrap();
        let robot = files::robot(&file("robot.toml").display().to_string()).map(drop);
        let errors = [
            (load(&file("mission.toml")).map(drop), "mission.toml: ", "a mission of at most 4194304 bytes"),
            (robot, "robot.toml: ", "a robot of at most 1048576 bytes"),
            (files::world(&world("")).map(drop), "floor.toml: ", "a floor plan of at most 4194304 bytes"),
            (
                files::world(&world("map.yaml")).map(drop),
                "map.yaml: ",
                "a map's YAML of at most 1048576 bytes",
            ),
            (
                files::world(&world("small.yaml")).map(drop),
                "m.pgm: ",
                "a map's picture of at most 67108864 bytes",
            ),
        ];
        for (read, name, words) in errors {
            let error = read.unwrap_err().to_string();
            assert!(
                error.contains(name) && error.contains(words) && error.ends_with("found 8589934592"),
                "{error}"
            );
        }
    }

    #[test]
    fn the_error_for_an_unknown_robot_lists_the_known_ones() {
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
