//! What a diagnosis notes about the recordings, as values. The sentences are written by the report.

use crate::refit_comparison::RefitComparison;

/// Why a campaign cannot be judged at all.
#[derive(Clone, Debug, PartialEq)]
pub enum Unjudgeable {
    /// Too few rows remain after screening.
    FewRows {
        /// Usable rows.
        usable: usize,
        /// The fewest that are judged.
        least: usize,
    },
    /// Too few half-strokes for a test by whole blocks.
    FewStrokes {
        /// Half-strokes found.
        found: usize,
        /// The fewest that are judged.
        least: usize,
    },
    /// The gauge pressure never rises to where a muscle pulls.
    NoPressure {
        /// The highest pressure, Pa.
        highest: f64,
    },
    /// The force is constant or never a pull.
    NoForce,
    /// The model misses the force by more than the force itself.
    WrongModel {
        /// Root mean square error of the model, N.
        misfit: f64,
        /// Root mean square of the measured force, N.
        measured: f64,
    },
    /// No muscle makes these recordings: their units, signs or zeros, or the description of the muscle, are wrong. In the fit's words.
    Implausible(String),
}

/// A dimension of the muscle with which nothing is left to explain.
#[derive(Clone, Debug, PartialEq)]
pub struct Dimension {
    /// Its name in the description.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The described value.
    pub described: f64,
    /// The value with which the model agrees with the recordings.
    pub fitted: f64,
}

/// How friction acts while the length is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestFriction {
    /// The hysteresis gap closes with this time constant, s.
    Fades(f64),
    /// Friction follows a slowly drifting pressure.
    Follows {
        /// Change of pressure that static friction carries, Pa.
        carries: f64,
        /// Further change over which friction reaches the other branch, Pa.
        over: f64,
    },
}

/// Why an effect was not kept after it had been selected.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// It does not improve held-out rows.
    NotConfirmed {
        /// Error without it, N.
        without: f64,
        /// Error with it, N.
        with: f64,
    },
    /// The recordings do not determine its size: its 95 % interval includes zero. The interval's half-width as a share of the size.
    UncertainSize(f64),
    /// The fit gives it a value that cannot be.
    Impossible {
        /// The parameter.
        parameter: String,
        /// Its value, SI.
        value: f64,
        /// The largest possible size of it, SI.
        most: f64,
    },
    /// It acts in the first strokes of recordings only, where the state of this memory effect is not known.
    UnknownMemory(String),
    /// Too many others explain the same share, so that none is named.
    Competitors {
        /// Share of the misfit that each explains.
        share: f64,
        /// Their names.
        others: Vec<String>,
    },
    /// A slowly drifting reading would explain it as well.
    SlowDrift,
    /// The joint refit keeps little of its gain.
    LostInRefit,
    /// The joint refit gives an effect parameters that cannot belong to one cause.
    ImpossibleInRefit,
}

