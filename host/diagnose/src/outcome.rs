//! What a diagnosis concludes, as values.

use serde::Serialize;

use crate::remark::{Scatter, Unjudgeable};
use crate::verdict::Region;

/// The judgement in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nothing exceeds the noise and the model's own stated inexactness.
    Consistent,
    /// What stood above is explained by the effects named.
    Explained,
    /// A part of it is.
    PartlyExplained,
    /// No effect of the library explains it, or several explain it equally well.
    Unexplained,
}

/// Whether there was anything to judge.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// There was not: nothing was fitted.
    NotJudged(Unjudgeable),
    /// There was.
    Judged(Verdict),
}

/// The pattern of what no named effect explains.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// No pattern is recognised.
    None,
    /// Periodic in time, with this frequency in Hz.
    Periodic(f64),
    /// Concentrated in a region.
    Region(Box<Region>),
    /// It does not repeat under the same conditions.
    NotRepeatable(Scatter),
}

/// How rows were held out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Nothing was fitted.
    NothingFitted,
    /// Nothing could be left out: errors are on the fitted rows.
    NothingLeftOut,
    /// Each pressure from the others.
    Pressures,
    /// Each of `runs` runs from the other runs of the muscle.
    Runs(usize),
    /// Every fourth cycle from the others, in turn.
    Cycles,
    /// Each recording from the others.
    Recordings,
    /// Every tenth recording from the others, in turn.
    TenthRecordings,
    /// Each quarter of the time from the rest.
    Quarters,
    /// Every fourth part of the stroke from the others, in turn.
    StrokeParts,
}
