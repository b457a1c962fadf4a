//! Sections that a suite reports in addition to its tables of outcomes: tables, plots and text, as in a paper.

use serde::Serialize;

use crate::experiments::table::Table;

/// A table with plots and text.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// Heading of the section.
    pub title: String,
    /// The numbers. The table has no rows if there are none.
    pub table: Table,
    /// Paragraphs that explain the numbers and their differences from published ones.
    pub words: Vec<String>,
    /// The plots.
    pub plots: Vec<Plot>,
}

/// A plot of successes and failures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plot {
    /// Heading of the plot.
    pub title: String,
    /// Unit of the horizontal axis.
    pub x_unit: String,
    /// Unit of the vertical axis.
    pub y_unit: String,
    /// Shape of the marks.
    pub form: Form,
    /// The marks.
    pub marks: Vec<Mark>,
}

/// The shape of the marks in a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// Dots.
    Dots,
    /// Bars from the base line.
    Bars,
}

/// A mark for one of the cases that are counted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mark {
    /// Position along the horizontal axis.
    pub x: f64,
    /// Height.
    pub y: f64,
    /// True if this is a success.
    pub is_success: bool,
}
