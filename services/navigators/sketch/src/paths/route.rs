//! Follows a drawn route (Boniardi et al. 2016, III-A) by determining the robot's place on the route and the next waypoint.
//!
//! The route Π is stored as evenly spaced waypoints. The robot's place k(t) on the route is the waypoint at half the arc length of
//! the sub-path in the local window W(x, r_L). If the route crosses itself, the window contains several pieces of it, of which the
//! one at the last visited waypoint counts, or else the next one. The next waypoint is the first one after k(t) outside the
//! look-ahead window W(x_k, r_H), or the first free one from there.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Point, Sketch};

use super::chart::Chart;

/// Maximum number of waypoints of a route.
pub const MAX_WAYPOINTS: usize = 4096;
/// Maximum distance along the route, in window radii, between the visited part and the next piece of the
/// route that may count. This limit keeps a robot that is driven off its route from skipping a loop.
const LONGEST_JUMP: f64 = 3.0;

/// A drawn route, and the robot's progress along it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DrawnRoute {
    waypoints: Vec<Point<Sketch>>,
    spacing_px: f64,
    visited: usize,
}

impl Default for DrawnRoute {
    fn default() -> Self {
        Self { waypoints: Vec::with_capacity(MAX_WAYPOINTS), spacing_px: 1.0, visited: 0 }
    }
}

impl DrawnRoute {
    /// Begins a drawn route at its first point. The spacing of the waypoints is `spacing_px`, or larger if there would be too many
    /// of them.
    pub fn begin(&mut self, points: impl Iterator<Item = Point<Sketch>> + Clone, spacing_px: f64) {
        let length = length(points.clone());
        self.spacing_px = spacing_px.max(length / (MAX_WAYPOINTS - 2) as f64);
        self.visited = 0;
        resample(points, self.spacing_px, &mut self.waypoints);
    }

    /// Reserves memory for the longest route, after a route was restored from a checkpoint.
    pub fn reserve(&mut self) {
        self.waypoints.reserve(MAX_WAYPOINTS.saturating_sub(self.waypoints.len()));
    }

    /// Returns the remaining waypoints, from the robot's place on.
    pub fn remaining(&self) -> &[Point<Sketch>] {
        &self.waypoints[self.visited.min(self.waypoints.len())..]
    }

    /// Returns the index k(t) of the robot's place on the route.
    pub fn place(&self) -> usize {
        self.visited
    }

    /// Returns the first point of the route.
    pub fn start(&self) -> Option<Point<Sketch>> {
        self.waypoints.first().copied()
    }

    /// Returns the last point of the route.
    pub fn end(&self) -> Option<Point<Sketch>> {
        self.waypoints.last().copied()
    }

    /// Returns the remaining length of the route, in pixels.
    pub fn remaining_px(&self) -> f64 {
        self.remaining().len().saturating_sub(1) as f64 * self.spacing_px
    }

    /// Returns true if the piece of the route around the robot's place reaches the end of the route.
    pub fn is_last_piece(&self, chart: &Chart, window_m: f64) -> bool {
        let robot = chart.robot_px().position();
        self.remaining().iter().all(|&w| chart.distance_m(robot, w) < window_m)
    }

    /// Finds the robot's place on the route and marks the waypoints before it as visited.
    pub fn track(&mut self, chart: &Chart, window_m: f64) {
        if let Some((first, last)) = self.piece(chart, window_m) {
            self.visited = self.visited.max((first + last) / 2);
        }
    }

    /// Returns the connected piece of the sub-path in the window that contains the last visited waypoint or else comes next after
    /// it, as the indices of its first and last waypoints.
    fn piece(&self, chart: &Chart, window_m: f64) -> Option<(usize, usize)> {
        let robot = chart.robot_px().position();
        let inside = |k: &usize| chart.distance_m(robot, self.waypoints[*k]) < window_m;
        let jump = LONGEST_JUMP * window_m * chart.mean_scale_pxpm() / self.spacing_px;
        let end = self.waypoints.len().min(self.visited + jump as usize + 1);
        let some = (self.visited..end).find(inside)?;
        let first = (0..=some).rev().take_while(inside).last()?;
        let last = (some..self.waypoints.len()).take_while(inside).last()?;
        Some((first, last))
    }

    /// Returns the next waypoint to drive to. This is the first waypoint beyond the look-ahead window around the robot's place, or
    /// the last one of the route. If that waypoint is not free, it is the next one for which `is_free` returns true, or the blocked
    /// one if there is none.
    pub fn next(
        &self,
        chart: &Chart,
        look_ahead_m: f64,
        is_free: impl Fn(Point<Sketch>) -> bool,
    ) -> Option<Point<Sketch>> {
        let remaining = self.remaining();
        let place = *remaining.first()?;
        let outside = remaining.iter().position(|&w| chart.distance_m(place, w) >= look_ahead_m);
        let beyond = &remaining[outside.unwrap_or(remaining.len() - 1)..];
        beyond.iter().copied().find(|&w| is_free(w)).or(beyond.first().copied())
    }
}

