//! The history of a campaign as plain values.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use model_core::effects::EffectName;
use pam_fit::bench::Candidate;

/// A number with its 95 % interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its value.
    pub value: f64,
    /// Lower end; absent where it is not determined.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// Of what the interval counts the independent units: runs, or mountings.
    pub unit_of_uncertainty: String,
}

impl Estimate {
    /// A value with the half-width of its interval.
    pub(super) fn new(value: f64, half: Option<f64>, unit: &str, of: &str) -> Self {
        let half = half.filter(|h| h.is_finite());
        Self {
            value,
            low: half.map(|h| value - h),
            high: half.map(|h| value + h),
            unit: unit.to_owned(),
            unit_of_uncertainty: of.to_owned(),
        }
    }

    /// Half of the interval's width.
    #[must_use]
    pub fn half(&self) -> Option<f64> {
        self.low.zip(self.high).map(|(low, high)| 0.5 * (high - low))
    }
}

/// The muscle between two changes of its held length.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounting {
    /// Its number, from 1, in the order of the recordings.
    pub number: usize,
    /// Active length, mm.
    pub length_mm: f64,
    /// Contraction `ΔL/L0`, a fraction; 0 at rest length.
    pub contraction: f64,
    /// How many runs.
    pub runs: usize,
    /// Pressure at which the muscle begins to pull, kPa.
    pub threshold_kPa: f64,
    /// Part of the pressure that the bladder carries, kPa.
    pub carried_kPa: f64,
}

/// The fitted law of the memory.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryLaw {
    /// Relaxed share of the carried pressure over the whole spectrum.
    pub relaxed_share: Estimate,
    /// Pressure at which the bladder carries no axial stress.
    pub balance_pressure: Estimate,
    /// Whether the recordings determine it; else it is a usual value.
    pub balance_identifiable: bool,
    /// Time constants, s.
    pub time_constants_s: Vec<f64>,
    /// Pause between runs, s: chosen on a grid; absent where the bench's clock gives the pauses.
    pub pause_s: Option<f64>,
    /// How long the muscle had been loaded before the first run of a mounting, s: chosen on a grid.
    pub loaded_before_s: f64,
    /// Unseen error of the best law with one time constant, as a ratio to this one (rms).
    pub one_time_constant_ratio: f64,
}

/// Sizes of errors on held-out points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSize {
    /// Root mean square, N.
    pub rms_N: f64,
    /// Root mean square, % of the largest force.
    pub rms_pct: f64,
    /// Mean absolute, % of the largest force.
    pub mean_pct: f64,
    /// How many points.
    pub points: usize,
}

/// Each run predicted from the other runs of the muscle.
#[derive(Clone, Debug, PartialEq)]
pub struct UnseenRuns {
    /// A static curve for each mounting and direction.
    pub without_memory: ErrorSize,
    /// A static curve for each mounting, and the memory.
    pub with_memory: ErrorSize,
    /// The same two over points whose pressure another run of the mounting reaches.
    pub supported_without: ErrorSize,
    /// With memory.
    pub supported_with: ErrorSize,
    /// With memory and the slips that were found; absent where none was.
    pub with_slips: Option<ErrorSize>,
    /// Share by which the memory lowers the squared error of supported points.
    pub gain: f64,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunError {
    /// Its recording.
    pub name: String,
    /// Number of its mounting, from 1.
    pub mounting: usize,
    /// Its number within the mounting, from 1.
    pub run: usize,
    /// When it begins, s since the mounting.
    pub since_mounting_s: f64,
    /// Mean unseen error (measured less predicted) over filling, static, N.
    pub mean_before_N: f64,
    /// With memory.
    pub mean_after_N: f64,
    /// Root mean square, static, N.
    pub rms_before_N: f64,
    /// With memory.
    pub rms_after_N: f64,
    /// Shift of pressure that remains against the other runs of the mounting, kPa; absent where it is not identifiable.
    pub offset_kPa: Option<f64>,
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingKind {
    /// The first filling of a mounting pulls less than the second.
    FirstRunDeficit,
    /// Creep that outlives a recording.
    Creep,
    /// Emptying pulls more than filling, the more the shorter.
    FillingEmptyingGap,
    /// The held length changed during a mounting and stayed changed.
    Slip,
    /// One run differs from the others of its mounting.
    BadRun,
    /// The muscle had been loaded before the first run.
    LoadedBefore,
    /// The load cell does not read zero of a slack muscle.
    SlackReading,
}

/// Something documented of such muscles, as these recordings show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Whether its interval excludes zero, or its rule holds.
    pub found: bool,
    /// Its size.
    pub size: Estimate,
    /// How many independent units the interval counts.
    pub units: usize,
    /// Sum of squares between those units, for pooling over muscles of one protocol.
    pub squares: f64,
    /// The effect that explains it; absent where none does.
    pub cause: Option<Candidate>,
    /// Effects that explain as well what the cause does within a run.
    pub alternatives: Vec<EffectName>,
    /// Number of the mounting, from 1, where it is about one.
    pub mounting: Option<usize>,
    /// Number of the run within the mounting, from 1, where it is about one.
    pub run: Option<usize>,
    /// What is known of it beyond its size.
    pub detail: FindingDetail,
}

impl Finding {
    /// What it is about.
    #[must_use]
    pub fn kind(&self) -> FindingKind {
        match self.detail {
            FindingDetail::FirstRun { .. } => FindingKind::FirstRunDeficit,
            FindingDetail::Creep { .. } => FindingKind::Creep,
            FindingDetail::Gap(_) => FindingKind::FillingEmptyingGap,
            FindingDetail::Shift { lasts: true, .. } => FindingKind::Slip,
            FindingDetail::Shift { lasts: false, .. } => FindingKind::BadRun,
            FindingDetail::LoadedBefore => FindingKind::LoadedBefore,
            FindingDetail::SlackReading { .. } => FindingKind::SlackReading,
        }
    }
}

/// What a finding is about, and what is known of it beyond its size.
#[derive(Clone, Debug, PartialEq)]
pub enum FindingDetail {
    /// Of a first-run deficit.
    FirstRun {
        /// What the memory leaves of it, N; absent where no memory is its cause.
        left: Option<f64>,
    },
    /// Of creep.
    Creep {
        /// Over how many decades of time.
        decades: usize,
        /// Force gained in tenfold time at the top pressure, N; absent of too few runs.
        plateau: Option<Estimate>,
    },
    /// Of a gap between filling and emptying; absent where it is not found, or no memory is named.
    Gap(Option<GapBesideMemory>),
    /// Of a slip or a bad run.
    Shift {
        /// Whether it lasts until the end of the mounting: a slip.
        lasts: bool,
        /// How much shorter than at full length the mounting is held, mm.
        shortened_mm: f64,
    },
    /// Of a load before the first run.
    LoadedBefore,
    /// Of the reading of a slack muscle: by how much it grows up to the highest pressure, N; absent where it does not follow the pressure.
    SlackReading {
        /// In N.
        grows: Option<f64>,
    },
}

/// What explains the gap between filling and emptying, and what does not.
#[derive(Clone, Debug, PartialEq)]
pub struct GapBesideMemory {
    /// What the memory leaves of it, N.
    pub left: Option<Estimate>,
    /// The effect that unseen runs need beside the memory.
    pub beside: Option<NeededEffect>,
    /// Friction in place of the memory within a run.
    pub instead: Option<InPlaceOfMemory>,
}

/// An effect that unseen runs need beside the memory.
#[derive(Clone, Debug, PartialEq)]
pub struct NeededEffect {
    /// The effect.
    pub effect: Candidate,
    /// Its largest force, N.
    pub peak: Estimate,
    /// Error of unseen runs without it, rms, N.
    pub without_N: f64,
    /// With it.
    pub with_N: f64,
}

/// Friction in place of the memory's fast part.
#[derive(Clone, Debug, PartialEq)]
pub struct InPlaceOfMemory {
    /// Error of unseen runs with the friction, rms, % of the largest force.
    pub friction_pct: f64,
    /// With the whole memory.
    pub memory_pct: f64,
    /// Whether unseen runs exclude it.
    pub excluded: bool,
}

/// A rule of a named memory that does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MemoryRefusal {
    /// The relaxed share is smaller than the least that is named.
    SmallShare {
        /// The share.
        share: f64,
        /// The least.
        least: f64,
    },
    /// The relaxed share is within its interval of none.
    UncertainShare {
        /// The share.
        share: f64,
        /// Half of its 95 % interval.
        half: f64,
    },
    /// The squared error of unseen runs falls by too little.
    SmallGain {
        /// What the memory is compared with.
        against: StaticCurve,
        /// The share by which it falls.
        gain: f64,
        /// The least.
        least: f64,
    },
}

