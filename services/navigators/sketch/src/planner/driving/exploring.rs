//! Drives by the outline of what was seen. The explorer sets courses through its map, and the local planner follows them around the
//! obstacles that the laser sees.

use std::f64::consts::TAU;

use crate::messages::{Correspondence, Question};
use crate::paths::chart::Chart;
use sketchnav_mapping::Map;
use sketchnav_motion::progress::{ProgressChecker, StuckCounter};
use sketchnav_motion::recovery::Recovery;
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::geometry::{Odom, Point, Pose};
use sketchnav_schemas::message::Here;

use super::way::{LENGTH_SHARE, farthest_within, is_in_reach, length};
use super::{Driver, Guide, TaskStatus};
use crate::planner::explorer::{Advice, Explorer};
use crate::planner::pace::Pace;
use crate::planner::reason::Reason;

/// Turn of a look around in addition to the angle that the laser does not cover, in radians.
const LOOK_MORE_RAD: f64 = 0.3;

/// Converts between the map and the odometry frame, which are joined at the robot's current pose.
#[derive(Debug, Clone, Copy)]
struct Join {
    map: Pose<Map>,
    odom: Pose<Odom>,
}

impl Join {
    fn to_odom(self, place: Point<Map>) -> Point<Odom> {
        self.odom.compose(&self.map.motion_to(&Pose::new(place.x, place.y, 0.0))).position()
    }

    fn to_map(self, place: Point<Odom>) -> Point<Map> {
        self.map.compose(&self.odom.motion_to(&Pose::new(place.x, place.y, 0.0))).position()
    }
}

impl Driver {
    /// Switches to the outline on an open floor, and to the filter among rooms, once the current recovery behaviour or look has
    /// ended.
    pub(super) fn go_by_the_floor(&mut self, chart: &Chart, now_s: f64) {
        let Some(explorer) = self.explorer.as_ref().filter(|_| self.attempt.recovery.is_none()) else {
            return;
        };
        self.attempt.guide = match (self.attempt.guide, explorer.is_in_charge()) {
            (Guide::Goal, true) => Guide::Outline,
            (Guide::Outline, false) => Guide::Goal,
            _ => return,
        };
        let is_estimated = explorer.is_estimated();
        (self.attempt.plan_due_s, self.attempt.pace) = (now_s, Pace::new(now_s));
        self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
        if is_estimated && self.attempt.guide == Guide::Goal {
            self.attempt.look_again(now_s, Some(chart));
            self.set_off(chart);
        }
    }

    /// Returns true if the outline can take over a task in which the filter fails.
    pub(super) fn can_hand_over(&self) -> bool {
        let is_by_filter = self.attempt.guide == Guide::Goal && self.finding.is_none();
        is_by_filter && self.explorer.as_ref().is_some_and(Explorer::sees_rooms)
    }

    /// Ends a task in which the filter has failed, or hands it over to the outline, which uses the map of the whole drive and does
    /// not depend on the estimate.
    pub(super) fn give_up(
        &mut self,
        state: TaskState,
        reason: Reason,
        chart: &Chart,
        now_s: f64,
        dt_s: f64,
    ) -> TaskStatus {
        self.stop(dt_s);
        let can_hand_over = self.can_hand_over();
        let Some(explorer) = self.explorer.as_mut().filter(|_| can_hand_over) else {
            return TaskStatus::Ended(state, reason);
        };
        explorer.take_over();
        self.attempt.look_again(now_s, Some(chart));
        self.attempt.stuck = StuckCounter::default();
        TaskStatus::Driving(Reason::HandedOver)
    }

    /// Follows the explorer's advice for one step.
    pub(super) fn explore(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        if self.attempt.recovery.is_some() {
            return self.recover(chart, now_s, dt_s);
        }
        let left_s = self.attempt.limit_s - now_s;
        let Some(explorer) = &mut self.explorer else { return TaskStatus::Driving(Reason::None) };
        let (before, aimed) = (explorer.course_end(), (explorer.aim(), explorer.looks()));
        match explorer.step(left_s) {
            Advice::Arrived(evidence) => {
                self.stop(dt_s);
                return TaskStatus::Ended(TaskState::Reached, Reason::Matched(evidence));
            }
            Advice::Alike(margin) => {
                self.stop(dt_s);
                return TaskStatus::Ended(TaskState::Lost, Reason::Alike(margin));
            }
            Advice::Look => return self.look(chart, now_s, dt_s),
            Advice::Ask => {
                let (count, margin) = explorer.asks().unwrap_or_default();
                self.stop(dt_s);
                return TaskStatus::Asks(Reason::Asks(count, margin));
            }
            Advice::Drive => {}
        }
        let Some(aim) = explorer.aim() else {
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
            self.stop(dt_s);
            return TaskStatus::Driving(Reason::Comparing);
        };
        if explorer.course_end() != before {
            self.attempt.plan_due_s = now_s;
        }
        // Moving back and forth between two places on purpose does not mean that the robot is stuck.
        if (explorer.aim(), explorer.looks()) != aimed {
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
        }
        self.plan_when_due(chart, now_s);
        if self.is_stuck(chart, now_s) {
            return self.give_way(chart, now_s, dt_s);
        }
        self.pursuit.follow(
            &self.local_path,
            &chart.robot_m(),
            &self.obstacles,
            self.parameters.speed_share,
            dt_s,
        );
        TaskStatus::Driving(Reason::Exploring(aim))
    }

