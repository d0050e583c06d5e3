//! Forces predicted for one recording.

use numpy::{IntoPyArray, PyArray1};
use pam_data::pluralise::pluralise;
use pam_fit::predict::Predicted;
use pyo3::prelude::*;

use crate::frames;

/// The prediction of a table for one recording.
#[pyclass(frozen, module = "pamtools")]
pub(crate) struct Prediction(pub(crate) Predicted);

#[pymethods]
impl Prediction {
    /// The force that the load cell would read, N.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.force.clone().into_pyarray(py)
    }

    /// Half the width of the 95 % interval of the table's own force, N, per row; None where the table holds no uncertainty.
    #[getter]
    fn band<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.bands.as_ref().map(|b| b.half.clone().into_pyarray(py))
    }

    /// Root mean square of measured minus predicted force, N; None without a force column.
    #[getter]
    fn rms(&self) -> Option<f64> {
        self.0.rms
    }

    /// The share of readings within the 95 % interval of single readings, 0 to 1; None where either is not known.
    #[getter]
    fn inside(&self) -> Option<f64> {
        self.0.bands.as_ref().and_then(|b| b.inside)
    }

    fn __len__(&self) -> usize {
        self.0.force.len()
    }

    /// Draws the predicted force by row with matplotlib, and its band; returns the axes.
    #[pyo3(signature = (axes = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        frames::plot(slf, "prediction", axes)
    }

    fn __repr__(&self) -> String {
        let rms = self.0.rms.map_or(String::new(), |r| format!(", rms {r:.3} N"));
        let band = self.0.bands.as_ref().map_or(String::new(), |b| format!(", ± {:.3} N", b.mean));
        format!("Prediction({}{rms}{band})", pluralise(self.0.force.len(), "row"))
    }
}
