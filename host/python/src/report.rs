//! Reports as HTML files.

use std::path::PathBuf;

use pam_report::Page;
use pyo3::prelude::*;

use crate::error::raised;

/// Writes a report to a file.
pub(crate) fn write_report(page: &Page, path: &PathBuf) -> PyResult<()> {
    pam_data::output::write_whole(path, page.html().as_bytes()).map_err(raised)
}
