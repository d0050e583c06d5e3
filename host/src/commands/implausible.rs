//! A table that is useless for control is written on request only.

use crate::console::Console;
use pam_data::error::{Error, Result};
use pam_fit::error::FitCode;

/// An error that names the faults of a table, or a warning where it was written nevertheless.
///
/// # Errors
/// [`FitCode::FitImplausible`] for a table with faults that is not forced.
pub(super) fn judge(faults: &[String], forced: bool, requested: bool, console: &Console) -> Result<()> {
    if faults.is_empty() {
        return Ok(());
    }
    if forced {
        console.warning(format!("the table is useless for control: {}", faults.join(". ")));
        return Ok(());
    }
    let unwritten = if requested { ", and it was not written" } else { "" };
    Err(Error::new(
        FitCode::FitImplausible,
        format!("the table is useless for control{unwritten}: {}", faults.join(". ")),
    ))
}
