//! Why a robot failed at a task in a learned map.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::outline::distance;
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::mission::Task;
use sketchnav_sketch::messages::PoseEstimate;

use super::series::{FOUND_WITHIN_M, Lesson};
use crate::experiments::run::Driven;
use crate::judge;

/// Minimum difference between distances in the map and in the true world, in metres, for the map to count as drifted.
const DRIFT_M: f64 = 1.0;

/// Why a robot failed: the first of these causes that applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The goal is elsewhere in the map, because the first drive arrived at the wrong place.
    WrongArrival,
    /// The goal is elsewhere in the map, according to the correspondence with the drawing. The first drive did not arrive.
    WrongCorrespondence,
    /// The goal's distance from where the task began differs by more than 1 m between map and world.
    Drift,
    /// The robot was certain of a wrong pose.
    WrongPlace,
    /// The robot was uncertain of its pose.
    Unsure,
    /// The robot's estimate was right.
    Driving,
}

impl Cause {
    /// All causes, in the order in which they are considered.
    pub const ALL: [Self; 6] = [
        Self::WrongArrival,
        Self::WrongCorrespondence,
        Self::Drift,
        Self::WrongPlace,
        Self::Unsure,
        Self::Driving,
    ];

    /// Returns the words for the cause in tables.
    pub const fn words(self) -> &'static str {
        match self {
            Self::WrongArrival => "first drive: wrong arrival",
            Self::WrongCorrespondence => "first drive: wrong correspondence",
            Self::Drift => "drifted map",
            Self::WrongPlace => "sure of a wrong place",
            Self::Unsure => "unsure of its place",
            Self::Driving => "driving",
        }
    }
}

impl Lesson {
    /// Returns why the robot failed at a task of this drive, whose number is `index`, or `None` if the task never began.
    pub(super) fn cause(&self, driven: &Driven, task: &Task, index: usize) -> Option<Cause> {
        let goal = *self.goals.get(&task.name)?;
        if !task.there.contains(goal[0], goal[1]) {
            let has_arrived = self.learned.goals.iter().any(|goal| goal.task == task.name && goal.reached);
            return Some(if has_arrived { Cause::WrongArrival } else { Cause::WrongCorrespondence });
        }
        let span = (*judge::spans(driven.run.mission.task.len(), &driven.log.status).get(index)?)?;
        let begun = span.of(&driven.log.truth).first()?.pose().position();
        let begun = [begun.x, begun.y];
        let in_map = distance(self.in_map(begun), self.in_map(goal));
        if (in_map - distance(begun, goal)).abs() > DRIFT_M {
            return Some(Cause::Drift);
        }
        let last: &PoseEstimate = span.of(&driven.log.estimates).last()?;
        let is_sure = Tracking::from_code(last.tracking) == Some(Tracking::Tracking);
        let is_right = self.off_m(last, span.of(&driven.log.truth)) <= FOUND_WITHIN_M;
        Some(match (is_sure, is_right) {
            (true, true) => Cause::Driving,
            (true, false) => Cause::WrongPlace,
            (false, _) => Cause::Unsure,
        })
    }
}
