//! A driver in Python: the functions behind `sketchnav.drive`.
//!
//! A process has a single driver, which belongs to the thread that opened it.

use std::cell::RefCell;
use std::time::Duration;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;
use sketchnav_driver::{Clock, Driver, DriverError};
use sketchnav_schemas::channels::{ODOMETRY, TRUTH};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::Twist;

use crate::{function, table};

thread_local! {
    static DRIVER: RefCell<Option<Driver>> = const { RefCell::new(None) };
}

fn raised(error: DriverError) -> PyErr {
    match error {
        DriverError::Runtime(_) | DriverError::Over { .. } => PyRuntimeError::new_err(error.to_string()),
        error if error.concerns_the_system() => PyRuntimeError::new_err(error.to_string()),
        error => PyValueError::new_err(error.to_string()),
    }
}

/// Calls `use_it` with the driver that this thread has opened.
fn with<R>(use_it: impl FnOnce(&mut Driver) -> Result<R, DriverError>) -> PyResult<R> {
    DRIVER.with_borrow_mut(|driver| match driver {
        Some(driver) => use_it(driver).map_err(raised),
        None => Err(PyRuntimeError::new_err(
            "driver: expected a call inside `with sketchnav.drive(…)`, by the thread that entered it",
        )),
    })
}

/// Joins a system, and returns what the Python side needs at the start as JSON: the run, the tick period, and the last poses sent
/// by an earlier driver.
fn join(system: &str, clock: Clock) -> PyResult<String> {
    if DRIVER.with_borrow(Option::is_some) {
        return Err(PyRuntimeError::new_err("driver: expected one in a process, found another one"));
    }
    let joined = Driver::join(system, clock).and_then(|mut driver| {
        let numbers = |pose: (f64, f64, f64)| json!([pose.0, pose.1, pose.2]);
        let odometry = driver.last_of(ODOMETRY)?.map(|last| last.pose());
        let truth = driver.last_of(TRUTH)?.map(|last| last.pose());
        let facts = json!({
            "run": driver.run(),
            "period_ns": driver.period_ns(),
            "odometry": odometry.map(|pose| numbers((pose.x, pose.y, pose.yaw_rad))),
            "truth": truth.map(|pose| numbers((pose.x, pose.y, pose.yaw_rad))),
        });
        Ok((driver, facts.to_string()))
    });
    let (driver, facts) = joined.map_err(raised)?;
    DRIVER.set(Some(driver));
    Ok(facts)
}

/// Returns the walls and the furniture in the run's world as JSON.
fn floor() -> PyResult<String> {
    let run = with(|driver| Ok(driver.run().clone()))?;
    let read = sketchnav_recordings::sources::of_run(&run).map_err(|error| error.to_string());
    let floor = read.and_then(|files| {
        sketchnav_sim::files::world_in(&*files, &run.mission.world).map_err(|error| error.to_string())
    });
    let floor = floor.map_err(PyValueError::new_err)?;
    let corners = |solids: &[sketchnav_sim::convex::Convex]| {
        json!(solids.iter().map(|solid| solid.corners()).collect::<Vec<_>>())
    };
    let (walls, furniture) = (corners(&floor.walls), corners(&floor.furniture));
    Ok(json!({ "faces": floor.outline, "walls": walls, "furniture": furniture }).to_string())
}

/// Adds the functions of this module.
pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    function(module, c"driver_join", |arguments| {
        let (system, is_simulated) = arguments.extract::<(String, bool)>()?;
        let clock = if is_simulated { Clock::Simulator } else { Clock::Robot };
        arguments.py().detach(|| join(&system, clock))
    })?;
    function(module, c"driver_leave", |arguments| {
        arguments.py().detach(|| DRIVER.set(None));
        Ok(())
    })?;
    function(module, c"driver_floor", |arguments| arguments.py().detach(floor))?;
    function(module, c"driver_now", |_| with(|driver| Ok(driver.now_ns())))?;
    function(module, c"driver_send", |arguments| {
        let (channel, stamp_ns, bytes) = arguments.extract::<(usize, u64, Bound<'_, PyBytes>)>()?;
        let (spec, bytes) = (table::spec(channel)?, bytes.as_bytes());
        if bytes.len() != spec.message.size {
            let found = bytes.len();
            return Err(PyValueError::new_err(format!(
                "{}: expected {} bytes, found {found}",
                spec.name, spec.message.size
            )));
        }
        with(|driver| {
            driver.send_bytes(spec, stamp_ns, |message| {
                message.copy_from_slice(bytes);
                Ok(())
            })
        })
    })?;
    function(module, c"driver_odometry", |arguments| {
        let (stamp_ns, pose, twist) = arguments.extract::<(u64, [f64; 3], [f64; 3])>()?;
        let [x, y, yaw_rad] = pose;
        let [vx_mps, vy_mps, yaw_rate_radps] = twist;
        let twist = Twist { vx_mps, vy_mps, yaw_rate_radps };
        with(|driver| driver.odometry(stamp_ns, &Pose::new(x, y, yaw_rad), twist))
    })?;
    function(module, c"driver_tick", |_| with(|driver| driver.tick(driver.now_ns())))?;
    function(module, c"driver_command", |arguments| {
        let (wait_s,) = arguments.extract::<(f64,)>()?;
        let wait = Duration::try_from_secs_f64(wait_s).map_err(|_| {
            PyValueError::new_err(format!("wait_s: expected seconds, 0 or more, found {wait_s}"))
        })?;
        let twist = arguments.py().detach(|| with(|driver| driver.command(wait)))?;
        Ok(twist.map(|twist| (twist.vx_mps, twist.vy_mps, twist.yaw_rate_radps)))
    })
}
