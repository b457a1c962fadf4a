//! Tasks, as they appear in pictures.

use sketchnav_schemas::geometry::Point;

/// How a task ended, as far as pictures show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskMark {
    /// The task was reached.
    Reached,
    /// The task was begun but not reached.
    Failed,
    /// The task was never begun.
    NotBegun,
}

/// A task in frame `F`, as shown by both pictures.
#[derive(Debug, Clone)]
pub struct TaskPicture<F> {
    /// Name of the task in the legend.
    pub name: String,
    /// Positions to go to: one for a goal, or several for a drawn route.
    pub marks: Vec<Point<F>>,
    /// Outline of the place that counts as the goal, or empty if it is not to be shown.
    pub place: Vec<Point<F>>,
    /// The driven path, in order.
    pub trail: Vec<Point<F>>,
    /// Particles at the end of the task, or empty if they are not to be shown.
    pub particles: Vec<Point<F>>,
    /// Outcome of the task.
    pub outcome: TaskMark,
}
