//! What a suite reports in addition to its tables of outcomes: tables and figures in the form of a paper, with text.

use serde::Serialize;

use crate::experiments::table::Table;

/// A table with figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// What it shows.
    pub title: String,
    /// Its numbers; without rows if there are none.
    pub table: Table,
    /// What they mean, and how they differ from what was published, one paragraph each.
    pub words: Vec<String>,
    /// Its plots.
    pub plots: Vec<Plot>,
}

/// A picture of successes and failures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// The unit along it.
    pub x_unit: String,
    /// The unit up it.
    pub y_unit: String,
    /// The form of its marks.
    pub form: Form,
    /// The marks.
    pub marks: Vec<Mark>,
}

/// How marks are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// As dots.
    Dots,
    /// As bars from the base line.
    Bars,
}

/// One of the things counted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mark {
    /// The position along the picture.
    pub x: f64,
    /// The height.
    pub y: f64,
    /// Whether it succeeded.
    pub is_success: bool,
}
