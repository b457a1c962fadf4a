//! Finds out where the robot is in a learned map, in which it may be anywhere.
//!
//! The robot turns on the spot until the localizer knows a single place. If a full turn leaves several, it drives to its goal from
//! the likeliest of them, because what it sees on the way tells them apart, and looks around again. A robot that still does not know
//! after several looks is lost.

use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::ProgressChecker;
use sketchnav_motion::recovery::Recovery;
use sketchnav_schemas::codes::{TaskState, Tracking};

use super::{Driver, TaskStatus};
use crate::paths::chart::Chart;
use crate::planner::reason::Reason;

/// Time for which the localizer must know a single place, in seconds.
const SURE_S: f64 = 1.0;
/// Time between two looks around, in seconds.
const ROAM_S: f64 = 15.0;
/// Number of looks after which a robot that does not know where it is is lost.
const MOST_LOOKS: u32 = 5;
/// Time for which the localizer must be lost before the robot looks for where it is, in seconds.
const LOST_S: f64 = 2.0;

/// The state of a search for where the robot is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Finding {
    looks: u32,
    /// Time for which the localizer has known a single place, in seconds.
    sure_s: f64,
    /// Time, in seconds of the task, when the next look is due.
    look_due_s: f64,
}

impl Driver {
    /// Begins to look for where the robot is if the localizer has lost it.
    pub(super) fn find_if_lost(&mut self, now_s: f64) {
        if self.parameters.finds_itself && self.finding.is_none() && self.attempt.lost_s >= LOST_S {
            self.finding = Some(Finding { look_due_s: now_s, ..Finding::default() });
            self.attempt.recovery = None;
        }
    }

    /// Makes a robot that is looking for where it is look around in the next step, because it gets no farther. Returns false if it
    /// knows where it is.
    pub(super) fn looks_at_once(&mut self, now_s: f64) -> bool {
        let Some(finding) = &mut self.finding else { return false };
        finding.look_due_s = now_s;
        true
    }

    /// Takes a step of the search for where the robot is. Returns `None` if the robot should drive on instead, because it has found
    /// itself or because it has to see more.
    pub(super) fn find(
        &mut self,
        chart: &Chart,
        tracking: Tracking,
        now_s: f64,
        dt_s: f64,
    ) -> Option<TaskStatus> {
        let finding = self.finding.as_mut()?;
        finding.sure_s = if tracking == Tracking::Tracking { finding.sure_s + dt_s } else { 0.0 };
        if finding.looks > 0 && finding.sure_s >= SURE_S {
            self.finding = None;
            self.attempt.look_again(now_s, Some(chart));
            return None;
        }
        if self.attempt.recovery.is_none() && now_s >= finding.look_due_s {
            if finding.looks >= MOST_LOOKS {
                let looks = finding.looks;
                self.stop(dt_s);
                return Some(TaskStatus::Ended(TaskState::Lost, Reason::Ambiguous(looks)));
            }
            finding.looks += 1;
            let turn = Recovery::look_around(now_s, &chart.robot_m(), self.turn_rate_radps);
            if let Recovery::Spin { until_s, .. } = turn {
                finding.look_due_s = until_s + ROAM_S;
            }
            self.attempt.recovery = Some(turn);
        }
        // A look that has just ended must not count as a lack of progress.
        if self.attempt.recovery.is_some() {
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
            self.recover(chart, now_s, dt_s);
            return Some(TaskStatus::Driving(Reason::Finding));
        }
        None
    }
}
