//! Every constant of the diagnosis against a reference: symbol, value, meaning, source.
//!
//! "Development half" are the recordings of six 10 mm fluidic muscles (three of 2021, three of 2022) on which constants were chosen; what
//! is claimed is measured on the other five. "By principle" means that no data chose it.

/// A row is fast where the pressure moved by more than this share of its range within [`FAST_WITHIN`]. Ringing of valve pulses.
pub const FAST_SHARE: f64 = 0.015;
/// s; see [`FAST_SHARE`].
pub const FAST_WITHIN: f64 = 0.1;
/// s since the last fast row until a row counts as settled: valve pulses ring at about 20 Hz for 0.2 to 0.3 s.
pub const SETTLE: f64 = 0.25;
/// With a smaller share of settled rows all rows count as settled: the pressure never rests.
pub const FEWEST_SETTLED: f64 = 0.1;
/// Share of the range by which pressure or stroke must come back before it has turned: above ringing and ripple.
pub const TURN: f64 = 0.05;
/// The turn stands after the last row within this share of the range of the extremum, so that a hold keeps its direction.
pub const TURN_HOLD: f64 = 0.01;

/// Pressure bins of a point: finer than any curve needs, coarser than rows.
pub const POINT_BINS: usize = 64;
/// Intervals of the reference spline over the pressure range.
pub const SPLINE_INTERVALS: usize = 14;
/// Factor of the penalty on the gap between the directions: it is smoother than the curve.
pub const GAP_PENALTY: f64 = 10.0;
/// Ridge on the gap, which decides where one direction has no data.
pub const GAP_RIDGE: f64 = 1e-3;
/// (Noise of a point / size of a run effect)²: run effects are about five times the noise of a point.
pub const RUN_RIDGE: f64 = 0.04;
/// Price of a degree of freedom in the generalised cross-validation, above 1 against undersmoothing (Kim and Gu 2004).
pub const GCV_PRICE: f64 = 1.4;
/// Pressures of the tabulated surface.
pub const GRID: usize = 101;
/// AFTER may reach this share of the range beyond BEFORE's pressures; the rest is not comparable.
pub const BEYOND: f64 = 0.05;
/// Residual cells per direction.
pub const CELLS: usize = 6;
/// m: strokes nearer than this are one mounting (tape measure).
pub const SAME_STROKE: f64 = 1e-3;
/// Fewer common cells and a mounting is not comparable.
pub const FEWEST_CELLS: usize = 4;
/// More cells are joined in pairs of runs, so that the covariance stays quick.
pub const MOST_CELLS: usize = 840;
/// s: unknown pauses between runs.
pub const PAUSE: f64 = 12.0;
/// s: where the logarithmic clocks of creep begin.
pub const CREEP_START: f64 = 1.0;
/// s: a longer pause on a shared clock, and the actuator counts as mounted anew.
pub const NEW_VISIT: f64 = 3600.0;

/// s: first-order lags and delays that are tried on the rows of a run.
pub const LAGS: [f64; 13] = [0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.17, 0.23, 0.3, 0.4, 0.55, 0.75];
/// A row further than this many median intervals from the one before says nothing about lags.
pub const LAG_GAP: f64 = 3.0;
/// Residuals of the lag score are clipped at this share of the largest force.
pub const LAG_CLIP: f64 = 0.1;
/// s: spread of the lag score between runs that is always allowed: what valve timing does.
pub const LAG_FLOOR: f64 = 0.010;
/// Runs that [`LAG_FLOOR`] is worth.
pub const LAG_RUNS: f64 = 4.0;
/// s: the sizes of lags that are equally likely beforehand.
pub const LAG_SIZES: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];
/// Variance of a median over that of a mean.
pub const MEDIAN_VARIANCE: f64 = 1.57;

/// What repeats: standard deviations in per cent of the largest force, learned by restricted maximum likelihood on untouched runs of the
/// development half and rounded; floors as said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeats {
    /// Slope per unit ln(time since mounting), own to a mounting.
    pub creep: f64,
    /// The same, common to all mountings.
    pub creep_common: f64,
    /// Slope per unit ln(time in the run), own: also how fast the branch is filled.
    pub within: f64,
    /// The same, common.
    pub within_common: f64,
    /// A run differs from the others.
    pub run: f64,
    /// A run number differs in all mountings.
    pub run_common: f64,
    /// All later runs differ from all earlier ones, per mounting.
    pub group: f64,
    /// The same, common.
    pub group_common: f64,
    /// The load cell's zero per run (floor; the estimate was 0.015).
    pub offset: f64,
    /// What remains in one cell (floor; the estimate was 0.042).
    pub cell: f64,
    /// Correlation length in pressure, share of the range.
    pub length: f64,
    /// Correlation between the directions.
    pub directions: f64,
}

