//! What a muscle remembers over a campaign of staircases, as the object `history` of a diagnosis.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_diagnose::history::History;
use pam_diagnose::history::answer::{
    ErrorSize, Estimate, Finding, FindingKind, ForceOverTime, LayerShare, MemoryLaw, Mounting, RunError,
    UnseenRuns,
};
use serde::Serialize;

use crate::wording::history as wording;

/// The history of a campaign of isometric staircases.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(super) struct HistoryDocument<'a> {
    /// Whether the memory is named: its rules hold.
    named: bool,
    /// Which rules do not hold; empty where it is named.
    why_not: Vec<String>,
    /// Settled points.
    points: usize,
    /// Whether rows were averaged into settled points after each pulse.
    averaged: bool,
    /// The largest force: the scale of errors in percent.
    largest_force_N: f64,
    /// Coefficient of the base model's friction, taken out before the memory was fitted; null where unseen runs do not need it.
    friction: Option<f64>,
    mountings: Vec<MountingDocument>,
    law: LawDocument<'a>,
    unseen: UnseenDocument,
    runs: Vec<RunDocument<'a>>,
    findings: Vec<FindingDocument<'a>>,
    layers: Vec<LayerDocument>,
    /// For a picture.
    courses: Vec<ForceOverTimeDocument<'a>>,
    /// Slope of the force over pressure at full length near the highest pressure.
    full_length_slope_N_per_kPa: Option<f64>,
}

/// A number with its 95 % interval.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct EstimateDocument<'a> {
    value: f64,
    /// Null where it is not determined.
    low: Option<f64>,
    high: Option<f64>,
    unit: &'a str,
    /// Of what the interval counts the independent units: `run` or `mounting`.
    unit_of_uncertainty: &'a str,
}

/// The muscle between two changes of its held length.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct MountingDocument {
    /// From 1, in the order of the recordings.
    number: usize,
    /// Active length.
    length_mm: f64,
    contraction: f64,
    runs: usize,
    /// Pressure at which the muscle begins to pull.
    threshold_kPa: f64,
    /// Part of the pressure that the bladder carries.
    carried_kPa: f64,
}

/// The fitted law of the memory.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct LawDocument<'a> {
    /// Relaxed share of the carried pressure over the whole spectrum.
    relaxed_share: EstimateDocument<'a>,
    /// Pressure at which the bladder carries no axial stress.
    balance_pressure: EstimateDocument<'a>,
    /// Whether the recordings determine it; else it is a usual value.
    balance_identifiable: bool,
    time_constants_s: &'a [f64],
    /// Pause between runs, chosen on a grid; null where the bench's clock gives the pauses.
    pause_s: Option<f64>,
    /// How long the muscle had been loaded before the first run of a mounting, chosen on a grid.
    loaded_before_s: f64,
    /// Unseen error of the best law with one time constant, as a ratio to this one (rms).
    one_time_constant_ratio: f64,
}

/// Sizes of errors on held-out points, also in percent of the largest force.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ErrorSizeDocument {
    rms_N: f64,
    rms_pct: f64,
    /// Mean absolute error.
    mean_pct: f64,
    points: usize,
}

/// Each run predicted from the other runs of the muscle.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct UnseenDocument {
    /// A static curve for each mounting and direction.
    without_memory: ErrorSizeDocument,
    /// A static curve for each mounting, and the memory.
    with_memory: ErrorSizeDocument,
    /// The same two over points whose pressure another run of the mounting reaches.
    supported_without: ErrorSizeDocument,
    supported_with: ErrorSizeDocument,
    /// With memory and the slips that were found; null where none was.
    with_slips: Option<ErrorSizeDocument>,
    /// Share by which the memory lowers the squared error of supported points.
    gain: f64,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct RunDocument<'a> {
    /// Its recording.
    name: &'a str,
    /// Number of its mounting, from 1.
    mounting: usize,
    /// Its number within the mounting, from 1.
    run: usize,
    /// When it begins.
    since_mounting_s: f64,
    /// Mean unseen error (measured less predicted) over filling, static.
    mean_before_N: f64,
    /// With memory.
    mean_after_N: f64,
    /// Root mean square, static.
    rms_before_N: f64,
    /// With memory.
    rms_after_N: f64,
    /// Shift of pressure that remains against the other runs of the mounting; null where it is not identifiable.
    offset_kPa: Option<f64>,
}

/// Something documented of such muscles, as these recordings show it.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct FindingDocument<'a> {
    kind: FindingName,
    /// Whether its interval excludes zero, or its rule holds.
    found: bool,
    size: EstimateDocument<'a>,
    /// How many independent units the interval counts.
    units: usize,
    /// Sum of squares between those units, for pooling over muscles of one protocol.
    squares: f64,
    /// The effect that explains it; null where none does.
    cause: Option<&'static str>,
    /// Effects that explain as well what the cause does within a run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    alternatives: Vec<&'static str>,
    /// Number of the mounting, from 1, where it is about one.
    mounting: Option<usize>,
    /// Number of the run within the mounting, from 1, where it is about one.
    run: Option<usize>,
    words: String,
}

