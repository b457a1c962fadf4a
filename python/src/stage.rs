//! A stage that is an object in Python.

use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sketchnav_schemas::say;
use sketchnav_stage::{Heard, Hosted, Instant, Outbox, Remains, StageError};

use crate::lent::Lent;

/// An object of the class `Stage`, which calls the author's methods.
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
        Python::attach(|py| {
            let object = self.object.bind(py);
            lent.during(py, || call(object))?.map_err(|error| failure(py, &place(object, method), error))
        })
    }
}

fn place(object: &Bound<'_, PyAny>, method: &str) -> String {
    let class = object.get_type().name().map_or_else(|_| "stage".to_owned(), |name| name.to_string());
    format!("{class}.{method}")
}

/// Prints the traceback of an exception, and returns an error that names the exception and its line.
pub fn failure(py: Python<'_>, place: &str, error: PyErr) -> StageError {
    let told = (|| {
        let traceback = py.import("traceback")?;
        let lines = traceback.call_method1("format_exception", (error.value(py),))?;
        for line in lines.try_iter()?.collect::<PyResult<Vec<_>>>()? {
            line.to_string().trim_end().lines().for_each(|line| say!("{line}"));
        }
        let frames = traceback.call_method1("extract_tb", (error.traceback(py),))?;
        let last = frames.get_item(-1)?;
        PyResult::Ok(format!(" ({}, line {})", last.getattr("filename")?, last.getattr("lineno")?))
    })();
    format!("{place}: {error}{}", told.unwrap_or_default()).into()
}

impl Hosted for PythonStage {
    fn form(&self) -> &'static str {
        self.form
    }

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        self.call(Lent::default().heard(message), "hear", |stage| {
            stage.call_method0(intern!(stage.py(), "_hear")).map(drop)
        })
    }

    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.call(Lent::default().out(out), "speak", |stage| {
            stage.call_method0(intern!(stage.py(), "_speak")).map(drop)
        })
    }

    fn is_ready(&self) -> bool {
        let asked = self.call(Lent::default(), "is_ready", |stage| {
            stage.call_method0(intern!(stage.py(), "is_ready"))?.is_truthy()
        });
        // A stage that cannot say so takes its step, and fails there.
        asked.unwrap_or(true)
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.call(Lent::default().instant(instant).out(out), "step", |stage| {
            stage.call_method0(intern!(stage.py(), "_step")).map(drop)
        })
    }

    fn save(&self, room: &mut [u8]) -> Result<usize, postcard::Error> {
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
        match saved {
            Ok(Some(length)) => Ok(length),
            Ok(None) => Err(postcard::Error::SerializeBufferFull),
            Err(error) => {
                say!("{error}");
                Err(postcard::Error::SerdeSerCustom)
            }
        }
    }

    fn load(&mut self, state: &[u8]) -> Result<(), StageError> {
        self.call(Lent::default(), "restore", |stage| {
            let state = PyBytes::new(stage.py(), state);
            stage.call_method1(intern!(stage.py(), "restore"), (state,)).map(drop)
        })
    }

    fn recover(&mut self, remains: &dyn Remains) {
        let recovered = self.call(Lent::default().remains(remains), "recover", |stage| {
            stage.call_method0(intern!(stage.py(), "recover")).map(drop)
        });
        if let Err(error) = recovered {
            say!("{error}");
        }
    }
}
