//! Counts of outcomes, and intervals for success rates.
//!
//! Wilson's interval is valid only for independent trials. Drives by the same drawing mostly have the same outcome, so if drawings
//! repeat, the interval is over drawings ([`OverDrawings`]).

mod over_drawings;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::statistics::{mean, wilson};

use crate::experiments::outcome::{Kind, TaskOutcome};
pub use over_drawings::OverDrawings;

/// Counts of tasks by kind of outcome.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Number of tasks driven.
    pub attempts: usize,
    /// Number of tasks reached.
    pub reached: usize,
    /// Number of tasks that the robot reported as reached while it was elsewhere.
    pub wrong_arrival: usize,
    /// Number of tasks reached by a path that is not consistent with the drawing.
    pub wrong_side: usize,
    /// Number of tasks that ended because the robot touched something.
    pub collided: usize,
    /// Number of tasks where the robot reported being lost.
    pub lost: usize,
    /// Number of tasks where the robot reported that there is no path.
    pub blocked: usize,
    /// Number of tasks that ran out of time.
    pub timed_out: usize,
    /// Number of tasks that ended in another way.
    pub aborted: usize,
    /// Number of tasks where the robot never moved.
    #[serde(default)]
    pub never_moved: usize,
    /// Number of tasks, failed or not, where the robot touched something.
    pub with_collision: usize,
    /// Interval of the success rate over drawings, if drawings repeat, or `None` for independent trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_drawings: Option<OverDrawings>,
    /// The same tasks as judged by the robot's own pose in the drawing, or `None` unless all of them were judged in this way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_sketch: Option<Score>,
    /// The same tasks as judged by the true final position alone, whichever path the robot took, or `None` if there are no
    /// drawings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_place: Option<Score>,
    /// Mean distance of the true path from the drawn route, in metres, over the tasks that were reached along a route.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement_m: Option<f64>,
}

/// How many tasks were reached by another judgement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Number of tasks reached.
    pub reached: usize,
    /// Interval of the success rate over drawings, like [`Tally::over_drawings`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_drawings: Option<OverDrawings>,
}

impl Score {
    /// Counts outcomes by this judgement. Returns `None` if there are none, or if one of them was not judged in this way.
    fn of(outcomes: &[&TaskOutcome], is_reached: impl Fn(&TaskOutcome) -> Option<bool>) -> Option<Self> {
        let judged = outcomes.iter().map(|outcome| Some((outcome.cluster.as_deref(), is_reached(outcome)?)));
        let judged: Vec<_> = judged.collect::<Option<_>>()?;
        let reached = judged.iter().filter(|(_, is_reached)| *is_reached).count();
        (!judged.is_empty()).then(|| Self { reached, over_drawings: OverDrawings::of(&judged) })
    }
}

