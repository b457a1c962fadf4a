//! Suites that follow the protocol of Boniardi et al. 2015, section IV, in which the robot drives a series of tasks. Its pose is
//! set at the start of the first task and, if a task fails, again at the goal of that task. A suite consists of one mission file
//! for each drawing, and of the paper's table for comparison.
//!
//! The paper "required the executed trajectories to be topologically consistent with the sketch". If anchors give the
//! correspondence between a drawing and its floor, a task therefore counts as reached only if the path is homotopic to that in the
//! drawing. The drawings of Building 079 have no anchors. In drawing c, a wall ends too early, so the planner's path from room 2 to
//! room 3 is not homotopic to the one on the floor.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sketchnav_schemas::mission::{Mission, Start};
use sketchnav_schemas::robot::Robot;
use sketchnav_sim::SimError;
use sketchnav_sim::description::WorldDescription;
use sketchnav_sketch::mission::{Aim, SketchMission};
use sketchnav_sketch::reading::Options;

use crate::error::{EvalError, read};
use crate::experiments::ground::{Ground, departure_deg, length_m};
use crate::experiments::joined;
use crate::experiments::suite::{Datum, Folders, Leg, Suite};
use crate::experiments::trial::{Restart, Sheet, Trial, time_limit_s};
use crate::judge::anchors::Anchors;

/// The floor of [`building_079`].
const FURNISHED: Datum = Datum {
    what: "the map of Building 079 in Freiburg with its furniture",
    file: "maps/Freiburg79_scan_furnitures.yaml",
};
/// Number of times that each chain of tasks is driven.
const ATTEMPTS: u32 = 10;
/// Distance that the robot keeps from walls, in metres, in addition to its radius. Paths are measured with the same clearance.
const CLEARANCE_M: f64 = 0.075;
/// Distance along the path, in metres, of the point that the robot faces when it starts again after a failure.
const LOOK_AHEAD_M: f64 = 1.0;
/// Cell size, in metres, of the grid on which paths are searched in a world of walls and furniture.
const CELL_M: f64 = 0.1;

/// Table I: path, length in metres, and successes out of ten with drawings A to D.
const BUILDING: [(&str, f64, [u32; 4]); 9] = [
    ("0 → 1", 6.4, [10, 10, 8, 10]),
    ("1 → 2", 9.7, [10, 10, 7, 8]),
    ("2 → 3", 9.5, [9, 10, 6, 0]),
    ("3 → 9", 7.1, [9, 0, 9, 0]),
    ("9 → 4", 13.6, [6, 0, 2, 0]),
    ("4 → 5", 8.5, [8, 0, 6, 0]),
    ("5 → 8", 7.9, [7, 9, 2, 1]),
    ("8 → 6", 9.6, [10, 10, 1, 0]),
    ("6 → 7", 8.2, [10, 0, 9, 5]),
];
/// Table II: path, length in metres, and successes out of ten with drawings A and B.
const LABORATORY: [(&str, f64, [u32; 2]); 7] = [
    ("1 → 2", 3.8, [9, 8]),
    ("1 → 4", 6.7, [9, 10]),
    ("2 → 5", 5.4, [10, 9]),
    ("2 → 6", 6.0, [5, 5]),
    ("3 → 6", 4.0, [4, 5]),
    ("4 → 5", 6.3, [9, 10]),
    ("7 → 5", 6.2, [9, 10]),
];

/// Loads Table I on the real, furnished floor of Building 079, with four drawings of ours, from good to bad.
///
/// # Errors
/// [`EvalError::NoData`] if the floor is missing, or another [`EvalError`] if a file is malformed.
pub fn building_079(folders: &Folders) -> Result<Suite, EvalError> {
    let map = folders.datum(FURNISHED)?;
    let mut suite = Suite {
        title: "Table I of Boniardi et al. 2015: nine tasks in a row, ten attempts, in the furnished floor of Building 079 by four drawings of ours.".into(),
        ..table(&BUILDING)
    };
    let folder = folders.project.join("tests/freiburg");
    let missions = ["a", "b", "c", "d"].map(|drawing| (drawing, format!("building-079-{drawing}.toml")));
    add(&mut suite, &folder, &missions, (Some(&map), None))?;
    Ok(suite)
}

