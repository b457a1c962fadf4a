//! The true floor of a run, with the people on it, the camera's field of view, and the robot's true path.

use sketchnav_files::Files;
use sketchnav_schemas::geometry::{Base, Point, Pose, World};
use sketchnav_schemas::message::{MarkerView, People};
use sketchnav_schemas::run::RunConfig;

use super::{outcome, within};
use crate::judge::log::Log;
use crate::judge::{TaskSpan, Verdict};
use crate::picture::{self, FloorPicture, FloorShapes, TaskPicture};

/// Returns the path of each person.
fn ways(people: &[People]) -> Vec<Vec<Point<World>>> {
    let count = people.iter().map(|all| all.people().len()).max().unwrap_or_default();
    let way = |person: usize| {
        let places = people.iter().filter_map(|all| all.people().get(person));
        places.map(|walking| Point::new(walking.x_m, walking.y_m)).collect()
    };
    (0..count).map(way).collect()
}

/// Number of points in time at which the camera's field of view is shown.
const VIEWS: usize = 5;

/// Returns polygons of the camera's field of view at points in time that are spread evenly over the run.
fn views(log: &Log) -> Vec<Vec<Point<World>>> {
    let step = (log.markers.len() / VIEWS).max(1);
    let shown = log.markers.iter().step_by(step).take(VIEWS);
    shown.filter_map(|view| Some(sector(view, &log.pose_at(view.header.stamp_ns)?))).collect()
}

/// Returns the field of view between the camera's minimum and maximum range.
fn sector(view: &MarkerView, robot: &Pose<World>) -> Vec<Point<World>> {
    const STEPS: i32 = 12;
    let [x, y, yaw_rad] = [view.camera_x_m, view.camera_y_m, view.camera_yaw_rad].map(f64::from);
    let camera = robot.compose(&Pose::<Base>::new(x, y, yaw_rad));
    let half_rad = f64::from(view.half_view_rad);
    let at = |range_m: f32, k: i32| {
        let (sin, cos) = (camera.yaw_rad + half_rad * f64::from(k) / f64::from(STEPS)).sin_cos();
        Point::new(camera.x + f64::from(range_m) * cos, camera.y + f64::from(range_m) * sin)
    };
    let far = (-STEPS..=STEPS).map(|k| at(view.range_max_m, k));
    far.chain((-STEPS..=STEPS).rev().map(|k| at(view.range_min_m, k))).collect()
}

/// Draws the true floor with the true trajectory.
pub fn picture(
    run: &RunConfig,
    files: &dyn Files,
    log: &Log,
    verdict: &Verdict,
    spans: &[Option<TaskSpan>],
) -> anyhow::Result<String> {
    let description = sketchnav_sim::files::world_in(files, &run.mission.world)?;
    let point = |p: &[f64; 2]| Point::<World>::new(p[0], p[1]);
    let tasks = run.mission.task.iter().enumerate().map(|(i, task)| TaskPicture {
        name: task.name.clone(),
        marks: (!task.there.is_unknown()).then(|| point(&task.there.middle())).into_iter().collect(),
        place: picture::place_outline(&task.there),
        trail: within(&spans[i], &log.truth).iter().map(|t| t.pose().position()).collect(),
        particles: Vec::new(),
        outcome: outcome(&spans[i], &verdict.tasks[i]),
    });
    let began = log.contacts.iter().filter(|contact| contact.begins == 1);
    let contacts: Vec<_> =
        began.map(|contact| Point::new(contact.position_m[0], contact.position_m[1])).collect();
    let start = &run.mission.start;
    Ok(picture::floor(&FloorPicture {
        title: &format!(
            "{}, seed {}: the true floor, with the robot's true path",
            run.mission.name, run.seed
        ),
        shapes: &FloorShapes::of(&description),
        people: &ways(&log.people),
        views: &views(log),
        start: Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians()),
        tasks: &tasks.collect::<Vec<_>>(),
        contacts: &contacts,
    }))
}