/// One remark on what can and cannot be concluded.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// Beside a memory of the muscle, the static model between mountings leaves this error, N rms, without a name.
    StaticMisfit(f64),
    /// The first runs of the mountings differ from those that follow, and no effect explains it: they were left out of the search.
    FirstRuns {
        /// How many runs.
        left_out: usize,
        /// Of how many.
        of: usize,
        /// Whether the model agrees with the other runs.
        others_agree: bool,
    },
    /// Friction opposes the first stroke of each recording from its beginning, where this effect builds up after each reversal.
    BeginsWithinStroke(String),
    /// Each recording begins with a muscle that was just filled, for the memory of this effect.
    BeginsJustFilled(String),
    /// A bladder whose stiffness changes with the pressure explains what this effect would, and tables hold that.
    BladderStiffens(String),
    /// The memory that was found goes into the table, as an effect of its own.
    MemoryInTable,
    /// Nothing can be judged.
    NotJudged(Unjudgeable),
    /// The length was held throughout.
    HeldLength,
    /// All rows are at one pressure.
    OnePressure,
    /// No temperature column.
    NoTemperature,
    /// The muscle moves one way only.
    OneDirection,
    /// No vented rows.
    NoVentedRows,
    /// Near full contraction the force falls more steeply than the table's elastic orders can follow.
    Wall,
    /// This share of the rows is slack and excluded.
    Slack(f64),
    /// Friction while the length is held.
    FrictionAtRest(RestFriction),
    /// On ramps of the pressure at held length friction turns slowly; rows on which it still turns are excluded.
    FrictionTurns {
        /// Change of pressure over which it turns by 63 %, Pa.
        over: f64,
    },
    /// All channels passed a low-pass filter; rows about reversals, in which it mixes both directions of friction, are excluded.
    FilteredChannels {
        /// Time over which friction turns in the recordings, s.
        over: f64,
    },
    /// Readings at the end of the force sensor's range, excluded.
    SensorEnd {
        /// Number of such readings.
        rows: usize,
        /// The reading, N.
        force: f64,
    },
    /// The displacement is read in steps that are worth more force than the model admits as lack of fit.
    CoarseStroke {
        /// The step, m.
        step: f64,
        /// Root mean square error of the model's force by it, N.
        force: f64,
    },
    /// What screening of the recordings reported, in the data library's words.
    Screening(String),
    /// Isolated force readings, excluded.
    Spikes {
        /// Rows excluded.
        excluded: usize,
        /// Rows in all.
        total: usize,
    },
    /// Readings at which a valve's pulse still rings, excluded.
    Ringing {
        /// Readings excluded.
        excluded: usize,
        /// Readings in all.
        total: usize,
    },
    /// `k_F(P)` of the fitted tables follows `constant + slope/P`.
    InverseFriction {
        /// The constant.
        constant: f64,
        /// The slope, Pa.
        slope: f64,
    },
    /// `E_1(P)` of the fitted tables is a straight line; its relative change over the range, with sign.
    StraightElasticity(f64),
    /// Noise had to be estimated without repeats.
    NoRepeats,
    /// The tables differ between pressures more than one bladder does.
    Concealed {
        /// What they take up, N rms.
        rms: f64,
        /// The same as a share of the blocked force.
        share: f64,
        /// Effects that would leave such a difference.
        candidates: Vec<String>,
    },
    /// Strokes under the same conditions differ more than instruments scatter.
    NotRepeatable(Scatter),
    /// A gain or offset outside the known range, as a wrong muscle description imitates it.
    CheckDescription(String),
    /// With these dimensions instead of those described, the model agrees with the recordings, and no effect is needed.
    Dimensions(Vec<Dimension>),
    /// An effect that was selected and not kept.
    Refused {
        /// Its name.
        effect: String,
        /// Why it is not kept.
        why: Refusal,
    },
    /// What a check of the bench measured.
    Measured {
        /// Which check.
        check: String,
        /// The value with its interval.
        value: String,
    },
    /// The next experiment could not be worked out.
    NoAdvice(String),
    /// The table was written without the effects, or with them on the user's word.
    Table {
        /// The file.
        file: String,
        /// What happened.
        comparison: RefitComparison,
    },
}

/// How strokes under the same conditions differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Standard deviation, N.
    pub sigma: f64,
    /// The same as a share of the blocked force.
    pub share: f64,
    /// Correlation time, s.
    pub memory: f64,
}

impl Remark {
    /// Whether it reports that an effect is confounded with others or was not kept.
    #[must_use]
    pub fn refuses(&self, name: &str) -> bool {
        match self {
            Self::Refused { effect, why: Refusal::Competitors { others, .. } } => {
                effect == name || others.iter().any(|o| o == name)
            }
            Self::Refused { effect, why: Refusal::UnknownMemory(memory) } => effect == name || memory == name,
            Self::Refused { effect, .. } | Self::CheckDescription(effect) => effect == name,
            Self::Concealed { candidates, .. } => candidates.iter().any(|c| c == name),
            _ => false,
        }
    }

    /// Whether it reports that an effect was selected and then failed a requirement of its own.
    #[must_use]
    pub fn drops(&self, name: &str) -> bool {
        use Refusal::{Impossible, NotConfirmed, UncertainSize};
        matches!(self, Self::Refused { effect, why: NotConfirmed { .. } | UncertainSize(_) | Impossible { .. } } if effect == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remark_refuses_the_effect_it_is_about_and_those_it_was_confused_with() {
        let competitors = Refusal::Competitors { share: 0.5, others: vec!["leak".into(), "inertia".into()] };
        let remark = Remark::Refused { effect: "backlash".into(), why: competitors };
        assert!(remark.refuses("backlash") && remark.refuses("leak") && !remark.refuses("gravity"));
        let alone = Remark::Refused { effect: "gauge-gain".into(), why: Refusal::SlowDrift };
        let uncertain = Remark::Refused { effect: "leak".into(), why: Refusal::UncertainSize(3.0) };
        assert!(uncertain.drops("leak") && !uncertain.drops("gauge-gain") && !alone.drops("gauge-gain"));
        assert!(alone.refuses("gauge-gain") && !alone.refuses("gain") && !Remark::HeldLength.refuses("gain"));
    }
}
