//! What to record or to measure next, as values.

pub use model_core::effects::{BenchCheck, Experiment};
use pam_fit::bench::Candidate;

/// A recording of the menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Loops at four speeds, at two pressures.
    Speeds,
    /// Rests of 1, 10 and 100 s reached from both sides, at two pressures.
    Dwells,
    /// Nested small loops at two speeds, at two pressures.
    NestedLoops,
    /// Slow pressure ramps at three held lengths.
    PressureRamps,
    /// The same loops before and after half an hour of vented rest.
    Rest,
}

impl Motion {
    /// Whether a rig can do it that only holds the length.
    #[must_use]
    pub(crate) fn holds_the_length(self) -> bool {
        self == Self::PressureRamps
    }
}

/// Why an experiment is proposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Proposal {
    /// The recording.
    pub motion: Motion,
    /// A check of the bench that separates the same effects.
    pub check: Option<BenchCheck>,
    /// Whether the recording separates them; otherwise the check alone does.
    pub motion_separates: bool,
}

/// What to do so that an effect would show which recordings like these conceal.
#[must_use]
pub fn what_would_show(effect: &str) -> Experiment {
    Candidate::from_name(effect).map_or(Experiment::Varied, |law| law.traits().shown_by)
}

/// The check of the bench that separates effects which no motion can.
pub(crate) fn bench_check(names: &[String]) -> Option<BenchCheck> {
    names.iter().filter_map(|name| Candidate::from_name(name).and_then(|law| law.traits().check)).min()
}