/// Loads Table I in the demo's building, with its four drawings, and with people who walk around.
///
/// # Errors
/// [`EvalError`] if a file is missing or malformed.
pub fn building(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: "Table I of Boniardi et al. 2015: nine tasks in a row, ten attempts, in the building that ships, where people walk.".into(),
        ..table(&BUILDING)
    };
    let missions = ["a", "b", "c", "d"].map(|drawing| (drawing, format!("building-{drawing}.toml")));
    add(&mut suite, &folders.project.join("sim/missions/building"), &missions, (None, None))?;
    Ok(suite)
}

/// Loads Table II in our laboratory, part of which both drawings show at a different scale.
///
/// # Errors
/// Any error of [`building`].
pub fn laboratory(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: "Table II of Boniardi et al. 2015: seven legs joined to a chain, ten attempts; the lower part is drawn at half the scale.".into(),
        ..table(&LABORATORY)
    };
    let folder = folders.project.join("sim/missions/laboratory");
    let missions = ["a", "b"].map(|drawing| (drawing, format!("laboratory-{drawing}.toml")));
    add(&mut suite, &folder, &missions, (None, Some(&joined::anchors(&folder)?)))?;
    Ok(suite)
}

fn table<const N: usize>(paper: &[(&str, f64, [u32; N])]) -> Suite {
    let legs = paper.iter().map(|(name, length_m, successes)| Leg {
        name: (*name).to_owned(),
        paper_length_m: *length_m,
        paper: successes.iter().map(|&reached| (reached, 10)).collect(),
        length_m: None,
    });
    Suite { repetitions: ATTEMPTS, legs: legs.collect(), ..Suite::default() }
}

fn add(
    suite: &mut Suite,
    folder: &Path,
    missions: &[(&str, String)],
    (map, anchors): (Option<&PathBuf>, Option<&Anchors>),
) -> Result<(), EvalError> {
    for (drawing, file) in missions {
        let file = folder.join(file);
        let (mut mission, robot) = open(&file, map)?;
        let world = sketchnav_sim::files::world(&mission.world)?;
        let ground = ground(&world, &mission, &robot)?;
        measure(suite, &mut mission, &ground)?;
        let mut trial = trial(drawing, mission, robot, &ground)?;
        if let (Some(anchors), Some(sheet)) = (anchors, &mut trial.sheet) {
            let join = joined::join(anchors, &file, &trial.mission, &sheet.paper)?;
            sheet.correspondence = Some(Arc::new(join));
        }
        suite.trials.push(trial);
    }
    Ok(())
}

/// Loads a mission file. If `map` is given, it replaces the map that the mission names.
fn open(path: &Path, map: Option<&PathBuf>) -> Result<(Mission, Robot), EvalError> {
    let Some(map) = map else { return Ok(sketchnav_sim::mission_file::load(path)?) };
    let text = String::from_utf8_lossy(&read(path)?).into_owned();
    let wrong = |error: SimError| error.in_file(path);
    let mut mission = Mission::parse(&text).map_err(|error| wrong(error.into()))?;
    mission.world.map = Some(map.to_string_lossy().into_owned());
    for (_, file) in mission.navigator_files_mut() {
        *file = path.with_file_name(&*file).to_string_lossy().into_owned();
    }
    let robot = sketchnav_sim::files::robot(&mission.robot).map_err(wrong)?;
    Ok((mission, robot))
}

