//! A fit of a table to recordings.

use std::path::PathBuf;

use pam_data::date;
use pam_data::recording::Campaign as HostCampaign;
use pam_fit::{Fit as HostFit, Options};
use pam_report::fit_page;
use pyo3::prelude::*;

use crate::arrays::loads;
use crate::campaign::Campaign;
use crate::error::{raised, wrong};
use crate::frames;
use crate::muscle::Muscle;
use crate::report::write_report;
use crate::table::Table;

/// A finished fit.
#[pyclass(frozen, module = "pamtools")]
pub(crate) struct Fit {
    fit: HostFit,
    campaign: HostCampaign,
    options: Options,
}

#[pymethods]
impl Fit {
    /// The figures of the fit, as in the JSON of `host fit`.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.fit.summary).map_err(|e| wrong(e.to_string()))?;
        loads(py, &text)
    }

    /// The table.
    #[getter]
    fn table(&self) -> Table {
        let mut file = self.fit.table_file(format!("pamtools {}", env!("CARGO_PKG_VERSION")));
        file.about.date = date::now_utc();
        Table(file)
    }

    /// The recordings that were fitted.
    #[getter]
    fn campaign(&self) -> Campaign {
        Campaign(self.campaign.clone())
    }

    /// Writes the report, one HTML file.
    fn report(&self, path: PathBuf) -> PyResult<()> {
        write_report(&fit_page::page(&self.fit, &self.campaign, &self.options), &path)
    }

    /// Draws the measured and the fitted force against stroke with matplotlib; returns the axes.
    #[pyo3(signature = (axes = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        frames::plot(slf, "fit", axes)
    }

    fn __repr__(&self) -> String {
        let s = &self.fit.summary;
        format!("Fit({:?}, mean error {:.3} %, P0={:.1} kPa)", s.muscle, s.mean_error_pct, s.deadband_kPa)
    }
}

/// Fits a muscle's table to recordings.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, order = 4, tip_correction = false, smoothing = None, fit_geometry = false, fit_lengths = false,
    physical = false))]
#[allow(clippy::too_many_arguments)] // They are the options of `host fit`.
pub(crate) fn fit(
    py: Python<'_>,
    campaign: PyRef<'_, Campaign>,
    muscle: PyRef<'_, Muscle>,
    order: i64,
    tip_correction: bool,
    smoothing: Option<f64>,
    fit_geometry: bool,
    fit_lengths: bool,
    physical: bool,
) -> PyResult<Fit> {
    let order = usize::try_from(order)
        .ok()
        .filter(|m| (1..=6).contains(m))
        .ok_or_else(|| wrong(format!("`order` is {order}; it must lie between 1 and 6")))?;
    if smoothing.is_some_and(|w| !(w.is_finite() && w >= 0.0)) {
        return Err(wrong("`smoothing` must be a number from 0 up, or None for an automatic choice"));
    }
    let options = Options {
        order,
        tip_correction,
        smoothing,
        fit_geometry,
        fit_lengths,
        physical,
        ..Options::default()
    };
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let fit = py.detach(|| pam_fit::fit(&campaign, &muscle, &options)).map_err(raised)?;
    Ok(Fit { fit, campaign, options })
}
