//! Saves a drawing as a mission file, which `sketchnav run` can then drive without a page.
//!
//! The folder belongs to the user and usually contains missions written by hand. A file is therefore never
//! replaced unless the pad itself wrote it.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::mission::Mission;
use sketchnav_stage::drawn::{Drawn, Kept, Marks};

use crate::draft;
use crate::machine;
use crate::protocol::{Refusal, SketchType};

/// Maximum length of a mission's name, in characters.
const MAX_NAME: usize = 48;

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    /// Its name, in the pad's folder.
    pub name: String,
    /// Its content; null for a picture.
    pub text: Option<String>,
}

/// Writes `name.toml`, the drawing and the map learned by it into `folder`, or none of them if another file has one of the names.
/// `mission` provides the world and the robot, with absolute paths. `drawn` belongs to its navigator. `own` contains the names of
/// files in the folder that the pad has written and may replace, and the new ones are added to it.
///
/// # Errors
/// [`Refusal::Malformed`] for an invalid name, [`Refusal::Taken`], or [`Refusal::File`].
pub fn write(
    folder: &Path,
    name: &str,
    (mission, drawn): (&Mission, &Drawn),
    (sketch, learned): (&machine::AcceptedSketch, Option<&[u8]>),
    path: &machine::Path,
    own: &mut BTreeSet<String>,
) -> Result<Vec<Written>, Refusal> {
    let stem = stem(name)?;
    let drawing = format!("{stem}.{}", sketch.kind.extension());
    let map = format!("{stem}.learned");
    let toml = text(name, (&drawing, learned.map(|_| map.as_str())), (mission, drawn), sketch, path)?;
    let file = format!("{stem}.toml");
    for name in [&file, &drawing].into_iter().chain(learned.map(|_| &map)) {
        check_free(&folder.join(name), own.contains(name))?;
    }
    put(folder, &drawing, &sketch.bytes, own)?;
    if let Some(content) = learned {
        put(folder, &map, content, own)?;
    }
    put(folder, &file, toml.as_bytes(), own)?;
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let strokes = (sketch.kind == SketchType::Strokes).then(|| words(&sketch.bytes));
    let learned = learned.map(|content| Written { name: map, text: Some(words(content)) });
    let written = [Written { name: file, text: Some(toml) }, Written { name: drawing, text: strokes }];
    Ok(written.into_iter().chain(learned).collect())
}

/// The name as a file name: letters, digits, hyphens.
fn stem(name: &str) -> Result<String, Refusal> {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let stem: String = name.chars().map(plain).collect();
    let stem = stem.trim_matches('-');
    let holds = !stem.is_empty() && name.chars().count() <= MAX_NAME && !name.contains(char::is_control);
    let words =
        || format!("name: expected 1 to {MAX_NAME} characters with a letter among them, found {name:?}");
    if holds { Ok(stem.to_owned()) } else { Err(Refusal::Malformed(words())) }
}

fn text(
    name: &str,
    (drawing, learned): (&str, Option<&str>),
    (mission, drawn): (&Mission, &Drawn),
    sketch: &machine::AcceptedSketch,
    path: &machine::Path,
) -> Result<String, Refusal> {
    let failed = |error: &dyn std::fmt::Display| Refusal::File(format!("the mission: {error}"));
    let marks = |bytes: &[u8]| serde_json::from_slice::<Marks>(bytes).map_err(|error| failed(&error));
    let (placing, now) = (marks(&path.placing)?, marks(&path.marks)?);
    let mut mission = mission.clone();
    name.clone_into(&mut mission.name);
    mission.description = "Drawn on the pad.".into();
    let kept = Kept {
        drawing,
        learned,
        size_px: sketch.size_px,
        scale: sketch.scale,
        placing: &placing,
        marks: &now,
    };
    (drawn.keep)(&mut mission, &kept).map_err(|error| failed(&error))?;
    toml::to_string(&mission).map_err(|error| failed(&error))
}

fn check_free(path: &Path, is_own: bool) -> Result<(), Refusal> {
    // A dangling link counts as taken, too.
    let is_taken = !is_own && path.symlink_metadata().is_ok();
    if is_taken { Err(Refusal::Taken(path.into())) } else { Ok(()) }
}

