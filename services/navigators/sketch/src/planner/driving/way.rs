//! Plans the robot's path, periodically and whenever a new obstacle lies on it.
//!
//! The path descends the cost field, or follows the drawn route, to a target in the local window, and the local planner finds the
//! way to that target (Boniardi et al. 2015, III-C; 2016, III-A). If the drawing is wrong by a few tens of centimetres, the target
//! may be unreachable or inside an obstacle. The robot then drives to the farthest reachable waypoint before the target or, if
//! there is none, to the reachable cell with the shortest remaining distance.

use std::iter::once;

use crate::paths::chart::Chart;
use sketchnav_motion::local::LocalPlanner;
use sketchnav_schemas::geometry::{Odom, Point, Sketch};

use super::{Driver, Guide};

/// A target is out of reach if the local path to it is longer than this factor times the drawn path plus [`DETOUR_M`].
const DETOUR_FACTOR: f64 = 1.5;
/// Length, in metres, that is added to [`DETOUR_FACTOR`] times the drawn path.
const DETOUR_M: f64 = 1.5;
/// Minimum distance, in metres, of a waypoint that is worth driving to.
pub(super) const LEAST_STEP_M: f64 = 0.4;
/// Weight of the length of a local path relative to the remaining distance. It is less than 1 so that driving on is worthwhile even
/// if the remaining distance is underestimated, as it is if the estimated scale is too large.
pub(super) const LENGTH_SHARE: f64 = 0.7;
/// Weight of the straight line to the next waypoint if the waypoint is out of reach.
const STRAIGHT_WEIGHT: f64 = 2.0;
/// Minimum time between two plans, in seconds.
const SHORTEST_PERIOD_S: f64 = 0.2;
/// Number of points of the local path that are watched for new obstacles.
const WATCHED: usize = 18;

impl Driver {
    pub(super) fn plan_when_due(&mut self, chart: &Chart, now_s: f64) {
        let obstructed = now_s - self.attempt.planned_s >= SHORTEST_PERIOD_S && self.is_obstructed(chart);
        // A tolerance is needed because sums of steps are not exact.
        if now_s + 0.02 >= self.attempt.plan_due_s || obstructed {
            self.attempt.planned_s = now_s;
            self.attempt.plan_due_s = now_s + self.parameters.plan_period_s;
            self.planned = true;
            self.plan(chart);
        }
    }

    /// Returns true if a new obstacle lies on the next metre of the local path.
    fn is_obstructed(&self, chart: &Chart) -> bool {
        let robot = chart.robot_m().position();
        let next = self.local_path.iter().filter(|p| p.distance(&robot) < 1.0).take(WATCHED);
        let mut places = next.filter(|p| p.distance(&robot) > self.radius_m);
        places.any(|&p| self.obstacles.clearance_m(p, self.radius_m) < self.radius_m)
    }

    fn plan(&mut self, chart: &Chart) {
        self.local.prepare(&self.obstacles, chart.robot_m().position(), self.room);
        match self.attempt.guide {
            Guide::Route => self.plan_on_route(chart),
            Guide::Outline => self.plan_on_course(chart),
            Guide::Goal | Guide::ToRoute => self.plan_to_goal(chart),
        }
        self.attempt.pace.plan(self.attempt.remaining_m);
    }

