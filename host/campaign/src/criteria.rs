//! Every number that decides in a campaign, with its meaning and its source.

/// Highest pressure of a campaign, as a share of the muscle's rated pressure. The protocols of the virtual bench end there, too.
pub(crate) const TOP_SHARE: f64 = 0.9;
/// Largest force of the ideal braid at the highest level, as a share of what rig and controller allow: friction, noise, and an error of the
/// braid angle of a degree do not reach the limit then.
pub(crate) const FORCE_SHARE: f64 = 0.9;
/// Lowest level at least, as a share of the highest (the virtual bench's protocols).
pub(crate) const BOTTOM_SHARE: f64 = 1.0 / 6.0;
/// Lowest level at least, in deadbands: below it the muscle hardly moves (the virtual bench's protocols).
pub(crate) const BOTTOM_DEADBANDS: f64 = 1.8;
/// Free stroke of the lowest level, share of that at the highest: below it the muscle hardly moves (the virtual bench's protocols).
pub(crate) const BOTTOM_STROKE: f64 = 0.125;
/// Recordings from which on a table is fitted: zeros, blocked force, and one stroke or staircase.
pub(crate) const FIT_FROM: usize = 3;
/// Pressure levels that a campaign plans with: six is what the book's page on campaigns requires.
pub(crate) const LEVELS: usize = 6;
/// Seconds for the free stroke at the slow speed (the thesis: 1 mm/s for a 150 mm muscle).
pub(crate) const SLOW_STROKE: f64 = 27.0;
/// Pressure rate of the first ramp at rest length, share of the highest level per second: it shows deadband and blocked force, and takes
/// 5 s each way.
pub(crate) const FIRST_RAMP_SHARE: f64 = 0.2;
/// The first tare, s: the mean of 50 readings has a seventh of their noise, and later tares improve it.
pub(crate) const FIRST_TARE: f64 = 5.0;
/// Speed of the survey of all levels, in slow speeds: a stroke of some seconds, slow against regulators of some hundredths of a second.
pub(crate) const SURVEY_SPEED: f64 = 8.0;
/// Share of the blocked force below which the muscle counts as free; a stroke turns there.
pub(crate) const FREE_FORCE: f64 = 0.01;
/// Largest contraction that a stroke may reach before anything is known, as a share of the rest length. A braid's
/// neutral angle lies at about a third; the force ends a stroke long before.
pub(crate) const LARGEST_CONTRACTION: f64 = 0.4;
/// Pressure rate while nothing is recorded, share of the highest level per second.
pub(crate) const RAMP_SHARE: f64 = 0.2;
/// Pressure rate between the levels of the survey, share of the highest level per second, and the rest at each level, s: a tenth of a
/// second's lag and its decay are over by then, and creep matters less than time before there is a table.
pub(crate) const SURVEY_RAMP_SHARE: f64 = 0.4;
/// See [`SURVEY_RAMP_SHARE`].
pub(crate) const SURVEY_HOLD: f64 = 1.0;
/// Pressure rate of a recorded ramp, share of the highest level per second: slow against every regulator.
pub(crate) const SLOW_RAMP_SHARE: f64 = 0.04;
/// Samples per second of bench time.
pub(crate) const SAMPLE_HZ: f64 = 10.0;

/// Target for the standard error of the table's force on unseen pressures and strokes, share of the blocked force. The model's own stated
/// inexactness is as large.
pub fn target_error() -> f64 {
    inexactness()
}
/// Inexactness of the model that no number of rows averages out, share of the blocked force.
pub(crate) fn inexactness() -> f64 {
    pam_diagnose::criteria::lack_of_fit()
}
/// Least time between readings that count as independent, s. The diagnosis tests by whole blocks, of which a slow half-stroke is one; the
/// memory of the noise replaces it where it is longer.
pub(crate) const INDEPENDENT_S: f64 = 10.0;
/// Size at which an effect must be noticed, share of the blocked force.
pub(crate) const EFFECT_SIZE: f64 = 0.01;
/// Prior standard deviation of a table column's contribution, in blocked forces.
pub(crate) const PRIOR_COLUMN: f64 = 1.0;
/// Prior standard deviation of the second difference of a coefficient between neighbouring levels, in blocked forces.
pub(crate) const PRIOR_BEND: f64 = 0.05;
/// Prior probability that no effect is missing, before any diagnosis.
pub(crate) const PRIOR_NOTHING: f64 = 0.5;
/// Rows of the past that the design is computed on, at most (cost).
pub(crate) const PAST_ROWS: usize = 900;
/// Rows of a candidate step that the design is computed on, at most (cost).
pub(crate) const STEP_ROWS: usize = 160;
/// Information that a step must promise for it to be worth its time, nats: a tenth of the doubt about one effect among 33.
pub(crate) const WORTHWHILE_NATS: f64 = 2e-3;
/// Steps between two diagnoses of the recordings.
pub(crate) const DIAGNOSE_EVERY: usize = 3;
/// Earliest bench time of a diagnosis, s: before it there are not enough levels.
pub(crate) const DIAGNOSE_FROM: f64 = 240.0;
/// Probability from which a name counts as the only one.
pub(crate) const SURE: f64 = 0.9;
/// Expected entropy of the set, nats, below which an effect that is present would be named: one competing candidate at a tenth of its odds.
pub(crate) const NAMED: f64 = 0.1;
/// Times that a spoiled step is repeated before it is left out.
pub(crate) const REPEATS: u32 = 2;
/// Seconds that the operator needs to set a stroke, mount a check or prepare a step by hand.
pub(crate) const HANDLING_S: f64 = 60.0;

/// Largest difference of pressure and command before a reading counts as not settled, share of the highest level.
pub(crate) const FOLLOWS: f64 = 0.1;
/// How long pressure may stay away from its command, s.
pub(crate) const FOLLOWS_S: f64 = 3.0;
/// Measured pressure above this multiple of the muscle's limit ends the campaign.
pub(crate) const OVER_PRESSURE: f64 = 1.1;
/// Equal extreme readings in a row that count as a clipped sensor.
pub(crate) const CLIPPED_ROWS: usize = 12;
/// Noise of the load cell from which a step counts as spoiled, share of the blocked force.
pub(crate) const NOISY: f64 = 0.02;
/// Share of slack rows from which a stroke step counts as spoiled.
pub(crate) const SLACK_ROWS: f64 = 0.25;
