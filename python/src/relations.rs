//! Qualitative relations for Python: arrays of positions in, arrays of relations out.
//!
//! Python holds a calculus with its parameters in a capsule (see `calculi`). The functions of the calculus read arrays in place
//! (see `arrays`) and represent relations by their numbers in the calculus. The classes and their documentation are in
//! `python/sketchnav/relations`.

mod arrays;
mod calculi;
mod forces;
mod qsrlib;
mod related;

use std::ffi::CStr;

use pyo3::buffer::PyBuffer;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyCapsule, PyTuple};
use sketchnav_qualitative::tpcc::Permutation;
use sketchnav_qualitative::{Error, Inconsistent, Options};

use crate::function;
use arrays::Array;
use calculi::Spec;
use related::{Given, Question, Related, Task};

const CALCULUS: &CStr = c"sketchnav.relations.calculus";

/// Returns the calculus from the capsule that is the first argument.
fn calculus<'a>(arguments: &'a Bound<'_, PyTuple>) -> PyResult<&'a dyn Related> {
    let capsule = arguments.get_item(0)?.cast_into::<PyCapsule>()?;
    let pointer = capsule.pointer_checked(Some(CALCULUS))?.cast::<Box<dyn Related>>();
    // SAFETY: capsules of this name contain a calculus. The arguments own a reference to the capsule for as long as they are
    // borrowed.
    Ok(unsafe { pointer.as_ref() }.as_ref())
}

fn rejected(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Opens arrays that have the same number of samples and of tracks.
fn given(
    names: Vec<String>,
    arrays: Vec<Bound<'_, PyAny>>,
    times_s: Option<PyBuffer<f64>>,
    py: Python<'_>,
) -> PyResult<Given> {
    let arrays = names.into_iter().zip(&arrays).map(|(name, array)| Array::new(name, array));
    let arrays: Vec<_> = arrays.collect::<PyResult<_>>()?;
    let times_s = times_s.map(|times_s| times_s.to_vec(py)).transpose()?;
    let [samples, tracks, _] = arrays.first().map_or([0; 3], Array::shape);
    let is_alike = |array: &Array| array.shape()[..2] == [samples, tracks];
    let is_timed = times_s.as_ref().is_none_or(|times_s| times_s.len() == samples);
    if arrays.is_empty() || !arrays.iter().all(is_alike) || !is_timed {
        return Err(PyValueError::new_err("expected arrays of as many samples and tracks"));
    }
    Ok(Given { arrays, times_s })
}

/// Copies numbers into a `bytearray`.
fn bytes<'py, T: Copy, const N: usize>(
    py: Python<'py>,
    numbers: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> Bound<'py, PyByteArray> {
    PyByteArray::new(py, &numbers.iter().flat_map(|number| bytes(*number)).collect::<Vec<_>>())
}

fn question(word: &str) -> PyResult<Question> {
    Ok(match word {
        "converse" => Question::Converse,
        "neighbours" => Question::Neighbours,
        "compose" => Question::Compose,
        "inverse" => Question::Permuted(Permutation::Inverse),
        "short cut" => Question::Permuted(Permutation::ShortCut),
        "inverse short cut" => Question::Permuted(Permutation::InverseShortCut),
        "homing" => Question::Permuted(Permutation::Homing),
        "inverse homing" => Question::Permuted(Permutation::InverseHoming),
        _ => {
            let expected = "inverse, short cut, inverse short cut, homing or inverse homing";
            return Err(PyValueError::new_err(format!("by: expected {expected}, found {word:?}")));
        }
    })
}

fn task(word: &str) -> PyResult<Task> {
    match word {
        "close" => Ok(Task::Close),
        "scenario" => Ok(Task::Scenario),
        "minimal" => Ok(Task::Minimal),
        _ => Err(PyValueError::new_err(format!("expected close, scenario or minimal, found {word:?}"))),
    }
}

