//! Suite `routes`: 25 drawings, each with a route that the robot is to follow (Boniardi et al. 2016, V).
//!
//! A trial succeeds if the robot reports that it has arrived, truly is no farther than the mission's limit from the intended goal,
//! and took a path that is homotopic to the drawn route with respect to what the person drew ([`Correspondence`]). The paper judges
//! the estimated path and names no limit; here the true path is judged, and the missions say 1 m.
//!
//! The start is the route's first point and direction, with the error that the person made in drawing.

use std::path::Path;
use std::sync::Arc;

use sketchnav_schemas::mission::Mission;
use sketchnav_sim::{SimError, mission_file};
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::{DrawnMap, Options};

use crate::error::{EvalError, read};
use crate::experiments::suite::{Folders, Published, Suite};
use crate::experiments::trial::{Sheet, Trial};
use crate::judge::anchors::{Anchors, AnchorsError};
use crate::judge::homotopy::Correspondence;

const TITLE: &str = "25 drawings with drawn routes, landscape and portrait, in two floors of panels; reached: within 1 m of the goal by a way homotopic to the route.";
const NOTICE: &str =
    "paper: Boniardi et al. 2016; each of its 25 drawings is of another person and was driven once.";
/// Repetitions per drawing, by default.
const REPETITIONS: u32 = 4;

/// Loads the suite.
///
/// # Errors
/// [`EvalError`] with the file that is missing or not as expected.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let folder = folders.project.join("sim/missions/routes");
    let path = folder.join("anchors.toml");
    let text = String::from_utf8_lossy(&read(&path)?).into_owned();
    let anchors = Anchors::parse(&text).map_err(|cause| in_file(&path, cause))?;
    let trials = anchors.drawings().map(|name| trial(&folder, &anchors, name)).collect::<Result<_, _>>()?;
    let (title, notices) = (TITLE.into(), vec![NOTICE.into()]);
    let paper = vec![Published { name: "paper".into(), reached: 17, attempts: 25 }];
    Ok(Suite { paper, title, notices, trials, repetitions: REPETITIONS, ..Suite::default() })
}

fn trial(folder: &Path, anchors: &Anchors, name: &str) -> Result<Trial, EvalError> {
    let path = folder.join(format!("{name}.toml"));
    let (mission, robot) = mission_file::load(&path)?;
    let options = Options::of_mission(&mission, 1)?;
    let sketch = SketchMission::of(&mission).map_err(SimError::from)?;
    let paper = sketchnav_sketch::reading::read(&read(Path::new(&sketch.drawing))?, name, &options)?;
    let correspondence = join(anchors, (name, &path), &mission, &paper)?;
    Ok(Trial {
        sheet: Some(Sheet {
            start_error: None,
            correspondence: Some(Arc::new(correspondence)),
            ..Sheet::new(Arc::new(paper))
        }),
        ..Trial::new(name.to_owned(), name.to_owned(), mission, robot)
    })
}

/// Joins the drawing of a mission file to its floor.
fn join(
    anchors: &Anchors,
    (name, file): (&str, &Path),
    mission: &Mission,
    paper: &DrawnMap,
) -> Result<Correspondence, EvalError> {
    let plan = mission.world.floor_plan.as_deref().map(Path::new).and_then(Path::file_name);
    let plan = plan.unwrap_or_default().to_string_lossy();
    let floor = plan.split('.').next().unwrap_or_default();
    let places = anchors.of(name, floor, |at| paper.from_image(at)).map_err(|cause| in_file(file, cause))?;
    let torn = |cause| EvalError::Correspondence { path: file.to_path_buf(), cause };
    Correspondence::new(&places).map_err(torn)
}

fn in_file(path: &Path, cause: AnchorsError) -> EvalError {
    EvalError::Anchors { path: path.to_path_buf(), cause }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use sketchnav_schemas::geometry::{Point, World};

    use super::*;

    /// Loaded only once, since 25 drawings are read.
    static SHIPPED: LazyLock<Suite> = LazyLock::new(|| suite(&Folders::of_checkout()).unwrap());

    /// Each drawing joins its floor, and its route ends approximately where the person meant.
    #[test]
    fn every_route_leads_from_the_robot_to_the_goal_that_was_meant() {
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

    /// A route is homotopic to itself, carried to the floor; if driven back to where it began, it is not.
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

    #[test]
    fn about_half_of_the_canvases_are_upright() {
        let papers = SHIPPED.trials.iter().map(|trial| &trial.sheet.as_ref().unwrap().paper);
        let upright = papers.filter(|paper| paper.height_px > paper.width_px).count();
        assert_eq!(upright, 12);
    }
}
