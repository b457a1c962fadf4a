//! A stage that is an object in Python.

use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sketchnav_schemas::say;
use sketchnav_stage::{Hosted, Incoming, Instant, Outbox, Remains, SaveError, StageError};

use crate::lent::Lent;

/// A stage written in Python, which is an object of the class `Stage`.
pub struct PythonStage {
    object: Py<PyAny>,
    form: &'static str,
}

impl PythonStage {
    pub fn new(object: Py<PyAny>, form: &'static str) -> Self {
        Self { object, form }
    }

    fn call<R>(
        &self,
        lent: Lent,
        method: &'static str,
        call: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<R>,
    ) -> Result<R, StageError> {
        call_on(&self.object, lent, method, call)
    }
}

/// Calls a method of an object that the navigator's author wrote. In the meantime, the method may use the lent objects.
///
/// # Errors
/// [`failure`] for an exception, or the host's error that it passed on.
pub fn call_on<R>(
    object: &Py<PyAny>,
    lent: Lent,
    method: &'static str,
    call: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<R>,
) -> Result<R, StageError> {
    Python::attach(|py| {
        let object = object.bind(py);
        lent.during(py, || call(object))?.map_err(|error| failure(py, &place(object, method), error))
    })
}

fn place(object: &Bound<'_, PyAny>, method: &str) -> String {
    let class = object.get_type().name().map_or_else(|_| "stage".to_owned(), |name| name.to_string());
    format!("{class}.{method}")
}

/// Maximum number of calls that an error shows, which are the innermost ones of the traceback.
const CALLS: usize = 10;

/// Prints the whole traceback of an exception, and returns an error that names the exception, its line and the innermost calls
/// outside this package.
pub fn failure(py: Python<'_>, place: &str, error: PyErr) -> StageError {
    let calls = (|| {
        let (traceback, calls) = (py.import("traceback")?, error.traceback(py));
        let exception = (error.get_type(py), error.value(py), calls.as_ref());
        text(&traceback.call_method1("format_exception", exception)?)?
            .lines()
            .for_each(|line| say!("{line}"));
        let found = py.import("sketchnav.navigator")?.call_method1("_calls", (calls.as_ref(), CALLS))?;
        let (file, line, innermost) = found.extract::<(String, u32, String)>()?;
        PyResult::Ok(format!(
            " ({file}, line {line}); traceback (most recent call last):\n{}",
            innermost.trim_end()
        ))
    })();
    // An exception that was not raised by a line of Python code has no calls.
    format!("{place}: {error}{}", calls.unwrap_or_default()).into()
}

fn text(lines: &Bound<'_, PyAny>) -> PyResult<String> {
    lines.try_iter()?.map(|line| line?.extract::<String>()).collect()
}

impl Hosted for PythonStage {
    fn form(&self) -> &'static str {
        self.form
    }

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        self.call(Lent::default().incoming(message), "receive", |stage| {
            stage.call_method0(intern!(stage.py(), "_receive")).map(drop)
        })
    }

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.call(Lent::default().out(out), "announce", |stage| {
            stage.call_method0(intern!(stage.py(), "_announce")).map(drop)
        })
    }

    fn is_ready(&self) -> Result<bool, StageError> {
        self.call(Lent::default(), "is_ready", |stage| {
            stage.call_method0(intern!(stage.py(), "is_ready"))?.is_truthy()
        })
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.call(Lent::default().instant(instant).out(out), "step", |stage| {
            stage.call_method0(intern!(stage.py(), "_step")).map(drop)
        })
    }

    fn save(&self, room: &mut [u8]) -> Result<usize, SaveError> {
        let saved = self.call(Lent::default(), "save", |stage| {
            let state = stage.call_method0(intern!(stage.py(), "save"))?;
            let state = state.cast::<PyBytes>().map_err(|_| {
                let found = state.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
                PyTypeError::new_err(format!("expected bytes, found {found}"))
            })?;
            let state = state.as_bytes();
            Ok(room.get_mut(..state.len()).map(|room| {
                room.copy_from_slice(state);
                state.len()
            }))
        });
        saved.map_err(SaveError::Stage)?.ok_or(SaveError::Full)
    }

    fn load(&mut self, state: &[u8]) -> Result<(), StageError> {
        self.call(Lent::default(), "restore", |stage| {
            let state = PyBytes::new(stage.py(), state);
            stage.call_method1(intern!(stage.py(), "restore"), (state,)).map(drop)
        })
    }

    fn recover(&mut self, remains: &dyn Remains) -> Result<(), StageError> {
        self.call(Lent::default().remains(remains), "recover", |stage| {
            stage.call_method0(intern!(stage.py(), "recover")).map(drop)
        })
    }
}
