//! The experiments of Park and Kender 1995, and some of our own, as pure functions of a seed. Each returns a
//! table.
//!
//! The paper's world has 100 dots on a square with a side of ten windows. The distances in figure 30 imply that in the physical
//! setup, a window is about 100 mm wide. This module therefore uses a window of 100 mm on a square of 1000 mm × 1000 mm, on
//! which the paper's errors of 1 and 5 mm are 0.01 and 0.05 windows.

mod journeys;
mod paths;
mod predictions;
mod success;
mod worlds;

use std::fmt;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::statistics::{interval_of_mean, mean, wilson};

pub use journeys::{Attempt, Case, Choice, Setting};
pub use paths::{Goal, PUBLISHED_WAY, paths};
pub use predictions::{of_paths, of_transitions};
pub use success::{Success, by_case, calibration, costs, stated_and_reached, success, words_and_windows};
pub use worlds::{components, fits, parkways, recoverable, reliability, windows};

use crate::error::Error;
use crate::geometry::Window;

/// The side of the paper's world, in millimetres.
pub const SIDE: f64 = 1000.0;
/// Number of dots in the paper's world.
pub const DOTS: usize = 100;

/// Returns the window of the experiments, which is 100 mm wide with a margin of 15 mm.
pub fn window() -> Result<Window, Error> {
    Window::new(100.0, 15.0)
}

/// A table of numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// The title.
    pub title: String,
    /// The names of the columns, including that of the row names.
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

    /// Returns the mean over worlds, Student's confidence interval, and the number of worlds. For a single world, both ends of
    /// the interval are its value.
    fn mean_of(numbers: &[f64]) -> [f64; 4] {
        let middle = mean(numbers);
        let [low, high] = interval_of_mean(numbers).unwrap_or([middle; 2]);
        [middle, low, high, numbers.len() as f64]
    }

    /// Adds a row with a share in percent, Wilson's confidence interval, and the number of worlds.
    fn share(&mut self, name: impl fmt::Display, hits: usize, of: usize) {
        let [low, high] = wilson(hits, of);
        let shares = [hits as f64 / of.max(1) as f64, low, high].map(|share| 100.0 * share);
        self.row(name, &[shares[0], shares[1], shares[2], of as f64]);
    }

    /// Returns the numbers of a column, where 0 is the first column after the names.
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
