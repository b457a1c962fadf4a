//! The objects that a stage in Python may use while one of its methods is called, such as the instant, the incoming message and the
//! outbox.
//!
//! A host lends these objects for a single call. They are stored in a thread-local variable, from which the functions of the Python
//! module take them. Outside of calls, the variable is empty and these functions raise `RuntimeError`.

use std::cell::RefCell;

use pyo3::exceptions::{PyBaseException, PyOSError, PyRuntimeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sketchnav_stage::{Denied, Files, Incoming, Instant, Outbox, Remains, StageError};

use crate::function;
use crate::memory::{self, Memory};
use crate::table;

/// The objects that are lent for one call. The pointers are valid until the call ends.
#[derive(Default)]
pub struct Lent {
    instant: Option<*const Instant<'static>>,
    incoming: Option<*const Incoming<'static>>,
    out: Option<*mut Outbox<'static>>,
    remains: Option<*const (dyn Remains + 'static)>,
    files: Option<*const Files<'static>>,
    memories: Vec<Memory>,
    /// True if Python kept a view of a message to be sent. In that case, nothing more is sent.
    is_kept: bool,
    /// Errors of the host, each with the exception that carries it through Python.
    errors: Vec<(Py<PyBaseException>, StageError)>,
}

thread_local! {
    static LENT: RefCell<Lent> = RefCell::default();
}

impl Lent {
    pub fn instant(mut self, instant: &Instant<'_>) -> Self {
        self.instant = Some(std::ptr::from_ref(instant).cast());
        self
    }

    pub fn incoming(mut self, incoming: &Incoming<'_>) -> Self {
        self.incoming = Some(std::ptr::from_ref(incoming).cast());
        self
    }

    pub fn out(mut self, out: &mut Outbox<'_>) -> Self {
        self.out = Some(std::ptr::from_mut(out).cast());
        self
    }

    pub fn remains(mut self, remains: &dyn Remains) -> Self {
        // SAFETY: only the lifetime changes, and `during` ends before it.
        self.remains = Some(unsafe {
            std::mem::transmute::<*const (dyn Remains + '_), *const (dyn Remains + 'static)>(remains)
        });
        self
    }

    pub fn files(mut self, files: &Files<'_>) -> Self {
        // SAFETY: only the lifetime changes, and `during` ends before it.
        self.files = Some(unsafe { std::mem::transmute::<*const Files<'_>, *const Files<'static>>(files) });
        self
    }

    /// Lends these objects for the duration of `call`, and afterwards takes back the memory that Python has seen.
    ///
    /// # Errors
    /// Any error of the call, an error of the host that the call passed on, and an error if Python keeps a view of a message.
    pub fn during<R>(
        self,
        py: Python<'_>,
        call: impl FnOnce() -> PyResult<R>,
    ) -> Result<PyResult<R>, StageError> {
        struct Before(Option<Lent>);
        impl Drop for Before {
            fn drop(&mut self) {
                if let Some(before) = self.0.take() {
                    LENT.set(before);
                }
            }
        }
        let mut before = Before(Some(LENT.replace(self)));
        let result = call();
        let lent = LENT.replace(before.0.take().unwrap_or_default());
        let value = match result {
            Ok(value) => value,
            // Objects that the exception refers to may view messages until it is reported. By then, the stage has failed, and so
            // has its host.
            Err(exception) => {
                let mut errors = lent.errors.into_iter();
                let passed_on = errors.find(|(carrier, _)| carrier.is(exception.value(py)));
                return passed_on.map_or(Ok(Err(exception)), |(_, error)| Err(error));
            }
        };
        if lent.is_kept {
            return Ok(Err(memory::kept()));
        }
        let taken = lent.memories.into_iter().try_for_each(|memory| memory.take_back(py));
        Ok(taken.map(|()| value))
    }
}

fn missing(what: &str) -> PyErr {
    PyRuntimeError::new_err(format!("expected {what}, which a stage has only while it is called for that"))
}

fn instant() -> PyResult<&'static Instant<'static>> {
    let instant = LENT.with_borrow(|lent| lent.instant).ok_or_else(|| missing("an instant"))?;
    // SAFETY: the pointer is valid during the call. No reference is kept beyond the function of the module that asks for it.
    Ok(unsafe { &*instant })
}

fn incoming() -> PyResult<&'static Incoming<'static>> {
    let incoming = LENT.with_borrow(|lent| lent.incoming).ok_or_else(|| missing("an incoming message"))?;
    // SAFETY: as in `instant`.
    Ok(unsafe { &*incoming })
}

/// Calls `use_it` with the incoming message.
pub fn with_incoming<R>(use_it: impl FnOnce(&Incoming<'_>) -> R) -> PyResult<R> {
    Ok(use_it(incoming()?))
}

/// Calls `use_it` with the instant.
pub fn with_instant<R>(use_it: impl FnOnce(&Instant<'_>) -> R) -> PyResult<R> {
    Ok(use_it(instant()?))
}

/// Calls `use_it` with the outbox. In the meantime, no other function can use the outbox.
pub fn with_out<R>(use_it: impl FnOnce(&mut Outbox<'_>) -> Result<R, StageError>) -> PyResult<R> {
    if LENT.with_borrow(|lent| lent.is_kept) {
        return Err(memory::kept());
    }
    let out = LENT.with_borrow_mut(|lent| lent.out.take()).ok_or_else(|| missing("an outbox"))?;
    // SAFETY: the pointer is valid during the call, and was taken, so this is the only reference.
    let result = use_it(unsafe { &mut *out });
    LENT.with_borrow_mut(|lent| lent.out = Some(out));
    result.map_err(passed_on)
}

/// Calls `use_it` with the last messages that the process sent before it was restarted.
pub fn with_remains<R>(use_it: impl FnOnce(&dyn Remains) -> R) -> PyResult<R> {
    let remains = LENT.with_borrow(|lent| lent.remains).ok_or_else(|| missing("the remains"))?;
    // SAFETY: as in `instant`.
    Ok(use_it(unsafe { &*remains }))
}

/// Converts an error to an exception. If the error wraps an exception, returns that one. Otherwise, stores the error of the host
/// and returns an exception that carries it through Python.
fn passed_on(error: StageError) -> PyErr {
    let error = match error.downcast::<PyErr>() {
        Ok(exception) => return *exception,
        Err(error) => error,
    };
    let exception = PyRuntimeError::new_err(error.to_string());
    let carrier = Python::attach(|py| exception.value(py).clone().unbind());
    LENT.with_borrow_mut(|lent| lent.errors.push((carrier, error)));
    exception
}

pub fn denied(error: Denied) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Returns a read-only view of bytes that stay valid during the call.
fn view<'py>(py: Python<'py>, bytes: &[u8]) -> PyResult<Bound<'py, PyAny>> {
    // SAFETY: the host keeps the message until the call ends, and `during` takes the memory back. It cannot be written.
    let (memory, view) = unsafe { Memory::lend(py, (bytes.as_ptr().cast_mut(), bytes.len()), true) }?;
    LENT.with_borrow_mut(|lent| lent.memories.push(memory));
    Ok(view)
}

/// Lets Python fill a message and its cells in place. If Python keeps a view of them, records that in `LENT`.
fn fill(fill: &Bound<'_, PyAny>, message: &mut [u8], cells: &mut [u8]) -> PyResult<()> {
    let py = fill.py();
    // SAFETY: the slices are used by nothing else. If a memory cannot be taken back, the message is not sent, and neither is
    // another one that could lie in the same place.
    let (message, view) = unsafe { Memory::lend(py, (message.as_mut_ptr(), message.len()), false) }?;
    // SAFETY: as above.
    let (cells, cells_view) = unsafe { Memory::lend(py, (cells.as_mut_ptr(), cells.len()), false) }?;
    let filled = fill.call1((view, cells_view)).map(drop);
    if let Err(exception) = &filled {
        // If this fails, the views are found below.
        let _ = clear_frames(py, exception);
    }
    let taken = [message, cells].map(|memory| memory.take_back(py));
    if taken.iter().any(Result::is_err) {
        LENT.with_borrow_mut(|lent| lent.is_kept = true);
    }
    taken.into_iter().fold(filled, Result::and)
}

/// Clears the local variables in the frames of an exception, and of the exceptions that it was raised from, since they may be views
/// of a message.
fn clear_frames(py: Python<'_>, exception: &PyErr) -> PyResult<()> {
    let module = py.import(intern!(py, "traceback"))?;
    let clear = |calls| module.call_method1(intern!(py, "clear_frames"), (calls,)).map(drop);
    clear(exception.traceback(py).map(Bound::into_any))?;
    let mut before = exception.value(py).getattr(intern!(py, "__context__"))?;
    while !before.is_none() {
        clear(Some(before.getattr(intern!(py, "__traceback__"))?))?;
        before = before.getattr(intern!(py, "__context__"))?;
    }
    Ok(())
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"instant", |_| with_instant(|instant| (instant.tick, instant.stamp_ns)))?;
    function(module, c"newest", |arguments| {
        let (channel, is_fresh) = arguments.extract::<(usize, bool)>()?;
        let reading = instant()?.reading(table::spec(channel)?).map_err(denied)?;
        let reading = reading.filter(|reading| reading.is_fresh || !is_fresh);
        reading.map(|reading| Ok(view(arguments.py(), reading.message)?.unbind())).transpose()
    })?;
    function(module, c"incoming", |arguments| {
        let (channel,) = arguments.extract::<(usize,)>()?;
        let message = incoming()?.bytes_on(table::spec(channel)?).map_err(denied)?;
        message.map(|message| Ok(view(arguments.py(), message)?.unbind())).transpose()
    })?;
    function(module, c"cells", |arguments| Ok(view(arguments.py(), incoming()?.cells())?.unbind()))?;
    function(module, c"attempts", |_| with_incoming(|incoming| incoming.attempts))?;
    function(module, c"send", |arguments| {
        let (channel, cells, filler) = arguments.extract::<(usize, usize, Bound<'_, PyAny>)>()?;
        let spec = table::spec(channel)?;
        with_out(|out| out.send_bytes(spec, cells, |message, cells| Ok(fill(&filler, message, cells)?)))
    })?;
    function(module, c"file", |arguments| {
        let (name,) = arguments.extract::<(String,)>()?;
        let files = LENT.with_borrow(|lent| lent.files).ok_or_else(|| missing("the files of a run"))?;
        // SAFETY: as in `instant`.
        let bytes =
            unsafe { &*files }(&name).map_err(|error| PyOSError::new_err(format!("{name}: {error}")))?;
        Ok(PyBytes::new(arguments.py(), &bytes).unbind())
    })
}
