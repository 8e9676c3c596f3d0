//! What goes from one language to the other: numbers, images, JSON.

use lightgraph::Image;
use lightgraph::internals::value::Value;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

/// A number, or a tuple of numbers.
///
/// # Errors
/// Those of Python.
pub fn value<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Bool(v) => v.into_pyobject(py)?.to_owned().into_any(),
        Value::Uint(v) => v.into_pyobject(py)?.into_any(),
        Value::Int(v) => v.into_pyobject(py)?.into_any(),
        Value::Float(v) => v.into_pyobject(py)?.into_any(),
        Value::UVec2(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::UVec3(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::UVec4(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::Vec2(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::Vec3(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::Vec4(v) => PyTuple::new(py, v.to_array())?.into_any(),
        Value::Mat4(v) => PyTuple::new(py, v.to_cols_array())?.into_any(),
    })
}

/// An array of the shape (height, width, channels), or (layers, height, width, channels) where there are several.
/// Nobody may write to it: it is given out again as long as the image stays the same.
///
/// # Errors
/// Those of Python.
pub fn array<'py>(py: Python<'py>, image: Image) -> PyResult<Bound<'py, PyAny>> {
    let [height, width, channels] = [image.height, image.width, image.channels].map(|n| n as usize);
    let flat = PyArray1::from_vec(py, image.data);
    let shaped = match image.layers {
        1 => flat.reshape([height, width, channels])?.into_any(),
        layers => flat.reshape([layers as usize, height, width, channels])?.into_any(),
    };
    locked(flat.as_any())?;
    locked(&shaped)?;
    Ok(shaped)
}

/// The words of a buffer as an array of `uint32`, which nobody may write to.
///
/// # Errors
/// Those of Python.
pub fn words(py: Python<'_>, words: Vec<u32>) -> PyResult<Bound<'_, PyAny>> {
    let flat = PyArray1::from_vec(py, words).into_any();
    locked(&flat)?;
    Ok(flat)
}

fn locked(array: &Bound<'_, PyAny>) -> PyResult<()> {
    array.call_method1("setflags", (false,)).map(drop)
}

/// An image of an array of the shape (height, width), (height, width, channels) or (layers, height, width, channels).
///
/// # Errors
/// `ValueError`: it has another shape.
pub fn image(what: &str, array: &PyReadonlyArrayDyn<'_, f32>) -> PyResult<Image> {
    let shape = array.shape();
    let (layers, rest) = match shape {
        [layers, rest @ ..] if rest.len() == 3 => (*layers, rest),
        _ => (1, shape),
    };
    let (height, width, channels) = match *rest {
        [height, width, channels] => (height, width, channels),
        [height, width] => (height, width, 1),
        _ => {
            let text = format!(
                "{what} has the shape {shape:?}; an image is (height, width), (height, width, channels) or \
                 (layers, height, width, channels)"
            );
            return Err(PyValueError::new_err(text));
        }
    };
    let small =
        |n: usize| u32::try_from(n).map_err(|_| PyValueError::new_err(format!("{what} is too large: {shape:?}")));
    if !array.data().is_aligned() {
        return Err(PyValueError::new_err(format!(
            "{what} is not aligned to its numbers: give numpy.require(…, requirements=\"A\")"
        )));
    }
    let data = match array.as_slice() {
        Ok(values) => values.to_vec(),
        Err(_) => array.as_array().iter().copied().collect(),
    };
    Ok(Image { width: small(width)?, height: small(height)?, layers: small(layers)?, channels: small(channels)?, data })
}

/// JSON as dictionaries, lists, numbers and texts.
///
/// # Errors
/// Those of Python.
pub fn json<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    use serde_json::Value as Json;
    Ok(match value {
        Json::Null => py.None().into_bound(py),
        Json::Bool(v) => v.into_pyobject(py)?.to_owned().into_any(),
        Json::Number(v) => match v.as_i64() {
            Some(v) => v.into_pyobject(py)?.into_any(),
            None => v.as_f64().into_pyobject(py)?.into_any(),
        },
        Json::String(v) => v.into_pyobject(py)?.into_any(),
        Json::Array(v) => PyList::new(py, v.iter().map(|v| json(py, v)).collect::<PyResult<Vec<_>>>()?)?.into_any(),
        Json::Object(v) => {
            let made = PyDict::new(py);
            for (name, v) in v {
                made.set_item(name, json(py, v)?)?;
            }
            made.into_any()
        }
    })
}
