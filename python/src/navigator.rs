//! Navigators in Python, and the command line that includes them.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::{Robot, SENSORS};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::account::Account;
use sketchnav_stage::{Files, Hosted, Make, Navigator, Review, StageError};

use crate::account::PythonAccount;
use crate::lent::Lent;
use crate::stage::{PythonStage, failure};
use crate::{agenda, function, table};

/// A navigator written in Python, which is an object of the class `Navigator`.
struct PythonNavigator {
    kind: &'static str,
    sensors: Vec<&'static str>,
    object: Py<PyAny>,
}

static KNOWN: OnceLock<Vec<PythonNavigator>> = OnceLock::new();

const STAGES: [Make; 3] = [make::<0>, make::<1>, make::<2>];

/// Returns the Python navigator of this kind. Every navigator in Python has the same functions in its [`Navigator`], and these
/// functions use `known` to find the navigator that the mission names.
fn known(kind: &str) -> Result<&'static PythonNavigator, StageError> {
    let found = KNOWN.get().into_iter().flatten().find(|known| known.kind == kind);
    found.ok_or_else(|| {
        format!("navigator.kind: expected one that is written in Python, found {kind:?}").into()
    })
}

fn make<const STAGE: usize>(run: &RunConfig, files: &Files<'_>) -> Result<Box<dyn Hosted>, StageError> {
    let navigator = known(run.mission.navigator_kind())?;
    let config = serde_json::to_string(run)?;
    Python::attach(|py| {
        let made = Lent::default().files(files).during(py, || {
            let capsule = PyCapsule::new_with_value(py, run.clone(), agenda::RUN)?;
            let stage = navigator.object.bind(py).call_method1("_make", (STAGE, config, capsule))?;
            let form = stage.getattr("form")?.extract::<String>()?;
            Ok(PythonStage::new(stage.unbind(), table::interned(&form)))
        })?;
        let stage = made.map_err(|error| failure(py, navigator.kind, error))?;
        Ok(Box::new(stage) as Box<dyn Hosted>)
    })
}

fn check(mission: &Mission, robot: &Robot) -> Result<(), StageError> {
    let navigator = known(mission.navigator_kind())?;
    for sensor in &navigator.sensors {
        robot.require(sensor)?;
    }
    let (mission, robot) = (serde_json::to_string(mission)?, serde_json::to_string(robot)?);
    Python::attach(|py| {
        let object = navigator.object.bind(py);
        object.call_method1("_check", (mission, robot)).map(drop).map_err(|error| {
            // A `ValueError` reports a mistake in the mission, so it is shown without a traceback.
            match error.is_instance_of::<PyValueError>(py) {
                true => error.value(py).to_string().into(),
                false => failure(py, navigator.kind, error),
            }
        })
    })
}

fn review(run: &RunConfig) -> Box<dyn Account> {
    let make = || {
        let navigator = known(run.mission.navigator_kind())?;
        let config = serde_json::to_string(run)?;
        Python::attach(|py| {
            let made = navigator.object.bind(py).call_method1("_account", (config,));
            made.map(Bound::unbind).map_err(|error| failure(py, navigator.kind, error))
        })
    };
    Box::new(PythonAccount::new(make()))
}

/// Checks that `word` names a table of sensors in robot files.
fn sensor(word: &str) -> PyResult<&'static str> {
    SENSORS.into_iter().find(|table| *table == word).ok_or_else(|| {
        PyValueError::new_err(format!("sensors: expected one of {}, found {word:?}", SENSORS.join(", ")))
    })
}

/// Reads the attributes of a navigator, and builds the [`Navigator`] that registers it.
fn read(object: &Bound<'_, PyAny>) -> PyResult<(PythonNavigator, Navigator)> {
    let kind = table::interned(&object.getattr("kind")?.extract::<String>()?);
    let about = table::interned(&object.getattr("about")?.extract::<String>()?);
    let sensors = object.getattr("sensors")?.extract::<Vec<String>>()?;
    let sensors = sensors.iter().map(|word| sensor(word)).collect::<PyResult<Vec<_>>>()?;
    let channels = object.call_method0("_channels")?.extract::<Vec<usize>>()?;
    let channels = channels.into_iter().map(table::spec).collect::<PyResult<Vec<_>>>()?;
    let account = (!object.getattr("account")?.is_none()).then_some(review as Review);
    let navigator =
        Navigator { check, channels: channels.leak(), account, ..Navigator::new(kind, about, STAGES) };
    Ok((PythonNavigator { kind, sensors, object: object.clone().unbind() }, navigator))
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"main", |arguments| {
        type Given<'py> = (Vec<Bound<'py, PyAny>>, PathBuf, Vec<OsString>, Vec<OsString>);
        let (navigators, program, first, words) = arguments.extract::<Given<'_>>()?;
        let read = navigators.iter().map(read).collect::<PyResult<Vec<_>>>()?;
        let (known, navigators): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        KNOWN.set(known).map_err(|_| PyRuntimeError::new_err("main: expected one call in a process"))?;
        sketchnav::start_by(program, first);
        // Other threads may host stages while this one waits for them.
        Ok(arguments.py().detach(|| sketchnav::run(navigators.leak(), words)))
    })
}