/// A static model of unseen runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StaticCurve {
    /// A curve for each mounting.
    ByMounting,
    /// A curve for each mounting and direction.
    ByMountingAndDirection,
}

/// A layer of the explanation of unseen runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerName {
    /// The memory of the bladder.
    Memory,
    /// Slips of the held length.
    Slips,
    /// What neither explains.
    NotExplained,
}

/// What one layer takes of the squared error of unseen runs.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerShare {
    /// The layer.
    pub layer: LayerName,
    /// Share that it takes when the layers enter in this order.
    pub in_order: f64,
    /// Share of the error without this layer alone that it takes when it enters last.
    pub last_in: f64,
}

/// Force over time since the mounting at one pressure, for a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceOverTime {
    /// Number of the mounting, from 1.
    pub mounting: usize,
    /// Its length, mm.
    pub length_mm: f64,
    /// The pressure, kPa.
    pub pressure_kPa: f64,
    /// s since the mounting.
    pub time_s: Vec<f64>,
    /// Measured force, brought to this pressure by the curve's slope, N.
    pub force_N: Vec<f64>,
    /// Force by the law at this pressure, N.
    pub law_N: Vec<f64>,
}

/// The history of a campaign of isometric staircases.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    /// Whether the memory is named: its rules hold.
    pub named: bool,
    /// Which rules do not hold; empty where it is named.
    pub why_not: Vec<MemoryRefusal>,
    /// Settled points.
    pub points: usize,
    /// Whether rows were averaged into settled points after each pulse.
    pub averaged: bool,
    /// The largest force, N: the scale of errors in percent.
    pub largest_force_N: f64,
    /// Coefficient `k_F` of the base model's friction, taken out before the memory was fitted; absent where unseen runs do not need it.
    pub friction: Option<f64>,
    /// Every mounting, in the order of the recordings.
    pub mountings: Vec<Mounting>,
    /// The law.
    pub law: MemoryLaw,
    /// Unseen runs.
    pub unseen: UnseenRuns,
    /// Run by run.
    pub runs: Vec<RunError>,
    /// Documented findings.
    pub findings: Vec<Finding>,
    /// What each layer takes of the squared error of unseen runs.
    pub layers: Vec<LayerShare>,
    /// For a picture.
    pub force_over_time: Vec<ForceOverTime>,
    /// Slope of the force over pressure at full length near the highest pressure, N/kPa: comes with the length to an end effect over a stock.
    pub full_length_slope_N_per_kPa: Option<f64>,
}

impl History {
    /// The findings of one kind.
    pub fn of(&self, kind: FindingKind) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(move |f| f.kind() == kind)
    }
}
