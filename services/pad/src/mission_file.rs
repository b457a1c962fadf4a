//! A mission file out of what was drawn: `sketchnav run` drives it again, without a page.
//!
//! The folder is the user's, and mostly the one in which the missions lie that they have written by hand. A file in
//! it that the pad has not written is never replaced.

use std::collections::BTreeSet;
use std::fs::Permissions;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::sketch_mission::{Aim, SketchMission, SketchTask, WallTone};
use sketchnav_sketch::reading::Marks;
use sketchnav_sketch::reading::{Settings, route_heading_rad};
use tempfile::Builder;

use crate::machine;
use crate::protocol::{Refusal, SketchType};

/// Longest name of a mission, characters.
const MAX_NAME: usize = 48;
/// Time for a task, seconds of simulation.
const TIME_LIMIT_S: f64 = 1800.0;

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    /// Its name, in the pad's folder.
    pub name: String,
    /// What it holds; null for a picture.
    pub text: Option<String>,
}

/// Writes `name.toml` and the drawing beside it into `folder`, both or neither where a file is in the way. `mission`
/// says in which world and with which robot; its paths are absolute. `own`: the names in the folder that the pad has
/// written, which may be replaced; these come to them.
///
/// # Errors
/// [`Refusal::Malformed`] for a name that is none, [`Refusal::Taken`], [`Refusal::File`].
pub fn write(
    folder: &Path,
    name: &str,
    mission: &Mission,
    sketch: &machine::AcceptedSketch,
    path: &machine::Path,
    own: &mut BTreeSet<String>,
) -> Result<Vec<Written>, Refusal> {
    let stem = stem(name)?;
    let drawing = format!("{stem}.{}", sketch.kind.extension());
    let toml = text(name, &drawing, mission, sketch, path)?;
    let file = format!("{stem}.toml");
    for name in [&file, &drawing] {
        check_free(&folder.join(name), own.contains(name))?;
    }
    put(folder, &drawing, &sketch.bytes, own)?;
    put(folder, &file, toml.as_bytes(), own)?;
    let is_text = sketch.kind == SketchType::Strokes;
    let strokes = is_text.then(|| String::from_utf8_lossy(&sketch.bytes).into_owned());
    Ok(vec![Written { name: file, text: Some(toml) }, Written { name: drawing, text: strokes }])
}

/// The name as a file's: letters, digits, hyphens.
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
    drawing: &str,
    mission: &Mission,
    sketch: &machine::AcceptedSketch,
    path: &machine::Path,
) -> Result<String, Refusal> {
    let failed = |error: &dyn std::fmt::Display| Refusal::File(format!("the mission: {error}"));
    let marks = |bytes: &[u8]| serde_json::from_slice::<Marks>(bytes).map_err(|error| failed(&error));
    let (placing, now) = (marks(&path.placing)?, marks(&path.marks)?);
    let mut mission = mission.clone();
    name.clone_into(&mut mission.name);
    mission.description = "Drawn on the pad.".into();
    let first = placing.route.as_ref().and_then(|route| route.first().copied());
    let mut drawn = SketchMission {
        method: SketchMission::of(&mission).map_err(|error| failed(&error))?.method,
        drawing: drawing.to_owned(),
        walls: WallTone::Auto,
        start: placing.start.map(|start| start.at).or(first),
        start_heading_deg: placing.start.and_then(|start| start.heading_deg),
        tasks: tasks(&now),
    };
    // A heading that is to be found along the route that placed the robot is found in these tasks only if they begin
    // with that route.
    if drawn.start_heading_deg.is_none() && placing.route != now.route {
        let settings = Settings::from_table(mission.parameters.of(Process::Sketcher));
        let settings = settings.map_err(|error| failed(&error))?;
        let route = placing.route.as_deref().unwrap_or_default();
        drawn.start_heading_deg = heading_deg(route, sketch, &settings);
    }
    // These tasks' places in the true world are not known.
    mission.task.clear();
    drawn.write_to(&mut mission);
    toml::to_string(&mission).map_err(|error| failed(&error))
}

fn tasks(marks: &Marks) -> Vec<SketchTask> {
    let task = |name: String, aim| SketchTask { name, aim, time_limit_s: TIME_LIMIT_S };
    let named = |(i, name): (usize, &String)| match name.is_empty() {
        true => format!("goal {}", i + 1),
        false => name.clone(),
    };
    let goals =
        marks.goals.iter().enumerate().map(|(i, goal)| task(named((i, &goal.name)), Aim::Goal(goal.at)));
    let route = marks.route.iter().map(|route| task("route".into(), Aim::Route(route.clone())));
    goals.chain(route).collect()
}

/// The heading that the sketcher has taken from a route, degrees counter-clockwise from "to the right".
fn heading_deg(route: &[[f64; 2]], sketch: &machine::AcceptedSketch, settings: &Settings) -> Option<f64> {
    let [width_px, height_px] = sketch.size_px.map(f64::from);
    let place = |[column, row]: &[f64; 2]| Point::new(column * sketch.scale, height_px - row * sketch.scale);
    route_heading_rad(route.iter().map(place), width_px.hypot(height_px), settings).map(f64::to_degrees)
}