/// The values for fluidic muscles; for another actuator they are a prior, and the common scale adapts.
pub const REPEATS: Repeats = Repeats {
    creep: 0.386,
    creep_common: 0.273,
    within: 2.073,
    within_common: 1.976,
    run: 0.202,
    run_common: 0.159,
    group: 0.224,
    group_common: 0.069,
    offset: 0.10,
    cell: 0.10,
    length: 0.277,
    directions: 0.566,
};
/// m: a mounting made anew by tape measure.
pub const REMOUNT: f64 = 1e-3;
/// Observations that the prior scale is worth.
pub const SCALE_PRIOR: f64 = 10.0;
/// Independent directions that a run can teach.
pub const DIRECTIONS_PER_RUN: f64 = 4.0;
/// Never believe that this actuator repeats more than √2 better than its class.
pub const LEAST_SCALE: f64 = 0.5;

/// Sizes of a change that are equally likely beforehand, share of the largest force rms: heavy-tailed and scale-free over what is of
/// interest; below 1 % nobody asks.
pub const SIZES: [f64; 4] = [0.01, 0.02, 0.04, 0.08];
/// Prior probability that nothing changed: four of five pairs of campaigns.
pub const PRIOR_NONE: f64 = 0.80;
/// Prior probability of a change without a name.
pub const PRIOR_UNKNOWN: f64 = 0.05;
/// Bayes factor that must be left when any one mounting is set aside: "strong evidence" (Kass and Raftery 1995).
pub const GATE: f64 = 20.0;
/// Mountings from which on the gate can ask.
pub const GATE_MOUNTINGS: usize = 3;
/// A probability from which on something is named.
pub const NAMED: f64 = 0.5;
/// The set of names holds so much probability.
pub const SET: f64 = 0.95;
/// Error of the slopes ∂F/∂P and ∂F/∂x, share of the size: by principle, they are estimated from the same recordings.
pub const SLOPE_ERROR: f64 = 0.05;
/// Start points of a step that are tried, at most.
pub const STEP_STARTS: usize = 24;
/// Log evidence by which one course in time must lead the other to be told: e³ = 20.
pub const COURSE_LEAD: f64 = 3.0;
/// Names in one answer, at most.
pub const MOST_CHANGES: usize = 3;

/// Residual rms as a share of the largest force from which on another actuator is suspected.
pub const OTHER_ACTUATOR: f64 = 0.25;
/// Force ratios within this range do not raise the suspicion.
pub const FORCE_RATIO: (f64, f64) = (0.7, 1.4);
/// How near a ratio must be to a factor between units to be taken for one.
pub const UNIT_NEAR: f64 = 0.05;

/// Strokes: bins over the middle of the stroke.
pub const STROKE_BINS: usize = 6;
/// Share of the stroke left out at either end.
pub const STROKE_ENDS: f64 = 0.15;
/// Rows slower than this share of the 70th percentile of speed are left out: turns and holds.
pub const STROKE_SPEED: f64 = 0.3;
/// Neighbouring mean pressures that differ by less than this share of the largest are one level.
pub const LEVEL: f64 = 0.04;
/// m: a recording whose stroke stays within this is held.
pub const HELD: f64 = 1e-3;

/// What repeats between campaigns of strokes: shares of the largest force, or of friction. By principle; reshaped once after a first run
/// on the cylinder's recordings (friction as a share of friction, not of force).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrokeRepeats {
    /// Zero of the load cell, of the largest force.
    pub zero: f64,
    /// Gain of a reseated part.
    pub gain: f64,
    /// A level's own zero, of the largest force.
    pub level: f64,
    /// Along the stroke, of the largest force.
    pub along: f64,
    /// Friction in common, of friction.
    pub friction: f64,
    /// Friction of a recording, of friction.
    pub friction_level: f64,
    /// Friction along the stroke, of friction.
    pub friction_along: f64,
}

/// See [`StrokeRepeats`].
pub const STROKE_REPEATS: StrokeRepeats = StrokeRepeats {
    zero: 0.002,
    gain: 0.005,
    level: 0.002,
    along: 0.002,
    friction: 0.05,
    friction_level: 0.10,
    friction_along: 0.10,
};
/// Correlation length along the stroke, share of its range.
pub const STROKE_LENGTH: f64 = 0.3;
/// Prior probability of no change for strokes, where nothing of the spread between campaigns is learned.
pub const STROKE_PRIOR_NONE: f64 = 0.5;
