//! The suites by name.
//!
//! A suite that needs data which is not part of the project, and does not find it, has no trials and
//! says so in a notice.

use std::path::PathBuf;

use crate::error::EvalError;
use crate::outcome::Outcome;
use crate::trial::Trial;
use crate::{ablation, deformed, people, protocol, routes, sensitivity};

/// Where files lie.
#[derive(Debug, Clone)]
pub struct Folders {
    /// The project: missions and drawings that ship.
    pub project: PathBuf,
    /// Maps and drawings that are not part of it.
    pub data: PathBuf,
}

/// A list of trials with a heading.
#[derive(Debug, Default)]
pub struct Suite {
    /// Its word on the command line.
    pub name: String,
    /// What is done, in a sentence or two.
    pub title: String,
    /// What the reader of its figures must know, data that are missing first of all.
    pub notices: Vec<String>,
    /// What is driven.
    pub trials: Vec<Trial>,
    /// What a line of its table is, where it is no drawing: then the trials' `drawing` says that.
    pub lines: Option<&'static str>,
    /// Repetitions where nobody says how many.
    pub repetitions: u32,
    /// What others reached with a suite of the same protocol, where no table lists its tasks.
    pub paper: Option<Paper>,
    /// Lines of the table that together are a curve.
    pub curves: Vec<Curve>,
    /// The tasks that count, where a published table lists them: its lines. Empty: all tasks count, and the
    /// table has a line for each drawing.
    pub legs: Vec<Leg>,
}

/// A published count.
#[derive(Debug, Clone, PartialEq)]
pub struct Paper {
    /// What was counted: `paper A`.
    pub name: String,
    /// Successes.
    pub reached: u32,
    /// Of so many.
    pub attempts: u32,
}

impl Paper {
    /// Share of tasks reached, from 0 to 1; `None` without attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.attempts > 0).then(|| f64::from(self.reached) / f64::from(self.attempts))
    }
}

/// Success against one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Which condition.
    pub title: String,
    /// What it is measured in.
    pub unit: String,
    /// Its values, and the line (a trial's `drawing`) that was driven with each.
    pub points: Vec<(f64, String)>,
}

/// A line of a published table.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// The task's name: `0 → 1`.
    pub name: String,
    /// How long the way was there, metres.
    pub paper_length_m: f64,
    /// Successes and attempts there, a pair for each drawing.
    pub paper: Vec<(u32, u32)>,
    /// How long the shortest way is here.
    pub length_m: Option<f64>,
}

impl Suite {
    /// The names of its drawings, in the order of the trials.
    pub fn drawings(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for trial in &self.trials {
            if !names.contains(&trial.drawing) {
                names.push(trial.drawing.clone());
            }
        }
        names
    }

    /// What others reached: of a published table its columns.
    pub fn papers(&self) -> Vec<Paper> {
        let columns = self.legs.iter().map(|leg| leg.paper.len()).max().unwrap_or_default();
        let column = |i: usize| {
            let cells = || self.legs.iter().filter_map(move |leg| leg.paper.get(i));
            Paper {
                name: format!("paper {}", char::from(b'A' + i as u8)),
                reached: cells().map(|(reached, _)| reached).sum(),
                attempts: cells().map(|(_, attempts)| attempts).sum(),
            }
        };
        self.paper.iter().cloned().chain((0..columns).map(column)).collect()
    }

    /// Whether an outcome counts: legs that only lead from one to the next do not.
    pub fn counts(&self, outcome: &Outcome) -> bool {
        self.legs.is_empty() || self.legs.iter().any(|leg| leg.name == outcome.task)
    }

    /// Keeps at most `count` trials of each drawing, spread evenly over them: the same ones every time.
    pub fn sample(&mut self, count: usize) {
        let mut kept = Vec::new();
        for drawing in self.drawings() {
            let of_drawing: Vec<_> = self.trials.iter().filter(|trial| trial.drawing == drawing).collect();
            let step = (of_drawing.len() as f64 / count.max(1) as f64).max(1.0);
            let chosen = (0..count).map_while(|k| of_drawing.get((k as f64 * step + step / 2.0) as usize));
            kept.extend(chosen.map(|trial| (*trial).clone()));
        }
        self.trials = kept;
    }
}

/// Loads a suite.
type Loader = fn(&Folders) -> Result<Suite, EvalError>;

/// The suites: a new one is a line here and a module of its own.
const SUITES: [(&str, Loader); 8] = [
    ("ablation", ablation::suite),
    ("building-079", protocol::building_079),
    ("building", protocol::building),
    ("deformed", deformed::suite),
    ("laboratory", protocol::laboratory),
    ("people", people::suite),
    ("routes", routes::suite),
    ("sensitivity", sensitivity::suite),
];

/// The names of all suites.
pub fn names() -> impl Iterator<Item = &'static str> {
    SUITES.iter().map(|(name, _)| *name)
}

/// Loads the suite of that name.
///
/// # Errors
/// [`EvalError`]: an unknown name, a file that is there and cannot be read.
pub fn load(name: &str, folders: &Folders) -> Result<Suite, EvalError> {
    let Some((_, load)) = SUITES.iter().find(|(known, _)| *known == name) else {
        let known = names().collect::<Vec<_>>().join(", ");
        return Err(EvalError::Suite { found: name.to_owned(), known });
    };
    load(folders)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deformed;

    fn folders() -> Folders {
        let project = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Folders { data: project.join("none"), project }
    }

    /// Four trials by each of two drawings.
    fn suite() -> Suite {
        let site = deformed::shipped(&folders()).unwrap().remove(1);
        let drawings = [0.0, 0.5].map(|degree| site.trials(degree, 1).unwrap());
        Suite { trials: drawings.concat(), ..Suite::default() }
    }

    fn names(suite: &Suite) -> Vec<String> {
        suite.trials.iter().map(|trial| trial.name.clone()).collect()
    }

    #[test]
    fn a_sample_is_spread_over_each_drawing_and_always_the_same() {
        let all = names(&suite());
        assert_eq!(all.len(), 8);
        for (count, kept) in [
            (0, vec![]),
            (1, vec![2, 6]),
            (2, vec![1, 3, 5, 7]),
            (4, (0..8).collect::<Vec<_>>()),
            (99, (0..8).collect()),
        ] {
            let mut sampled = suite();
            sampled.sample(count);
            let kept: Vec<_> = kept.into_iter().map(|i: usize| all[i].clone()).collect();
            assert_eq!(names(&sampled), kept, "{count}");
        }
    }

    #[test]
    fn an_unknown_suite_is_told_all_that_there_are() {
        let error = load("poeple", &folders()).unwrap_err().to_string();
        assert!(super::names().all(|name| error.contains(name)), "{error}");
    }

    #[test]
    fn the_columns_of_a_published_table_are_added_up() {
        let table = protocol::laboratory(&folders()).unwrap().papers();
        let found: Vec<_> = table.iter().map(|p| (p.name.as_str(), p.reached, p.attempts)).collect();
        assert_eq!(found, [("paper A", 55, 70), ("paper B", 57, 70)]);
    }
}
