//! Handles drawings made on the pad: reads their walls for the page, and saves them as missions that can be
//! driven without it.

use std::collections::BTreeMap;

use crate::learned;
use crate::mission::{Aim, SketchMission, SketchTask, WallTone};
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::StageError;
use sketchnav_stage::drawn::{Drawn, Kept, Lessons, Marks, Placing};
use sketchnav_stage::lookout::Walls;

use crate::messages::Origin;
use crate::reading::{self, Options, Settings, desk, route_heading_rad};

/// Time limit for a task, in seconds of simulation time.
const TIME_LIMIT_S: f64 = 1800.0;

/// The functions that the pad uses to show and save drawings for this navigator.
pub const DRAWN: Drawn = Drawn {
    blank,
    placing,
    walls,
    keep,
    lessons: Some(Lessons { begin: learned::begin, show: learned::show }),
};

/// Reads the walls with the sketcher's own code, so that the page shows exactly what the sketcher would read. Returns `None` if
/// the drawing cannot be read.
fn walls(run: &RunConfig, bytes: &[u8]) -> Option<Walls> {
    let options = Options::of_mission(&run.mission, run.seed).ok()?;
    let drawing = reading::read(bytes, desk::NAME, &options).ok()?;
    Some(Walls { size_px: [drawing.width_px, drawing.height_px], cells: drawing.cells })
}

fn blank(mission: &mut Mission) -> Result<(), StageError> {
    let blank = SketchMission {
        method: SketchMission::of(mission)?.method,
        drawing: desk::NAME.to_owned(),
        walls: WallTone::Auto,
        start: None,
        start_heading_deg: None,
        places: BTreeMap::new(),
        learned_file: None,
        tasks: Vec::new(),
    };
    blank.write_to(mission);
    Ok(())
}

/// Returns what places the robot in a hand drawing. If a person sends the picture of a surveyed map instead, only the sketcher
/// notices, and a start may be needed after all.
fn placing(mission: &Mission) -> Placing {
    let finds_start = |mission: SketchMission| mission.method_in(Origin::Drawn).finds_start();
    if SketchMission::of(mission).is_ok_and(finds_start) { Placing::Anywhere } else { Placing::Start }
}

