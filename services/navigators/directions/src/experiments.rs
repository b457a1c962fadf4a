//! The experiments of Park and Kender 1995 as pure functions, by seed, and those that they leave out. Each gives a table.
//!
//! The paper's world: 100 dots on a square of ten windows. In its physical setting, figure 30's distances say that a
//! window is some 100 mm wide. So this module has a window of 100 mm on 1000 mm × 1000 mm. Its errors of 1 and 5 mm
//! are then 0.01 and 0.05 windows.

mod journeys;
mod paths;
mod predictions;
mod worlds;

use std::fmt;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::statistics::{interval_of_mean, mean, wilson};

pub use journeys::{Calibration, Choice, Setting, Success, calibration, costs, success, words_and_windows};
pub use paths::{Goal, PUBLISHED_WAY, paths};
pub use predictions::{of_paths, of_transitions};
pub use worlds::{components, fits, parkways, recoverable, reliability, windows};

use crate::error::Error;
use crate::geometry::Window;

/// The side of the paper's world, in millimetres.
pub const SIDE: f64 = 1000.0;
/// How many dots it has.
pub const DOTS: usize = 100;

/// The window of the experiments: 100 mm, with a margin of 15 mm.
pub fn window() -> Result<Window, Error> {
    Window::new(100.0, 15.0)
}

/// A table of numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// The names of the columns; the first is that of the rows.
    pub head: Vec<String>,
    /// The name of each row and its numbers.
    pub rows: Vec<(String, Vec<f64>)>,
}

impl Table {
    fn new(title: &str, head: &[&str]) -> Self {
        Self {
            title: title.to_owned(),
            head: head.iter().map(|&name| name.to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    fn row(&mut self, name: impl fmt::Display, values: &[f64]) {
        self.rows.push((name.to_string(), values.to_vec()));
    }

    /// The mean over worlds, Student's interval, and the number of worlds. With a single world, the interval is its value.
    fn mean_of(numbers: &[f64]) -> [f64; 4] {
        let middle = mean(numbers);
        let [low, high] = interval_of_mean(numbers).unwrap_or([middle; 2]);
        [middle, low, high, numbers.len() as f64]
    }

    /// A row with a share in percent, Wilson's interval and the number of worlds.
    fn share(&mut self, name: impl fmt::Display, hits: usize, of: usize) {
        let [low, high] = wilson(hits, of);
        let shares = [hits as f64 / of.max(1) as f64, low, high].map(|share| 100.0 * share);
        self.row(name, &[shares[0], shares[1], shares[2], of as f64]);
    }

    /// The numbers of a column, 0 for the first behind the names.
    pub fn column(&self, column: usize) -> Vec<f64> {
        self.rows.iter().map(|(_, values)| values[column]).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        let width =
            self.rows.iter().map(|(name, _)| name.len()).chain([self.head[0].len()]).max().unwrap_or(0);
        write!(f, "{:<width$}", self.head[0])?;
        self.head[1..].iter().try_for_each(|name| write!(f, " {name:>12}"))?;
        writeln!(f)?;
        for (name, values) in &self.rows {
            write!(f, "{name:<width$}")?;
            values.iter().try_for_each(|value| write!(f, " {value:>12.3}"))?;
            writeln!(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
