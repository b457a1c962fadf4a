//! The agenda of planners for Python.

use std::ffi::CStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyTuple};
use sketchnav_motion::agenda::{Agenda, Due, Phase};
use sketchnav_schemas::channels::ODOMETRY;
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::run::RunConfig;

use crate::{function, lent};

/// Name of the capsules that contain a [`RunConfig`].
pub const RUN: &CStr = c"sketchnav.run";
const AGENDA: &CStr = c"sketchnav.agenda";

/// Returns the agenda from the capsule that is the first argument.
fn agenda<'a>(arguments: &'a Bound<'_, PyTuple>) -> PyResult<MutexGuard<'a, Agenda>> {
    let capsule = arguments.get_item(0)?.cast_into::<PyCapsule>()?;
    let pointer = capsule.pointer_checked(Some(AGENDA))?.cast::<Mutex<Agenda>>();
    // SAFETY: capsules of this name contain an agenda. The arguments own a reference to the capsule for as long as they are
    // borrowed.
    let agenda: &'a Mutex<Agenda> = unsafe { pointer.as_ref() };
    Ok(agenda.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Extracts one of the arguments that follow the agenda.
fn argument<'py, T>(arguments: &Bound<'py, PyTuple>, index: usize) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    arguments.get_item(index)?.extract()
}

fn state(word: &str) -> PyResult<TaskState> {
    word.parse().map_err(|error: String| PyValueError::new_err(format!("state: {error}")))
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"agenda", |arguments| {
        let capsule = arguments.get_item(0)?.cast_into::<PyCapsule>()?;
        let run = capsule.pointer_checked(Some(RUN))?.cast::<RunConfig>();
        // SAFETY: capsules of this name contain a run, and the arguments own a reference to this one.
        let agenda = Agenda::new(unsafe { run.as_ref() });
        Ok(PyCapsule::new_with_value(arguments.py(), Mutex::new(agenda), AGENDA)?.unbind())
    })?;
    function(module, c"agenda_receive", |arguments| {
        let mut agenda = agenda(arguments)?;
        lent::with_incoming(|incoming| agenda.receive(incoming).map(|order| order.is_some()))?
            .map_err(lent::denied)
    })?;
    function(module, c"agenda_is_ready", |arguments| {
        Ok(agenda(arguments)?.is_ready(argument::<bool>(arguments, 1)?))
    })?;
    function(module, c"agenda_begin_step", |arguments| {
        let mut agenda = agenda(arguments)?;
        lent::with_instant(|instant| {
            let odometry = instant.newest(ODOMETRY).map_err(lent::denied)?;
            Ok(odometry.map(|odometry| agenda.begin_step(instant.stamp_ns, odometry)))
        })?
    })?;
    function(module, c"agenda_due", |arguments| {
        let missing = argument::<Option<String>>(arguments, 1)?;
        Ok(match agenda(arguments)?.due(missing) {
            Due::Begin => "begin",
            Due::Drive => "drive",
            Due::Stand => "stand",
        })
    })?;
    function(module, c"agenda_keep_going", |arguments| {
        Ok(agenda(arguments)?.keep_going(argument::<String>(arguments, 1)?))
    })?;
    function(module, c"agenda_end", |arguments| {
        let state = state(&argument::<String>(arguments, 1)?)?;
        agenda(arguments)?.end(state, argument::<String>(arguments, 2)?);
        Ok(())
    })?;
    function(module, c"agenda_lose", |arguments| {
        agenda(arguments)?.lose(argument::<String>(arguments, 1)?);
        Ok(())
    })?;
    function(module, c"agenda_send", |arguments| {
        let agenda = agenda(arguments)?;
        let [vx_mps, vy_mps, yaw_rate_radps, remaining_m] = argument::<[f64; 4]>(arguments, 1)?;
        lent::with_out(|out| agenda.send(Twist { vx_mps, vy_mps, yaw_rate_radps }, remaining_m, out))
    })?;
    function(module, c"agenda_now", |arguments| {
        let agenda = agenda(arguments)?;
        let phase = match agenda.phase() {
            Phase::Waiting => "waiting",
            Phase::Driving => "driving",
            Phase::Ended => "ended",
            Phase::Over => "over",
        };
        Ok((phase, agenda.task(), agenda.elapsed_s(), agenda.is_driving()))
    })?;
    function(module, c"agenda_save", |arguments| {
        let bytes = postcard::to_stdvec(&agenda(arguments)?.standing());
        let bytes = bytes.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(PyBytes::new(arguments.py(), &bytes).unbind())
    })?;
    function(module, c"agenda_restore", |arguments| {
        let state = arguments.get_item(1)?.cast_into::<PyBytes>()?;
        let standing = postcard::from_bytes(state.as_bytes());
        let error = |error| PyValueError::new_err(format!("state of an agenda: {error}"));
        agenda(arguments)?.restore(standing.map_err(error)?);
        Ok(())
    })?;
    function(module, c"agenda_recover", |arguments| {
        let mut agenda = agenda(arguments)?;
        lent::with_remains(|remains| agenda.recover(remains))
    })
}
