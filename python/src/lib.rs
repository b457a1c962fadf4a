//! The Python package `sketchnav`: the whole program as a library, and navigators written in Python.
//!
//! - `navigator` implements `sketchnav.main([navigator])`, which is the command line with additional navigators. Its processes are
//!   Python processes, each of which hosts one `stage`.
//! - `lent` contains the functions that a stage uses to access messages, which only work while one of its methods is called. What
//!   they return are views of shared memory (see `memory`), so no message is copied.
//! - `driver` implements `sketchnav.drive`, with which a robot or another simulator takes the world's place.
//! - `relations` computes qualitative relations of arrays.
//!
//! The Python classes, their fields and their documentation are in `python/sketchnav/navigator.py`.
//!
//! PyO3 is used without its macros, because they would require most of the program's crates to be compiled with other features.

mod account;
mod agenda;
mod driver;
mod lent;
mod memory;
mod navigator;
mod relations;
mod stage;
mod table;

use std::ffi::CStr;

use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyTuple};
use pyo3::{BoundObject, ffi};

/// Counts the allocations of each step for `health`.
#[global_allocator]
static ALLOCATOR: sketchnav_runtime::CountingAllocator = sketchnav_runtime::CountingAllocator;

/// The definition of the module. The interpreter writes to it once, when the module is imported.
static mut DEFINITION: ffi::PyModuleDef = ffi::PyModuleDef {
    m_base: ffi::PyModuleDef_HEAD_INIT,
    m_name: c"_core".as_ptr(),
    m_doc: c"The program sketchnav as a library. See sketchnav.navigator.".as_ptr(),
    m_size: -1,
    m_methods: std::ptr::null_mut(),
    m_slots: std::ptr::null_mut(),
    m_traverse: None,
    m_clear: None,
    m_free: None,
};

/// Creates the module. The interpreter looks for a function with this name.
///
/// # Safety
/// Only the interpreter may call this, once, when it imports the module.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn PyInit__core() -> *mut ffi::PyObject {
    // SAFETY: the interpreter calls this function from a thread that is attached.
    let py = unsafe { Python::assume_attached() };
    // SAFETY: nothing else refers to the definition, and the result is a new reference or null with an exception set.
    let module = unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyModule_Create(&raw mut DEFINITION)) };
    let filled = module.and_then(|module| {
        let module = module.cast_into::<PyModule>()?;
        navigator::add(&module)?;
        table::add(&module)?;
        lent::add(&module)?;
        agenda::add(&module)?;
        driver::add(&module)?;
        relations::add(&module)?;
        Ok(module)
    });
    match filled {
        Ok(module) => module.into_ptr(),
        Err(error) => {
            error.restore(py);
            std::ptr::null_mut()
        }
    }
}

/// Adds a function to the module.
fn function<R>(
    module: &Bound<'_, PyModule>,
    name: &'static CStr,
    call: impl Fn(&Bound<'_, PyTuple>) -> PyResult<R> + Send + Sync + 'static,
) -> PyResult<()>
where
    R: for<'py> IntoPyObject<'py>,
{
    let closure = move |arguments: &Bound<'_, PyTuple>, _: Option<&Bound<'_, pyo3::types::PyDict>>| {
        let py = arguments.py();
        call(arguments).and_then(|value| {
            value.into_pyobject(py).map(|value| value.into_any().unbind()).map_err(Into::into)
        })
    };
    let function = PyCFunction::new_closure(module.py(), Some(name), None, closure)?;
    module.add(name.to_str().unwrap_or_default(), function)
}
