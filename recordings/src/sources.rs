//! The files of a run inside its recording: what its navigator is given, and the map, floor plan or plane of the
//! world. With them a recording can be executed once more where those files are not, or have changed.
//!
//! A map's picture is found by the line `image:` of its YAML, a plane's by its table `picture`. What cannot be read is left out: a recording
//! is not refused for it.

use std::path::{Component, Path, PathBuf};

use sketchnav_files::Limit;
use sketchnav_schemas::mission::Mission;

use crate::reader::{Attachment, Recording};

/// Folders inside the recording.
const NAVIGATOR: &str = "navigator/";
const WORLD: &str = "world/";
/// Larger files are not taken along.
const SOURCE: Limit = Limit { what: "a file of a run", bytes: 32 << 20 };

/// Whether an attachment of this name is one of the files that the run is made of.
pub fn is_source(name: &str) -> bool {
    name.starts_with(NAVIGATOR) || name.starts_with(WORLD)
}

/// Reads the files that a mission names; its paths are absolute.
pub fn read(mission: &Mission) -> Vec<Attachment> {
    let mut given = mission.clone();
    let mut files: Vec<_> =
        given.navigator_files_mut().filter_map(|(_, path)| file(NAVIGATOR, Path::new(path))).collect();
    let world = &mission.world;
    files.extend(world.floor_plan.iter().filter_map(|path| file(WORLD, Path::new(path))));
    let pictured: [(_, PictureOf); 2] = [(&world.map, picture_of), (&world.plane, picture_of_plane)];
    for (path, picture_of) in pictured {
        let Some(path) = path.as_ref().map(Path::new) else { continue };
        let Some(named) = file(WORLD, path) else { continue };
        let picture = picture_of(&named.data);
        files.push(named);
        files.extend(picture.and_then(|picture| {
            let bytes = file("", &path.with_file_name(&picture))?;
            Some(Attachment { name: format!("{WORLD}{picture}"), ..bytes })
        }));
    }
    files
}

/// Finds the picture that a file names.
type PictureOf = fn(&[u8]) -> Option<String>;

fn file(folder: &str, path: &Path) -> Option<Attachment> {
    let data = sketchnav_files::read(path, SOURCE).ok()?;
    let name = format!("{folder}{}", path.file_name()?.to_str()?);
    Some(Attachment { name, media_type: media_type(path).to_owned(), data })
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => "image/png",
        Some("jpg" | "jpeg") => "image/jpeg",
        Some("svg") => "image/svg+xml",
        Some("json") => "application/json",
        Some("toml") => "application/toml",
        Some("yaml" | "yml") => "application/yaml",
        _ => "application/octet-stream",
    }
}

/// The picture that a map's YAML names, where it lies beside it or below.
fn picture_of(yaml: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(yaml).ok()?;
    let line = text.lines().find_map(|line| line.trim().strip_prefix("image:"))?;
    let name = line.trim().trim_matches(['"', '\'']);
    is_below(Path::new(name)).then(|| name.to_owned())
}

/// The picture that a plane's file names, where it lies beside it or below.
fn picture_of_plane(plane: &[u8]) -> Option<String> {
    let table: toml::Table = toml::from_str(std::str::from_utf8(plane).ok()?).ok()?;
    let name = table.get("picture")?.get("file")?.as_str()?;
    is_below(Path::new(name)).then(|| name.to_owned())
}

fn is_below(path: &Path) -> bool {
    let mut parts = path.components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Writes the files that are inside the recording into `folder`, and has `mission` name those. What is not
/// inside is left where the mission says that it is.
///
/// # Errors
/// As the system says.
pub fn unpack(recording: &Recording, mission: &mut Mission, folder: &Path) -> std::io::Result<()> {
    for (name, attachment) in recording.attachments() {
        if is_source(name) && is_below(Path::new(name)) {
            let path = folder.join(name);
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            std::fs::write(path, &attachment.data)?;
        }
    }
    let moved = |inside: &str, path: &mut String| {
        let name = Path::new(path.as_str()).file_name().unwrap_or_default().to_owned();
        let there: PathBuf = folder.join(inside).join(name);
        if let (true, Some(there)) = (there.is_file(), there.to_str()) {
            there.clone_into(path);
        }
    };
    mission.navigator_files_mut().for_each(|(_, path)| moved(NAVIGATOR, path));
    mission.world.floor_plan.iter_mut().for_each(|path| moved(WORLD, path));
    mission.world.map.iter_mut().for_each(|path| moved(WORLD, path));
    mission.world.plane.iter_mut().for_each(|path| moved(WORLD, path));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_maps_picture_is_found_and_no_file_outside_is_touched() {
        assert_eq!(picture_of(b"image: 'm.pgm'\nresolution: 1\n").as_deref(), Some("m.pgm"));
        assert_eq!(picture_of(b"resolution: 1\nimage: parts/m.png"), Some("parts/m.png".into()));
        for outside in ["image: /etc/passwd", "image: ../m.png", "image:", "resolution: 1"] {
            assert_eq!(picture_of(outside.as_bytes()), None, "{outside}");
        }
        let plane = b"picture = { file = 'dots.png', pixels_per_m = 100.0 }";
        assert_eq!(picture_of_plane(plane).as_deref(), Some("dots.png"));
        for outside in ["picture = { file = '../dots.png' }", "picture = 'dots.png'", "dots = [[0, 0]]"] {
            assert_eq!(picture_of_plane(outside.as_bytes()), None, "{outside}");
        }
    }
}
