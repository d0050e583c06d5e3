//! What counts as noise, as a motion, a reversal, a hold and a ramp: each threshold of the reconstruction, once.

crate::criteria! {
    "Motion: noise, reversals, holds and ramps":
    /// A series is quantised where more than one of this many successive readings are equal.
    QUANTISED_REPEATS: usize = 5, "1/q_equal", "1", Judgement;
    /// Equal successive readings are steps of a converter where the range holds at least this many of its smallest step, or where
    /// readings change often. Otherwise they are values that were set, for instance lengths of mountings.
    QUANTISED_LEVELS: f64 = 32.0, "n_levels", "1", Judgement;
    /// Readings change often where more than one of this many successive readings differ.
    QUANTISED_CHANGES: usize = 20, "1/q_change", "1", Judgement;
    /// Fewest rows of a stay at one length, where a file of an isometric test is split at its lengths.
    STAY_ROWS: usize = 16, "N_stay", "1", Judgement;
    /// The file is an isometric test where the pressure moves over at least this share of its range at the median stay.
    STAY_SWEEP: f64 = 0.5, "ΔP_stay/ΔP", "1", Judgement;
    /// Samples behind an estimate of white noise, in runs of neighbours, about.
    NOISE_SAMPLES: usize = 16_384, "N_noise", "1", Cost;
    /// Samples among which the smallest step of a converter is looked for, at most.
    QUANTUM_SAMPLES: usize = 65_536, "N_q", "1", Cost;
    /// Fewest samples for fourth differences beside second ones.
    FOURTH_DIFFERENCES: usize = 16, "N_4", "1", Judgement;
    /// Second differences of noise rise by less than this factor when the lag doubles. Those of a smooth motion rise fourfold.
    NOISE_RISE: f64 = 1.8, "r_lag", "1", Derived("below the geometric mean of 1 for white noise and 4 for curvature");
    /// The longest such lag in samples.
    NOISE_LAG: usize = 64, "k_lag", "1", Judgement;
    /// It is at most this part of the recording.
    NOISE_LAG_PART: usize = 16, "N/k_lag", "1", Judgement;
    /// The smallest step between readings is a step of the converter up to this share of the range.
    QUANTUM_SHARE: f64 = 1e-3, "q/range", "1", Measured("converters of 10 bits and more");
    /// Noise of a pressure is at most this share of its largest value: settled readings of a staircase differ by whole steps.
    PRESSURE_NOISE_MOST: f64 = 0.005, "s_P/P_max", "1", Measured("no industrial pressure sensor is noisier");
    /// A change is a motion above this many times the largest of as many readings of noise, plus one deviation.
    MOTION_NOISE: f64 = 2.0, "n_motion", "1", Derived("n normal values spread over twice their expected largest, sqrt(2 ln n) deviations");
    /// It is also above this share of the range of the campaign's strokes.
    MOTION_STROKE_SHARE: f64 = 0.004, "x_rev/range", "1", Judgement;
    /// It is also above this stroke.
    MOTION_STROKE_FLOOR: f64 = 1e-5, "x_rev", "m", Measured("frames and mountings yield by some micrometres");
    /// Share of the readings at either end that the range of a column leaves out.
    RANGE_TRIM: f64 = 0.002, "q_trim", "1", Judgement;
    /// A change of pressure at held length is filling or emptying above this share of the recording's largest pressure.
    MOTION_PRESSURE_SHARE: f64 = 0.02, "P_rev/P_max", "1", Judgement;
    /// The threshold is at most this share.
    MOTION_PRESSURE_MOST: f64 = 0.08, "P_rev,max/P_max", "1", Judgement;
    /// The largest pressure counts as at least this.
    MOTION_PRESSURE_FLOOR: f64 = 100e3, "P_max", "Pa", Measured("2 % of it, 2 kPa, is the hysteresis of regulators, 0.2 to 1 % of 200 to 1000 kPa");
    /// A threshold is raised by this factor while ripple remains.
    RIPPLE_RAISE: f64 = 1.5, "r_ripple", "1", Judgement;
    /// It is raised at most this often.
    RIPPLE_RAISES: usize = 12, "m_ripple", "1", Cost;
    /// Ripple has at least this many strokes.
    RIPPLE_STROKES: usize = 6, "N_ripple", "1", Judgement;
    /// At least half of them are below this many thresholds.
    RIPPLE_SMALL: f64 = 2.5, "A_ripple/x_rev", "1", Judgement;
    /// The largest stroke exceeds this many thresholds.
    RIPPLE_LARGEST: f64 = 8.0, "A_max/x_rev", "1", Judgement;
    /// A moving mean averages at most this part of the shortest stroke, and of the recording.
    SMOOTHING_PART: usize = 8, "N_stroke/m_mean", "1", Judgement;
    /// It averages at most this many samples.
    SMOOTHING_MOST: usize = 2001, "m_mean", "1", Cost;
    /// Readings stray from the level of a rest or a reversal by this many standard deviations.
    ONSET_CLEAR: f64 = 3.0, "n_onset", "1", Convention("three deviations");
    /// A reversal is found on single samples where the stroke changes by this many deviations of the noise from one to the next.
    SHARP_STEP: f64 = 5.0, "n_step", "1", Convention("five deviations");
    /// The same where fewer samples than this lie within the threshold of it.
    SHARP_SAMPLES: usize = 6, "m_sharp", "1", Judgement;
    /// The sample at a corner belongs to the side from whose line it is this many times nearer.
    SHARP_RATIO: f64 = 3.0, "r_side", "1", Judgement;
    /// Lines on either side of a reversal reach this many thresholds far.
    LINE_REACH: f64 = 3.0, "x_line/x_rev", "1", Judgement;
    /// They reach at most this share of the strokes on either side.
    LINE_STROKE_SHARE: f64 = 0.4, "x_line/A", "1", Judgement;
    /// A pressure has left its level by this part of its threshold.
    PRESSURE_ONSET: f64 = 0.25, "dP_onset/P_rev", "1", Judgement;
    /// A length is held while the stroke stays within this many motion thresholds: frames yield to the force.
    HOLD_DRIFT: f64 = 3.0, "n_hold", "1", Judgement;
    /// Strokes that small are creep at a held length below this share of the typical speed.
    CREEP_SPEED: f64 = 0.05, "v_creep/v", "1", Judgement;
    /// A stroke of fewer thresholds has the mean speed of all of it; of a larger one, the threshold at either end is left out.
    SMALL_STROKE: f64 = 4.0, "A_small/x_rev", "1", Judgement;
    /// A stroke is divided into at most this many parts to find holds on its way.
    PACE_PARTS: usize = 10, "m_pace", "1", Judgement;
    /// A part has at least this many samples, on average.
    PACE_SAMPLES: usize = 3, "k_pace", "1", Judgement;
    /// A part that takes this many times the median part contains a hold; the ends of a sine take three times as long.
    DWELL_RATIO: f64 = 10.0, "t_dwell/t_med", "1", Derived("three times what the ends of a sine take");
    /// Fewest samples of a hold.
    HOLD_SAMPLES: usize = 6, "N_hold", "1", Judgement;
    /// A hold lasts longer than the motion around it takes for the threshold, by this factor.
    HOLD_TIME: f64 = 4.0, "t_hold/t_pass", "1", Judgement;
    /// What lasts longer by this factor is a hold even if it creeps.
    LONG_HOLD_TIME: f64 = 60.0, "t_long/t_pass", "1", Derived("a sine never passes this and LONG_HOLD_SHARE together");
    /// It also lasts longer than this share of the shortest stroke beside it.
    LONG_HOLD_SHARE: f64 = 0.1, "t_long/t_stroke", "1", Derived("with LONG_HOLD_TIME: a sine of amplitude A spends 0.9 sqrt(x_rev/A) of a stroke within x_rev");
    /// Samples at rest stray from its level by at least this share of the threshold.
    HOLD_TOLERANCE: f64 = 0.1, "dx_rest/x_rev", "1", Judgement;
    /// A hold is entered and left within this many times what passing takes; the round top of a smooth turn is not.
    HOLD_EDGE_TIME: f64 = 2.5, "t_edge/t_pass", "1", Judgement;
    /// The same within this share of its duration.
    HOLD_EDGE_SHARE: f64 = 0.3, "t_edge/t_hold", "1", Judgement;
    /// Slope and curvature of a hold are within this many deviations of what noise makes.
    FLAT_NOISE: f64 = 5.0, "n_flat", "1", Convention("five deviations: one rest in a million is missed");
    /// They are bounded to these shares of the threshold.
    FLAT_SHARE: ((f64, f64)) = (0.05, 0.25), "dx_flat/x_rev", "1", Derived("a smooth turn that fills the threshold bends by half of it; half of that divides the two");
    /// Beyond its ends a hold extends to samples this near to its level, in thresholds.
    HOLD_REACH: f64 = 0.6, "dx_reach/x_rev", "1", Judgement;
    /// Two holds side by side are one where their levels differ by less than this many thresholds.
    HOLD_JOIN: f64 = 0.5, "dx_join/x_rev", "1", Judgement;
    /// Samples behind the level of a hold, at most.
    LEVEL_SAMPLES: usize = 4096, "N_level", "1", Cost;
    /// A cycle ends where the stroke has gone back by this share of it.
    CYCLE_SHARE: f64 = 0.7, "q_cycle", "1", Judgement;
    /// The direction is in doubt for at most this many samples on either side of a reversal.
    DOUBT_SAMPLES: usize = 200, "m_doubt", "1", Cost;
    /// The window of a speed is wide enough that noise leaves this relative error of the typical speed.
    SPEED_PRECISION: f64 = 0.03, "dv/v", "1", Derived("variance of a least-squares slope over m samples, 12 s^2/(m^3 dt^2)");
    /// The window of an acceleration is that of a speed known this many times as well.
    ACCELERATION_PRECISION: f64 = 10.0, "r_acc", "1", Judgement;
    /// Half the window of a rate in samples, least and most.
    RATE_HALF_SAMPLES: ((usize, usize)) = (2, 2000), "m_rate/2", "1", Cost;
    /// Samples that a window takes on either side, at most; beyond that it strides over means.
    RATE_SAMPLES: usize = 24, "m_taken", "1", Cost;
    /// A pressure crosses its range within this time, as far as the window of its rate is concerned.
    PRESSURE_TIME: f64 = 5.0, "t_P", "s", Judgement;
    /// The range of a pressure is at least this many deviations of its noise.
    PRESSURE_RANGE_NOISE: f64 = 20.0, "n_P", "1", Judgement;
    /// A ramp begins where the pressure has left its level by this many deviations of its noise.
    RAMP_NOISE: f64 = 4.0, "n_ramp", "1", Convention("four deviations");
    /// A ramp may begin this long before the length is held, and end this long after.
    RAMP_MARGIN: f64 = 1.0, "t_margin", "s", Judgement;
    /// The same in samples, at least and at most.
    RAMP_MARGIN_SAMPLES: ((usize, usize)) = (6, 200), "m_margin", "1", Judgement;
    /// A ramp is judged from this time after its reversal: a regulator's step response comes before.
    RAMP_SETTLES: f64 = 3.0, "t_ramp", "s", Judgement;
    /// A ramp continues while its rate exceeds this share of its mean rate since the reversal.
    RAMP_STEADY: f64 = 0.3, "r_ramp", "1", Judgement;
    /// A row is fast where the pressure moved by more than this share of its range within `FAST_WITHIN`. Ringing of valve pulses.
    FAST_SHARE: f64 = 0.015, "ΔP_fast/ΔP", "1", Measured("ringing of valve pulses");
    /// Time within which a fast row has moved.
    FAST_WITHIN: f64 = 0.1, "t_fast", "s", Judgement;
    /// Time since the last fast row until a row counts as settled: valve pulses ring at about 20 Hz for 0.2 to 0.3 s.
    SETTLE: f64 = 0.25, "t_set", "s", Measured("ringing of valve pulses");
    /// With a smaller share of settled rows all rows count as settled: the pressure never rests.
    FEWEST_SETTLED: f64 = 0.1, "q_set", "1", Judgement;
    /// Share of the range by which pressure or stroke must come back before it has turned: above ringing and ripple.
    TURN: f64 = 0.05, "δ_settled", "1", Judgement;
    /// The turn stands after the last row within this share of the range of the extremum, so that a hold keeps its direction.
    TURN_HOLD: f64 = 0.01, "δ_hold", "1", Judgement;
}
