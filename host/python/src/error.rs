//! The exception of the module.

use pam_data::error::{DataCode, Error};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    pamtools,
    PamError,
    PyValueError,
    "What is wrong: the text names cause, place and remedy; code, cause, file, line, column and help give them one by one."
);

/// The error as an exception: its text names cause, place and remedy, its attributes give them one by one.
pub(crate) fn raised(error: Error) -> PyErr {
    let help = error.advice().map_or(String::new(), |a| format!("; {a}"));
    let exception = PamError::new_err(format!("{error}{help}"));
    let place = error.place();
    let file = place.file.as_ref().map(|f| f.display().to_string());
    let attributes = Python::attach(|py| {
        let value = exception.value(py);
        value.setattr("code", error.code().name())?;
        value.setattr("cause", error.cause())?;
        value.setattr("file", file)?;
        value.setattr("line", place.line)?;
        value.setattr("column", place.column.as_deref())?;
        value.setattr("help", error.advice())
    });
    attributes.err().unwrap_or(exception)
}

pub(crate) fn wrong(text: impl Into<String>) -> PyErr {
    raised(Error::new(DataCode::CallInvalid, text).help("help() of the function shows what it takes"))
}
