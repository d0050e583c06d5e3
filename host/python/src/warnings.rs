//! Warnings of the libraries as warnings of Python.

use std::ffi::CString;

use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;

/// Warnings, as Python's own: shown once per line, and silenced or raised by its filters.
pub(crate) fn warn(py: Python<'_>, warnings: &[String]) -> PyResult<()> {
    for text in warnings {
        let text = CString::new(text.as_str())?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(())
}