/// Returns the objects whose relations contradict each other: two objects, or three with the second one in between. Empty if the
/// network has no scenario although no two or three objects show that.
fn contradiction(found: Inconsistent) -> Vec<usize> {
    match found {
        Inconsistent::Pair { first, second } => vec![first, second],
        Inconsistent::Triangle { first, via, second } => vec![first, via, second],
        Inconsistent::NoScenario => Vec::new(),
    }
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"relations_open", |arguments| {
        let (spec,) = arguments.extract::<(String,)>()?;
        let spec: Spec =
            serde_json::from_str(&spec).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let calculus = spec.open().map_err(rejected)?;
        Ok(PyCapsule::new_with_value(arguments.py(), calculus, CALCULUS)?.unbind())
    })?;
    function(module, c"relations_words", |arguments| Ok(calculus(arguments)?.words()))?;
    function(module, c"relations_code", |arguments| {
        let word = arguments.get_item(1)?.extract::<String>()?;
        calculus(arguments)?.parse(&word).map_err(rejected)
    })?;
    function(module, c"relations_relate", relate)?;
    function(module, c"relations_series", |arguments| {
        let (_, names, arrays, times_s, options) = arguments.extract::<(
            Bound<'_, PyAny>,
            Vec<String>,
            Vec<Bound<'_, PyAny>>,
            Option<PyBuffer<f64>>,
            (bool, bool, Option<f64>),
        )>()?;
        let (collapse, validate, max_gap_s) = options;
        let py = arguments.py();
        let given = given(names, arrays, times_s, py)?;
        let found = calculus(arguments)?.series(&given, Options { collapse, validate, max_gap_s })?;
        let [from_s, to_s] =
            [found.from_s, found.to_s].map(|times_s| bytes(py, &times_s, f64::to_ne_bytes).unbind());
        let relations = bytes(py, &found.relations, i16::to_ne_bytes).unbind();
        Ok((from_s, to_s, relations, bytes(py, &found.changes, i8::to_ne_bytes).unbind()))
    })?;
    function(module, c"relations_answer", |arguments| {
        let (_, asked, relations) = arguments.extract::<(Bound<'_, PyAny>, String, Vec<usize>)>()?;
        Ok(calculus(arguments)?.answer(&question(&asked)?, &relations))
    })?;
    function(module, c"relations_reason", |arguments| {
        let (_, asked, objects, sets) =
            arguments.extract::<(Bound<'_, PyAny>, String, usize, Vec<Vec<usize>>)>()?;
        let reasoned = calculus(arguments)?.reason(&task(&asked)?, objects, &sets);
        Ok(reasoned.map(|reasoned| match reasoned {
            Ok(sets) => (true, sets),
            Err(found) => (false, vec![contradiction(found)]),
        }))
    })?;
    forces::add(module)?;
    qsrlib::add(module)
}

/// Fills the last argument, an array, with the relations of the objects in the other arrays.
fn relate(arguments: &Bound<'_, PyTuple>) -> PyResult<()> {
    let (_, names, arrays, times_s, out) = arguments.extract::<(
        Bound<'_, PyAny>,
        Vec<String>,
        Vec<Bound<'_, PyAny>>,
        Option<PyBuffer<f64>>,
        PyBuffer<i16>,
    )>()?;
    let given = given(names, arrays, times_s, arguments.py())?;
    let [samples, tracks, _] = given.arrays[0].shape();
    if out.readonly() || !out.is_c_contiguous() || out.item_count() != samples * tracks {
        return Err(PyTypeError::new_err("expected a contiguous array of 16-bit numbers to write to"));
    }
    // SAFETY: the buffer is contiguous, aligned and writable, and has one number per sample and track. It is a new array, which
    // nothing else accesses while the interpreter is attached.
    let out = unsafe { std::slice::from_raw_parts_mut(out.buf_ptr().cast::<i16>(), out.item_count()) };
    calculus(arguments)?.relate(&given, out)
}