fn check_free(path: &Path, is_own: bool) -> Result<(), Refusal> {
    // A link that leads nowhere is somebody's, too.
    let is_taken = !is_own && path.symlink_metadata().is_ok();
    if is_taken { Err(Refusal::Taken(path.into())) } else { Ok(()) }
}

/// Under its own name once it is whole. A file that has come there since somebody looked is not replaced either.
fn put(folder: &Path, name: &str, bytes: &[u8], own: &mut BTreeSet<String>) -> Result<(), Refusal> {
    let path = folder.join(name);
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => Refusal::Taken(path.clone()),
        _ => Refusal::File(format!("{}: {error}", path.display())),
    };
    let mut draft =
        Builder::new().permissions(Permissions::from_mode(MODE)).tempfile_in(folder).map_err(failed)?;
    draft.write_all(bytes).map_err(failed)?;
    let put = if own.contains(name) { draft.persist(&path) } else { draft.persist_noclobber(&path) };
    put.map_err(|refused| failed(refused.error))?;
    own.insert(name.to_owned());
    Ok(())
}

/// As any other new file: what the user's mask leaves of it.
const MODE: u32 = 0o666;

#[cfg(test)]
mod tests {
    use sketchnav_sketch::reading::{Intent, Options};

    use super::*;

    fn mission() -> Mission {
        Mission::parse(
            "name = 'm'\nrobot = 'robotino'\nworld = { floor_plan = '/f.toml' }\n\
             start = { world = [1.0, 2.0], world_heading_deg = 90 }\nnavigator = { kind = 'sketch', drawing = 'x' }\n\
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

    /// What is read of the mission that is written after these marks.
    fn written(placing: &str, marks: &str) -> (Mission, SketchMission) {
        let text =
            text("My room", "my-room.json", &mission(), &sketch("{}", [600, 400]), &path(placing, marks));
        read(&text.unwrap())
    }

    fn read(text: &str) -> (Mission, SketchMission) {
        let mission = Mission::parse(text).unwrap();
        let sketch = SketchMission::of(&mission).unwrap();
        (mission, sketch)
    }

    const ROUTE: &str = r#"{"route":[[100,300],[100,200],[300,100]]}"#;
    const GOALS: &str = r#"{"goals":[{"at":[5,6]},{"name":"hall","at":[7,8]}]}"#;

    #[test]
    fn a_drawn_path_is_a_mission() {
        let (mission, read) = written(ROUTE, ROUTE);
        assert_eq!((mission.name.as_str(), read.drawing.as_str()), ("My room", "my-room.json"));
        assert_eq!((read.start, read.start_heading_deg), (Some([100.0, 300.0]), None));
        assert_eq!(read.tasks[0].aim.route().unwrap().len(), 3);
        assert!(mission.task[0].there.is_unknown());
    }

    #[test]
    fn goals_after_a_path_keep_its_start() {
        let (_, read) = written(ROUTE, GOALS);
        assert_eq!((read.start, read.start_heading_deg), (Some([100.0, 300.0]), Some(90.0)));
        let names: Vec<_> = read.tasks.iter().map(|task| task.name.as_str()).collect();
        assert_eq!(names, ["goal 1", "hall"]);
    }

    /// The pad took the heading from the first point more than 50 px away. The sketcher took it from the first one farther
    /// away than 2 % of the diagonal. With a squiggle at the beginning of a route, a saved mission had another heading
    /// than the robot had.
    #[test]
    fn a_saved_mission_begins_looking_as_the_robot_did() {
        // 57 px on a large canvas, 14 px on a small one.
        for (size, squiggle, far) in [([2540, 1252], 54, 30), ([600, 400], 20, 10)] {
            let strokes = format!(
                r#"{{"canvas":[{},{}],"strokes":[{{"points":[[1,1],[9,1]]}}],"route":[[300,300],[{},300],[300,{}]]}}"#,
                size[0],
                size[1],
                300 + squiggle,
                300 - 2 * squiggle - far,
            );
            let marks = &strokes[strokes.find("\"route\"").unwrap()..];
            let text =
                text("m", "m.json", &mission(), &sketch(&strokes, size), &path(&format!("{{{marks}"), GOALS));
            let (_, saved) = read(&text.unwrap());
            let drawing =
                sketchnav_sketch::reading::read(strokes.as_bytes(), "m.json", &Options::default()).unwrap();
            let placed = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).unwrap();
            assert_eq!(saved.start_heading_deg, Some(placed.start.yaw_rad.to_degrees()), "{size:?}");
        }
    }

    /// The pad once took any name that a page gave. In a folder where it was started with `--mission my-floor.toml`,
    /// saving "My floor" replaced that hand-written mission. Saving "package" replaced a `package.json` beside it.
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
            write(folder.path(), name, &mission(), &sketch, &path(ROUTE, ROUTE), &mut own)
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
        // By another name it is saved, and by that name as often as one likes.
        save("My floor 2", "first").unwrap();
        save("My floor 2", "second").unwrap();
        assert_eq!(read("my-floor-2.json"), "second");
        assert!(Mission::parse(&read("my-floor-2.toml")).is_ok());
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
