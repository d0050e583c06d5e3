//! The answer as values. Its JSON and its sentences are written by the reports.

#![allow(non_snake_case, reason = "units are spelled as in the JSON")]

use pam_data::statistics::NORMAL_95;
use pam_fit::numerics::student::half_width;
use serde::Serialize;

use super::criteria::POSSIBLE;
use super::shapes::{Change, Class, Owner};

/// The judgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No change beyond the normal repeatability of this actuator.
    Consistent,
    /// What changed is named, and nothing else stands out.
    Explained,
    /// Something is named, and something else is left.
    PartlyExplained,
    /// Something changed that no name describes well enough.
    Unexplained,
}

/// What of AFTER has no counterpart in the reference.
#[derive(Debug, Clone, PartialEq)]
pub enum NotComparable {
    /// A recording at a length that the reference does not have.
    Stroke {
        /// Its name.
        recording: String,
        /// Its stroke, m.
        stroke: f64,
    },
    /// Rows at pressures that the reference does not have.
    Pressure {
        /// Its name.
        recording: String,
        /// Their share of the settled rows.
        share: f64,
    },
    /// Too few common cells.
    FewCells {
        /// Stroke of the mounting, m.
        stroke: f64,
    },
    /// Changes that need several lengths, and the reference has one.
    OneLength,
    /// A level of pressure of strokes that only one side has, Pa.
    Level {
        /// Gauge pressure of the level, Pa.
        pressure: f64,
    },
    /// Changes that strokes at regulated pressures are not tested for.
    Strokes,
    /// Changes that a motion of length and pressure together is not tested for.
    Moving,
    /// Parts of strokes at levels, places or speeds that the reference does not have.
    States {
        /// Their share.
        share: f64,
    },
    /// Ramps of pressure at a held length among strokes.
    Ramps {
        /// Their share of the rows.
        share: f64,
    },
    /// Rows at lengths that the reference does not have.
    Lengths {
        /// Its name.
        recording: String,
        /// Their share of the rows.
        share: f64,
    },
}

/// A note on the comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum Remark {
    /// The largest force is this many times that of the reference, at the same pressures.
    ForceRatio(f64),
    /// The reference is later than AFTER, s since 1970.
    ReferenceLater {
        /// First date of the reference.
        reference: f64,
        /// Last date of AFTER.
        after: f64,
    },
    /// The reference is a table.
    Table {
        /// Error that it counts with in a cell, N: what it states, times what AFTER shows of it.
        error: f64,
        /// Error that it states, N; zero where it states none.
        stated: f64,
        /// The recordings that it was fitted to.
        sources: Vec<String>,
    },
    /// The table is one of another actuator than the one described: both names.
    OtherTable(String, String),
    /// The difference is larger than a change of the bench makes.
    OtherActuator,
    /// Remounted, and one length only.
    OneLengthMountedAnew,
    /// Nothing is named, since remounting to a millimetre makes a difference of this size.
    WithinMounting,
    /// A length that the reference does not have, m: its force there is interpolated, with this error, N.
    Interpolated {
        /// Its stroke, m.
        stroke: f64,
        /// Root mean square error of the interpolated force, N.
        error: f64,
    },
    /// Nothing in the reference was recorded twice.
    NothingTwice,
    /// One mounting, m, differs alone, with this log Bayes factor.
    OneMounting {
        /// Its stroke, m.
        stroke: f64,
        /// Log Bayes factor.
        log: f64,
    },
    /// How far campaigns of strokes repeat is assumed.
    StrokesAssumed,
    /// How far campaigns of strokes of a described muscle repeat beyond their noise is assumed: this share of the largest force.
    CatalogueAssumed(f64),
    /// This many rests in which friction slipped in one of the campaigns.
    SlippedRests(usize),
    /// Probabilities of strokes are marginal.
    StrokesMarginal,
    /// No change is named, but the probability that nothing changed is this only.
    NotAcquitted(f64),
    /// Gains have the same shape at regulated pressures.
    GainOfStrokes,
    /// A zero of the gauge often takes the name of a gain or of another zero where length and pressure move together.
    GaugeOfMotion,
}