    fn look(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        self.attempt.arrival.begin_look();
        let left_rad = (TAU - self.field_of_view_rad).max(0.0) + LOOK_MORE_RAD;
        let until_s = now_s + 2.0 * left_rad / self.turn_rate_radps + 2.0;
        self.attempt.recovery = Some(Recovery::Spin { left_rad, yaw_rad: chart.robot_m().yaw_rad, until_s });
        TaskStatus::Driving(Reason::Surveying)
    }

    /// Records that a recovery behaviour has ended. If it was a look around for the explorer, the explorer evaluates it. Looks
    /// because of a doubtful arrival by the filter do not concern the explorer.
    pub(super) fn end_look(&mut self) {
        let is_explorers = self.attempt.guide == Guide::Outline && self.attempt.arrival.is_looking();
        if let Some(explorer) = self.explorer.as_mut().filter(|_| is_explorers) {
            explorer.end_look();
        }
    }

    /// Makes a stuck robot back up and, from the second time at the same place, choose another course.
    fn give_way(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        let place = chart.robot_m().position();
        if !self.attempt.stuck.count(place, &self.parameters.progress()) {
            let total = self.attempt.stuck.total;
            let is_placed = self.explorer.as_ref().is_none_or(Explorer::is_placed);
            let place = is_placed.then(|| chart.robot_px().position());
            return TaskStatus::Ended(
                TaskState::Blocked,
                place.map_or(Reason::Stuck(total), |place| Reason::Shut(place, total)),
            );
        }
        if let Some(explorer) = self.explorer.as_mut().filter(|_| self.attempt.stuck.here > 1) {
            explorer.give_way();
        }
        self.attempt.recovery = Some(Recovery::begin(now_s, place));
        TaskStatus::Driving(Reason::Recovering(self.attempt.stuck.total))
    }

    /// Writes a question to a person, with the positions in the drawing at which the robot may be.
    pub fn write_question(&self, out: &mut Question) {
        if let Some(explorer) = &self.explorer {
            explorer.write_question(out);
        }
    }

    /// Continues without help, since nobody has answered. `now_s` is the time since the beginning of the task.
    pub fn go_on_alone(&mut self, now_s: f64) {
        self.attempt.look_again(now_s, self.chart.as_ref());
        if let Some(explorer) = &mut self.explorer {
            explorer.believe();
        }
    }

    /// Processes a person's report of where the robot is. `now_s` is the time since the beginning of the task.
    pub fn tell(&mut self, here: &Here, now_s: f64) {
        self.attempt.look_again(now_s, self.chart.as_ref());
        self.finding = None;
        if let Some(explorer) = &mut self.explorer {
            explorer.tell(here);
        }
    }

    /// Returns true if there is a new correspondence to send.
    pub fn has_news(&mut self) -> bool {
        self.explorer.as_mut().is_some_and(Explorer::has_news)
    }

    /// Writes the correspondence between drawing and map, except for the header.
    pub fn write_correspondence(&self, out: &mut Correspondence) {
        if let Some(explorer) = &self.explorer {
            explorer.write(out);
        }
    }

    /// Returns the cost of the rest of the course, in metres.
    pub(super) fn course_cost_m(&self) -> f64 {
        let of = |explorer: &Explorer| explorer.cost_m(explorer.robot().position());
        self.explorer.as_ref().map_or(f64::INFINITY, of)
    }

    /// Plans a path to the farthest reachable waypoint of the course in the local window, or else to the reachable point with the
    /// least remaining cost.
    pub(super) fn plan_on_course(&mut self, chart: &Chart) {
        let Some(explorer) = &self.explorer else { return };
        let join = Join { map: explorer.robot(), odom: chart.robot_m() };
        explorer.descend(&mut self.map_path);
        self.course_path.clear();
        self.course_path.extend(self.map_path.iter().map(|&place| join.to_odom(place)));
        self.global_path.clear();
        // Where the course leads in the drawing is only known once the robot has been placed in it.
        let room = if explorer.is_placed() { self.global_path.capacity() } else { 0 };
        self.global_path.extend(self.course_path.iter().take(room).map(|&place| chart.to_sketch(place)));
        let robot = chart.robot_m().position();
        let path = &self.course_path;
        self.attempt.remaining_m = length(path);
        let window_m = self.parameters.window_radius_m;
        let index = farthest_within(path, window_m, |place| self.local.contains(place));
        self.local.search(robot, path.get(index).copied());
        let reached = |i: &usize| is_in_reach(&self.local, path[*i], length(&path[..=*i]));
        let gets_on = |i: &usize| path[*i].distance(&robot) > super::way::LEAST_STEP_M;
        let all = std::iter::once(index).chain((0..index).rev().take_while(gets_on));
        let found = all.into_iter().find(reached);
        let rest_m = |place| explorer.cost_m(join.to_map(place));
        self.attempt.detour = found != Some(index);
        let end = found.map(|i| path[i]).or_else(|| self.local.best(LENGTH_SHARE, rest_m)).unwrap_or(robot);
        self.attempt.target_px = chart.to_sketch(end);
        self.local.path(end, &mut self.local_path);
    }
}
