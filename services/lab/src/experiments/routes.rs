//! The `routes` suite consists of 25 drawings, each with a route for the robot to follow (Boniardi et al.
//! 2016, V).
//!
//! A trial succeeds if the robot reports that it has arrived, is in fact within the mission's limit of the intended goal, and took
//! a path that is homotopic to the drawn route with respect to what the person drew ([`crate::judge::homotopy`]). The paper judges
//! pose and path on the sketch, without giving a limit. The missions here use 1 m, and both judgements are counted.
//!
//! The robot's start is the first point and direction of the route, including the person's drawing error.
//!
//! As in the paper, drawings are grouped by the orientation of the canvas (V-A: portrait succeeds more often) and by the
//! number of obstacles drawn (V-B: success is "independent of the amount of clutter drawn in the sketch").

use std::path::Path;
use std::sync::Arc;

use sketchnav_sim::{SimError, mission_file};
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::Options;

use crate::error::{EvalError, read};
use crate::experiments::joined;
use crate::experiments::suite::{Folders, Group, Published, Suite};
use crate::experiments::trial::{Sheet, Trial};
use crate::judge::anchors::Anchors;

const TITLE: &str = "25 drawings with drawn routes, landscape and portrait, in two floors of panels; reached: within 1 m of the goal, by a path homotopic to the route.";
const NOTICE: &str =
    "paper: Boniardi et al. 2016; each of its 25 drawings is by a different person and was driven once.";
/// Default number of repetitions for each drawing.
const REPETITIONS: u32 = 4;
/// Free-standing obstacles on the two floors that people may draw, five on each floor.
const OBSTACLES: [&str; 10] =
    ["crate", "table", "drum", "shelf", "wedge", "pallet", "cabinet", "barrel", "bench", "plant"];
/// Number of these obstacles on each floor.
const OF_A_FLOOR: usize = 5;

/// Loads the suite.
///
/// # Errors
/// [`EvalError`] if a file is missing or malformed.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let folder = folders.project.join("sim/missions/routes");
    let anchors = joined::anchors(&folder)?;
    let trials =
        anchors.drawings().map(|name| trial(&folder, &anchors, name)).collect::<Result<Vec<_>, _>>()?;
    let groups = groups(&trials, &anchors);
    let (title, notices) = (TITLE.into(), vec![NOTICE.into()]);
    let paper = vec![Published { name: "paper".into(), reached: 17, attempts: 25 }];
    Ok(Suite { paper, title, notices, trials, groups, repetitions: REPETITIONS, ..Suite::default() })
}

/// Groups trials by the orientation of the canvas and by the number of obstacles drawn.
fn groups(trials: &[Trial], anchors: &Anchors) -> Vec<Group> {
    let is_upright = |trial: &Trial| {
        trial.sheet.as_ref().is_some_and(|sheet| sheet.paper.height_px > sheet.paper.width_px)
    };
    let drawn = |trial: &Trial| OBSTACLES.iter().filter(|name| anchors.has(&trial.drawing, name)).count();
    let group = |name: &str, belongs: &dyn Fn(&Trial) -> bool| {
        let lines = trials.iter().filter(|trial| belongs(trial)).map(|trial| trial.drawing.clone());
        Group { name: name.to_owned(), lines: lines.collect() }
    };
    vec![
        group("portrait", &is_upright),
        group("landscape", &|trial| !is_upright(trial)),
        group("all obstacles drawn", &|trial| drawn(trial) == OF_A_FLOOR),
        group("some obstacles drawn", &|trial| (1..OF_A_FLOOR).contains(&drawn(trial))),
        group("no obstacle drawn", &|trial| drawn(trial) == 0),
    ]
}

fn trial(folder: &Path, anchors: &Anchors, name: &str) -> Result<Trial, EvalError> {
    let path = folder.join(format!("{name}.toml"));
    let (mission, robot) = mission_file::load(&path)?;
    let options = Options::of_mission(&mission, 1)?;
    let sketch = SketchMission::of(&mission).map_err(SimError::from)?;
    let paper = sketchnav_sketch::reading::read(&read(Path::new(&sketch.drawing))?, name, &options)?;
    let correspondence = joined::join(anchors, &path, &mission, &paper)?;
    Ok(Trial {
        sheet: Some(Sheet {
            start_error: None,
            correspondence: Some(Arc::new(correspondence)),
            ..Sheet::new(Arc::new(paper))
        }),
        cluster: Some(name.to_owned()),
        ..Trial::new(name.to_owned(), name.to_owned(), mission, robot)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use sketchnav_schemas::geometry::{Point, World};

    use super::*;

    /// Loaded only once, because the suite has 25 drawings to read.
    static SHIPPED: LazyLock<Suite> = LazyLock::new(|| suite(&Folders::of_checkout()).unwrap());

    /// Each drawing must have a correspondence with its floor, and its route must end close to the goal that the person meant.
    #[test]
    fn every_route_leads_from_the_robot_to_its_goal() {
        assert_eq!((SHIPPED.trials.len(), SHIPPED.drawings().len()), (25, 25));
        for Trial { name, mission, sheet, .. } in &SHIPPED.trials {
            let Sheet { paper, correspondence, .. } = sheet.as_ref().unwrap();
            let correspondence = correspondence.as_ref().unwrap();
            let sketch = SketchMission::of(mission).unwrap();
            let route = sketch.tasks[0].aim.route().unwrap();
            let on_floor = |at: &[f64; 2]| correspondence.to_floor(paper.from_image(*at)).unwrap();
            let (first, last) = (on_floor(&route[0]), on_floor(&route[route.len() - 1]));
            let off = |place: Point<World>, at: [f64; 2]| place.distance(&Point::new(at[0], at[1]));
            let goal = mission.task[0].there.middle();
            assert!(off(first, mission.start.world) < 0.8, "{name}: begins at {first:?}");
            assert!(off(last, goal) < 0.5, "{name}: ends at {last:?}");
            assert_eq!(mission.task[0].there.radius_m, Some(1.0), "{name}");
        }
    }

    /// Each route, mapped to the floor, is homotopic to itself. If it is driven back to its start as well, it no longer is.
    #[test]
    fn the_routes_themselves_would_succeed() {
        for Trial { name, mission, sheet, .. } in &SHIPPED.trials {
            let Sheet { paper, correspondence, .. } = sheet.as_ref().unwrap();
            let correspondence = correspondence.as_ref().unwrap();
            let sketch = SketchMission::of(mission).unwrap();
            let route: Vec<_> = sketch.tasks[0].aim.points().iter().map(|&at| paper.from_image(at)).collect();
            let way: Vec<_> = route.iter().map(|&place| correspondence.to_floor(place).unwrap()).collect();
            assert!(correspondence.is_homotopic(&way, &route), "{name}");
        }
    }

    /// The numbers were counted by hand in the file of anchors and in the drawings.
    #[test]
    fn the_drawings_are_grouped_by_their_canvas_and_by_what_is_drawn() {
        let sizes: Vec<_> =
            SHIPPED.groups.iter().map(|group| (group.name.as_str(), group.lines.len())).collect();
        let expected = [
            ("portrait", 12),
            ("landscape", 13),
            ("all obstacles drawn", 16),
            ("some obstacles drawn", 7),
            ("no obstacle drawn", 2),
        ];
        assert_eq!(sizes, expected);
        assert_eq!(SHIPPED.groups[4].lines, ["court-03", "screens-03"]);
    }
}
