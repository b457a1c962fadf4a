//! An account that is an object in Python.

use pyo3::prelude::*;
use sketchnav_stage::account::{Account, Curve, Summary};
use sketchnav_stage::{Denied, Incoming, StageError};

use crate::lent::Lent;
use crate::stage::call_on;
use crate::table::interned;

/// Named curves. Each point consists of a time in seconds and a value.
type Curves = Vec<(String, Vec<[f64; 2]>)>;
/// What the Python method `_summarize` returns: named figures, and charts with a title, a unit and curves.
type Told = (Vec<(String, String)>, Vec<(String, String, Curves)>);

/// An account written in Python: an object of the class `Account`, or the error with which it failed. Even then, the run can be
/// judged.
pub struct PythonAccount(Result<Py<PyAny>, StageError>);

impl PythonAccount {
    pub fn new(made: Result<Py<PyAny>, StageError>) -> Self {
        Self(made)
    }
}

impl Account for PythonAccount {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if let Ok(object) = &self.0 {
            let result = call_on(object, Lent::default().incoming(message), "receive", |account| {
                account.call_method0("_receive").map(drop)
            });
            if let Err(error) = result {
                self.0 = Err(error);
            }
        }
        Ok(())
    }

    fn summarize(&self, summary: &mut Summary) {
        let told = self.0.as_ref().map_err(ToString::to_string).and_then(|object| {
            let summarize =
                |account: &Bound<'_, PyAny>| account.call_method0("_summarize")?.extract::<Told>();
            call_on(object, Lent::default(), "summarize", summarize).map_err(|error| error.to_string())
        });
        match told {
            Ok((figures, charts)) => {
                summary.figures.extend(figures);
                charts.into_iter().for_each(|(title, unit, curves)| chart(summary, &title, &unit, curves));
            }
            // The traceback follows on further lines, and has already been printed.
            Err(why) => {
                let first = why.lines().next().unwrap_or_default();
                summary.figure(
                    "account",
                    format!("failed: {}", first.split("; traceback").next().unwrap_or(first)),
                );
            }
        }
    }
}

fn chart(summary: &mut Summary, title: &str, unit: &str, curves: Curves) {
    let curve = |(name, points): (String, _)| Curve { name: interned(&name), points };
    let curves: Vec<_> = curves.into_iter().map(curve).collect();
    summary.chart(interned(title), interned(unit), curves);
}
