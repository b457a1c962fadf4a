//! Studies: experiments that do not drive missions. A study is a pure function from a seed, a number of worlds and, for some
//! studies, data outside the repository, to tables. If the rows of a table are numbers, its columns can be drawn as curves.
//!
//! Studies provide the figures of a paper and statistics over thousands of simulated journeys under the same command as the suites.

pub mod directions;
pub mod logs;
pub mod report;

pub use sketchnav_directions::experiments::{Attempt, Case, Table};

use crate::error::EvalError;
use crate::experiments::jobs::in_parallel;
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
    /// By its size only.
    BySize(fn(Size) -> Result<Vec<Figure>, EvalError>),
    /// With files from these folders.
    WithFiles(fn(&Folders, Size) -> Result<Vec<Figure>, EvalError>),
    /// World by world. Each world is a job, which any machine can run.
    ByWorld(ByWorld),
}

/// A study that tries the same cases in each world.
#[derive(Clone, Copy)]
pub struct ByWorld {
    /// Offset of the worlds' seeds.
    pub offset: u64,
    /// Returns the cases to try in each world.
    pub cases: fn() -> Result<Vec<Case>, EvalError>,
    /// Computes the figures from the attempts at all cases in each world.
    pub figures: fn(&[Case], &[Vec<Attempt>]) -> Vec<Figure>,
}

/// A world of a study, with the number of its job, from 1, and its seed.
pub type World = (usize, u64);

impl ByWorld {
    /// Returns the worlds of a study of the given size.
    pub fn worlds(&self, size: Size) -> Vec<World> {
        (1..).zip(size.seeds(self.offset)).collect()
    }

    /// Tries all cases in these worlds, `threads` at a time. Returns the attempts in the order of the worlds.
    ///
    /// # Errors
    /// The first error of a case, in the order of the worlds.
    pub fn attempt(
        &self,
        worlds: &[World],
        threads: usize,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Vec<Vec<Attempt>>, EvalError> {
        let cases = (self.cases)()?;
        let attempt = |&(_, seed): &World| {
            let attempts = cases.iter().map(|case| Ok(case.attempt(seed)?)).collect();
            progress();
            attempts
        };
        in_parallel(worlds, threads, attempt).into_iter().collect()
    }

    /// Computes the figures from the attempts in all worlds.
    ///
    /// # Errors
    /// Returns an error if a case cannot be set up.
    pub fn figures(&self, worlds: &[Vec<Attempt>]) -> Result<Vec<Figure>, EvalError> {
        Ok((self.figures)(&(self.cases)()?, worlds))
    }
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
    /// Runs the study, on several threads if it runs world by world. The figures do not depend on their number.
    ///
    /// # Errors
    /// [`EvalError::NoData`] if its data are missing, or any error of its files or of the experiment.
    pub fn run(&self, folders: &Folders, size: Size, threads: usize) -> Result<Vec<Figure>, EvalError> {
        match self.run {
            Run::BySize(run) => run(size),
            Run::WithFiles(run) => run(&Folders { suite: self.name, ..folders.clone() }, size),
            Run::ByWorld(study) => study.figures(&study.attempt(&study.worlds(size), threads, &|| {})?),
        }
    }
}

/// A table, and how to draw it.
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
    /// For each row, a share in percent is drawn with its interval. The columns are those of the share, of the lower end and of the
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
