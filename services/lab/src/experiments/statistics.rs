//! Counts and intervals.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::statistics::wilson;

use crate::experiments::outcome::{Kind, TaskOutcome};

/// How many tasks ended in which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Tasks driven.
    pub attempts: usize,
    /// Tasks reached.
    pub reached: usize,
    /// Reported as reached by a robot that was elsewhere.
    pub wrong_arrival: usize,
    /// Reached by a path other than the drawn route's.
    pub wrong_side: usize,
    /// Ended because the robot touched something.
    pub collided: usize,
    /// Ended by a robot that reported being lost.
    pub lost: usize,
    /// Ended by a robot that reported that there is no path.
    pub blocked: usize,
    /// Out of time.
    pub timed_out: usize,
    /// Ended in another way.
    pub aborted: usize,
    /// Never moved.
    #[serde(default)]
    pub never_moved: usize,
    /// Tasks, failed or not, in which the robot touched something.
    pub with_collision: usize,
}

impl Tally {
    /// Counts outcomes.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a TaskOutcome>) -> Self {
        let mut tally = Self::default();
        outcomes.into_iter().for_each(|outcome| tally.add(outcome));
        tally
    }

    fn add(&mut self, outcome: &TaskOutcome) {
        self.attempts += 1;
        *self.slot(outcome.kind) += 1;
        self.with_collision += usize::from(outcome.collisions > 0);
    }

    fn slot(&mut self, kind: Kind) -> &mut usize {
        match kind {
            Kind::Reached => &mut self.reached,
            Kind::WrongArrival => &mut self.wrong_arrival,
            Kind::WrongSide => &mut self.wrong_side,
            Kind::Collided => &mut self.collided,
            Kind::Lost => &mut self.lost,
            Kind::Blocked => &mut self.blocked,
            Kind::TimedOut => &mut self.timed_out,
            Kind::Aborted => &mut self.aborted,
            Kind::NeverMoved => &mut self.never_moved,
        }
    }

    /// The number of tasks that ended in this way.
    pub fn count(&self, kind: Kind) -> usize {
        let mut copy = *self;
        *copy.slot(kind)
    }

    /// Share of tasks reached, from 0 to 1; `None` without attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.attempts > 0).then(|| self.reached as f64 / self.attempts as f64)
    }

    /// Whether most of the tasks were reached.
    pub fn is_mostly_reached(&self) -> bool {
        2 * self.reached > self.attempts
    }

    /// Wilson's interval of the success rate.
    pub fn interval(&self) -> [f64; 2] {
        wilson(self.reached, self.attempts)
    }

    /// Of the failed tasks, the share that ended as lost or blocked; `None` if none failed.
    pub fn share_that_knows(&self) -> Option<f64> {
        let failed = self.attempts - self.reached;
        (failed > 0).then(|| (self.lost + self.blocked) as f64 / failed as f64)
    }
}
