//! The end of a task at a goal, about which regions and doors are asked before it is reported.

use std::task::Poll;

use sketchnav_schemas::codes::TaskState;

use super::{Driver, Guide, TaskStatus};
use crate::planner::certainty::{Basis, Said, Signs};
use crate::planner::explorer::Explorer;
use crate::planner::reason::Reason;

/// Time, in seconds, that must be left for a question.
const LEAST_S: f64 = 10.0;

impl Driver {
    /// Begins to ask regions and doors if the task ends with an arrival at a goal. A person who has confirmed it knows better, and
    /// the probability is not that of arrivals at the end of drawn routes.
    pub(super) fn doubt(&mut self, status: TaskStatus, now_s: f64, dt_s: f64) -> TaskStatus {
        let TaskStatus::Ended(TaskState::Reached, reason) = status else { return status };
        let is_to_goal = matches!(self.attempt.guide, Guide::Goal | Guide::Outline);
        let is_confirmed = matches!(reason, Reason::Matched(evidence) if evidence.is_confirmed);
        let Some(explorer) = self.explorer.as_mut().filter(|_| is_to_goal && !is_confirmed) else {
            return status;
        };
        if self.attempt.limit_s - now_s < LEAST_S || !explorer.ask_rooms() {
            return arrived(reason, None);
        }
        self.attempt.arrived = Some(reason);
        self.stop(dt_s);
        TaskStatus::Driving(Reason::Comparing)
    }

    /// Waits for what regions and doors say about an arrival.
    pub(super) fn hear_rooms(&mut self, reason: Reason, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        match self.explorer.as_mut().map_or(Poll::Ready(None), Explorer::hear_rooms) {
            Poll::Pending => TaskStatus::Driving(Reason::Comparing),
            Poll::Ready(said) => arrived(reason, said),
        }
    }
}

fn arrived(reason: Reason, rooms: Option<Said>) -> TaskStatus {
    let basis = if matches!(reason, Reason::Matched(_)) { Basis::Outline } else { Basis::Filter };
    TaskStatus::Arrived(reason, Signs { basis, rooms }.probability())
}
