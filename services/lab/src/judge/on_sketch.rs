//! Judges the outcome of a task by the robot's own pose in the drawing, as Boniardi et al. do (2016, V-B). A task succeeds
//! if the robot ends near its goal and if its trajectory on the sketch is homotopic to the drawn path "with respect to the
//! topology induced by the sketch".
//!
//! Distances are measured in the local metric, as all distances in the drawing are in the paper (III-A). The paper does not give a
//! threshold. A task that the robot gave up was not reached, wherever the robot was: a robot that "lost track of its current pose"
//! failed (2015, IV).

use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_sketch::messages::PoseEstimate;
use sketchnav_sketch::paths::chart::Chart;

use super::homotopy::Correspondence;

/// Maximum distance from the goal, in metres, if the mission does not give a radius.
pub const LIMIT_M: f64 = 1.0;

/// What a task prescribes in the drawing.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Position of the goal.
    pub goal: Point<Sketch>,
    /// Maximum distance between the robot's end position and the goal, in metres.
    pub limit_m: f64,
    /// The drawn route and the correspondence between drawing and floor, or `None` if the task has only a goal.
    pub route: Option<(&'a Correspondence, &'a [Point<Sketch>])>,
    /// Direction of the walls in the drawing, in radians.
    pub wall_direction_rad: f64,
}

impl Asked<'_> {
    /// Returns true if a task that ended in `state` was reached according to the robot's estimates during the task, which must be
    /// in order.
    pub fn is_reached(&self, state: TaskState, estimates: &[PoseEstimate]) -> bool {
        let is_placed = |last: &&PoseEstimate| state == TaskState::Reached && last.is_placed();
        let Some(last) = estimates.last().filter(is_placed) else { return false };
        let end = last.pose.pose().position();
        let chart = Chart::new(last, self.wall_direction_rad);
        let is_near = chart.is_some_and(|chart| chart.distance_m(end, self.goal) < self.limit_m);
        let way = || estimates.iter().map(|estimate| estimate.pose.pose().position()).collect::<Vec<_>>();
        is_near && self.route.is_none_or(|(join, route)| join.is_homotopic_on_sketch(&way(), route))
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::Pose;
    use sketchnav_schemas::message::PosePx;

    use super::*;
    use crate::judge::homotopy::Anchor;

    /// Returns an estimate whose scale is twenty pixels per metre along the walls, which run to the right, and forty across.
    fn at(x: f64, y: f64) -> PoseEstimate {
        let pose = PosePx::new(&Pose::new(x, y, 0.0));
        PoseEstimate { pose, scale_a_pxpm: 20.0, scale_b_pxpm: 40.0, ..Zeroable::zeroed() }
    }

    fn asked<'a>(route: Option<(&'a Correspondence, &'a [Point<Sketch>])>) -> Asked<'a> {
        Asked { goal: Point::new(100.0, 100.0), limit_m: 1.0, route, wall_direction_rad: 0.0 }
    }

    /// Thirty pixels are 1.5 m along the walls and 0.75 m across.
    #[test]
    fn the_distance_to_the_goal_uses_the_local_metric() {
        let is_reached = |state, x, y| asked(None).is_reached(state, &[at(0.0, 0.0), at(x, y)]);
        assert!(is_reached(TaskState::Reached, 100.0, 130.0));
        assert!(!is_reached(TaskState::Reached, 130.0, 100.0));
        assert!(!is_reached(TaskState::Lost, 100.0, 100.0), "the robot gave up");
        assert!(!asked(None).is_reached(TaskState::Reached, &[]), "no estimate");
    }

    #[test]
    fn the_estimated_path_must_be_homotopic_to_the_route() {
        let corners = [[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0], [50.0, 60.0]];
        let anchors =
            corners.map(|[x, y]| Anchor { world: Point::new(x / 20.0, y / 20.0), drawing: Point::new(x, y) });
        let join = Correspondence::new(&anchors).unwrap();
        let below = [Point::new(10.0, 10.0), Point::new(90.0, 30.0), Point::new(100.0, 100.0)];
        let asked = asked(Some((&join, &below)));
        let end = at(100.0, 101.0);
        assert!(asked.is_reached(TaskState::Reached, &[at(12.0, 10.0), at(80.0, 20.0), end]));
        assert!(!asked.is_reached(TaskState::Reached, &[at(12.0, 10.0), at(10.0, 90.0), end]));
    }
}
