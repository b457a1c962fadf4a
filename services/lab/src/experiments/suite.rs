//! What a suite is: trials with a heading, and the figures that its own are compared with.

use std::path::PathBuf;

use crate::error::EvalError;
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::trial::Trial;

/// Where the files of suites are.
#[derive(Debug, Clone)]
pub struct Folders {
    /// The suite that they are for; empty if it is not known yet.
    pub suite: &'static str,
    /// The project: missions and drawings that ship.
    pub project: PathBuf,
    /// Maps and drawings that are not part of the project, if a folder was given for them.
    pub data: Option<PathBuf>,
}

/// A file of the data that is not part of the project.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datum {
    /// What it is and who made it.
    pub what: &'static str,
    /// Its path in the folder of the data.
    pub file: &'static str,
}

impl Folders {
    /// The path of a file without which the suite cannot be driven.
    ///
    /// # Errors
    /// [`EvalError::NoData`] if it does not exist.
    pub fn datum(&self, Datum { what, file }: Datum) -> Result<PathBuf, EvalError> {
        let found = match &self.data {
            Some(folder) if folder.join(file).is_file() => return Ok(folder.join(file)),
            Some(folder) => format!("no such file in {}", folder.display()),
            None => "neither is set".to_owned(),
        };
        Err(EvalError::NoData { suite: self.suite, what, file, found })
    }

    /// The checkout that is tested, without data.
    #[cfg(test)]
    pub(crate) fn of_checkout() -> Self {
        let project = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Self { suite: "", project, data: None }
    }
}

/// Makes the sections of a suite from all of its outcomes.
pub type Telling = fn(&[TaskOutcome]) -> Vec<Section>;

/// A list of trials with a heading.
#[derive(Debug, Default)]
pub struct Suite {
    /// Its name on the command line.
    pub name: String,
    /// What is done, in a sentence or two.
    pub title: String,
    /// What the reader of its figures must know, missing data first of all.
    pub notices: Vec<String>,
    /// The trials.
    pub trials: Vec<Trial>,
    /// What a line of its table is, if it is not a drawing; the trials' `drawing` then names that.
    pub lines: Option<&'static str>,
    /// The methods that it compares by default; empty: the first one of its kind of navigator.
    pub methods: Vec<String>,
    /// Repetitions by default.
    pub repetitions: u32,
    /// What others reached with a suite of the same protocol, if no published table lists its tasks.
    pub paper: Vec<Published>,
    /// What others say of single lines, in words.
    pub told: Vec<Told>,
    /// Whether its table of costs is shown as well.
    pub shows_costs: bool,
    /// Lines of the table that together form a curve.
    pub curves: Vec<Curve>,
    /// Lines of the table that are counted together as well.
    pub groups: Vec<Group>,
    /// The tasks that count, if a published table lists them: the table's lines. Empty: all tasks count, and the table has a line
    /// for each drawing.
    pub legs: Vec<Leg>,
    /// What it reports of all outcomes in addition to its tables.
    pub tells: Option<Telling>,
}

/// A published count.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// What was counted: `paper A`.
    pub name: String,
    /// Successes.
    pub reached: u32,
    /// The number of attempts.
    pub attempts: u32,
}

impl Published {
    /// Share of tasks reached, from 0 to 1; `None` without attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.attempts > 0).then(|| f64::from(self.reached) / f64::from(self.attempts))
    }
}

/// What others say of one line of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Told {
    /// The method.
    pub method: &'static str,
    /// The line.
    pub line: &'static str,
    /// What they say, in few words.
    pub words: &'static str,
}

/// Success as a function of one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The condition.
    pub title: String,
    /// The unit of its values.
    pub unit: String,
    /// Its values, each with the line (a trial's `drawing`) that was driven with it.
    pub points: Vec<(f64, String)>,
}

/// Lines that have something in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// What they have in common.
    pub name: String,
    /// The lines (a trial's `drawing`).
    pub lines: Vec<String>,
}

impl Group {
    /// Whether an outcome belongs to it.
    pub fn counts(&self, outcome: &TaskOutcome) -> bool {
        self.lines.contains(&outcome.drawing)
    }
}

/// A line of a published table.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// The task's name: `0 → 1`.
    pub name: String,
    /// The length of the path there, metres.
    pub paper_length_m: f64,
    /// Successes and attempts there, a pair for each drawing.
    pub paper: Vec<(u32, u32)>,
    /// The length of the shortest path here, metres.
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

    /// What others reached; if there is a published table, its columns.
    pub fn papers(&self) -> Vec<Published> {
        let columns = self.legs.iter().map(|leg| leg.paper.len()).max().unwrap_or_default();
        let column = |i: usize| {
            let cells = || self.legs.iter().filter_map(move |leg| leg.paper.get(i));
            Published {
                name: format!("paper {}", char::from(b'A' + i as u8)),
                reached: cells().map(|(reached, _)| reached).sum(),
                attempts: cells().map(|(_, attempts)| attempts).sum(),
            }
        };
        self.paper.iter().cloned().chain((0..columns).map(column)).collect()
    }

    /// Whether a trial is driven by one of the methods. A trial with a method of its own is not driven by any other. If its own is
    /// not among those asked for, it is left out if the suite compares methods, and otherwise driven once.
    pub fn is_driven(&self, trial: &Trial, method: &str, methods: &[String]) -> bool {
        match &trial.method {
            None => true,
            Some(own) if methods.contains(own) => own == method,
            Some(_) => self.methods.is_empty() && methods.first().is_some_and(|first| first == method),
        }
    }

    /// What it reports of all outcomes in addition to its tables.
    pub fn sections(&self, outcomes: &[TaskOutcome]) -> Vec<Section> {
        self.tells.map_or(Vec::new(), |tells| tells(outcomes))
    }

    /// Whether an outcome counts; legs that only lead from one to the next do not.
    pub fn counts(&self, outcome: &TaskOutcome) -> bool {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The folder was fixed at compile time, and a suite without its data drove nothing and succeeded.
    #[test]
    fn who_lacks_data_is_told_which_suite_needs_what_and_what_to_do() {
        let map = Datum { what: "the map of a house", file: "maps/house.yaml" };
        let mut folders = Folders { suite: "houses", ..Folders::of_checkout() };
        let told = folders.datum(map).unwrap_err().to_string();
        for word in ["houses", "the map of a house", "maps/house.yaml", "--data", "SKETCHNAV_DATA"] {
            assert!(told.contains(word), "{told}");
        }
        let folder = tempfile::tempdir().unwrap();
        folders.data = Some(folder.path().to_path_buf());
        let told = folders.datum(map).unwrap_err().to_string();
        assert!(told.contains(&folder.path().display().to_string()), "{told}");
        std::fs::create_dir(folder.path().join("maps")).unwrap();
        std::fs::write(folder.path().join(map.file), "").unwrap();
        assert_eq!(folders.datum(map).unwrap(), folder.path().join(map.file));
    }
}
