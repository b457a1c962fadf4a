//! QSRlib's relations for Python, computed from rows of numbers.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sketchnav_qualitative::Point;
use sketchnav_qualitative::mos::Motion;
use sketchnav_qualitative::order::Order;
use sketchnav_qualitative::qsrlib::{self, Box2, Parameters, Which};
use sketchnav_qualitative::rcc::{Rcc2, Rcc3, Rcc4, Rcc5};

use super::arrays::Array;
use super::{given, rejected};
use crate::function;

/// Returns the word of the relation in each row.
fn words(which: Which, arrays: &[Array], quantisation: f64) -> PyResult<Vec<String>> {
    let [rows, ..] = arrays[0].shape();
    let point = |i: usize, row| arrays[i].present::<Point>(row);
    let boxes = |row| Ok::<[Box2; 2], PyErr>([arrays[0].present(row)?, arrays[1].present(row)?]);
    let rcc8 = |row| boxes(row).map(|[a, b]| qsrlib::rcc8(a, b, quantisation));
    let word = |row| {
        Ok(match which {
            Which::Cardir => boxes(row).map(|[a, b]| qsrlib::direction(a, b).to_string())?,
            Which::Ra => boxes(row).map(|[a, b]| qsrlib::rectangular(a, b).to_string())?,
            Which::Rcc2 => Rcc2::from(rcc8(row)?).to_string(),
            Which::Rcc3 => Rcc3::from(rcc8(row)?).to_string(),
            Which::Rcc4 => Rcc4::from(rcc8(row)?).to_string(),
            Which::Rcc5 => Rcc5::from(rcc8(row)?).to_string(),
            Which::Rcc8 => rcc8(row)?.to_string(),
            Which::Mos => Motion::of(point(0, row)?, point(1, row)?, quantisation).to_string(),
            Which::Tpcc => qsrlib::tpcc(point(0, row)?, point(1, row)?, point(2, row)?).to_string(),
            Which::Mwe => Order::of(point(0, row)?, point(1, row)?).to_string(),
            Which::Argd | Which::Qtcbs | Which::Qtccs | Which::Qtcbcs => {
                return Err(PyValueError::new_err(format!(
                    "expected a calculus of single samples, found {which}"
                )));
            }
        })
    };
    (0..rows).map(word).collect()
}

/// Returns the words of the QTC relations of two points, one for each step. Unless the steps are independent, a step begins where
/// the previous one ends.
fn steps(which: Which, arrays: &[Array], parameters: &Parameters) -> PyResult<Vec<String>> {
    let [rows, ..] = arrays[0].shape();
    let pair = |of: [usize; 2], row| {
        Ok::<[Point; 2], PyErr>([arrays[of[0]].present(row)?, arrays[of[1]].present(row)?])
    };
    let (before, after) = ([0, 2], [1, 3]);
    let found = if parameters.no_collapse && !parameters.validate {
        let step = |row| Ok(qsrlib::qtc(which, &[pair(before, row)?, pair(after, row)?], parameters));
        (0..rows).map(step).collect::<PyResult<Vec<_>>>()?.concat()
    } else {
        let first = (rows > 0).then(|| pair(before, 0));
        let points = first.into_iter().chain((0..rows).map(|row| pair(after, row)));
        qsrlib::qtc(which, &points.collect::<PyResult<Vec<_>>>()?, parameters)
    };
    Ok(found.iter().map(ToString::to_string).collect())
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"qsrlib_relations", |arguments| {
        let (which, names, arrays, quantisation) =
            arguments.extract::<(String, Vec<String>, Vec<Bound<'_, PyAny>>, f64)>()?;
        let given = given(names, arrays, None, arguments.py())?;
        words(which.parse().map_err(rejected)?, &given.arrays, quantisation)
    })?;
    // The arrays are the positions of the first object before and after each step, followed by those of the
    // second one.
    function(module, c"qsrlib_steps", |arguments| {
        let (which, names, arrays, (quantisation_factor, distance_threshold, no_collapse, validate)) =
            arguments.extract::<(String, Vec<String>, Vec<Bound<'_, PyAny>>, (f64, f64, bool, bool))>()?;
        let parameters = Parameters {
            quantisation_factor,
            distance_threshold,
            no_collapse,
            validate,
            ..Parameters::default()
        };
        let given = given(names, arrays, None, arguments.py())?;
        steps(which.parse().map_err(rejected)?, &given.arrays, &parameters)
    })
}
