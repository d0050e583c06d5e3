//! Errors of a fit on held-out recordings.

use pam_data::output::json_of;
use pam_evaluate::cross_validation::{Split, cross_validate};
use pam_fit::Options;
use pam_fit::RecordingResidual;
use pyo3::prelude::*;
use serde::Serialize;

use crate::arrays::loads;
use crate::campaign::Campaign;
use crate::error::{raised, wrong};
use crate::muscle::Muscle;

/// Errors on held-out recordings as Python gets them.
#[derive(Serialize)]
#[allow(non_snake_case, reason = "names carry their unit")]
struct HeldOut<'a> {
    rows: f64,
    mean_N: f64,
    rms_N: f64,
    bias_N: f64,
    /// Percent of the largest measured force.
    mean_pct: f64,
    largest_force_N: f64,
    recordings: &'a [RecordingResidual],
}

/// Scores a fit on held-out recordings: each run is left out in turn. Returns mean and rms error and bias in N, the percentage
/// of the largest measured force, and the errors by recording.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, *, order = 4, leave_out = "runs"))]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    campaign: PyRef<'py, Campaign>,
    muscle: PyRef<'py, Muscle>,
    order: usize,
    leave_out: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let split = match leave_out {
        "runs" => Split::Run,
        "contractions" => Split::Contraction,
        other => return Err(wrong(format!("`leave_out` is {other:?}; it is \"runs\" or \"contractions\""))),
    };
    let options = Options { order, ..Options::default() };
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let held = py.detach(|| cross_validate(&campaign, &muscle, &options, split, None)).map_err(raised)?;
    let errors = HeldOut {
        rows: held.table.rows,
        mean_N: held.table.mean(),
        rms_N: held.table.rms(),
        bias_N: held.table.bias(),
        mean_pct: 100.0 * held.table.mean() / held.largest,
        largest_force_N: held.largest,
        recordings: &held.recordings,
    };
    loads(py, &json_of(&errors).to_string())
}