/// What a finding is about.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum FindingName {
    FirstRunDeficit,
    Creep,
    FillingEmptyingGap,
    Slip,
    BadRun,
    LoadedBefore,
    SlackReading,
}

/// What one layer takes of the squared error of unseen runs.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct LayerDocument {
    layer: &'static str,
    /// Share that it takes when the layers enter in this order.
    in_order: f64,
    /// Share of the error without this layer alone that it takes when it enters last.
    last_in: f64,
}

/// Force over time since the mounting at one pressure.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ForceOverTimeDocument<'a> {
    /// Number of the mounting, from 1.
    mounting: usize,
    length_mm: f64,
    pressure_kPa: f64,
    /// Since the mounting.
    time_s: &'a [f64],
    /// Measured force, brought to this pressure by the curve's slope.
    force_N: &'a [f64],
    /// Force by the law at this pressure.
    law_N: &'a [f64],
}

impl<'a> HistoryDocument<'a> {
    pub(super) fn of(h: &'a History) -> Self {
        Self {
            named: h.named,
            why_not: h.why_not.iter().map(wording::memory_refusal).collect(),
            points: h.points,
            averaged: h.averaged,
            largest_force_N: h.largest_force_N,
            friction: h.friction,
            mountings: h.mountings.iter().map(mounting).collect(),
            law: law(&h.law),
            unseen: unseen(&h.unseen),
            runs: h.runs.iter().map(run).collect(),
            findings: h.findings.iter().map(finding).collect(),
            layers: h.layers.iter().map(layer).collect(),
            courses: h.force_over_time.iter().map(force_over_time).collect(),
            full_length_slope_N_per_kPa: h.full_length_slope_N_per_kPa,
        }
    }
}

fn estimate(e: &Estimate) -> EstimateDocument<'_> {
    EstimateDocument {
        value: e.value,
        low: e.low,
        high: e.high,
        unit: &e.unit,
        unit_of_uncertainty: &e.unit_of_uncertainty,
    }
}

fn mounting(m: &Mounting) -> MountingDocument {
    let Mounting { number, length_mm, contraction, runs, threshold_kPa, carried_kPa } = *m;
    MountingDocument { number, length_mm, contraction, runs, threshold_kPa, carried_kPa }
}

fn law(l: &MemoryLaw) -> LawDocument<'_> {
    LawDocument {
        relaxed_share: estimate(&l.relaxed_share),
        balance_pressure: estimate(&l.balance_pressure),
        balance_identifiable: l.balance_identifiable,
        time_constants_s: &l.time_constants_s,
        pause_s: l.pause_s,
        loaded_before_s: l.loaded_before_s,
        one_time_constant_ratio: l.one_time_constant_ratio,
    }
}

fn error_size(e: &ErrorSize) -> ErrorSizeDocument {
    let ErrorSize { rms_N, rms_pct, mean_pct, points } = *e;
    ErrorSizeDocument { rms_N, rms_pct, mean_pct, points }
}

fn unseen(u: &UnseenRuns) -> UnseenDocument {
    UnseenDocument {
        without_memory: error_size(&u.without_memory),
        with_memory: error_size(&u.with_memory),
        supported_without: error_size(&u.supported_without),
        supported_with: error_size(&u.supported_with),
        with_slips: u.with_slips.as_ref().map(error_size),
        gain: u.gain,
    }
}

fn run(r: &RunError) -> RunDocument<'_> {
    RunDocument {
        name: &r.name,
        mounting: r.mounting,
        run: r.run,
        since_mounting_s: r.since_mounting_s,
        mean_before_N: r.mean_before_N,
        mean_after_N: r.mean_after_N,
        rms_before_N: r.rms_before_N,
        rms_after_N: r.rms_after_N,
        offset_kPa: r.offset_kPa,
    }
}

fn finding(f: &Finding) -> FindingDocument<'_> {
    FindingDocument {
        kind: match f.kind() {
            FindingKind::FirstRunDeficit => FindingName::FirstRunDeficit,
            FindingKind::Creep => FindingName::Creep,
            FindingKind::FillingEmptyingGap => FindingName::FillingEmptyingGap,
            FindingKind::Slip => FindingName::Slip,
            FindingKind::BadRun => FindingName::BadRun,
            FindingKind::LoadedBefore => FindingName::LoadedBefore,
            FindingKind::SlackReading => FindingName::SlackReading,
        },
        found: f.found,
        size: estimate(&f.size),
        units: f.units,
        squares: f.squares,
        cause: f.cause.map(|c| c.info().name),
        alternatives: f.alternatives.iter().map(|e| e.info().name).collect(),
        mounting: f.mounting,
        run: f.run,
        words: wording::finding(f),
    }
}

fn layer(l: &LayerShare) -> LayerDocument {
    LayerDocument { layer: wording::layer(l.layer), in_order: l.in_order, last_in: l.last_in }
}

fn force_over_time(c: &ForceOverTime) -> ForceOverTimeDocument<'_> {
    ForceOverTimeDocument {
        mounting: c.mounting,
        length_mm: c.length_mm,
        pressure_kPa: c.pressure_kPa,
        time_s: &c.time_s,
        force_N: &c.force_N,
        law_N: &c.law_N,
    }
}
