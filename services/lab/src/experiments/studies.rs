//! Studies, which are experiments that do not drive missions. A study is a pure function of a seed, a number
//! of worlds and, for some, data that are not part of the repository. It returns tables. If the rows of a
//! table are numbers, its columns can be drawn as curves.
//!
//! With studies, figures of a paper and statistics over thousands of simulated journeys are available next to
//! the suites and under the same command.

pub mod directions;
pub mod logs;
pub mod report;

pub use sketchnav_directions::experiments::Table;

use crate::error::EvalError;
use crate::experiments::suite::Folders;

/// The number of worlds in a study, and its seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Number of random worlds.
    pub worlds: u64,
    /// Seed from which all other seeds are derived.
    pub seed: u64,
}

impl Size {
    /// Returns the seeds of the worlds. Use a different `offset` for each experiment to keep their seeds apart.
    pub fn seeds(self, offset: u64) -> std::ops::Range<u64> {
        let first = self.seed.wrapping_sub(1).wrapping_mul(1_000_000).wrapping_add(offset);
        first..first + self.worlds
    }
}

/// How a study is run.
pub enum Run {
    /// By its size alone.
    BySize(fn(Size) -> Result<Vec<Figure>, EvalError>),
    /// With files from these folders.
    WithFiles(fn(&Folders, Size) -> Result<Vec<Figure>, EvalError>),
}

/// A study that can be run by name.
pub struct Study {
    /// Name on the command line.
    pub name: &'static str,
    /// A sentence or two describing the study.
    pub title: &'static str,
    /// Default number of worlds.
    pub worlds: u64,
    /// Runs the study.
    pub run: Run,
}

impl Study {
    /// Runs the study.
    ///
    /// # Errors
    /// [`EvalError::NoData`] if its data are missing, and otherwise the error of its files or of the experiment.
    pub fn run(&self, folders: &Folders, size: Size) -> Result<Vec<Figure>, EvalError> {
        match self.run {
            Run::BySize(run) => run(size),
            Run::WithFiles(run) => run(&Folders { suite: self.name, ..folders.clone() }, size),
        }
    }
}

/// A table and how to draw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The numbers.
    pub table: Table,
    /// How to draw the table.
    pub drawn: Drawn,
}

/// How to draw a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawn {
    /// The table is not drawn.
    Nothing,
    /// Columns are drawn as curves over the names of the rows, which must be numbers.
    Curves {
        /// Unit of the rows.
        x_unit: &'static str,
        /// Unit of the columns.
        unit: &'static str,
        /// Indices of the drawn columns, from 0.
        columns: Vec<usize>,
    },
    /// A share in percent is drawn with its interval for each row. The columns are those of the share, the lower end and the
    /// upper end.
    Shares([usize; 3]),
}

/// Returns all studies.
fn all() -> impl Iterator<Item = &'static Study> {
    directions::STUDIES.iter().chain([&logs::STUDY])
}

/// Returns the names of all studies.
pub fn names() -> impl Iterator<Item = &'static str> {
    all().map(|study| study.name)
}

/// Returns the study with the given name.
pub fn find(name: &str) -> Option<&'static Study> {
    all().find(|study| study.name == name)
}
