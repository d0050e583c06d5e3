//! Values of Python: numpy arrays, JSON objects.

use numpy::{IntoPyArray, PyReadonlyArrayDyn};
use pam_data::error::{DataCode, Error};
use pyo3::prelude::*;
use pyo3::types::{PyModule, PyTuple};

use crate::error::{raised, wrong};

/// Anything that numpy takes for a column of numbers.
pub(crate) fn column(name: &str, values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = numbers(name, values)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 1 {
        return Err(raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` has {} dimensions", shape.len()))
                .help("give a one-dimensional array, one number a row"),
        ));
    }
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok(array.as_array().iter().copied().collect())
}

/// Anything that numpy can turn into an array of numbers.
pub(crate) fn numbers<'py>(name: &str, values: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = values.py();
    let numpy = PyModule::import(py, "numpy")?;
    // numpy would drop the imaginary parts with no more than a warning.
    if numpy.call_method1("iscomplexobj", (values,))?.is_truthy()? {
        return Err(raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` holds complex numbers"))
                .help("give its real part"),
        ));
    }
    numpy.call_method1("asarray", (values, "float64")).map_err(|e| {
        raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` is not an array of numbers: {}", e.value(py))).help(
                "give a numpy array, a list or a column of a data frame; missing values are not filled in",
            ),
        )
    })
}

/// JSON text as Python values.
pub(crate) fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    PyModule::import(py, "json")?.call_method1("loads", (text,))
}

/// A function of two quantities and the direction over arrays, as numpy broadcasts them, and the places that it was taken at.
pub(crate) fn broadcast<'py>(
    names: [&str; 3],
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    direction: Option<&Bound<'py, PyAny>>,
    check: impl Fn(&[(f64, f64)]) -> Result<(), Error>,
    of: impl Fn(f64, f64, f64) -> f64,
) -> PyResult<(Bound<'py, PyAny>, Vec<(f64, f64)>)> {
    let py = first.py();
    let numpy = PyModule::import(py, "numpy")?;
    let first = numbers(names[0], first)?;
    let second = numbers(names[1], second)?;
    let direction = match direction {
        Some(given) => numbers(names[2], given)?,
        None => numpy.call_method1("zeros", ((),))?,
    };
    let same = numpy.call_method1("broadcast_arrays", (first, second, direction)).map_err(|e| {
        raised(
            Error::new(DataCode::CallInvalid, format!("the arrays do not fit each other: {}", e.value(py)))
                .help(format!("{} are numbers or arrays of one shape", names.join(", "))),
        )
    })?;
    let part = |i: usize| -> PyResult<PyReadonlyArrayDyn<'py, f64>> { Ok(same.get_item(i)?.extract()?) };
    let (a, x, s) = (part(0)?, part(1)?, part(2)?);
    if let Some(wrong_way) = s.as_array().iter().find(|s| !(-1.0..=1.0).contains(*s)) {
        return Err(wrong(format!(
            "`direction` is {wrong_way}; it is 1 shortening, -1 lengthening, 0 the mid-line"
        )));
    }
    let places: Vec<(f64, f64)> = a.as_array().iter().copied().zip(x.as_array().iter().copied()).collect();
    check(&places).map_err(raised)?;
    let values: Vec<f64> = places.iter().zip(s.as_array()).map(|((a, x), s)| of(*a, *x, *s)).collect();
    let shape = a.as_array().shape().to_vec();
    let array = values.into_pyarray(py).call_method1("reshape", (shape,))?;
    // One number for one place.
    let array = array.get_item(PyTuple::empty(py)).or(Ok::<_, PyErr>(array))?;
    Ok((array, places))
}
