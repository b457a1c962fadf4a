//! Histograms of forces for Python.

use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use sketchnav_qualitative::hof::{Force, Grade, Pair, Polygon, Surround, View, Workspace};
use sketchnav_qualitative::{Error, Point};

use super::arrays::Array;
use super::{bytes, rejected};
use crate::function;

/// Creates a polygon from rings, each an array of corners.
fn polygon(name: &str, rings: &[Bound<'_, PyAny>]) -> PyResult<Polygon> {
    let ring = |(i, ring): (usize, &Bound<'_, PyAny>)| -> PyResult<Vec<Point>> {
        let name = if rings.len() == 1 { name.to_owned() } else { format!("{name}[{i}]") };
        let array = Array::new(name.clone(), ring)?;
        let missing =
            |corner| PyValueError::new_err(format!("{name}[{corner}]: expected a corner, found NaN"));
        let [corners, ..] = array.shape();
        (0..corners).map(|corner| array.object::<Point>(corner, 0)?.ok_or_else(|| missing(corner))).collect()
    };
    let corners = rings.iter().enumerate().map(ring).collect::<PyResult<Vec<_>>>()?;
    Polygon::from_rings(corners).map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}

/// Creates polygons from the first two arguments.
fn polygons(arguments: &Bound<'_, PyTuple>) -> PyResult<[Polygon; 2]> {
    let rings = |i| arguments.get_item(i)?.extract::<Vec<Bound<'_, PyAny>>>();
    Ok([polygon("argument", &rings(0)?)?, polygon("referent", &rings(1)?)?])
}

/// Reads a histogram. Infinity stands for an infinite force.
fn histogram(array: &PyBuffer<f64>, py: Python<'_>) -> PyResult<Vec<Force>> {
    let force = |(i, force): (usize, f64)| match force {
        f64::INFINITY => Ok(Force::Infinite),
        0.0.. => Ok(Force::Finite(force)),
        _ => {
            let expected = "expected a force from 0 to infinity";
            Err(PyValueError::new_err(format!("histogram[{i}]: {expected}, found {force}")))
        }
    };
    let forces: Vec<_> = array.to_vec(py)?.into_iter().enumerate().map(force).collect::<PyResult<_>>()?;
    let is_some = !forces.is_empty();
    is_some
        .then_some(forces)
        .ok_or_else(|| PyValueError::new_err("histogram: expected a force or more, found none"))
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"forces_histogram", |arguments| {
        let [argument, referent] = polygons(arguments)?;
        let exponent = arguments.get_item(2)?.extract::<f64>()?;
        let directions = arguments.get_item(3)?.extract::<usize>()?;
        let mut forces = vec![Force::ZERO; directions];
        let pair = Pair::new(&argument, &referent);
        pair.histogram_into(exponent, &mut forces, &mut Workspace::default()).map_err(rejected)?;
        let number = |force: Force| force.finite().unwrap_or(f64::INFINITY).to_ne_bytes();
        Ok(bytes(arguments.py(), &forces, number).unbind())
    })?;
    function(module, c"forces_distance", |arguments| {
        let [argument, referent] = polygons(arguments)?;
        Ok(argument.distance(&referent))
    })?;
    function(module, c"forces_degrees", |arguments| {
        let (forces, directions_rad) = arguments.extract::<(PyBuffer<f64>, PyBuffer<f64>)>()?;
        let py = arguments.py();
        let forces = histogram(&forces, py)?;
        let view = View::new(&forces, 0.0);
        let mut degrees = directions_rad.to_vec(py)?;
        for (i, degree) in degrees.iter_mut().enumerate() {
            if !degree.is_finite() {
                let error =
                    Error::Parameter { what: "direction", expected: "a finite angle", found: *degree };
                return Err(PyValueError::new_err(format!("directions_rad[{i}]: {error}")));
            }
            *degree = view.degree(*degree).unwrap_or(f64::NAN);
        }
        Ok(bytes(py, &degrees, f64::to_ne_bytes).unbind())
    })?;
    function(module, c"forces_assess", |arguments| {
        let (forces, gravitational, heading_rad, directions) =
            arguments.extract::<(PyBuffer<f64>, Option<PyBuffer<f64>>, f64, usize)>()?;
        let py = arguments.py();
        let forces = histogram(&forces, py)?;
        let gravitational = gravitational.map(|forces| histogram(&forces, py)).transpose()?;
        let view = View::new(&forces, heading_rad);
        let found = match &gravitational {
            Some(forces) => view.assess_with(&View::new(forces, heading_rad), directions),
            None => view.assess(directions),
        };
        Ok(found.map(|found| {
            let grade = match found.grade() {
                Grade::Unsatisfactory => "unsatisfactory",
                Grade::RatherSatisfactory => "rather satisfactory",
                Grade::Satisfactory => "satisfactory",
            };
            (found.direction, found.degree, grade)
        }))
    })?;
    function(module, c"forces_surround", |arguments| {
        let (width_rad, main, directions, can_escape) = arguments.extract::<(f64, usize, usize, bool)>()?;
        Ok(Surround::by_width(width_rad, main, directions, can_escape).map(|found| match found {
            Surround::From(direction) => ("from", Some(direction)),
            Surround::OpeningAt(direction) => ("opening", Some(direction)),
            Surround::Completely => ("completely", None),
        }))
    })?;
    function(module, c"forces_extent", |arguments| {
        let (forces,) = arguments.extract::<(PyBuffer<f64>,)>()?;
        let forces = histogram(&forces, arguments.py())?;
        let view = View::new(&forces, 0.0);
        Ok((view.width_rad(), view.opening()))
    })
}
