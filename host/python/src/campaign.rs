//! The recordings of one muscle, and reading them from files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pam_data::pluralise::pluralise;
use pam_data::recording::{Campaign as HostCampaign, Import, Reader};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

use crate::error::raised;
use crate::frames;
use crate::muscle::Muscle;
use crate::recording::Recording;

/// Recordings of one muscle in chronological order.
#[pyclass(frozen, module = "pamtools")]
#[derive(Clone)]
pub(crate) struct Campaign(pub(crate) HostCampaign);

#[pymethods]
impl Campaign {
    #[new]
    fn new(recordings: Vec<PyRef<'_, Recording>>) -> Self {
        Self(HostCampaign::new(recordings.iter().map(|r| r.0.clone()).collect()))
    }

    /// The recordings, in order.
    #[getter]
    fn recordings(&self) -> Vec<Recording> {
        self.0.recordings.iter().cloned().map(Recording).collect()
    }

    /// What was noticed while reading.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// For libraries that read the Arrow PyCapsule interface, with the recordings one below the other and their names in the first column.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        frames::stream(py, &self.0.recordings, true)
    }

    /// A pandas data frame with the recordings one below the other; the column `recording` has their names.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        frames::pandas(py, &self.0.recordings, true)
    }

    /// A polars data frame with the recordings one below the other; the column `recording` has their names.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        frames::polars(slf)
    }

    /// Draws force against stroke of every recording with matplotlib; returns the axes.
    #[pyo3(signature = (axes = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        frames::plot(slf, "campaign", axes)
    }

    fn __len__(&self) -> usize {
        self.0.recordings.len()
    }

    /// One recording, from the end where the number is negative; for iteration over a campaign.
    fn __getitem__(&self, index: isize) -> PyResult<Recording> {
        let count = self.0.recordings.len();
        let from_start = if index < 0 { index.checked_add_unsigned(count) } else { Some(index) };
        from_start
            .and_then(|i| usize::try_from(i).ok())
            .and_then(|i| self.0.recordings.get(i).cloned())
            .map(Recording)
            .ok_or_else(|| PyIndexError::new_err(format!("recording {index} of {count}")))
    }

    fn __repr__(&self) -> String {
        format!(
            "Campaign({}, {})",
            pluralise(self.0.recordings.len(), "recording"),
            pluralise(self.0.samples(), "row")
        )
    }
}

/// One file, or several.
#[derive(FromPyObject)]
pub(crate) enum Paths {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

/// Reads a file, or several in chronological order; `import_description` is the TOML file for other formats.
///
/// `filters` maps columns to the text that rows must have, as `--where` of `host fit`: `{"run": "1,2", "condition!": "Kinked69mm"}`.
#[pyfunction]
#[pyo3(signature = (paths, muscle = None, import_description = None, filters = None))]
pub(crate) fn read(
    py: Python<'_>,
    paths: Paths,
    muscle: Option<PyRef<'_, Muscle>>,
    import_description: Option<PathBuf>,
    filters: Option<BTreeMap<String, String>>,
) -> PyResult<Campaign> {
    let muscle = muscle.map(|m| m.0.clone());
    let paths = match paths {
        Paths::One(path) => vec![path],
        Paths::Several(paths) => paths,
    };
    py.detach(|| {
        let import = import_description.as_ref().map(Import::read).transpose()?;
        let mut reader = muscle.as_ref().map_or_else(Reader::new, Reader::of).import(import.as_ref());
        reader.filters.extend(filters.unwrap_or_default());
        reader.campaign(&paths)
    })
    .map(Campaign)
    .map_err(raised)
}
