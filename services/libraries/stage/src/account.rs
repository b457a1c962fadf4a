//! What is to be said of a run when it is over, as the navigator itself says it.
//!
//! An [`Account`] hears the recorded messages of a run and gives a [`Summary`]: figures by name, which `judge` prints and a
//! report lists, and charts over time for the report. It is as pure as a stage, and knows what was recorded and no more.

use sketchnav_schemas::message::Header;
use sketchnav_schemas::time::seconds;

use crate::{Denied, Heard};

/// What a navigator says of a run.
///
/// It hears the channels of its kind, and `status`, in the order of the recording.
pub trait Account {
    /// Takes in a message. Those of channels that do not matter are to be ignored.
    ///
    /// # Errors
    /// [`Denied`] for a channel of another kind of navigator.
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), Denied>;

    /// Says what it has gathered.
    fn tell(&self, summary: &mut Summary);
}

/// What an account comes to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Figures: what each is, and its value with the unit.
    pub figures: Vec<(String, String)>,
    /// What changed over time.
    pub charts: Vec<Chart>,
}

/// Curves over time that have a unit in common.
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
    /// A value of each of these messages, at their times.
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
