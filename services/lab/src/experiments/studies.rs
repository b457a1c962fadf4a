//! Studies: experiments that drive no missions. A study is a pure function of a seed and a number of worlds, and gives
//! tables. Where the rows of a table are numbers, its columns are curves.
//!
//! So figures of a paper, and statistics over thousands of simulated journeys, stand beside the suites, under the same command.

pub mod directions;
pub mod report;

pub use sketchnav_directions::experiments::Table;

use crate::error::EvalError;

/// How large a study is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// How many random worlds.
    pub worlds: u64,
    /// From which all seeds are derived.
    pub seed: u64,
}

impl Size {
    /// Seeds of worlds, `offset` apart from those of other experiments.
    pub fn seeds(self, offset: u64) -> std::ops::Range<u64> {
        let first = self.seed.wrapping_sub(1).wrapping_mul(1_000_000).wrapping_add(offset);
        first..first + self.worlds
    }
}

/// A study.
pub struct Study {
    /// Its word on the command line.
    pub name: &'static str,
    /// What is done, in a sentence or two.
    pub title: &'static str,
    /// Worlds by default.
    pub worlds: u64,
    /// Does it.
    pub run: fn(Size) -> Result<Vec<Figure>, EvalError>,
}

/// A table, and how it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The numbers.
    pub table: Table,
    /// What is drawn of them.
    pub drawn: Drawn,
}

/// How a table is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawn {
    /// Not at all.
    Nothing,
    /// Columns as curves against the names of the rows, which are numbers of this unit; in that unit.
    Curves {
        /// Unit of the rows.
        x_unit: &'static str,
        /// Unit of the columns.
        unit: &'static str,
        /// Which columns, from 0.
        columns: Vec<usize>,
    },
    /// A share in percent with its interval for each row: the columns of the share, the lower and the upper end.
    Shares([usize; 3]),
}

/// The studies.
const STUDIES: [Study; 8] = directions::STUDIES;

/// The names of all studies.
pub fn names() -> impl Iterator<Item = &'static str> {
    STUDIES.iter().map(|study| study.name)
}

/// The study of that name.
pub fn find(name: &str) -> Option<&'static Study> {
    STUDIES.iter().find(|study| study.name == name)
}