fn length(points: impl Iterator<Item = Point<Sketch>> + Clone) -> f64 {
    points.clone().zip(points.skip(1)).map(|(a, b)| a.distance(&b)).sum()
}

/// Writes waypoints `spacing` apart along the line through `points`, including both ends of the line.
fn resample(points: impl Iterator<Item = Point<Sketch>>, spacing: f64, out: &mut Vec<Point<Sketch>>) {
    out.clear();
    let mut last: Option<Point<Sketch>> = None;
    let mut until_next = 0.0;
    for point in points {
        let from = last.unwrap_or(point);
        let length = from.distance(&point);
        while until_next <= length && out.len() < MAX_WAYPOINTS - 1 {
            let share = if length > 0.0 { until_next / length } else { 0.0 };
            out.push(Point::new(from.x + share * (point.x - from.x), from.y + share * (point.y - from.y)));
            until_next += spacing;
        }
        until_next -= length;
        last = Some(point);
    }
    out.extend(last);
}

#[cfg(test)]
mod tests {
    use crate::messages::PoseEstimate;
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::Pose;
    use sketchnav_schemas::message::PosePx;

    use super::*;

    fn chart(x: f64, y: f64) -> Chart {
        let pose = PosePx::new(&Pose::new(x, y, 0.0));
        let odometry = sketchnav_schemas::message::PoseM::new(&Pose::<Sketch>::new(0.0, 0.0, 0.0));
        let estimate =
            PoseEstimate { pose, odometry, scale_a_pxpm: 20.0, scale_b_pxpm: 20.0, ..Zeroable::zeroed() };
        Chart::new(&estimate, 0.0).unwrap()
    }

    fn route(points: &[[f64; 2]]) -> DrawnRoute {
        let mut route = DrawnRoute::default();
        route.begin(points.iter().map(|p| Point::new(p[0], p[1])), 2.0);
        route
    }

    /// A figure of eight that crosses itself at (100, 100).
    fn eight() -> DrawnRoute {
        route(&[[0.0, 100.0], [200.0, 100.0], [200.0, 200.0], [100.0, 200.0], [100.0, 0.0]])
    }

    #[test]
    fn waypoints_lie_at_even_distances() {
        let route = route(&[[0.0, 0.0], [5.0, 0.0], [5.0, 5.0]]);
        let found: Vec<_> = route.waypoints.iter().map(|w| [w.x, w.y]).collect();
        assert_eq!(
            found,
            [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [5.0, 1.0], [5.0, 3.0], [5.0, 5.0], [5.0, 5.0]]
        );
    }

    #[test]
    fn the_place_is_at_half_the_arc_length_in_the_window() {
        let mut route = eight();
        route.track(&chart(50.0, 104.0), 1.0);
        assert_eq!(route.waypoints[route.place()], Point::new(50.0, 100.0));
    }

    #[test]
    fn at_a_crossing_the_piece_that_comes_next_counts() {
        let mut route = eight();
        (0..=100).for_each(|x| route.track(&chart(f64::from(x), 100.0), 1.0));
        let first_pass = route.waypoints[route.place()];
        assert_eq!(first_pass, Point::new(100.0, 100.0));
        (100..=200).for_each(|x| route.track(&chart(f64::from(x), 100.0), 1.0));
        (100..=200).for_each(|y| route.track(&chart(200.0, f64::from(y)), 1.0));
        (0..=100).for_each(|i| route.track(&chart(200.0 - f64::from(i), 200.0), 1.0));
        (0..=100).for_each(|i| route.track(&chart(100.0, 200.0 - f64::from(i)), 1.0));
        let second_pass = route.waypoints[route.place()];
        assert!(second_pass.distance(&Point::new(100.0, 100.0)) < 2.1, "{second_pass:?}");
        assert!((route.remaining_px() - 100.0).abs() < 4.0);
    }

    #[test]
    fn a_robot_beside_a_later_piece_skips_nothing() {
        let mut route = eight();
        route.track(&chart(20.0, 100.0), 1.0);
        let before = route.place();
        route.track(&chart(100.0, 10.0), 1.0);
        assert_eq!(route.place(), before);
    }

    #[test]
    fn a_blocked_waypoint_is_passed_over() {
        let mut route = eight();
        route.track(&chart(50.0, 100.0), 1.0);
        let free = route.next(&chart(50.0, 100.0), 1.0, |_| true).unwrap();
        assert_eq!(free, Point::new(70.0, 100.0));
        let beyond = route.next(&chart(50.0, 100.0), 1.0, |w| w.x > 85.0).unwrap();
        assert_eq!(beyond, Point::new(86.0, 100.0));
    }

    #[test]
    fn the_end_of_the_route_is_its_last_target() {
        let mut route = route(&[[0.0, 0.0], [30.0, 0.0]]);
        route.track(&chart(25.0, 0.0), 1.0);
        assert_eq!(route.next(&chart(25.0, 0.0), 1.0, |_| true), route.end());
        assert!(route.is_last_piece(&chart(25.0, 0.0), 1.0));
    }
}