/// How recordings were held out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Every other recording of AFTER.
    OtherRecordings,
    /// None: AFTER is one recording.
    None,
    /// Every other level of pressure.
    OtherLevels,
    /// Every other part of AFTER, by length and time.
    OtherParts,
}

/// Why a change is not named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhyNot {
    /// These recordings cannot show it.
    NotComparable,
    /// Another cause is more probable.
    LessProbable,
    /// The difference does not have its shape, or is too small.
    OtherShape,
    /// The best name for the difference, but held-out recordings get worse with it, or the difference is that of another actuator.
    HeldOutWorse,
}

impl WhyNot {
    pub(super) fn of(comparable: bool, probability: f64) -> Self {
        match comparable {
            false => Self::NotComparable,
            true if probability >= POSSIBLE => Self::LessProbable,
            true => Self::OtherShape,
        }
    }
}

/// A part of the cells in which the difference is concentrated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Its name, one of those of every diagnosis.
    pub coordinate: String,
    /// From this value, in `unit`.
    pub from: f64,
    /// To this value.
    pub to: f64,
    /// Share of the difference's energy that lies there.
    pub share: f64,
    /// Share of the cells that lie there.
    pub rows: f64,
    /// Unit of `from` and `to`.
    pub unit: String,
}

/// When a change began.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// Name of the recording.
    pub recording: String,
    /// s since AFTER began.
    pub moment: f64,
    /// Lower end of its 95 % interval, s.
    pub low: f64,
    /// Upper end, s.
    pub high: f64,
}

/// Since when a change is there.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "course", rename_all = "kebab-case")]
pub enum Since {
    /// From the first recording of AFTER on.
    Beginning,
    /// Suddenly, from a moment on.
    From(Moment),
    /// Gradually, from a moment on.
    Gradual(Moment),
    /// The recordings do not say.
    NotDetermined,
}

/// The size of a change, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Size {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Standard deviation, the slopes' error included.
    pub std: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// SI unit.
    pub unit: String,
}

/// What changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Changed {
    /// Which one.
    pub change: Change,
    /// Its name.
    pub effect: String,
    /// How probable this very name is.
    pub probability: f64,
    /// How probable its class is.
    pub class_probability: f64,
    /// Its class.
    pub class: Class,
    /// Share of the difference's energy that is gone on recordings held out, this change alone.
    pub share_explained: f64,
    /// Its size.
    pub parameters: Vec<Size>,
    /// Names that these recordings cannot distinguish from it.
    pub confusable_with: Vec<String>,
    /// Since when.
    pub since: Since,
    /// Whose it is.
    pub owner: Owner,
    /// Whether it is the bench's: it corrects the data and never goes to a controller.
    pub correction: bool,
    /// rms of the force that it adds in AFTER, N.
    pub rms_N: f64,
}

/// What no name explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Left {
    /// Share of the difference's energy.
    pub share: f64,
    /// Where most of it lies; absent where nothing is left or no part stands out.
    pub place: Option<Place>,
}

/// The difference on recordings that the sizes were not fitted to.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// How recordings were held out.
    pub split: Split,
    /// rms without the named changes, N.
    pub rms_before_N: f64,
    /// rms with them, N.
    pub rms_after_N: f64,
    /// Share of the difference's energy that they remove from the held-out recordings in which they show: a change that begins within
    /// AFTER does not show in those before it.
    pub share_where_shown: f64,
    /// What repeats, N.
    pub noise_N: f64,
}

/// A change that was tested.
#[derive(Clone, Debug, PartialEq)]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Its probability.
    pub gain: f64,
    /// Why it is not named.
    pub why_not: WhyNot,
    /// The size that would have been seen with 90 %, SI; absent where these recordings cannot show it.
    pub detectable: Option<f64>,
    /// Unit of `detectable`.
    pub unit: String,
}

