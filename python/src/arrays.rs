//! numpy arrays in and out.

use numpy::{
    Element, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods, ndarray::ArrayView,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{SceneError, SceneTypeError};

/// An array element that can be made from a number of another type.
pub trait Number: Sized {
    fn from_f64(value: f64) -> Option<Self>;
    fn from_i64(value: i64) -> Option<Self>;
}

impl Number for f64 {
    fn from_f64(value: f64) -> Option<f64> {
        Some(value)
    }

    fn from_i64(value: i64) -> Option<f64> {
        Some(value as f64)
    }
}

impl Number for f32 {
    fn from_f64(value: f64) -> Option<f32> {
        Some(value as f32)
    }

    fn from_i64(value: i64) -> Option<f32> {
        Some(value as f32)
    }
}

impl Number for u32 {
    fn from_f64(_: f64) -> Option<u32> {
        None
    }

    fn from_i64(value: i64) -> Option<u32> {
        value.try_into().ok()
    }
}

/// Anything that numpy accepts as an array.
pub fn as_array<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    let numpy = value.py().import("numpy")?;
    Ok(numpy.call_method1("asarray", (value,))?.cast_into()?)
}

/// The rows of an (n, N) array of any number type; `name` and `expected` are for messages.
pub fn rows<T: Number + Copy, const N: usize>(
    value: &Bound<'_, PyAny>,
    name: &str,
    expected: &str,
) -> PyResult<Vec<[T; N]>> {
    let array = as_array(value)?;
    let shape = array.shape();
    if shape.len() != 2 || shape[1] != N {
        // An empty list has no second axis.
        if array.is_empty() {
            return Ok(Vec::new());
        }
        return Err(SceneError::new_err(format!(
            "{name} has the shape {shape:?}; give an array of the shape (n, {N})"
        )));
    }
    let numbers = numbers(&array, name, expected)?;
    Ok(numbers.as_chunks::<N>().0.to_vec())
}

/// The numbers of an array, row by row.
pub fn numbers<T: Number + Copy>(
    array: &Bound<'_, PyUntypedArray>,
    name: &str,
    expected: &str,
) -> PyResult<Vec<T>> {
    let wrong_type = |_: f64| {
        let kind = array.dtype();
        SceneTypeError::new_err(format!("{name} is an array of {kind}; give {expected}"))
    };
    let wrong_value =
        |value: i64| SceneError::new_err(format!("{name} holds {value}; give {expected}"));
    let py = array.py();
    macro_rules! read {
        ($from:ident, $problem:expr, $($source:ty),*) => {
            $(if array.dtype().is_equiv_to(&numpy::dtype::<$source>(py)) {
                let array: PyReadonlyArrayDyn<$source> = array.extract()?;
                let number = |&value: &$source| {
                    T::$from(value.into()).ok_or_else(|| $problem(value.into()))
                };
                return array.as_array().iter().map(number).collect();
            })*
        };
    }
    read!(from_f64, wrong_type, f32, f64);
    read!(from_i64, wrong_value, i64, i32, u32, u16, i16, u8, i8);
    // numpy would make numbers of them.
    if array.dtype().kind() == b'b' {
        return Err(wrong_type(0.0));
    }
    // Other arrays, such as those with the other byte order, are converted by numpy if nothing is lost.
    for kind in ["int64", "float64"] {
        let options = PyDict::new(py);
        options.set_item("casting", "safe")?;
        if let Ok(converted) = array.call_method("astype", (kind,), Some(&options)) {
            return numbers(converted.cast()?, name, expected);
        }
    }
    Err(wrong_type(0.0))
}

/// A read-only array that reads memory of `owner` and keeps it alive.
pub fn view<'py, T: Element>(
    values: &[T],
    shape: &[usize],
    owner: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let values = ArrayView::from_shape(shape, values)
        .map_err(|error| pyo3::exceptions::PyValueError::new_err(error.to_string()))?;
    // SAFETY: `values` are part of `owner`, which is frozen: they are neither moved nor changed while it lives.
    let array = unsafe { PyArrayDyn::borrow_from_array(&values, owner) };
    Ok(array
        .readwrite()
        .make_nonwriteable()
        .as_any()
        .cast::<PyArrayDyn<T>>()?
        .clone())
}

/// The values of a one-dimensional array or a sequence of numbers.
pub fn list<'py, T: Number + Copy>(
    value: &Bound<'py, PyAny>,
    name: &str,
    expected: &str,
) -> PyResult<Vec<T>> {
    numbers(&as_array(value)?, name, expected)
}