fn keep(mission: &mut Mission, kept: &Kept<'_>) -> Result<(), StageError> {
    let Kept { placing, marks, .. } = kept;
    let first = placing.route.as_ref().and_then(|route| route.first().copied());
    let mut drawn = SketchMission {
        method: SketchMission::of(mission)?.method,
        drawing: kept.drawing.to_owned(),
        walls: WallTone::Auto,
        start: placing.start.map(|start| start.at).or(first),
        start_heading_deg: placing.start.and_then(|start| start.heading_deg),
        places: BTreeMap::new(),
        learned_file: kept.learned.map(str::to_owned),
        tasks: tasks(marks),
    };
    // If the heading came from the route that placed the robot, a later run can derive it again only if its tasks begin with
    // that route. Otherwise the mission has to state it.
    if drawn.start_heading_deg.is_none() && placing.route != marks.route {
        let settings = Settings::of(&mission.parameters)?;
        drawn.start_heading_deg = heading_deg(kept, &settings);
    }
    // Without this, the new tasks would inherit the old tasks' places in the true world, although their own places are unknown.
    mission.task.clear();
    drawn.write_to(mission);
    Ok(())
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

/// Returns the heading that the sketcher derived from the route that placed the robot, in degrees counter-clockwise from "to
/// the right", or `None` if that route is too short to give a heading.
fn heading_deg(kept: &Kept<'_>, settings: &Settings) -> Option<f64> {
    let [width_px, height_px] = kept.size_px.map(f64::from);
    let route = kept.placing.route.as_deref().unwrap_or_default().iter();
    let route = route.map(|[column, row]| Point::new(column * kept.scale, height_px - row * kept.scale));
    route_heading_rad(route, width_px.hypot(height_px), settings).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::Intent;

    fn mission() -> Mission {
        Mission::parse(
            "name = 'm'\nrobot = 'robotino'\nworld = { floor_plan = '/f.toml' }\n\
             start = { world = [1.0, 2.0], world_heading_deg = 90 }\nnavigator = { kind = 'sketch', drawing = 'x' }\n\
             [[task]]\nname = 't'\ngoal = [1, 1]\n",
        )
        .unwrap()
    }

    /// Writes a mission for these marks in a drawing of the given size and reads it back.
    fn written(size_px: [u32; 2], placing: &str, marks: &str) -> (Mission, SketchMission) {
        let [placing, marks] = [placing, marks].map(|marks| serde_json::from_str::<Marks>(marks).unwrap());
        let drawing = "my-room.json";
        let mut mission = mission();
        keep(
            &mut mission,
            &Kept { drawing, learned: None, size_px, scale: 1.0, placing: &placing, marks: &marks },
        )
        .unwrap();
        let mission = Mission::parse(&toml::to_string(&mission).unwrap()).unwrap();
        let sketch = SketchMission::of(&mission).unwrap();
        (mission, sketch)
    }

    const ROUTE: &str = r#"{"route":[[100,300],[100,200],[300,100]]}"#;
    const GOALS: &str = r#"{"goals":[{"at":[5,6]},{"name":"hall","at":[7,8]}]}"#;

    #[test]
    fn a_drawn_path_is_a_mission() {
        let (mission, read) = written([600, 400], ROUTE, ROUTE);
        assert_eq!(read.drawing, "my-room.json");
        assert_eq!((read.start, read.start_heading_deg), (Some([100.0, 300.0]), None));
        assert_eq!(read.tasks[0].aim.route().unwrap().len(), 3);
        assert!(mission.task[0].there.is_unknown());
    }

    #[test]
    fn only_methods_that_find_the_start_need_no_mark() {
        for (method, expected) in
            [(None, Placing::Anywhere), (Some("outline"), Placing::Anywhere), (Some("beam"), Placing::Start)]
        {
            let mut mission = mission();
            if let Some(method) = method {
                mission.navigator.given.insert("method".into(), method.into());
            }
            blank(&mut mission).unwrap();
            assert_eq!(placing(&mission), expected, "{method:?}");
        }
    }

    #[test]
    fn goals_without_a_start_are_a_mission_without_one() {
        let (_, read) = written([600, 400], GOALS, GOALS);
        assert_eq!((read.start, read.start_heading_deg, read.tasks.len()), (None, None, 2));
    }

    #[test]
    fn goals_after_a_path_keep_its_start() {
        let (_, read) = written([600, 400], ROUTE, GOALS);
        assert_eq!((read.start, read.start_heading_deg), (Some([100.0, 300.0]), Some(90.0)));
        let names: Vec<_> = read.tasks.iter().map(|task| task.name.as_str()).collect();
        assert_eq!(names, ["goal 1", "hall"]);
    }

    /// The pad used to take the heading from the first point more than 50 px away, whereas the sketcher takes it from the first
    /// point farther away than 2 % of the diagonal. If a route began with a squiggle, the saved mission had a different heading
    /// from the robot's.
    #[test]
    fn a_saved_mission_begins_looking_as_the_robot_did() {
        // The sketcher's threshold is 57 px on the large canvas and 14 px on the small one.
        for (size, squiggle, far) in [([2540, 1252], 54, 30), ([600, 400], 20, 10)] {
            let strokes = format!(
                r#"{{"canvas":[{},{}],"strokes":[{{"points":[[1,1],[9,1]]}}],"route":[[300,300],[{},300],[300,{}]]}}"#,
                size[0],
                size[1],
                300 + squiggle,
                300 - 2 * squiggle - far,
            );
            let marks = &strokes[strokes.find("\"route\"").unwrap()..];
            let (_, saved) = written(size, &format!("{{{marks}"), GOALS);
            let drawing = reading::read(strokes.as_bytes(), "m.json", &Options::default()).unwrap();
            let placed = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).unwrap();
            assert_eq!(saved.start_heading_deg, Some(placed.start.yaw_rad.to_degrees()), "{size:?}");
        }
    }
}
