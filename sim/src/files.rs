//! Reads the files of worlds and robots.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use sketchnav_files::{Disk, FLOOR_PLAN, Files, MAP, MAP_PICTURE, PLANE, ROBOT};
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::mission::WorldSource;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::toml_text;

use crate::description::WorldDescription;
use crate::error::SimError;
use crate::plane_file::{PlaneDescription, PlaneFile};
use crate::ros_map::{MapInfo, OccupancyMap};
use crate::{floor_plan, robots};

/// Reads the world that a mission names from disk. Paths are used as they are.
///
/// # Errors
/// Any error of [`world_in`].
pub fn world(source: &WorldSource) -> Result<WorldDescription, SimError> {
    world_in(&Disk, source)
}

/// Reads the world that a mission names from a store of files.
///
/// # Errors
/// - [`SimError::InFile`], which names a file and the fault in it.
/// - [`SimError::Value`] if something that the mission itself adds to the world is invalid.
pub fn world_in(files: &dyn Files, source: &WorldSource) -> Result<WorldDescription, SimError> {
    let mut world = match (&source.floor_plan, &source.map) {
        (Some(path), None) => floor_plan_in(files, Path::new(path))?,
        (None, Some(path)) => map_in(files, Path::new(path))?,
        _ => {
            let found = format!("{:?} and {:?}", source.floor_plan, source.map);
            let expected = "one of floor_plan and map for a floor";
            return Err(SimError::Value { key: "world".into(), expected, found });
        }
    };
    world.add_furniture(&source.furniture)?;
    world.add_people(&source.person)?;
    world.add_markers(&source.marker)?;
    Ok(world)
}

/// Reads a floor plan in this project's own format.
///
/// # Errors
/// [`SimError::InFile`] if the file cannot be read or is invalid.
pub fn floor_plan_file(path: &Path) -> Result<WorldDescription, SimError> {
    floor_plan_in(&Disk, path)
}

/// Reads a floor plan in the project's own format as it is written, with its doors.
///
/// # Errors
/// [`SimError::InFile`] if the file cannot be read or is not a floor plan. Its values are only checked when a world is built.
pub fn floor_plan(path: &Path) -> Result<FloorPlan, SimError> {
    let text = Disk.read_to_string(path, FLOOR_PLAN).map_err(SimError::from);
    let read = |text: String| Ok(toml_text::read(&text)?);
    text.and_then(read).map_err(|error: SimError| error.in_file(path))
}

fn floor_plan_in(files: &dyn Files, path: &Path) -> Result<WorldDescription, SimError> {
    let parse = |text: String| floor_plan::parse(&text);
    let text = files.read_to_string(path, FLOOR_PLAN).map_err(SimError::from);
    text.and_then(parse).map_err(|error| error.in_file(path))
}

/// Reads a map in the format of map_server as a world with walls.
///
/// # Errors
/// Any error of [`occupancy_map`].
pub fn map_file(path: &Path) -> Result<WorldDescription, SimError> {
    map_in(&Disk, path)
}

fn map_in(files: &dyn Files, path: &Path) -> Result<WorldDescription, SimError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    occupancy_map_in(files, path)?.describe(&name).map_err(|error| error.in_file(path))
}

/// Reads a map in the format of map_server: the YAML file and the image named in it.
///
/// # Errors
/// [`SimError::InFile`], which names the YAML file or the image, if one of them cannot be read or is invalid.
pub fn occupancy_map(path: &Path) -> Result<OccupancyMap, SimError> {
    occupancy_map_in(&Disk, path)
}

/// Like [`occupancy_map`], but reads from a store of files.
///
/// # Errors
/// Any error of [`occupancy_map`].
pub fn occupancy_map_in(files: &dyn Files, path: &Path) -> Result<OccupancyMap, SimError> {
    let parse = |text: String| MapInfo::parse(&text);
    let yaml = files.read_to_string(path, MAP).map_err(SimError::from);
    let info = yaml.and_then(parse).map_err(|error| error.in_file(path))?;
    let picture_path = path.with_file_name(&info.image);
    let decode = |bytes: Vec<u8>| OccupancyMap::decode(&info, &bytes);
    let picture = match files.read(&picture_path, MAP_PICTURE) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let found = format!("none at {}", picture_path.display());
            let missing = SimError::Value { key: "image".into(), expected: "a file", found };
            return Err(missing.in_file(path));
        }
        read => read.map_err(SimError::from),
    };
    picture.and_then(decode).map_err(|error| error.in_file(picture_path).in_file(path))
}

/// Returns the path of the image named in the YAML file of a map, or `None` if the file does not describe a map.
pub fn picture_of(map: &Path) -> Option<PathBuf> {
    let yaml = sketchnav_files::read_to_string(map, MAP).ok()?;
    Some(map.with_file_name(MapInfo::parse(&yaml).ok()?.image))
}

/// Reads a plane of dots from disk.
///
/// # Errors
/// Any error of [`plane_in`].
pub fn plane_file(path: &Path) -> Result<PlaneDescription, SimError> {
    plane_in(&Disk, path)
}

/// Reads a plane of dots from a store of files.
///
/// # Errors
/// [`SimError::InFile`], which names the plane file or its picture.
pub fn plane_in(files: &dyn Files, path: &Path) -> Result<PlaneDescription, SimError> {
    let parse = |text: String| PlaneFile::parse(&text);
    let text = files.read_to_string(path, PLANE).map_err(SimError::from);
    let file = text.and_then(parse).map_err(|error| error.in_file(path))?;
    let Some(picture) = file.picture() else {
        return file.describe(&[]).map_err(|error| error.in_file(path));
    };
    let picture_path = path.with_file_name(&picture.file);
    let bytes = files.read(&picture_path, MAP_PICTURE).map_err(SimError::from);
    let described = bytes.and_then(|bytes| file.describe(&bytes));
    described.map_err(|error| error.in_file(picture_path).in_file(path))
}

/// Returns the robot with that name, or reads the robot file at that path.
///
/// # Errors
/// - [`SimError::InFile`], which names the file and the fault in it.
/// - [`SimError::Value`] if no robot has that name.
pub fn robot(name_or_path: &str) -> Result<Robot, SimError> {
    if let Some(robot) = robots::find(name_or_path)? {
        return Ok(robot);
    }
    if !name_or_path.ends_with(".toml") {
        let known: Vec<_> = robots::names().collect();
        return Err(SimError::Value {
            key: "robot".into(),
            expected: "the name of a robot that ships, or a robot file (.toml)",
            found: format!("{name_or_path:?} (known: {})", known.join(", ")),
        });
    }
    let parse = |text: String| Ok(Robot::parse(&text)?);
    let text = sketchnav_files::read_to_string(name_or_path, ROBOT).map_err(SimError::from);
    text.and_then(parse).map_err(|error| error.in_file(name_or_path))
}
