//! A navigator's own report about a finished run.
//!
//! An [`Account`] receives the recorded messages of a run and fills in a [`Summary`]: named figures, which
//! `judge` prints and a report lists, and charts over time for the report. Like a stage, an account is pure,
//! and the recording is its only input.

use sketchnav_schemas::message::Header;
use sketchnav_schemas::time::seconds;

use crate::{Denied, Incoming};

/// A navigator's report about a run.
///
/// An account receives `status` and the channels of its kind of navigator, in the order of the recording.
pub trait Account {
    /// Receives a message. Implementations should ignore messages of channels that they do not need.
    ///
    /// # Errors
    /// [`Denied`] if the implementation asks for a channel of another kind of navigator.
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied>;

    /// Adds the figures and charts of all messages so far to `summary`.
    fn summarize(&self, summary: &mut Summary);
}

/// The result of an account.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Figures, each with its name and its value including the unit.
    pub figures: Vec<(String, String)>,
    /// Charts over time.
    pub charts: Vec<Chart>,
}

/// Curves over time with a common unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title of the chart.
    pub title: &'static str,
    /// Unit of the values, or their meaning.
    pub unit: &'static str,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A curve over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: &'static str,
    /// Points of the curve, each as seconds since the mission's start and a value, which is NaN if there is none.
    pub points: Vec<[f64; 2]>,
}

impl Summary {
    /// Adds a figure.
    pub fn figure(&mut self, name: impl Into<String>, value: impl Into<String>) {
        self.figures.push((name.into(), value.into()));
    }

    /// Adds a chart, unless none of its curves has a point.
    pub fn chart(&mut self, title: &'static str, unit: &'static str, curves: impl Into<Vec<Curve>>) {
        let curves = curves.into();
        if curves.iter().any(|curve| !curve.points.is_empty()) {
            self.charts.push(Chart { title, unit, curves });
        }
    }
}

impl Curve {
    /// Creates a curve by plotting a value of each message over its timestamp.
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