impl Tally {
    /// Counts outcomes.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a TaskOutcome>) -> Self {
        let outcomes: Vec<_> = outcomes.into_iter().collect();
        let mut tally = Self::default();
        outcomes.iter().for_each(|outcome| tally.add(outcome));
        let by_truth = Score::of(&outcomes, |outcome| Some(outcome.is_success()));
        let reached = outcomes.iter().filter(|outcome| outcome.is_success());
        let displacements: Vec<_> = reached.filter_map(|outcome| outcome.displacement_m).collect();
        let is_there = |outcome: &TaskOutcome| matches!(outcome.kind, Kind::Reached | Kind::WrongSide);
        Self {
            over_drawings: by_truth.and_then(|score| score.over_drawings),
            on_sketch: Score::of(&outcomes, |outcome| outcome.on_sketch),
            by_place: Score::of(&outcomes, |outcome| outcome.on_sketch.map(|_| is_there(outcome))),
            displacement_m: (!displacements.is_empty()).then(|| mean(&displacements)),
            ..tally
        }
    }

    /// Returns the tally by another judgement, without kinds of failures.
    pub fn judged(&self, by: Score) -> Self {
        let Score { reached, over_drawings } = by;
        Self { attempts: self.attempts, reached, over_drawings, ..Self::default() }
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

    /// Returns the number of tasks with this outcome.
    pub fn count(&self, kind: Kind) -> usize {
        let mut copy = *self;
        *copy.slot(kind)
    }

    /// Returns the share of tasks reached, from 0 to 1, or `None` if there were no attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.attempts > 0).then(|| self.reached as f64 / self.attempts as f64)
    }

    /// Returns true if more than half of the tasks were reached.
    pub fn is_mostly_reached(&self) -> bool {
        2 * self.reached > self.attempts
    }

    /// Returns Wilson's interval of the success rate, which assumes independent trials.
    pub fn interval(&self) -> [f64; 2] {
        wilson(self.reached, self.attempts)
    }

    /// Formats the interval of the success rate in percent. If there are several drawings with repeated drives, the interval is
    /// over drawings, and the text gives their number. Otherwise, it is Wilson's.
    pub fn interval_words(&self) -> String {
        let words = |[low, high]: [f64; 2]| format!("{:.0} to {:.0}", 100.0 * low, 100.0 * high);
        match self.over_drawings {
            Some(OverDrawings { drawings, low, high }) if drawings > 1 => {
                format!("{} over {drawings} drawings", words([low, high]))
            }
            _ => words(self.interval()),
        }
    }

    /// Returns the share of failed tasks that ended as lost or blocked, or `None` if none failed.
    pub fn share_that_knows(&self) -> Option<f64> {
        let failed = self.attempts - self.reached;
        (failed > 0).then(|| (self.lost + self.blocked) as f64 / failed as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(cluster: &str, kind: Kind, on_sketch: Option<bool>) -> TaskOutcome {
        TaskOutcome { cluster: Some(cluster.to_owned()), on_sketch, ..TaskOutcome::sample("a#1", kind) }
    }

    /// Boniardi et al. 2016, V-B, judge the pose on the sketch. By this judgement, a wrong arrival is a success, and so is an
    /// arrival by a path that only the true floor shows to be a different one.
    #[test]
    fn the_same_drives_are_counted_by_three_judgements() {
        let driven = [
            outcome("a", Kind::Reached, Some(true)),
            outcome("a", Kind::WrongArrival, Some(true)),
            outcome("b", Kind::WrongSide, Some(false)),
            outcome("b", Kind::Lost, Some(false)),
        ];
        let tally = Tally::of(&driven);
        let (on_sketch, by_place) = (tally.on_sketch.unwrap(), tally.by_place.unwrap());
        assert_eq!((tally.reached, on_sketch.reached, by_place.reached), (1, 2, 2));
        let judged = tally.judged(on_sketch);
        assert_eq!((judged.attempts, judged.reached, judged.wrong_side), (4, 2, 0));
        assert_eq!(judged.over_drawings.map(|over| over.drawings), Some(2));
        let partly = [driven[0].clone(), outcome("b", Kind::Reached, None)];
        assert_eq!(Tally::of(&partly).on_sketch, None, "one of them was not judged in this way");
        assert_eq!(Tally::of([]).on_sketch, None);
    }

    #[test]
    fn the_displacement_is_the_mean_over_the_tasks_reached() {
        let driven = [(0.1, Kind::Reached), (0.3, Kind::Reached), (9.0, Kind::Lost)].map(|(metres, kind)| {
            TaskOutcome { displacement_m: Some(metres), ..TaskOutcome::sample("a#1", kind) }
        });
        assert_eq!(Tally::of(&driven).displacement_m, Some(0.2));
        assert_eq!(Tally::of(&driven[2..]).displacement_m, None);
    }

    /// Results that were stored before these judgements existed do not include them.
    #[test]
    fn a_tally_without_the_new_figures_can_be_read() {
        let old = r#"{"attempts": 4, "reached": 3, "wrong_arrival": 1, "wrong_side": 0, "collided": 0, "lost": 0,
            "blocked": 0, "timed_out": 0, "aborted": 0, "with_collision": 0}"#;
        let tally: Tally = serde_json::from_str(old).unwrap();
        assert_eq!((tally.on_sketch, tally.by_place, tally.over_drawings), (None, None, None));
    }
}
