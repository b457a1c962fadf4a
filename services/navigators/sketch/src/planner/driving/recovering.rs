//! Recovers a stuck robot, which backs up, turns, and looks for another way past the blockage.

use sketchnav_motion::progress::ProgressChecker;
use sketchnav_motion::recovery::{Next, Recovery};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::geometry::{Point, Sketch};

use super::{Driver, Guide, MAX_BLOCKAGES, TaskStatus};
use crate::paths::chart::Chart;
use crate::paths::cost_field::Blockage;
use crate::planner::reason::Reason;

/// Cost of a path through a blockage, per unit of length. It makes detours of a few tens of metres worthwhile.
const BLOCKAGE_WEIGHT: f64 = 30.0;
/// Radius of a blockage, in metres.
const BLOCKAGE_M: f64 = 0.6;

/// Maximum number of recoveries before the outline takes over from the filter: at the same place, and during a task.
const RECOVERIES_BEFORE_OUTLINE: [u32; 2] = [2, 4];

impl Driver {
    pub(super) fn is_stuck(&mut self, chart: &Chart, now_s: f64) -> bool {
        let robot = chart.robot_px().position();
        let cost_px = match (self.attempt.guide, &self.field) {
            (Guide::Outline, _) => self.course_cost_m() * chart.mean_scale_pxpm(),
            (Guide::Route, _) => self.route.remaining_px(),
            (_, Some(field)) => field.cost_px(robot),
            (_, None) => f64::INFINITY,
        };
        let (place, scale) = (chart.robot_m().position(), chart.mean_scale_pxpm());
        self.attempt.progress.is_stuck(
            now_s,
            place,
            cost_px,
            scale,
            self.speed_mps,
            &self.parameters.progress(),
        )
    }

    /// Begins a recovery. However, a robot that is stuck near the goal counts as having arrived, and if it has been stuck too
    /// often, the task ends as blocked.
    pub(super) fn begin_recovery(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        if self.looks_at_once(now_s) {
            return TaskStatus::Driving(Reason::Finding);
        }
        if let Some(off_m) = self.goal_within(chart, self.parameters.near_radius_m) {
            return self.arrive(Reason::NearEnough(off_m), chart, now_s, dt_s);
        }
        let place = chart.robot_m().position();
        let shut = self.shut_place(chart);
        let may_go_on = self.attempt.stuck.count(place, &self.parameters.progress());
        let [here, per_task] = RECOVERIES_BEFORE_OUTLINE;
        let is_enough = self.attempt.stuck.here > here || self.attempt.stuck.total > per_task;
        if !may_go_on || is_enough && self.can_hand_over() {
            return self.give_up(TaskState::Blocked, self.why_blocked(shut), chart, now_s, dt_s);
        }
        if self.attempt.detour || self.attempt.stuck.here > 1 {
            self.block(shut, chart);
        }
        self.attempt.recovery = Some(Recovery::begin(now_s, place));
        TaskStatus::Driving(Reason::Recovering(self.attempt.stuck.total))
    }

    fn why_blocked(&self, shut: Point<Sketch>) -> Reason {
        if self.attempt.drawn || self.attempt.guide == Guide::Route {
            Reason::Shut(shut, self.attempt.stuck.total)
        } else {
            Reason::NoDrawnWay(self.attempt.goal)
        }
    }

    /// Returns the first point of the path that is blocked according to the laser, or a point somewhat ahead if there is none.
    fn shut_place(&self, chart: &Chart) -> Point<Sketch> {
        let robot = chart.robot_px().position();
        let ahead = |p: &&Point<Sketch>| chart.distance_m(robot, **p) > 0.3;
        let near = |p: &&Point<Sketch>| chart.distance_m(robot, **p) > 0.8;
        let shut = |p: &&Point<Sketch>| {
            let place = chart.to_odom(**p);
            self.local.contains(place) && !self.local.is_free(place)
        };
        let path = self.global_path();
        let found = path.iter().filter(ahead).find(shut).or(path.iter().find(near));
        found.copied().unwrap_or(robot)
    }

    fn block(&mut self, place: Point<Sketch>, chart: &Chart) {
        if self.attempt.guide != Guide::Route && self.attempt.blocked.len() < MAX_BLOCKAGES {
            let radius_px = BLOCKAGE_M * chart.mean_scale_pxpm();
            self.attempt.blocked.push(Blockage { place, radius_px, weight: BLOCKAGE_WEIGHT });
            self.attempt.pace.go_around();
            self.solve(chart);
        }
    }

    pub(super) fn recover(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        let (robot, count) = (chart.robot_m(), self.attempt.stuck.total);
        let Some(recovery) = &mut self.attempt.recovery else { return TaskStatus::Driving(Reason::None) };
        let reason = match (self.attempt.arrival.is_looking(), self.attempt.guide) {
            (true, Guide::Outline) => Reason::Surveying,
            (true, _) => Reason::LookingAround,
            (false, _) => Reason::Recovering(count),
        };
        match recovery.step(now_s, &robot, count, self.turn_rate_radps) {
            Next::Drive(twist) => {
                self.pursuit.command(twist, &robot, &self.obstacles, dt_s);
            }
            Next::ClearAndSpin(turn) => {
                self.obstacles.clear();
                self.attempt.recovery = Some(turn);
                self.stop(dt_s);
            }
            Next::Done => {
                self.attempt.recovery = None;
                self.end_look();
                self.attempt.arrival.end_look();
                self.attempt.plan_due_s = now_s;
                self.attempt.progress = ProgressChecker::new(now_s, robot.position());
                self.stop(dt_s);
            }
        }
        TaskStatus::Driving(reason)
    }
}
