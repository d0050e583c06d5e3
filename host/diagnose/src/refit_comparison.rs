//! How the refitted table predicts with and without the named effects, and which one was written.

/// The table with the named effects predicts the recordings no better than without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefitComparison {
    /// Whether it was written with them all the same, because the user gave them.
    pub kept: bool,
    /// Root mean square error on these recordings with the effects, N.
    pub with: f64,
    /// The same without, N.
    pub without: f64,
    /// Mean error of a pressure left out of the fit, percent of blocked force: without, with.
    pub left_out: Option<(f64, f64)>,
}
