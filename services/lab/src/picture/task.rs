//! A task as the pictures show it.

use sketchnav_schemas::geometry::Point;

/// How a task ended, as far as pictures show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskMark {
    /// Reached.
    Reached,
    /// Begun, but not reached.
    Failed,
    /// Never begun.
    NotBegun,
}

/// A task as both pictures show it, in frame `F`.
#[derive(Debug, Clone)]
pub struct TaskPicture<F> {
    /// Name, for the legend.
    pub name: String,
    /// Where to go: one point for a goal, more for a drawn route.
    pub marks: Vec<Point<F>>,
    /// The outline of the place that counts as the goal; empty if it is not shown.
    pub place: Vec<Point<F>>,
    /// The path driven, in order.
    pub trail: Vec<Point<F>>,
    /// Particles at the task's end; empty if they are not shown.
    pub particles: Vec<Point<F>>,
    /// How it ended.
    pub outcome: TaskMark,
}
