//! Localizes a robot in a learned map, in which it may be anywhere.
//!
//! The robot turns on the spot until only one place remains plausible to the localizer. If several are left after a full turn, the
//! robot sets off for its goal from the most probable one, so that new views can distinguish them, and looks around again. If
//! several are still left after [`MOST_LOOKS`] looks, the robot is lost.

use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::ProgressChecker;
use sketchnav_motion::recovery::Recovery;
use sketchnav_schemas::codes::{TaskState, Tracking};

use super::{Driver, TaskStatus};
use crate::paths::chart::Chart;
use crate::planner::reason::Reason;

/// Time for which a single place must have been plausible, in seconds.
const SURE_S: f64 = 1.0;
/// Time between two looks around, in seconds.
const ROAM_S: f64 = 15.0;
/// Number of looks after which a robot that is still not localized is lost.
const MOST_LOOKS: u32 = 5;
/// Time for which the localizer must be lost before the robot begins to look around, in seconds.
const LOST_S: f64 = 2.0;

/// The state of a search for the robot's pose.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Finding {
    looks: u32,
    /// Time for which a single place has been plausible, in seconds.
    sure_s: f64,
    /// Time at which the next look is due, in seconds since the beginning of the task.
    look_due_s: f64,
}

impl Driver {
    /// Begins a search for the robot's pose if the localizer is lost.
    pub(super) fn find_if_lost(&mut self, now_s: f64) {
        if self.parameters.finds_itself && self.finding.is_none() && self.attempt.lost_s >= LOST_S {
            self.finding = Some(Finding { look_due_s: now_s, ..Finding::default() });
            self.attempt.recovery = None;
        }
    }

    /// Makes a stuck robot look around in the next step if a search is under way. Returns false if there is no search.
    pub(super) fn looks_at_once(&mut self, now_s: f64) -> bool {
        let Some(finding) = &mut self.finding else { return false };
        finding.look_due_s = now_s;
        true
    }

    /// Performs a step of the search for the robot's pose. Returns `None` if the robot should drive on instead, because it is
    /// localized or because it has to see more.
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
        // The time taken by a look must not count as a lack of progress.
        if self.attempt.recovery.is_some() {
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
            self.recover(chart, now_s, dt_s);
            return Some(TaskStatus::Driving(Reason::Finding));
        }
        None
    }
}
