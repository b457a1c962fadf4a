//! The tasks of a mission, as the planner keeps them.

use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::message::{Route, Text};

/// A task: one point is a goal, more are a drawn route.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Name, for people.
    pub name: Text<32>,
    /// Where to go.
    pub points: Vec<Point<Sketch>>,
    /// Time limit, seconds of simulation time.
    pub time_limit_s: f64,
}

impl Task {
    /// Whether the task is to follow a drawn route.
    pub fn is_route(&self) -> bool {
        self.points.len() > 1
    }

    /// Where the task ends; the drawing's origin for a task without points.
    pub fn end(&self) -> Point<Sketch> {
        self.points.last().copied().unwrap_or(Point::new(0.0, 0.0))
    }
}

/// The tasks of a route message, in order.
pub fn tasks(route: &Route) -> Vec<Task> {
    let task = |task| -> Task {
        let task: &sketchnav_schemas::message::RouteTask = task;
        Task { name: task.name, points: route.points(task).collect(), time_limit_s: task.time_limit_s }
    };
    route.tasks().iter().map(task).collect()
}
