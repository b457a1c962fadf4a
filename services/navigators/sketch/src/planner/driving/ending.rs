//! The end of a task, about which regions and doors are asked before it is reported.

use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::{ProgressChecker, StuckCounter};
use sketchnav_schemas::codes::TaskState;

use super::{Driver, Guide, TaskStatus};
use crate::paths::chart::Chart;
use crate::planner::certainty::{Basis, Said, Signs};
use crate::planner::explorer::{Explorer, Opinion};
use crate::planner::reason::Reason;

/// Time, in seconds, that must be left for a question.
const LEAST_S: f64 = 10.0;

/// How a task is about to end.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ending {
    /// The code of the state, with the reason, while regions and doors are being asked.
    pending: Option<(u32, Reason)>,
    /// True if they have been asked.
    is_over: bool,
}

impl Ending {
    /// Returns true if regions and doors are being asked about it.
    pub fn is_pending(&self) -> bool {
        self.pending.is_some()
    }
}

impl Driver {
    /// Asks regions and doors before a task ends.
    pub(super) fn reconsider(
        &mut self,
        status: TaskStatus,
        chart: &Chart,
        now_s: f64,
        dt_s: f64,
    ) -> TaskStatus {
        let TaskStatus::Ended(state, reason) = status else { return status };
        let is_to_goal = matches!(self.attempt.guide, Guide::Goal | Guide::Outline);
        let may = is_to_goal && !self.attempt.ending.is_over && self.attempt.limit_s - now_s > LEAST_S;
        let is_confirmed = matches!(reason, Reason::Matched(evidence) if evidence.is_confirmed);
        let explorer = self.explorer.as_mut().filter(|explorer| explorer.has_counsel());
        let Some(explorer) = explorer.filter(|_| may && !is_confirmed) else {
            return self.end(state, reason, None);
        };
        explorer.consult(state == TaskState::Reached);
        self.attempt.ending.pending = Some((state.code(), reason));
        self.attempt.guide = Guide::Outline;
        self.attempt.stuck = StuckCounter::default();
        self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
        self.stop(dt_s);
        TaskStatus::Driving(Reason::Comparing)
    }

    /// Takes a step while regions and doors are being asked, or while the robot looks where they have the goal.
    pub(super) fn consult(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        if self.attempt.recovery.is_some() {
            return self.recover(chart, now_s, dt_s);
        }
        let left_s = self.attempt.limit_s - now_s;
        let Some(explorer) = &mut self.explorer else { return self.conclude(None, dt_s) };
        let before = explorer.course_end();
        let opinion = explorer.hear_counsel(left_s);
        if explorer.course_end() != before {
            self.attempt.plan_due_s = now_s;
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
        }
        match opinion {
            Opinion::Wait => {
                self.stop(dt_s);
                TaskStatus::Driving(Reason::Comparing)
            }
            Opinion::Look => self.look(chart, now_s, dt_s),
            Opinion::Drive => match self.follow_course(chart, now_s, dt_s) {
                TaskStatus::Ended(..) => self.conclude(None, dt_s),
                status => status,
            },
            Opinion::Stand(said) => self.conclude(said, dt_s),
            Opinion::Arrived(said) => {
                self.attempt.ending = Ending { pending: None, is_over: true };
                self.stop(dt_s);
                let signs = Signs { basis: Basis::Rooms, margin: 0.0, rooms: Some(said) };
                TaskStatus::Arrived(Reason::ByRooms(said.margin), signs.probability())
            }
        }
    }

    /// Ends the task as it was about to end.
    fn conclude(&mut self, said: Option<Said>, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        self.explorer.iter_mut().for_each(Explorer::dismiss);
        let pending = self.attempt.ending.pending.take();
        self.attempt.ending.is_over = true;
        match pending.and_then(|(code, reason)| Some((TaskState::from_code(code)?, reason))) {
            Some((state, reason)) => self.end(state, reason, said),
            None => TaskStatus::Driving(Reason::Comparing),
        }
    }

    fn end(&self, state: TaskState, reason: Reason, rooms: Option<Said>) -> TaskStatus {
        let signs = match reason {
            // The weights are those of goals, not of drawn routes.
            _ if state != TaskState::Reached || self.explorer.is_none() || self.follows_route() => {
                return TaskStatus::Ended(state, reason);
            }
            Reason::Matched(evidence) if evidence.is_confirmed => return TaskStatus::Ended(state, reason),
            Reason::Matched(evidence) => {
                let margin = evidence.rival.map_or(0.0, |(margin, _)| margin);
                Signs { basis: Basis::Outline, margin, rooms }
            }
            _ => Signs { basis: Basis::Filter, margin: 0.0, rooms },
        };
        TaskStatus::Arrived(reason, signs.probability())
    }
}
