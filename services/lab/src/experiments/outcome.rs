//! The outcome of a task, as one word and a few figures.

use crate::experiments::cost::Cost;
use crate::judge::TaskVerdict;
use crate::judge::states::StateDriven;
use serde::{Deserialize, Serialize};

/// How a task ended. Only [`Self::Reached`] is a success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The robot reported that it arrived, and truly had.
    Reached,
    /// It reported so, but was elsewhere.
    WrongArrival,
    /// It arrived by a path that is not consistent with the drawing: past something on another side than the drawn route, or than
    /// the way to the goal in the drawing.
    WrongSide,
    /// It touched something, and a touch ends the drive.
    Collided,
    /// It reported that it does not know where it is.
    Lost,
    /// It reported that there is no path.
    Blocked,
    /// The time ran out.
    TimedOut,
    /// The mission ended in another way.
    Aborted,
    /// It never moved, whatever it reported then: in a corridor driven by markers, no pair was in view.
    NeverMoved,
}

impl Kind {
    /// All kinds, successes first.
    pub const ALL: [Self; 9] = [
        Self::Reached,
        Self::WrongArrival,
        Self::WrongSide,
        Self::Collided,
        Self::Lost,
        Self::Blocked,
        Self::TimedOut,
        Self::Aborted,
        Self::NeverMoved,
    ];

    /// The word for it in tables.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::WrongArrival => "wrong arrival",
            Self::WrongSide => "wrong side",
            Self::Collided => "collided",
            Self::Lost => "lost",
            Self::Blocked => "blocked",
            Self::TimedOut => "timed out",
            Self::Aborted => "aborted",
            Self::NeverMoved => "never moved",
        }
    }

    /// The kind of a judged task as far as its verdict says, which is without the path that the robot took and whether a touch is a
    /// failure.
    pub fn of(verdict: &TaskVerdict) -> Self {
        match (verdict.reached, verdict.state.as_str()) {
            (true, _) => Self::Reached,
            (false, "reached") => Self::WrongArrival,
            (false, "lost") => Self::Lost,
            (false, "blocked") => Self::Blocked,
            (false, "timed out") => Self::TimedOut,
            _ => Self::Aborted,
        }
    }
}

/// One task of one trial, driven once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskOutcome {
    /// The trial's name and the number of the repetition, as `--only` takes it: `00/a/2-5#1`.
    pub id: String,
    /// The drawing that it counts for.
    pub drawing: String,
    /// The method's name.
    pub method: String,
    /// The seed of the run in which the task was driven.
    pub seed: u64,
    /// The task's name.
    pub task: String,
    /// Number of the task within the trial, from 0.
    pub task_index: usize,
    /// How it ended.
    pub kind: Kind,
    /// The robot's reason, in its own words.
    pub reason: String,
    /// Simulated seconds.
    pub time_s: f64,
    /// Length of the true path, metres.
    pub path_m: f64,
    /// Where the robot truly was at the end, metres and degrees, frame `World`; `None` if the task never began.
    pub end: Option<[f64; 3]>,
    /// The distance from there to the middle of the goal's place, metres.
    pub final_error_m: Option<f64>,
    /// How often the robot began to touch something.
    pub collisions: u32,
    /// What it cost.
    pub cost: Cost,
    /// The landmark states of a drive by such states, in order; empty otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<StateDriven>,
    /// How often a person answered the robot in the drive; 0 if there was no person.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub answers: u32,
    /// The drawing, if it is that of other outcomes, too, so that they are not independent of each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster: Option<String>,
    /// Whether it was reached as judged by the robot's own pose in the drawing; `None` without a drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_sketch: Option<bool>,
    /// The mean distance of the true path from the drawn route, metres; `None` without a route.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement_m: Option<f64>,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

#[cfg(test)]
impl TaskOutcome {
    /// An outcome for tests: a trial's name with its repetition, and how it ended.
    pub fn sample(id: &str, kind: Kind) -> Self {
        Self {
            id: id.to_owned(),
            drawing: String::new(),
            method: String::new(),
            seed: 1,
            task: String::new(),
            task_index: 0,
            kind,
            reason: String::new(),
            time_s: 1.0,
            path_m: 1.0,
            end: None,
            final_error_m: None,
            collisions: 0,
            cost: Cost::default(),
            states: Vec::new(),
            answers: 0,
            cluster: None,
            on_sketch: None,
            displacement_m: None,
        }
    }
}

impl TaskOutcome {
    /// Whether the task succeeded.
    pub fn is_success(&self) -> bool {
        self.kind == Kind::Reached
    }
}
