//! Arrays of objects that Python passes. They contain doubles with any strides, and are read in place.

use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sketchnav_qualitative::dipole::Dipole;
use sketchnav_qualitative::qsrlib::Box2;
use sketchnav_qualitative::{Error, Interval, Oriented, Point, Rect};

/// An object that an array represents by a row of numbers.
pub trait Row: Copy {
    /// The numbers of a row.
    type Numbers: AsRef<[f64]> + AsMut<[f64]> + Default;

    /// Creates the object.
    ///
    /// # Errors
    /// If the numbers do not describe an object.
    fn of(numbers: Self::Numbers) -> Result<Self, Error>;
}

impl Row for Point {
    type Numbers = [f64; 2];

    fn of([x, y]: [f64; 2]) -> Result<Self, Error> {
        Self::new(x, y)
    }
}

impl Row for Interval {
    type Numbers = [f64; 2];

    fn of([low, high]: [f64; 2]) -> Result<Self, Error> {
        Self::new(low, high)
    }
}

impl Row for Oriented {
    type Numbers = [f64; 3];

    fn of([x, y, heading_rad]: [f64; 3]) -> Result<Self, Error> {
        Self::new(Point::new(x, y)?, heading_rad)
    }
}

impl Row for Rect {
    type Numbers = [f64; 4];

    fn of([x_low, y_low, x_high, y_high]: [f64; 4]) -> Result<Self, Error> {
        Self::new([x_low, y_low], [x_high, y_high])
    }
}

impl Row for Dipole {
    type Numbers = [f64; 4];

    fn of([x_start, y_start, x_end, y_end]: [f64; 4]) -> Result<Self, Error> {
        Self::new(Point::new(x_start, y_start)?, Point::new(x_end, y_end)?)
    }
}

/// A rectangle, which may have a width or height of zero.
impl Row for Box2 {
    type Numbers = Self;

    fn of(corners: Self) -> Result<Self, Error> {
        let [x_low, y_low, x_high, y_high] = corners;
        Point::new(x_low, y_low).and(Point::new(x_high, y_high)).map(|_| corners)
    }
}

/// The objects that a calculus relates.
pub trait Scene: Copy {
    /// The type of each of the objects.
    type Object: Row;

    /// Reads the objects of one track at one time. Returns `None` if one of them is missing.
    ///
    /// # Errors
    /// If a row does not describe an object. The error names the argument and the row.
    fn read(arrays: &[Array], time: usize, track: usize) -> PyResult<Option<Self>>;
}

impl Scene for Point {
    type Object = Self;

    fn read(arrays: &[Array], time: usize, track: usize) -> PyResult<Option<Self>> {
        arrays[0].object(time, track)
    }
}

impl<T: Row, const N: usize> Scene for [T; N] {
    type Object = T;

    fn read(arrays: &[Array], time: usize, track: usize) -> PyResult<Option<Self>> {
        let mut objects = [None; N];
        for (object, array) in objects.iter_mut().zip(arrays) {
            *object = array.object(time, track)?;
        }
        let is_complete = objects.iter().all(Option::is_some);
        Ok(is_complete.then(|| objects.map(|object| object.expect("all are there"))))
    }
}

/// A three-dimensional array of objects. Its dimensions are the times, the tracks, and the numbers of a row.
pub struct Array {
    name: String,
    buffer: PyBuffer<f64>,
    shape: [usize; 3],
    strides: [isize; 3],
}

impl Array {
    /// Opens an array with three dimensions.
    ///
    /// # Errors
    /// If it does not have three dimensions of doubles.
    pub fn new(name: String, object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let buffer = PyBuffer::get(object)?;
        let shape = buffer.shape().try_into();
        let strides = buffer.strides().try_into();
        let (Ok(shape), Ok(strides), None) = (shape, strides, buffer.suboffsets()) else {
            return Err(PyValueError::new_err(format!("{name}: expected an array of three dimensions")));
        };
        Ok(Self { name, buffer, shape, strides })
    }

    /// Returns the number of times, the number of tracks, and the length of a row.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Reads an object. Returns `None` if one of its numbers is NaN, which means that the object is missing.
    ///
    /// # Errors
    /// If the row does not describe an object.
    pub fn object<T: Row>(&self, time: usize, track: usize) -> PyResult<Option<T>> {
        let mut numbers = T::Numbers::default();
        let row = numbers.as_mut();
        assert!(time < self.shape[0] && track < self.shape[1] && row.len() == self.shape[2]);
        let [by_time, by_track, by_number] = self.strides;
        let start = time as isize * by_time + track as isize * by_track;
        let mut is_missing = false;
        for (i, number) in row.iter_mut().enumerate() {
            let offset = start + i as isize * by_number;
            // SAFETY: the buffer has this shape and these strides, and the indices are within the shape. The interpreter is
            // attached, so no other thread of Python writes to the buffer meanwhile.
            *number = unsafe { self.buffer.buf_ptr().byte_offset(offset).cast::<f64>().read_unaligned() };
            is_missing |= number.is_nan();
        }
        if is_missing {
            return Ok(None);
        }
        T::of(numbers).map(Some).map_err(|error| self.rejected(time, track, &error))
    }

    /// Reads an object of the first track, which must not be missing.
    ///
    /// # Errors
    /// If the row does not describe an object, or one of its numbers is NaN.
    pub fn present<T: Row>(&self, time: usize) -> PyResult<T> {
        self.object(time, 0)?.ok_or_else(|| {
            PyValueError::new_err(format!(
                "{}: expected finite numbers, found NaN at sample {time}",
                self.name
            ))
        })
    }

    #[cold]
    fn rejected(&self, time: usize, track: usize, error: &Error) -> PyErr {
        let tracks = if self.shape[1] == 1 { String::new() } else { format!(", {track}") };
        PyValueError::new_err(format!("{}[{time}{tracks}]: {error}", self.name))
    }
}