/// Returns the positions where the robot of a mission fits.
pub(super) fn ground(
    world: &WorldDescription,
    mission: &Mission,
    robot: &Robot,
) -> Result<Ground, EvalError> {
    let clearance_m = robot.radius_m + CLEARANCE_M;
    match &mission.world.map {
        Some(map) => Ok(Ground::new(&sketchnav_sim::files::occupancy_map(Path::new(map))?, clearance_m)),
        None => Ok(Ground::of_world(world, CELL_M, clearance_m)),
    }
}

/// Measures the length of each leg on this floor, and sets its time limit accordingly.
fn measure(suite: &mut Suite, mission: &mut Mission, ground: &Ground) -> Result<(), EvalError> {
    let mut from = mission.start.world;
    for task in &mut mission.task {
        let to = task.there.middle();
        let ends = standing(ground, from).zip(standing(ground, to));
        let way = ends.and_then(|(from, to)| ground.way(from, to));
        let length = way.map(|way| length_m(&way)).ok_or_else(|| no_way(&mission.name))?;
        task.time_limit_s = time_limit_s(length);
        for leg in suite.legs.iter_mut().filter(|leg| leg.name == task.name) {
            leg.length_m = leg.length_m.or(Some(length));
        }
        from = to;
    }
    Ok(())
}

fn no_way(mission: &str) -> EvalError {
    EvalError::NoWay { mission: mission.to_owned() }
}

fn standing(ground: &Ground, at: [f64; 2]) -> Option<[f64; 2]> {
    ground.nearest(at, |_| true)
}

fn trial(drawing: &str, mission: Mission, robot: Robot, ground: &Ground) -> Result<Trial, EvalError> {
    let sketch = SketchMission::of(&mission).map_err(SimError::from)?;
    let options = Options { walls: sketch.walls, ..Options::default() };
    let file = &sketch.drawing;
    let paper = sketchnav_sketch::reading::read(&read(Path::new(file))?, file, &options)?;
    let places: Vec<_> = mission.task.iter().map(|task| task.there.middle()).collect();
    let restart = |k: usize| {
        let start = standing_start(ground, places[k], places[k + 1])?;
        let marked = match &sketch.tasks[k].aim {
            Aim::Goal(at) => Some(*at),
            Aim::Place(_) | Aim::Route(_) => None,
        };
        Some(Restart { marked, marked_heading_deg: start.world_heading_deg, start })
    };
    let restarts: Option<Vec<_>> = (0..places.len() - 1).map(restart).collect();
    Ok(Trial {
        sheet: Some(Sheet {
            restarts: restarts.ok_or_else(|| no_way(&mission.name))?,
            ..Sheet::new(Arc::new(paper))
        }),
        ..Trial::new(drawing.to_owned(), drawing.to_owned(), mission, robot)
    })
}

/// Returns a start at `from` that faces along the path to `to`. The drawings of these suites have the orientation of their
/// floors.
fn standing_start(ground: &Ground, from: [f64; 2], to: [f64; 2]) -> Option<Start> {
    let from = standing(ground, from)?;
    let way = ground.way(from, standing(ground, to)?)?;
    let heading_deg = departure_deg(&way, LOOK_AHEAD_M)?;
    Some(Start { world: from, world_heading_deg: heading_deg })
}

#[cfg(test)]
mod tests {

    use sketchnav_schemas::geometry::Point;
    use sketchnav_sketch::sketch::SketchGrid;

    use super::*;
    use crate::experiments::drawn_task::way_through;
    use crate::experiments::outcome::Kind;
    use crate::experiments::run;

