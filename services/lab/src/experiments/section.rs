//! What a suite tells beside its tables of outcomes: tables and figures in the form of a paper, and what they say.

use serde::Serialize;

use crate::experiments::table::Table;

/// A table with figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// What it shows.
    pub title: String,
    /// Numbers; without rows where there is none.
    pub table: Table,
    /// What they say, and how they differ from what was published: a paragraph each.
    pub words: Vec<String>,
    /// What is drawn.
    pub plots: Vec<Plot>,
}

/// A picture of what succeeded and what failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// What lies along it.
    pub x_unit: String,
    /// What lies up it.
    pub y_unit: String,
    /// How.
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
    /// As bars from below.
    Bars,
}

/// One of what was counted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mark {
    /// Where along.
    pub x: f64,
    /// How high.
    pub y: f64,
    /// Whether it succeeded.
    pub is_success: bool,
}
