//! What counts as a motion, a reversal, a hold and a ramp.

criteria! {
    "Motion: reversals, holds and ramps":
    /// A change of stroke or pressure is a motion above this many standard deviations of its reading noise.
    MOTION_NOISE: f64 = 8.0, "n_motion", "1", Derived("white noise exceeds 8 deviations once in 1e15 readings, so noise makes no reversal");
    /// ... and above this share of the stroke's range.
    MOTION_STROKE_SHARE: f64 = 0.004, "x_rev/range", "1", Judgement;
    /// ... and above this share of the rest length.
    MOTION_STROKE_FLOOR: f64 = 5e-5, "x_rev/L0", "1", Judgement;
    /// A change of pressure at held length is filling or emptying above this share of the pressure's range.
    MOTION_PRESSURE_SHARE: f64 = 0.02, "P_rev/range", "1", Judgement;
    /// ... and above this pressure.
    MOTION_PRESSURE_FLOOR: f64 = 2e3, "P_rev", "Pa", Measured("hysteresis of regulators, 0.2 to 1 % (catalogue, P3)");
    /// Share of the readings at either end that the range of a column leaves out.
    RANGE_TRIM: f64 = 0.002, "q_trim", "1", Judgement;
    /// A length is held while the stroke stays within this many motion thresholds.
    HOLD_DRIFT: f64 = 3.0, "n_hold", "1", Judgement;
    /// Readings farther from the extreme than this many standard deviations belong to the motion.
    ONSET_CLEAR: f64 = 3.0, "n_onset", "1", Convention("three deviations");
    /// Doubt of a straight onset, in deviations of the stroke's noise divided by its speed.
    ONSET_DOUBT_NOISE: f64 = 2.0, "n_doubt", "1", Convention("95 % of a normal error");
    /// The doubt of a straight onset in rows, at most.
    ONSET_DOUBT_ROWS: f64 = 5.0, "k_doubt", "1", Judgement;
    /// Doubt that sampling alone leaves of an onset, in sampling intervals.
    ONSET_DOUBT_SAMPLING: f64 = 1.6, "k_sampling", "1", Judgement;
    /// The part of the motion threshold at which the slope of an onset begins.
    ONSET_SLOPE_FROM: f64 = 3.0, "1/part", "1", Judgement;
    /// A half-stroke is divided into at most this many parts to find holds on its way.
    PACE_PARTS: usize = 10, "m_pace", "1", Judgement;
    /// ... of at least this many rows each, on average.
    PACE_ROWS: usize = 3, "k_pace", "1", Judgement;
    /// A part that takes this many times the median part contains a hold; the ends of a sine take three times as long.
    DWELL_RATIO: f64 = 10.0, "t_dwell/t_med", "1", Derived("three times what the ends of a sine take");
    /// The slope window is wide enough that noise leaves this relative error of the typical speed.
    SPEED_PRECISION: f64 = 0.03, "dv/v", "1", Derived("variance of a least-squares slope over m rows, 12 s^2/(m^3 dt^2)");
    /// Rows of the slope window where the stroke has no noise.
    SLOPE_ROWS: f64 = 5.0, "m_slope", "1", Judgement;
    /// Half the slope window, least and most rows.
    SLOPE_HALF_ROWS: ((usize, usize)) = (2, 60), "m_slope/2", "1", Judgement;
    /// Slower than this share of the typical speed is rest.
    REST_SPEED: f64 = 0.05, "v_rest/v", "1", Judgement;
    /// ... or than this many deviations of the slope's noise.
    REST_SPEED_NOISE: f64 = 5.0, "n_rest", "1", Convention("five deviations");
    /// ... but never faster than this share of the typical speed.
    REST_SPEED_MOST: f64 = 0.3, "v_rest,max/v", "1", Judgement;
    /// A ramp begins where the pressure has left its level by this many deviations of its noise.
    RAMP_NOISE: f64 = 4.0, "n_ramp", "1", Convention("four deviations");
    /// A ramp is judged from this time after its reversal: a regulator's step response comes before.
    RAMP_SETTLES: f64 = 3.0, "t_ramp", "s", Judgement;
    /// A ramp continues while its rate exceeds this share of its mean rate since the reversal.
    RAMP_STEADY: f64 = 0.3, "r_ramp", "1", Judgement;
    /// A series is quantised where more than one of this many successive readings are equal.
    QUANTISED_REPEATS: usize = 5, "1/q_equal", "1", Judgement;
    /// Its noise is then at least its step divided by this.
    QUANTISATION: f64 = 3.0, "q/s", "1", Derived("a uniform error of a step q has the deviation q/3.46; rounded up");
    /// Second differences behind an estimate of noise, at most.
    NOISE_SAMPLES: usize = 20_000, "N_noise", "1", Cost;
}
