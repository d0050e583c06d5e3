//! `pamtools`: recordings, fits, predictions and diagnoses of pneumatic artificial muscles, with numpy arrays.
//!
//! Everything is in SI units inside arrays (s, Pa, m, N, K), regardless of the units in the files.

use pyo3::prelude::*;

mod arrays;
mod campaign;
mod device;
mod diagnosis;
mod error;
mod evaluation;
mod fit;
mod frames;
mod muscle;
mod prediction;
mod recording;
mod report;
mod table;
mod warnings;

/// Fit, predict and diagnose pneumatic artificial muscles.
#[pymodule]
#[pyo3(name = "_native")]
fn native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PamError", module.py().get_type::<error::PamError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<muscle::Muscle>()?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<campaign::Campaign>()?;
    module.add_class::<prediction::Prediction>()?;
    module.add_class::<table::Table>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<diagnosis::DiagnosisResult>()?;
    module.add_class::<device::Link>()?;
    module.add_function(wrap_pyfunction!(frames::from_frame, module)?)?;
    module.add_function(wrap_pyfunction!(campaign::read, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(diagnosis::diagnose, module)?)
}
