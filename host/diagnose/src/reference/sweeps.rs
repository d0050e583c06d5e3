//! Runs at the reference's lengths, for quantities that are followed over campaigns.

use super::runs::{Mounted, Run, Runs};
use pam_data::error::Result;
use pam_data::recording::Campaign;
use pam_data::statistics::extremes;

/// One run at a held length.
pub(crate) struct Sweep {
    /// Index of the stroke among those of the reference, ascending.
    pub(crate) stroke: usize,
    run: Run,
}

impl Sweep {
    /// Pressure, force and direction of the settled rows.
    pub(crate) fn settled(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let r = &self.run;
        (0..r.time.len()).filter(|i| r.settled[*i]).map(|i| (r.pressure[i], r.force[i], r.direction[i]))
    }

    /// Lowest and highest pressure of the settled rows, Pa.
    pub(crate) fn pressures(&self) -> (f64, f64) {
        extremes(self.settled().map(|(p, ..)| p))
    }
}

/// Runs of a campaign at the lengths of the reference; others are left out.
///
/// # Errors
/// A recording without force.
pub(crate) fn sweeps(reference: &Campaign, campaign: &Campaign) -> Result<Vec<Sweep>> {
    let runs = Runs::of(reference, campaign, Mounted::Anew)?;
    let after = runs.runs.into_iter().filter(|r| r.after);
    Ok(after.map(|run| Sweep { stroke: run.mounting, run }).collect())
}
