//! Outcomes of tasks: one word each, with figures.

use crate::experiments::cost::Cost;
use crate::experiments::learned::series::InSeries;
use crate::experiments::witnesses::RoomsSaid;
use crate::judge::TaskVerdict;
use crate::judge::directions::JourneyVerdict;
use crate::judge::states::StateDriven;
use serde::{Deserialize, Serialize};

/// The kind of outcome of a task. Only [`Self::Reached`] is a success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The robot reported its arrival, and actually was at the goal.
    Reached,
    /// The robot reported its arrival, but was elsewhere.
    WrongArrival,
    /// The robot arrived by a path that is not consistent with the drawing: it passed something on a different side than the drawn
    /// route, or than the path to the goal in the drawing.
    WrongSide,
    /// The robot touched something, in a trial in which contacts end the drive.
    Collided,
    /// The robot reported that it is lost.
    Lost,
    /// The robot reported that there is no path.
    Blocked,
    /// The time ran out.
    TimedOut,
    /// The mission ended in any other way.
    Aborted,
    /// The robot never moved, regardless of what it reported. In a corridor driven by markers, this means
    /// that no pair was in view.
    NeverMoved,
}

impl Kind {
    /// All kinds, starting with success.
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

    /// Returns the word for the outcome in tables.
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

    /// Returns the outcome that follows from a verdict alone, regardless of the robot's path and of whether contacts are failures.
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

/// The outcome of one task in one repetition of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskOutcome {
    /// Name of the trial and number of the repetition, for example `00/a/2-5#1`, in the form that `--only` takes.
    pub id: String,
    /// The drawing that the outcome counts for.
    pub drawing: String,
    /// Name of the method.
    pub method: String,
    /// Seed of the run that drove the task.
    pub seed: u64,
    /// Name of the task.
    pub task: String,
    /// Index of the task within the trial, from 0.
    pub task_index: usize,
    /// Kind of outcome.
    pub kind: Kind,
    /// The reason that the robot reported.
    pub reason: String,
    /// Duration, in simulated seconds.
    pub time_s: f64,
    /// Length of the true path, in metres.
    pub path_m: f64,
    /// True pose of the robot at the end in the frame `World`, in metres and degrees, or `None` if the task never began.
    pub end: Option<[f64; 3]>,
    /// Distance from the true final position to the centre of the goal's place, in metres.
    pub final_error_m: Option<f64>,
    /// Number of times the robot began to touch something.
    pub collisions: u32,
    /// Cost of the task.
    pub cost: Cost,
    /// The landmark states of the drive, in order. Empty unless the robot drives by states.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<StateDriven>,
    /// Kinds of warnings about the sketch before a drive past landmarks started, without duplicates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Number of times that a person answered the robot during the drive, or 0 without a person.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub answers: u32,
    /// The drawing, if other outcomes share it and are therefore not independent of this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster: Option<String>,
    /// Whether the task was reached as judged by the robot's own pose in the drawing, or `None` if there is no drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_sketch: Option<bool>,
    /// Mean distance of the true path from the drawn route, in metres, or `None` if there is no route.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement_m: Option<f64>,
    /// Where the goal was according to regions and doors at the end of the task, or `None` if these were not consulted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rooms: Option<RoomsSaid>,
    /// How a journey by a custom map ended and the probability of arrival that the map stated, or `None` for other tasks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub journey: Option<JourneyVerdict>,
    /// What is known about a task in a series of drives, or `None` for other tasks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_series: Option<InSeries>,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

#[cfg(test)]
impl TaskOutcome {
    /// Returns an outcome for tests. `id` consists of the name of a trial and its repetition.
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
            warnings: Vec::new(),
            answers: 0,
            cluster: None,
            on_sketch: None,
            displacement_m: None,
            rooms: None,
            journey: None,
            in_series: None,
        }
    }
}

impl TaskOutcome {
    /// Returns true if the task succeeded.
    pub fn is_success(&self) -> bool {
        self.kind == Kind::Reached
    }
}