    /// In each drawing, the path from mark to mark must be homotopic to the path between the corresponding places on the floor.
    #[test]
    fn paths_in_the_drawings_of_the_laboratory_match_the_floor() {
        let suite = laboratory(&Folders::of_checkout()).unwrap();
        for Trial { name, mission, robot, sheet, .. } in &suite.trials {
            let Sheet { paper, correspondence, .. } = sheet.as_ref().unwrap();
            let (width, height) = (paper.width_px as usize, paper.height_px as usize);
            let grid = SketchGrid::new(width, height, &paper.cells, paper.wall_direction_rad).unwrap();
            let world = sketchnav_sim::files::world(&mission.world).unwrap();
            let ground = ground(&world, mission, robot).unwrap();
            let sketch = SketchMission::of(mission).unwrap();
            let goals = sketch.tasks.iter().map(|task| task.aim.points()[0]);
            let marks: Vec<_> =
                sketch.start.into_iter().chain(goals).map(|at| paper.from_image(at)).collect();
            let places = mission.task.iter().map(|task| task.there.middle());
            let places: Vec<_> = std::iter::once(mission.start.world).chain(places).collect();
            let scale_pxpm = paper.diagonal_px() / 25.0;
            for (k, task) in mission.task.iter().enumerate() {
                let [from, to] = [places[k], places[k + 1]].map(|at| standing(&ground, at).unwrap());
                let true_way: Vec<_> =
                    ground.way(from, to).unwrap().iter().map(|at| Point::new(at[0], at[1])).collect();
                let drawn = way_through(&grid, marks[k], marks[k + 1], scale_pxpm);
                let join = correspondence.as_ref().unwrap();
                assert!(join.is_homotopic(&true_way, &drawn), "{name}: {}", task.name);
            }
        }
    }

    /// Returns a trial of drawing a of the laboratory with only its first two tasks, and with an exact start mark.
    fn two_tasks() -> Trial {
        let mut suite = laboratory(&Folders::of_checkout()).unwrap();
        let mut trial = suite.trials.swap_remove(0);
        trial.mission.task.truncate(2);
        let sheet = trial.sheet.as_mut().unwrap();
        sheet.restarts.truncate(1);
        sheet.start_error = None;
        trial
    }

    /// Following Boniardi et al. 2015, IV, the pose is set at the start and after a failure.
    #[test]
    fn after_a_task_that_failed_the_robot_is_put_at_its_goal() {
        let mut trial = two_tasks();
        trial.mission.task[0].time_limit_s = 0.5;
        let goal = trial.sheet.as_ref().unwrap().restarts[0].marked;
        let there = trial.mission.task[0].there.clone();
        let runs = run::drive(&trial, "beam", 3).unwrap();
        let [first, second] = &runs[..] else { panic!("{} runs", runs.len()) };
        assert_eq!((first.first_task, first.verdicts.len(), first.verdicts[0].reached), (0, 1, false));
        assert_eq!((second.first_task, second.verdicts.len()), (1, 1));
        assert_eq!(second.verdicts[0].name, trial.mission.task[1].name);
        assert_eq!(second.sketch.as_ref().unwrap().start, goal);
        let at = second.log.truth[0].pose();
        assert!(there.contains(at.x, at.y), "{at:?}");
        assert_ne!(first.run.seed, second.run.seed);
        let failed = &run::outcomes(&trial, "beam", 1, first)[0];
        assert_eq!((failed.kind, failed.on_sketch), (Kind::TimedOut, Some(false)));
    }

    #[test]
    fn after_a_task_that_was_reached_the_robot_drives_on() {
        let trial = two_tasks();
        let runs = run::drive(&trial, "beam", 3).unwrap();
        assert_eq!((runs.len(), runs[0].verdicts.len()), (1, 2));
        assert!(runs[0].verdicts[0].reached, "{:?}", runs[0].verdicts);
        // The path was consistent with the drawing, and the robot's own pose in the drawing was at the goal, too.
        let first = &run::outcomes(&trial, "beam", 1, &runs[0])[0];
        assert_eq!((first.kind, first.on_sketch), (Kind::Reached, Some(true)), "{first:?}");
        assert_eq!(
            (first.displacement_m, &first.cluster),
            (None, &None),
            "no route, and attempts by one drawing"
        );
    }
}
