//! The diagnosis of a campaign.

use std::path::PathBuf;

use pam_data::date;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign as HostCampaign;
use pam_diagnose as diagnosis;
use pam_report::{diagnose_page, document};
use pyo3::prelude::*;

use crate::campaign::Campaign;
use crate::error::raised;
use crate::muscle::Muscle;
use crate::report::write_report;
use crate::table::Table;

/// The answer of a diagnosis with what it was made from.
#[pyclass(frozen, module = "pamtools._native")]
pub(crate) struct DiagnosisResult {
    answer: diagnosis::Diagnosis,
    campaign: HostCampaign,
    muscle: MuscleDescription,
}

#[pymethods]
impl DiagnosisResult {
    /// The JSON of `host diagnose`.
    fn json(&self) -> String {
        document::diagnosis_json(&self.answer)
    }

    /// The table refitted beside the named effects.
    fn corrected_table(&self, py: Python<'_>) -> PyResult<Table> {
        let mut refitted = py
            .detach(|| diagnosis::refitted_table::refit(&self.campaign, &self.muscle, &self.answer))
            .map_err(raised)?;
        refitted.file.about.tool = format!("pamtools {}", env!("CARGO_PKG_VERSION"));
        refitted.file.about.date = date::now_utc();
        Ok(Table(refitted.file))
    }

    /// Writes the report, one HTML file.
    fn report(&self, path: PathBuf) -> PyResult<()> {
        write_report(&diagnose_page::page(&self.answer, &self.muscle.geometry(), &self.campaign), &path)
    }
}

/// Finds the effects that the model lacks.
#[pyfunction]
pub(crate) fn diagnose(
    py: Python<'_>,
    campaign: PyRef<'_, Campaign>,
    muscle: PyRef<'_, Muscle>,
) -> PyResult<DiagnosisResult> {
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let options = diagnosis::Options { muscle: muscle.name.clone(), ..Default::default() };
    let described = || {
        let plain = pam_fit::fit(&campaign, &muscle, &pam_fit::Options::default());
        diagnosis::diagnose_described(&campaign, &muscle, &options, plain.as_ref())
    };
    let answer = py.detach(described).map_err(raised)?;
    Ok(DiagnosisResult { answer, campaign, muscle })
}
