//! The tasks of a mission in a drawing.

use sketchnav_motion::agenda::TaskInfo;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::message::{NamedPlace, Text};

use crate::messages::{Route, RouteTask};

/// Time limit for a task from a person, in seconds of simulation time. It is generous because the person is watching and can abort
/// the task.
pub(crate) const PERSON_TIME_LIMIT_S: f64 = 1800.0;

/// A task, which is a goal if it has a single point and a drawn route if it has more.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Human-readable name.
    pub name: String,
    /// The goal, or the points of the route.
    pub points: Vec<Point<Sketch>>,
    /// Simulation time after which the task has failed, in seconds.
    pub time_limit_s: f64,
}

impl Task {
    /// Returns true if the task is to follow a drawn route.
    pub fn is_route(&self) -> bool {
        self.points.len() > 1
    }

    /// Returns the tasks of a route message, in order.
    pub fn of_route(route: &Route) -> Vec<Self> {
        let task = |task: &RouteTask| Self {
            name: task.name.as_str().to_owned(),
            points: route.points(task).collect(),
            time_limit_s: task.time_limit_s,
        };
        route.tasks().iter().map(task).collect()
    }

    /// Returns the end position of the task, or the drawing's origin if the task has no points.
    pub fn end(&self) -> Point<Sketch> {
        self.points.last().copied().unwrap_or(Point::new(0.0, 0.0))
    }
}

impl From<&NamedPlace> for Task {
    fn from(place: &NamedPlace) -> Self {
        Self {
            name: place.name.as_str().to_owned(),
            points: vec![place.at],
            time_limit_s: PERSON_TIME_LIMIT_S,
        }
    }
}

impl From<&Task> for TaskInfo {
    fn from(task: &Task) -> Self {
        Self { name: Text::new(&task.name), time_limit_s: task.time_limit_s }
    }
}

/// Fills a route message. Unused entries are set to zero.
///
/// Tasks and points beyond the capacity of the message are left out.
pub fn fill_route(tasks: &[Task], route: &mut Route) {
    let nothing = RouteTask { name: Text::default(), first_point: 0, point_count: 0, time_limit_s: 0.0 };
    route.tasks.fill(nothing);
    route.points_px.fill([0.0; 2]);
    let mut first_point = 0;
    for (slot, task) in route.tasks.iter_mut().zip(tasks) {
        let point_count = task.points.len() as u32;
        let name = Text::new(&task.name);
        *slot = RouteTask { name, first_point, point_count, time_limit_s: task.time_limit_s };
        first_point += point_count;
    }
    let points = tasks.iter().flat_map(|task| &task.points);
    for (place, point) in route.points_px.iter_mut().zip(points) {
        *place = [point.x, point.y];
    }
    route.task_count = tasks.len().min(route.tasks.len()) as u32;
    route.point_count = first_point.min(route.points_px.len() as u32);
}
