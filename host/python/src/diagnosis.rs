//! The diagnosis of a campaign.

use std::path::PathBuf;

use pam_diagnose as diagnosis;
use pam_report::diagnose_page;
use pyo3::prelude::*;

use crate::arrays::loads;
use crate::campaign::Campaign;
use crate::error::raised;
use crate::muscle::Muscle;
use crate::report::write_report;

/// Finds out what the model leaves out. Returns the JSON of `host diagnose` as a dict; `report` names an HTML file to write.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, report = None))]
pub(crate) fn diagnose<'py>(
    py: Python<'py>,
    campaign: PyRef<'py, Campaign>,
    muscle: PyRef<'py, Muscle>,
    report: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let geometry = muscle.geometry();
    let options = diagnosis::Options { muscle: muscle.name.clone(), ..Default::default() };
    let mut answer = py.detach(|| diagnosis::diagnose(&campaign, &geometry, &options)).map_err(raised)?;
    // One blocked force for one campaign: that of `fit`.
    if let Ok(plain) = py.detach(|| pam_fit::fit(&campaign, &muscle, &pam_fit::Options::default())) {
        answer.blocked_force_N = plain.summary.blocked_force_N;
    }
    if let Some(path) = &report {
        write_report(&diagnose_page::page(&answer, &geometry, &campaign), path)?;
    }
    loads(py, &pam_report::document::diagnosis_json(&answer))
}
