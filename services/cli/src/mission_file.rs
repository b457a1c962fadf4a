//! Opens a mission file and finds what it names.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;

/// Reads a mission; its paths become absolute.
///
/// # Errors
/// Names the file and the key, and what was expected there.
pub fn load(path: &Path) -> anyhow::Result<(Mission, Robot)> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{}: expected a mission file (TOML)", path.display()))?;
    let mut mission = Mission::parse(&text).with_context(|| path.display().to_string())?;
    let folder = std::path::absolute(path)?.parent().map(Path::to_path_buf).unwrap_or_default();
    let robot_is_file = mission.robot.ends_with(".toml");
    let world = &mut mission.world;
    for (key, file) in [
        ("world.floor_plan", world.floor_plan.as_mut()),
        ("world.map", world.map.as_mut()),
        ("sketch.file", Some(&mut mission.sketch.file)),
        ("robot", robot_is_file.then_some(&mut mission.robot)),
    ] {
        let Some(file) = file else { continue };
        *file = resolve(&folder, file).with_context(|| format!("{}: {key}", path.display()))?;
    }
    let robot = sketchnav_sim::files::robot(&mission.robot);
    let robot = robot.with_context(|| format!("{}: robot {:?}", path.display(), mission.robot))?;
    Ok((mission, robot))
}

fn resolve(folder: &Path, file: &str) -> anyhow::Result<String> {
    let path = folder.join(file);
    if !path.is_file() {
        bail!("expected a file, found none at {}", path.display());
    }
    path.into_os_string().into_string().map_err(|path| anyhow!("{path:?}: expected a path in UTF-8"))
}
