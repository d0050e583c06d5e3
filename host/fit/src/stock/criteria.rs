//! Constants of the joint fit of a stock, each with its meaning and source.

/// Standard deviation of the scale between muscles of one stock and length before any evidence, logarithm: the tolerance of a braided
/// tube's diameter is about 2 %, and force goes with its square.
pub(crate) const SCALE: f64 = 0.04;
/// Standard deviation of a rest length before any evidence, m: a tape measure is read to within a millimetre.
pub(crate) const LENGTH: f64 = 0.5e-3;
/// The same of a mounted length, m.
pub(crate) const MOUNTED: f64 = 0.5e-3;
/// Standard deviation of a load cell's zero before any evidence, as a share of the largest force: zero balance before a tare is 1 to 5 % of the
/// rated output, after it a tenth of that.
pub(crate) const ZERO: f64 = 0.005;
/// Weight of the deviation before any evidence beside those of the muscles, as a number of muscles; of mountings, twice as much.
pub(crate) const PRIOR_WEIGHT: f64 = 2.0;
/// Bounds of an estimated deviation, as multiples of the one before any evidence.
pub(crate) const BOUNDS: (f64, f64) = (0.1, 4.0);

/// Standard deviation of `λ` before any evidence, in bladder diameters: end effects extend over about a diameter at each end.
pub(crate) const ENDS: f64 = 2.0;
/// The same for `κ`: as much at a tenth of contraction.
pub(crate) const TAPER: f64 = 20.0;
/// The same for the compliance, as stroke at the largest force, m.
pub(crate) const COMPLIANCE: f64 = 5e-3;

/// Numbers that the readings of one half-stroke can determine: they are correlated, and weigh together as much as these.
pub(crate) const NUMBERS_PER_HALF: f64 = 8.0;
/// Residual deviation before any evidence, as a share of the largest force.
pub(crate) const RESIDUAL: f64 = 0.015;

/// Intervals of the splines over pressure and over contraction.
pub(crate) const INTERVALS: usize = 8;
/// Standard deviation of the second difference of neighbouring coefficients over pressure and over contraction, as a share of the largest
/// force: a curve that bends more within an eighth of its range is noise.
pub(crate) const BENDING: (f64, f64) = (0.045, 0.075);
/// The same for the half gap between the directions, as a share of that of the force: friction is a fraction of the force.
pub(crate) const GAP_BENDING: f64 = 0.33;
/// Standard deviation of the half gap itself, as a share of the largest force.
pub(crate) const GAP: f64 = 0.25;

/// Intervals of pressure, and of stroke where it moves, whose means are fitted.
pub(crate) const PRESSURE_CELLS: f64 = 26.0;
/// See [`PRESSURE_CELLS`].
pub(crate) const STROKE_CELLS: f64 = 24.0;
/// Readings nearer to a reversal than this share of the range of stroke are set aside where the muscle moves: friction turns there.
pub(crate) const AFTER_REVERSAL: f64 = 0.06;

/// Steps of Gauss and Newton.
pub(crate) const STEPS: usize = 30;
/// Steps end when no random effect moves by more than this share of its deviation.
pub(crate) const SETTLED: f64 = 2e-3;

/// With fewer muscles nothing between them can be estimated.
pub const FEWEST_MUSCLES: usize = 3;

/// Step over which the slope of the force by the stroke is taken, m: well below the errors of a length.
pub(crate) const SLOPE_STEP: f64 = 1e-4;
/// Steps of Gauss and Newton for the one number of a mounting that was left out.
pub(crate) const NUMBER_STEPS: usize = 8;
/// Mean size of a normal value in standard deviations: sqrt(2/π).
pub const MEAN_SIZE: f64 = 0.797_884_560_802_865_4;
