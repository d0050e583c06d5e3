//! What the caller of a diagnosis may choose.

use super::candidates::Law;
use pam_data::progress::SharedProgress;
use pam_fit::bench::Candidate;
use pam_fit::checks::Checks;

/// What the caller may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The muscle's name, for the answer.
    pub muscle: String,
    /// Checks of the bench on which the recordings were made.
    pub checks: Checks,
    /// Effects that are known to be present: they are fitted without a test of the evidence, and no other is selected.
    pub given: Vec<Candidate>,
    /// Receives progress; nothing by default.
    pub progress: SharedProgress,
    /// Effects beyond the catalogue, whose equations a test brings.
    #[cfg(test)]
    pub(crate) added: Vec<Law>,
}

impl Options {
    /// Laws beyond the catalogue.
    pub(super) fn added(&self) -> Vec<Law> {
        #[cfg(test)]
        return self.added.clone();
        #[cfg(not(test))]
        Vec::new()
    }
}