/// Puts a complete file in its place. A file that has appeared there since the check is not replaced either.
fn put(folder: &Path, name: &str, bytes: &[u8], own: &mut BTreeSet<String>) -> Result<(), Refusal> {
    let path = folder.join(name);
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => Refusal::Taken(path.clone()),
        _ => Refusal::File(format!("{}: {error}", path.display())),
    };
    let draft = draft::of(folder, bytes).map_err(failed)?;
    let put = if own.contains(name) { draft.persist(&path) } else { draft.persist_noclobber(&path) };
    put.map_err(|refused| failed(refused.error))?;
    own.insert(name.to_owned());
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use sketchnav_stage::drawn::Placing;

    use super::*;

    /// A navigator that leaves the mission unchanged.
    const DRAWN: Drawn = Drawn {
        blank: |_| Ok(()),
        placing: |_| Placing::Start,
        walls: |_, _| None,
        keep: |_, _| Ok(()),
        lessons: None,
    };

    fn mission() -> Mission {
        Mission::parse(
            "name = 'm'\nrobot = 'robotino'\nworld = { floor_plan = '/f.toml' }\n\
             start = { world = [1.0, 2.0], world_heading_deg = 90 }\nnavigator = { kind = 'drawn' }\n\
             [[task]]\nname = 't'\ngoal = [1, 1]\n",
        )
        .unwrap()
    }

    fn path(placing: &str, marks: &str) -> machine::Path {
        let (placing, marks) = (placing.as_bytes().to_vec(), marks.as_bytes().to_vec());
        machine::Path { body: String::new(), marks, placing, sketch_seq: 1 }
    }

    fn sketch(bytes: &str, [width_px, height_px]: [u32; 2]) -> machine::AcceptedSketch {
        machine::AcceptedSketch {
            kind: SketchType::Strokes,
            bytes: bytes.into(),
            canvas: [width_px, height_px],
            size_px: [width_px, height_px],
            scale: 1.0,
        }
    }

    const ROUTE: &str = r#"{"route":[[100,300],[100,200],[300,100]]}"#;

    /// The pad once accepted any name from a page. In a folder where it had been started with
    /// `--mission my-floor.toml`, saving "My floor" replaced that hand-written mission, and saving "package" replaced a
    /// `package.json` beside it.
    #[test]
    fn what_the_pad_has_not_written_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let in_folder = |name: &str| folder.path().join(name);
        let read = |name: &str| std::fs::read_to_string(in_folder(name)).unwrap();
        for name in ["my-floor.toml", "my-floor.part", "package.json"] {
            std::fs::write(in_folder(name), "by hand").unwrap();
        }
        std::os::unix::fs::symlink("nowhere", in_folder("away.toml")).unwrap();
        let mut own = BTreeSet::new();
        let mut save = |name: &str, bytes: &str| {
            let sketch = sketch(bytes, [9, 9]);
            write(folder.path(), name, (&mission(), &DRAWN), (&sketch, None), &path(ROUTE, ROUTE), &mut own)
        };
        for (name, in_the_way) in
            [("My floor", "my-floor.toml"), ("package", "package.json"), ("away", "away.toml")]
        {
            let refusal = save(name, "{}").unwrap_err();
            assert_eq!(refusal.status(), 409);
            let words = refusal.to_string();
            assert!(words.contains(in_the_way) && words.contains("another name"), "{words}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4, "nothing is written beside them");
        // Under another name it can be saved, any number of times.
        save("My floor 2", "first").unwrap();
        save("My floor 2", "second").unwrap();
        assert_eq!(read("my-floor-2.json"), "second");
        assert_eq!(Mission::parse(&read("my-floor-2.toml")).unwrap().name, "My floor 2");
        let mode = |name: &str| in_folder(name).metadata().unwrap().permissions().mode();
        assert_eq!(mode("my-floor-2.toml"), mode("my-floor.toml"), "others may read it as any file");
        for name in ["my-floor.toml", "my-floor.part", "package.json"] {
            assert_eq!(read(name), "by hand");
        }
    }

    #[test]
    fn a_file_that_comes_in_between_stays_too() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("late.toml"), "by hand").unwrap();
        let mut own = BTreeSet::new();
        assert_eq!(put(folder.path(), "late.toml", b"drawn", &mut own).unwrap_err().status(), 409);
        assert_eq!(std::fs::read(folder.path().join("late.toml")).unwrap(), b"by hand");
        assert!(own.is_empty() && std::fs::read_dir(folder.path()).unwrap().count() == 1, "no draft is left");
    }

    #[test]
    fn a_name_becomes_a_file_in_the_folder_and_nowhere_else() {
        assert_eq!(stem("../../etc/passwd").unwrap(), "etc-passwd");
        assert_eq!(stem("Büro 3").unwrap(), "b-ro-3");
        for wrong in ["", "…", "a\u{1b}[31m", &"x".repeat(49)] {
            assert_eq!(stem(wrong).unwrap_err().status(), 400, "{wrong:?}");
        }
    }
}
