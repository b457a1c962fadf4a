//! Lets Python access messages without copying them, as `memoryview`s that become invalid when the call of the stage ends.
//!
//! An object of the type `Memory` exports the bytes and counts the views of them: `memoryview`s, their slices, and NumPy arrays. No
//! view may be left when the call ends, because the memory belongs to the host.

use std::ffi::c_int;
use std::sync::OnceLock;

use pyo3::exceptions::PyRuntimeError;
use pyo3::ffi;
use pyo3::prelude::*;

/// The Python object that exports the bytes.
#[repr(C)]
struct Object {
    base: ffi::PyObject,
    start: *mut u8,
    length: ffi::Py_ssize_t,
    is_readonly: c_int,
    /// Number of views that have not been released.
    views: usize,
}

/// Memory that is lent to Python.
pub struct Memory(Py<PyAny>);

struct TypeOf(Py<PyAny>);

static TYPE: OnceLock<TypeOf> = OnceLock::new();

unsafe extern "C" fn get_buffer(
    exporter: *mut ffi::PyObject,
    view: *mut ffi::Py_buffer,
    flags: c_int,
) -> c_int {
    let object = exporter.cast::<Object>();
    // SAFETY: only `type_object` uses this function, so `exporter` is an `Object`, and the interpreter calls it from an
    // attached thread. A memory that has been taken back is empty.
    unsafe {
        let (start, length) = ((*object).start, (*object).length);
        let filled =
            ffi::PyBuffer_FillInfo(view, exporter, start.cast(), length, (*object).is_readonly, flags);
        if filled == 0 {
            (*object).views += 1;
        }
        filled
    }
}

unsafe extern "C" fn release_buffer(exporter: *mut ffi::PyObject, _: *mut ffi::Py_buffer) {
    // SAFETY: as in `get_buffer`; each view is given back once.
    unsafe { (*exporter.cast::<Object>()).views -= 1 };
}

fn type_object(py: Python<'_>) -> PyResult<*mut ffi::PyTypeObject> {
    if let Some(TypeOf(known)) = TYPE.get() {
        return Ok(known.as_ptr().cast());
    }
    let mut slots = [
        ffi::PyType_Slot { slot: ffi::Py_bf_getbuffer, pfunc: get_buffer as *mut _ },
        ffi::PyType_Slot { slot: ffi::Py_bf_releasebuffer, pfunc: release_buffer as *mut _ },
        ffi::PyType_Slot { slot: 0, pfunc: std::ptr::null_mut() },
    ];
    let mut spec = ffi::PyType_Spec {
        name: c"sketchnav._core.Memory".as_ptr(),
        basicsize: size_of::<Object>() as c_int,
        itemsize: 0,
        flags: (ffi::Py_TPFLAGS_DEFAULT | ffi::Py_TPFLAGS_DISALLOW_INSTANTIATION) as _,
        slots: slots.as_mut_ptr(),
    };
    // SAFETY: the specification is complete, and the interpreter copies what it keeps of it.
    let found = unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyType_FromSpec(&raw mut spec)) }?;
    Ok(TYPE.get_or_init(|| TypeOf(found.unbind())).0.as_ptr().cast())
}

/// Returns the error for a message of which Python still has a view when it must not.
pub fn kept() -> PyErr {
    PyRuntimeError::new_err(
        "a message, or an array of one, was kept beyond the call that it belongs to: expected a copy, as from message.copy() or \
         numpy.array(message.ranges_m)",
    )
}

impl Memory {
    /// Lends memory to Python, and returns a view of it.
    ///
    /// # Safety
    /// The memory must stay valid, and be used by nothing else if it can be written, until [`Memory::take_back`] succeeds.
    pub unsafe fn lend<'py>(
        py: Python<'py>,
        (start, length): (*mut u8, usize),
        is_readonly: bool,
    ) -> PyResult<(Self, Bound<'py, PyAny>)> {
        let type_ = type_object(py)?;
        // SAFETY: the type was made for objects of this size, which are zero at first.
        let memory = unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyType_GenericAlloc(type_, 0)) }?;
        // SAFETY: this is the only reference to the new object.
        unsafe {
            let object = memory.as_ptr().cast::<Object>();
            (*object).start = start;
            (*object).length = length as ffi::Py_ssize_t;
            (*object).is_readonly = is_readonly.into();
        }
        // SAFETY: the object exports a buffer.
        let view =
            unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyMemoryView_FromObject(memory.as_ptr())) }?;
        Ok((Self(memory.unbind()), view))
    }

    /// Takes the memory back, after which Python can no longer access it.
    ///
    /// # Errors
    /// If something in Python still has a view of it, even after a garbage collection.
    pub fn take_back(self, py: Python<'_>) -> PyResult<()> {
        let object = self.0.as_ptr().cast::<Object>();
        // SAFETY: the object is of this type, and the thread is attached.
        let views = || unsafe { (*object).views };
        if views() > 0 {
            py.import("gc")?.call_method0("collect")?;
        }
        if views() > 0 {
            return Err(kept());
        }
        // SAFETY: as above. If the object itself is kept, it is empty.
        unsafe {
            (*object).start = std::ptr::NonNull::dangling().as_ptr();
            (*object).length = 0;
        }
        Ok(())
    }
}
