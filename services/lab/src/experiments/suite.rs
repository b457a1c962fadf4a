//! Suites: lists of trials under a heading, with published figures for comparison.

use std::path::PathBuf;

use crate::error::EvalError;
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::trial::Trial;

/// The folders in which the files of suites are found.
#[derive(Debug, Clone)]
pub struct Folders {
    /// Name of the suite that loads the files, or empty if it is not known yet.
    pub suite: &'static str,
    /// Folder of the project, which contains missions and drawings.
    pub project: PathBuf,
    /// Folder of maps and drawings that are not part of the repository, if one was given.
    pub data: Option<PathBuf>,
}

/// A data file that is not part of the repository.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datum {
    /// A description of the data, including their authors.
    pub what: &'static str,
    /// Path of the file in the data folder.
    pub file: &'static str,
}

impl Folders {
    /// Returns the path of a file that the suite cannot do without.
    ///
    /// # Errors
    /// [`EvalError::NoData`] if the file does not exist.
    pub fn datum(&self, Datum { what, file }: Datum) -> Result<PathBuf, EvalError> {
        let found = match &self.data {
            Some(folder) if folder.join(file).is_file() => return Ok(folder.join(file)),
            Some(folder) => format!("no such file in {}", folder.display()),
            None => "neither is set".to_owned(),
        };
        Err(EvalError::NoData { suite: self.suite, what, file, found })
    }

    /// Returns the folders of the checkout under test, without data.
    #[cfg(test)]
    pub(crate) fn of_checkout() -> Self {
        let project = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Self { suite: "", project, data: None }
    }
}

/// A function that derives the sections of a suite from all of its outcomes.
pub type Sections = fn(&[TaskOutcome]) -> Vec<Section>;

/// A list of trials with a heading.
#[derive(Debug, Default)]
pub struct Suite {
    /// Name of the suite on the command line.
    pub name: String,
    /// A sentence or two describing the suite.
    pub title: String,
    /// Notes for readers of the figures, starting with data that are missing.
    pub notices: Vec<String>,
    /// The trials.
    pub trials: Vec<Trial>,
    /// What a line of the table stands for, if it is not a drawing. In that case, the `drawing` of each trial names its line.
    pub lines: Option<&'static str>,
    /// The methods that are compared by default. If empty, only the first method of the navigator is driven.
    pub methods: Vec<String>,
    /// Default number of repetitions.
    pub repetitions: u32,
    /// Published results of a suite with the same protocol, if there is no published table that lists its tasks.
    pub paper: Vec<Published>,
    /// Published remarks on single lines of the table.
    pub remarks: Vec<Remark>,
    /// Whether the table of costs is shown as well.
    pub shows_costs: bool,
    /// Lines of the table that together form a curve.
    pub curves: Vec<Curve>,
    /// Lines of the table that are also counted together.
    pub groups: Vec<Group>,
    /// The tasks that count, which then form the lines of the table, if a published table lists them. If empty, all tasks count,
    /// and the table has a line for each drawing.
    pub legs: Vec<Leg>,
    /// Derives the sections that are shown in addition to the tables from all outcomes.
    pub sections: Option<Sections>,
}

/// A published count of successes.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Name in the table, for example `paper A`.
    pub name: String,
    /// Number of successes.
    pub reached: u32,
    /// Number of attempts.
    pub attempts: u32,
}

impl Published {
    /// Returns the share of tasks reached, from 0 to 1, or `None` if there were no attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.attempts > 0).then(|| f64::from(self.reached) / f64::from(self.attempts))
    }
}

/// A published remark on one line of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Remark {
    /// Name of the method.
    pub method: &'static str,
    /// Name of the line.
    pub line: &'static str,
    /// The remark, in a few words.
    pub words: &'static str,
}

/// Success rates as a function of a condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name of the condition.
    pub title: String,
    /// Unit in which the condition is given.
    pub unit: String,
    /// Values of the condition, each with the line (the `drawing` of its trials) that was driven under it.
    pub points: Vec<(f64, String)>,
}

/// Lines of the table that have something in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// What the lines have in common.
    pub name: String,
    /// The lines (the `drawing` of the trials).
    pub lines: Vec<String>,
}

impl Group {
    /// Returns true if an outcome is part of the group.
    pub fn counts(&self, outcome: &TaskOutcome) -> bool {
        self.lines.contains(&outcome.drawing)
    }
}

/// A line of a published table, for one leg of a tour.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Name of the task, for example `0 → 1`.
    pub name: String,
    /// Length of the path in the paper, in metres.
    pub paper_length_m: f64,
    /// Successes and attempts in the paper, one pair for each drawing.
    pub paper: Vec<(u32, u32)>,
    /// Length of the shortest path here, in metres.
    pub length_m: Option<f64>,
}

impl Suite {
    /// Returns the names of the drawings, in the order of the trials.
    pub fn drawings(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for trial in &self.trials {
            if !names.contains(&trial.drawing) {
                names.push(trial.drawing.clone());
            }
        }
        names
    }

    /// Returns the published results. If there is a published table, this includes the sum of each of its columns.
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

    /// Returns true if a trial is to be driven by `method`, which is one of the requested `methods`. A trial with a method of its
    /// own is not driven by any other. If its own method was not requested, the trial is left out if the suite compares methods,
    /// and driven once otherwise.
    pub fn is_driven(&self, trial: &Trial, method: &str, methods: &[String]) -> bool {
        match &trial.method {
            None => true,
            Some(own) if methods.contains(own) => own == method,
            Some(_) => self.methods.is_empty() && methods.first().is_some_and(|first| first == method),
        }
    }

    /// Returns the sections that are reported in addition to the tables.
    pub fn sections(&self, outcomes: &[TaskOutcome]) -> Vec<Section> {
        self.sections.map_or(Vec::new(), |sections| sections(outcomes))
    }

    /// Returns true if an outcome counts. Legs that only lead from one counted leg to the next do not.
    pub fn counts(&self, outcome: &TaskOutcome) -> bool {
        self.legs.is_empty() || self.legs.iter().any(|leg| leg.name == outcome.task)
    }

    /// Keeps at most `count` trials of each drawing, spread evenly over them. The same trials are kept every time.
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

    /// Regression test: the data folder used to be fixed at compile time, and a suite without its data drove nothing and succeeded.
    #[test]
    fn the_error_for_missing_data_names_the_suite_and_the_remedy() {
        let map = Datum { what: "the map of a house", file: "maps/house.yaml" };
        let mut folders = Folders { suite: "houses", ..Folders::of_checkout() };
        let error = folders.datum(map).unwrap_err().to_string();
        for word in ["houses", "the map of a house", "maps/house.yaml", "--data", "SKETCHNAV_DATA"] {
            assert!(error.contains(word), "{error}");
        }
        let folder = tempfile::tempdir().unwrap();
        folders.data = Some(folder.path().to_path_buf());
        let error = folders.datum(map).unwrap_err().to_string();
        assert!(error.contains(&folder.path().display().to_string()), "{error}");
        std::fs::create_dir(folder.path().join("maps")).unwrap();
        std::fs::write(folder.path().join(map.file), "").unwrap();
        assert_eq!(folders.datum(map).unwrap(), folder.path().join(map.file));
    }
}
