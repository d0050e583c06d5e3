//! Why an effect is named, as values.

/// Probability of the finding by chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Chance {
    /// Tested by whole blocks over all effects and their shapes.
    Tested {
        /// Effects tried.
        effects: usize,
        /// Family-wise p.
        p: f64,
    },
    /// It acts in too few half-strokes for that test; the likelihood decides.
    FewStrokes {
        /// p of the test by blocks.
        p: f64,
        /// Logarithm of the likelihood ratio against chance.
        log_ratio: f64,
    },
}

/// When something happened.
#[derive(Clone, Debug, PartialEq)]
pub enum ChangePoint {
    /// Before this recording began.
    Before(String),
    /// After the end of this recording.
    After(String),
    /// Between two recordings.
    Between(String, String),
    /// In a recording, at this time after its first reading, s.
    In(String, f64),
}

/// The evidence for a named effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Share of the misfit above noise that it explains, with the base refitted.
    pub share: f64,
    /// By chance.
    pub chance: Chance,
    /// When it happened, of an effect that begins.
    pub change_point: Option<ChangePoint>,
}

/// Error on held-out rows, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnseenError {
    /// Without the effect.
    pub without: f64,
    /// With it.
    pub with: f64,
}

/// Why an effect is named.
#[derive(Clone, Debug, PartialEq)]
pub enum Why {
    /// Found by the search.
    Found(Evidence),
    /// Measured by a check of the bench.
    Measured {
        /// Which check.
        check: String,
        /// The value with its interval.
        value: String,
    },
    /// A memory over the runs of a campaign.
    Memory {
        /// Error of unseen runs with static curves alone, rms in percent of the largest force.
        without_pct: f64,
        /// The same with the memory.
        with_pct: f64,
        /// Share of the squared error that goes.
        gain: f64,
        /// The least share that is accepted.
        least_gain: f64,
        /// Error with a single time constant over that with the spectrum.
        one_time_constant_ratio: f64,
    },
    /// The load cell does not read zero of a slack muscle.
    SlackReading {
        /// What it reads, N; of a reading that follows the pressure, at the highest pressure.
        reading: f64,
        /// Mountings that are slack at some pressure.
        mountings: usize,
        /// Whether the reading follows the pressure.
        follows_pressure: bool,
    },
    /// Given by the user; the fit gives it no size.
    GivenWithoutSize,
    /// Given, and supported by the recordings.
    GivenSupported(Evidence, UnseenError),
    /// Given; held-out rows do not improve.
    GivenNoImprovement(UnseenError),
    /// Given; no more than chance or the tables could explain.
    GivenNoEvidence {
        /// Share of the misfit above noise that it explains.
        share: f64,
        /// On held-out rows.
        unseen: UnseenError,
    },
}
