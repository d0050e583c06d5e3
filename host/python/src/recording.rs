//! One recording.

use numpy::{IntoPyArray, PyArray1};
use pam_data::pluralise::pluralise;
use pam_data::recording::Recording as HostRecording;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

use crate::arrays::column;
use crate::error::raised;
use crate::frames;

/// One recording, columns in SI units.
#[pyclass(frozen, module = "pamtools")]
#[derive(Clone)]
pub(crate) struct Recording(pub(crate) HostRecording);

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (name, time, pressure, stroke, force = None, temperature = None))]
    fn new(
        name: String,
        time: &Bound<'_, PyAny>,
        pressure: &Bound<'_, PyAny>,
        stroke: &Bound<'_, PyAny>,
        force: Option<&Bound<'_, PyAny>>,
        temperature: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let recording = HostRecording {
            name,
            time: column("time", time)?,
            pressure: column("pressure", pressure)?,
            stroke: column("stroke", stroke)?,
            force: force.map(|f| column("force", f)).transpose()?,
            temperature: temperature.map(|t| column("temperature", t)).transpose()?,
            ..HostRecording::default()
        };
        recording.check().map_err(|e| raised(e.file(format!("recording `{}`", recording.name))))?;
        Ok(Self(recording))
    }

    /// What it is called: its file's name, where it was read from one.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Time, s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.time.clone().into_pyarray(py)
    }

    /// Gauge pressure, Pa.
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.pressure.clone().into_pyarray(py)
    }

    /// Contraction stroke, m.
    #[getter]
    fn stroke<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.stroke.clone().into_pyarray(py)
    }

    /// N, or None.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.force.clone().map(|f| f.into_pyarray(py))
    }

    /// K, or None.
    #[getter]
    fn temperature<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.temperature.clone().map(|t| t.into_pyarray(py))
    }

    /// For libraries that read the Arrow PyCapsule interface: `polars.DataFrame(recording)`, `pyarrow.table(recording)`.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface permits a producer to ignore it.
        let _ = requested_schema;
        frames::stream(py, std::slice::from_ref(&self.0), false)
    }

    /// A pandas data frame, columns named as in a file.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        frames::pandas(py, std::slice::from_ref(&self.0), false)
    }

    /// A polars data frame, columns named as in a file.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        frames::polars(slf)
    }

    /// Draws pressure, stroke and force over time with matplotlib; returns the axes.
    #[pyo3(signature = (axes = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        frames::plot(slf, "recording", axes)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "Recording({:?}, {}, {:.1} s)",
            self.0.name,
            pluralise(self.0.len(), "row"),
            self.0.duration()
        )
    }
}
