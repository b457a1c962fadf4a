//! A task as pictures show it.

use sketchnav_schemas::geometry::Point;

/// How a task ended, as far as a picture shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskMark {
    /// Reached.
    Reached,
    /// Begun, and not reached.
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
    /// Outline of the place that counts as there; empty where it is not shown.
    pub place: Vec<Point<F>>,
    /// The way driven, in order.
    pub trail: Vec<Point<F>>,
    /// Particles at the task's end; empty where they are not shown.
    pub particles: Vec<Point<F>>,
    /// How it ended.
    pub outcome: TaskMark,
}
