//! Every constant of the history layer, with its symbol, unit, meaning and source, in one place.
//!
//! "eleven muscles" stands for the two public sets of isometric pressure staircases of a 10 mm fluidic muscle (eleven lengths). Law,
//! spectrum and clock were chosen on six of them and then run once on the other five.

/// A constant as it is listed for a reader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criterion {
    /// Its symbol in the equations.
    pub symbol: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Where the value comes from.
    pub source: &'static str,
}

macro_rules! criteria {
    ($($name:ident: $symbol:literal = $value:literal, $unit:literal, $meaning:literal, $source:literal;)+) => {
        $(#[doc = $meaning] pub(super) const $name: f64 = $value;)+

        /// All of them, in the order of the computation.
        pub const ALL: &[Criterion] = &[$(Criterion {
            symbol: $symbol, value: $value, unit: $unit, meaning: $meaning, source: $source,
        },)+];
    };
}

criteria! {
    SAME_LENGTH: "ΔL_m" = 0.5e-3, "m", "largest change of a held length within one mounting", "half of a tape measure's ±1 mm";
    SETTLED_INTERVAL: "Δt_s" = 0.25, "s", "rows at least this far apart are settled points already", "valve pulses ring for 0.2 to 0.3 s (20 Hz, damping 0.5)";
    WINDOW_FROM: "w_1" = 0.70, "", "a settled point begins at this share of the pulse period", "after the ring of a pulse of 0.5 s";
    WINDOW_TO: "w_2" = 0.94, "", "a settled point ends at this share of the pulse period", "before the next pulse";
    LEAST_PERIODICITY: "r_p" = 0.15, "", "least autocorrelation of |dP/dt| at a pulse period", "well above 2/√n of the shortest run";
    LEAST_POINTS: "n_p" = 40.0, "", "least number of settled points of a campaign", "some ten per spline of a mounting";
    LEAST_RUNS: "n_r" = 4.0, "", "least number of runs of a campaign", "three degrees of freedom of the jackknife over runs";
    LEAST_SPAN: "s_P" = 0.3, "", "least share of the campaign's pressure range that a run covers to count as a staircase", "definition of the protocol";
    SMOOTHNESS: "λ" = 0.02, "", "weight of squared second differences of spline coefficients", "chosen on six muscles; flat optimum";
    SMOOTHNESS_STATIC: "λ_s" = 0.01, "", "the same for the static comparison", "chosen on six muscles; flat optimum";
    RIDGE: "λ_0" = 1e-6, "", "weight of squared spline coefficients", "numerical rank only";
    THRESHOLD_FROM: "p_1" = 0.84, "", "the tangent of the threshold starts at this share of the highest pressure", "the straight part of the pull";
    THRESHOLD_TO: "p_2" = 0.94, "", "the tangent of the threshold ends at this share of the highest pressure", "below the sparse last points";
    ENGAGED: "P_e" = 60.0, "kPa", "pressure from which the bladder carries its part", "on the 29 cm muscle the squared residual is 3377 N² with it, 4396 N² with P_b in its place";
    RAMP: "ΔP_r" = 60.0, "kPa", "least pressure over which the bladder's carried part builds up", "width of the knee at full length";
    BALANCE_START: "P_b0" = 115.0, "kPa", "start value of the stress-free pressure, and its value where it is not identifiable", "best common value of eleven muscles";
    BALANCE_MOST: "P_b,max" = 200.0, "kPa", "largest stress-free pressure", "above it no muscle of the kind begins to pull";
    BALANCE_MOVES: "ΔP_b" = 0.2, "kPa", "the search for the stress-free pressure ends at smaller steps", "a tenth of its usual standard error";
    NEAR_BALANCE: "r_b" = 1.5, "", "P_b is identifiable when a mounting pulls from less than this times P_b", "the sign of p_el must be seen";
    DAMPING: "d" = 0.9, "", "share of each Gauss-Newton step that is taken", "steps across the knee overshoot";
    VENT_TIME: "t_v" = 2.0, "s", "time after the last row until a muscle counts as vented", "emptying of the last pulse";
    VENTED_BEFORE: "t_0" = 30.0, "s", "vented time between an earlier load and the first run", "change of a mounting; weakly known";
    NESTED_RUNS: "n_n" = 20.0, "", "below this number of runs pause and earlier load are chosen anew in every fold", "cost; with more runs one run does not decide them";
    MOST_FOLDS: "n_f" = 40.0, "", "of more runs, every so many-th is left out together (delete-a-group jackknife)", "cost; a standard error by 40 groups is itself known to 11 %";
    SUPPORT: "ΔP_s" = 10.0, "kPa", "a row is supported when another run of the mounting reaches its pressure less this", "half a pulse";
    LEAST_SHARE: "c_min" = 0.1, "", "least relaxed share that is named (2 % a decade)", "largest of 144 nulls 0.040; below what filled rubbers relax";
    LEAST_GAIN: "g_min" = 0.15, "", "least share of the squared unseen error that the memory must remove", "largest of 60 nulls with ten runs 0.10";
    SLIP_RUNS: "n_s" = 6.0, "", "least number of runs of a mounting in which a lasting slip is looked for", "two levels and their scatter";
    SLIP_ERRORS: "t_s" = 4.0, "", "a slip is at least this many standard errors", "chosen on six muscles";
    SLIP_LEAST: "Δp_s" = 5.0, "kPa", "least slip", "about 0.3 mm of length; changes of pulse width make up to 4 kPa";
    SLIP_GAIN: "g_s" = 0.2, "", "a slip lowers the mounting's unseen error (rms) at least by this share", "chosen on six muscles";
    BAD_RUN_RUNS: "n_b" = 5.0, "", "least number of runs of a mounting in which a single bad run is looked for", "median and scatter of four others";
    BAD_RUN_ERRORS: "t_b" = 4.0, "", "a bad run is off by at least this many deviations of all runs", "none named on eleven muscles as recorded";
    BAD_RUN_LEAST: "Δp_b" = 3.0, "kPa", "least offset of a bad run", "about 0.2 mm of length";
    BAD_RUN_NEXT: "r_n" = 2.0, "", "a bad run is off by this many times the next largest offset", "one run, not a drift";
    KEPT_GAIN: "g_k" = 0.1, "", "a further effect is kept when the squared unseen error falls by this share", "chosen on six muscles";
    KEPT_ERRORS: "t_k" = 3.0, "", "and when its coefficient is this many standard errors", "chosen on six muscles";
    PULLS: "f_p" = 0.0125, "", "a settled point pulls above this share of the largest force", "5 N of 400 N, above the offset of a load cell between sessions";
    NEIGHBOURS: "Δk" = 2.6, "", "contrasts interpolate between points at most this many knots apart", "wider steps cut the knee";
    SHORTENED: "ε_s" = 5e-3, "", "a mounting counts as shortened above this contraction", "1 mm of 200 mm";
}

/// Time constants of the memory, s: one a decade. The upper end is not identifiable beyond 10³ s; one state alone is worse (0.485 against
/// 0.312 % of the largest force, mean of eleven muscles).
pub(super) const TIMES: [f64; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];
/// Pauses between runs that are tried where the clock does not tell them, s.
pub(super) const PAUSES: [f64; 4] = [2.5, 5.0, 12.0, 30.0];
/// Times for which the muscle may have been loaded before the first run, s. Longer ones trade against the relaxed share.
pub(super) const LOADED: [f64; 3] = [0.0, 100.0, 1e3];

/// 97.5 % quantile of Student's t; to 0.3 % beyond thirty degrees of freedom.
pub(super) fn t_quantile(freedom: usize) -> f64 {
    const TABLE: [f64; 30] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145,
        2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048,
        2.045, 2.042,
    ];
    match freedom {
        0 => f64::INFINITY,
        1..=30 => TABLE[freedom - 1],
        _ => 1.96 + 2.4 / freedom as f64,
    }
}