    fn plan_to_goal(&mut self, chart: &Chart) {
        let Some(field) = &self.field else { return };
        field.descend(chart.robot_px().position(), &mut self.global_path);
        let window_px = self.parameters.window_radius_m * chart.mean_scale_pxpm();
        let inside = |p: Point<Sketch>| self.local.contains(chart.to_odom(p));
        let index = farthest_within(&self.global_path, window_px, inside);
        let scale = chart.mean_scale_pxpm();
        self.attempt.remaining_m = length(&self.global_path) / scale;
        let robot = chart.robot_m().position();
        self.local.search(robot, Some(chart.to_odom(self.global_path[index])));
        let in_reach = |&i: &usize| {
            let drawn_m = length(&self.global_path[..=i]) / scale;
            is_in_reach(&self.local, chart.to_odom(self.global_path[i]), drawn_m)
        };
        let nearest = chart.to_sketch(robot);
        let gets_on = |i: &usize| chart.distance_m(nearest, self.global_path[*i]) > LEAST_STEP_M;
        let found = once(index).chain((0..index).rev().take_while(gets_on)).find(in_reach);
        let least_scale = chart.least_scale_pxpm();
        let rest_m = |place| field.raw_cost_px(chart.to_sketch(place)) / least_scale;
        let end = found.map(|i| chart.to_odom(self.global_path[i]));
        self.attempt.target_px = self.global_path[found.unwrap_or(index)];
        self.attempt.detour = found != Some(index);
        let end = end.or_else(|| self.local.best(LENGTH_SHARE, rest_m)).unwrap_or(robot);
        self.local.path(end, &mut self.local_path);
    }

    fn plan_on_route(&mut self, chart: &Chart) {
        let (local, look_ahead_m) = (&self.local, self.parameters.route_look_ahead_m);
        let is_free = |waypoint| local.is_free(chart.to_odom(waypoint));
        let robot = chart.robot_px().position();
        let target = self.route.next(chart, look_ahead_m, is_free).unwrap_or(robot);
        self.attempt.remaining_m = self.route.remaining_px() / chart.mean_scale_pxpm();
        self.attempt.target_px = target;
        let (place, target_m) = (chart.robot_m().position(), chart.to_odom(target));
        self.local.search(place, Some(target_m));
        let in_reach = is_in_reach(&self.local, target_m, chart.distance_m(robot, target));
        let rest_m = |place: Point<Odom>| STRAIGHT_WEIGHT * place.distance(&target_m);
        let end = if in_reach { Some(target_m) } else { self.local.best(LENGTH_SHARE, rest_m) };
        self.attempt.detour = !in_reach;
        self.local.path(end.unwrap_or(place), &mut self.local_path);
    }
}

/// Returns true if the local planner found a path to `target` that is not much longer than `drawn_m`, the length of the drawn path.
pub(super) fn is_in_reach(local: &LocalPlanner, target: Point<Odom>, drawn_m: f64) -> bool {
    let most_m = DETOUR_FACTOR * drawn_m + DETOUR_M;
    local.is_free(target) && local.length_m(target).is_some_and(|length| length <= most_m)
}

/// Returns the index of the farthest waypoint of the path within the window around its first point (Boniardi et al. 2015, III-C),
/// or the first such waypoint if several are equally far. Only the part before the path first leaves the window counts, because the
/// path may re-enter it behind a wall, out of the laser's sight.
pub(super) fn farthest_within<F>(path: &[Point<F>], window: f64, inside: impl Fn(Point<F>) -> bool) -> usize
where
    Point<F>: Copy,
{
    let in_window = |p: &&Point<F>| path[0].distance(p) <= window && inside(**p);
    let mut best = (0, 0.0);
    for (index, point) in path.iter().take_while(in_window).enumerate() {
        let distance = path[0].distance(point);
        if distance > best.1 {
            best = (index, distance);
        }
    }
    best.0
}

pub(super) fn length<F>(path: &[Point<F>]) -> f64 {
    path.windows(2).map(|pair| pair[0].distance(&pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_target_is_the_farthest_waypoint_before_the_path_leaves_the_window() {
        let path = [[0.0, 0.0], [3.0, 0.0], [5.0, 0.0], [9.0, 0.0], [0.0, 6.0]]
            .map(|p| Point::<Sketch>::new(p[0], p[1]));
        assert_eq!(farthest_within(&path, 7.0, |_| true), 2);
        assert_eq!(farthest_within(&path, 20.0, |_| true), 3);
    }
}
