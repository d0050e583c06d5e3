//! Strokes of a described muscle against earlier ones: every effect of the catalogue is tested as a change.
//!
//! ```text
//! BEFORE and AFTER as rows → model fitted to BEFORE alone → its residual by state in BEFORE is subtracted in AFTER
//!        → cells of AFTER → each effect's trace with its memory → evidence → probabilities → names
//! ```
//! What the model cannot describe is in both campaigns and cancels; the residual of AFTER is a change.

mod answer;
mod cells;
mod metric;
mod pieces;
mod rests;
mod taper;
mod weigh;

use super::answer::ChangeReport;
use super::report::Options;
use cells::Cells;
use model_core::braid::Geometry;
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use weigh::{Weighed, weigh};

/// What has changed between two campaigns of strokes.
///
/// # Errors
/// Recordings without force, an impossible geometry, or campaigns that have too little in common.
pub(super) fn compare(
    before: &Campaign,
    after: &Campaign,
    geometry: &Geometry,
    options: &Options,
) -> Result<ChangeReport> {
    let braid = geometry.build().map_err(|e| Error::new(DataCode::MuscleInvalid, e.to_string()))?;
    let cells = Cells::of(before, after, &braid)?;
    let none = super::report::prior(options, super::criteria::PRIOR_NONE);
    let weighed: Weighed = weigh(&cells, none);
    Ok(answer::answer(&cells, &weighed, none))
}
