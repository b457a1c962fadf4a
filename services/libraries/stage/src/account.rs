//! What a navigator itself reports about a run when it is over.
//!
//! An [`Account`] hears the recorded messages of a run and gives a [`Summary`]: named figures, which `judge` prints and a
//! report lists, and charts over time for the report. It is as pure as a stage, and knows only what was recorded.

use sketchnav_schemas::message::Header;
use sketchnav_schemas::time::seconds;

use crate::{Denied, Heard};

/// What a navigator reports about a run.
///
/// It hears the channels of its kind, and `status`, in the order of the recording.
pub trait Account {
    /// Receives a message. Messages of irrelevant channels are to be ignored.
    ///
    /// # Errors
    /// [`Denied`] for a channel of another kind of navigator.
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), Denied>;

    /// Reports what it has gathered.
    fn tell(&self, summary: &mut Summary);
}

/// The result of an account.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Figures: the name of each, and its value with the unit.
    pub figures: Vec<(String, String)>,
    /// What changed over time.
    pub charts: Vec<Chart>,
}

/// Curves over time with a common unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What is shown.
    pub title: &'static str,
    /// Its unit, or what its numbers mean.
    pub unit: &'static str,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A curve over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Its name in the legend.
    pub name: &'static str,
    /// Seconds since the mission's start, and the value; NaN if there is none.
    pub points: Vec<[f64; 2]>,
}

impl Summary {
    /// Adds a figure.
    pub fn figure(&mut self, name: impl Into<String>, value: impl Into<String>) {
        self.figures.push((name.into(), value.into()));
    }

    /// Adds a chart; none if no curve has a point.
    pub fn chart(&mut self, title: &'static str, unit: &'static str, curves: impl Into<Vec<Curve>>) {
        let curves = curves.into();
        if curves.iter().any(|curve| !curve.points.is_empty()) {
            self.charts.push(Chart { title, unit, curves });
        }
    }
}

impl Curve {
    /// The curve of a value of each of these messages, at their times.
    pub fn of<'a, T: 'a>(
        name: &'static str,
        messages: impl IntoIterator<Item = &'a T>,
        header: impl Fn(&T) -> &Header,
        value: impl Fn(&T) -> f64,
    ) -> Self {
        let point = |message: &T| [seconds(header(message).stamp_ns), value(message)];
        Self { name, points: messages.into_iter().map(point).collect() }
    }
}