/// What the reference is.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Its files.
    pub files: Vec<String>,
    /// The table file, where it is one.
    pub table: Option<String>,
    /// Its rows.
    pub samples: usize,
    /// How far untouched recordings of this actuator differ, rms of a cell, N.
    pub repeatability_N: f64,
    /// Where that is from.
    pub repeatability_from: Repeatability,
    /// Whether AFTER counts as remounted.
    pub mounted_anew: bool,
    /// What of AFTER could not be compared, and changes that were not tested.
    pub not_comparable: Vec<NotComparable>,
}

/// Where the repeatability is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Repeatability {
    /// From runs under the same conditions, beside what is usual.
    Measured,
    /// What is usual for such actuators: nothing was recorded twice.
    Assumed,
}

/// A name, none or unknown, with its probability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probability {
    /// `none`, `unknown` or a name.
    pub cause: String,
    /// Its probability.
    pub probability: f64,
}

/// A curve for a picture: force over pressure, or over stroke.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Curve {
    /// What it is of: a mounting or a level.
    pub title: String,
    /// Abscissae: kPa, or mm.
    pub at: Vec<f64>,
    /// N; the first of each pair filling or shortening, the second the other way.
    pub before: [Vec<f64>; 2],
    /// The same after.
    pub after: [Vec<f64>; 2],
    /// AFTER minus what was to be expected, N.
    pub difference: [Vec<f64>; 2],
    /// What the named changes add, N.
    pub explained: [Vec<f64>; 2],
}

/// The whole answer.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeReport {
    /// The actuator's name, where it is described.
    pub muscle: Option<String>,
    /// Rows of AFTER.
    pub samples: usize,
    /// The judgement.
    pub verdict: Verdict,
    /// How far untouched recordings differ, N.
    pub noise_N: f64,
    /// rms of AFTER minus what was to be expected, N.
    pub misfit_rms_N: f64,
    /// Largest force of the reference, N.
    pub largest_force_N: f64,
    /// Where the difference is concentrated; empty where nothing changed.
    pub r#where: Vec<Place>,
    /// What changed.
    pub missing: Vec<Changed>,
    /// What no name explains.
    pub unexplained: Left,
    /// How much of the difference is gone.
    pub held_out: HeldOut,
    /// Every change that was tested.
    pub considered: Vec<Considered>,
    /// All probabilities of the first weighing, in falling order.
    pub probabilities: Vec<Probability>,
    /// Causes that hold 95 % of the probability.
    pub set: Vec<String>,
    /// Notes on the comparison.
    pub remarks: Vec<Remark>,
    /// What it was compared with.
    pub reference: Reference,
    /// The size that each change would have if it were the only one.
    pub alone: Vec<(String, Size)>,
    /// For pictures.
    pub curves: Vec<Curve>,
    /// Label and unit of the curves' abscissa.
    pub abscissa: (&'static str, &'static str),
}

impl ChangeReport {
    /// Probability of a cause in the first weighing.
    #[must_use]
    pub fn probability(&self, cause: &str) -> f64 {
        self.probabilities.iter().find(|p| p.cause == cause).map_or(0.0, |p| p.probability)
    }

    /// Whether a named change shows in the force: a leak of closed valves shows in the pressure alone.
    #[must_use]
    pub fn shows_in_force(&self) -> bool {
        let in_pressure = |m: &Changed| m.change.effect().is_some_and(|e| e.traits().loses_air);
        self.missing.iter().any(|m| !in_pressure(m) || m.rms_N > 0.0)
    }

    /// The most probable cause.
    #[must_use]
    pub fn top(&self) -> &str {
        self.probabilities.first().map_or("none", |p| p.cause.as_str())
    }
}

/// A size with its 95 % interval. `freedom` widens it as Student's t does; `slopes` is the share by which the slopes may be wrong.
pub(super) fn size(parameter: (&str, &str), value: f64, std: f64, freedom: f64, slopes: f64) -> Size {
    let half = (half_width(0.05, freedom.max(1.0)) * std).hypot(slopes * value);
    Size {
        name: parameter.0.into(),
        value,
        std: half / NORMAL_95,
        low: value - half,
        high: value + half,
        unit: parameter.1.into(),
    }
}
