//! Which readings count, pressure levels, blocks, vented rows.

pam_data::criteria! {
    "Rows: readings, pressure levels, blocks":
    /// Share of the readings at either end that the range of the pressure leaves out.
    PRESSURE_TRIM: f64 = 0.002, "q_trim,P", "1", Judgement;
    /// Share of the moving rows at either end that the range of the speed leaves out: the muscle starts and stops.
    SPEED_TRIM: f64 = 0.1, "q_trim,v", "1", Judgement;
    /// Speeds within this factor are one speed.
    ONE_SPEED: f64 = 2.0, "v_max/v_min", "1", Convention("speeds of a protocol differ by octaves or more");
    /// Rows aimed at: enough for every reversal, few enough for seconds of computing.
    TARGET_ROWS: usize = 24_000, "N", "1", Cost;
    /// A reading is a spike where it differs from the median of five by this many deviations of the noise.
    SPIKE_NOISE: f64 = 9.0, "n_spike", "1", Derived("white noise exceeds 9 deviations never in a campaign");
    /// ... and by this share of the force's range.
    SPIKE_RANGE: f64 = 0.004, "F_spike/range", "1", Judgement;
    /// ... and by this many times the median change from reading to reading beside it.
    SPIKE_CHANGE: f64 = 3.0, "n_change", "1", Derived("where an even motion turns, the median of five is two changes away");
    /// Readings about one of pressure or stroke through which a line is laid, to take the noise of the sensor away; odd.
    SMOOTHED: ([usize; 3]) = [31, 15, 7], "n_line", "1", Cost;
    /// The smoothing stops at reversals, unless more than one of this many successive displacements are equal: then the steps of the converter
    /// round the reversal anyway.
    STEPPED_REPEATS: usize = 2, "1/q_stepped", "1", Judgement;
    /// They scatter as the sensor does where their variance about the line is below this quantile, in standard deviations of a normal value.
    SMOOTHED_QUANTILE: f64 = 1.645, "z_line", "1", Convention("95 %");
    /// Spikes are mentioned where they are more than one of this many readings.
    SPIKES_MENTIONED: usize = 200, "1/q_spike", "1", Judgement;
    /// Below this share of the largest force the muscle carries no load: a repeated reading is not an end of the sensor's range, a row may be slack.
    NO_LOAD: f64 = 0.02, "F_0/F_max", "1", Judgement;
    /// For a slack muscle the model must also give less than this share of the largest force.
    SLACK_MODEL: f64 = 0.015, "F_slack/F_max", "1", Judgement;
    /// Slack rows are mentioned where they are more than one of this many rows.
    SLACK_MENTIONED: usize = 100, "1/q_slack", "1", Judgement;
    /// Fits by which slack rows are found: the first still saw them.
    SLACK_ROUNDS: usize = 2, "n_slack", "1", Judgement;
    /// Force and stroke are simultaneous to this part of a row's duration at best.
    SIMULTANEITY: f64 = 0.25, "dt_skew/dt", "1", Judgement;
    /// A flank changes the force from row to row by this many times the half-stroke's median step.
    FLANK_STEP: f64 = 3.0, "n_flank", "1", Judgement;
    /// An error of this share of the largest force needs no weight taken from a row.
    NEGLIGIBLE_ERROR: f64 = 1e-3, "e_0/F_max", "1", Judgement;
    /// A stroke that was corrected for a frame has turned once it has come back by this share of the least motion.
    TURNED_BACK: f64 = 0.25, "dx_back/x_rev", "1", Judgement;
    /// Readings after a reversal that are in doubt for it, at most.
    TURN_SAMPLES: usize = 200, "m_turn", "1", Cost;
    /// A muscle is vented below this share of the highest pressure.
    VENTED_SHARE: f64 = 0.02, "P_vent/P_max", "1", Measured("zero errors of gauges, 0.1 to 0.5 % of full scale (catalogue, P1), with margin");
    /// ... and below this pressure.
    VENTED_PRESSURE: f64 = 8e3, "P_vent", "Pa", Measured("below the deadbands of muscles, 10 to 100 kPa (catalogue, S3)");
    /// Tares agree where they differ by this share of the largest at most.
    SAME_ZERO: f64 = 0.15, "dF_0/F_0", "1", Judgement;
    /// ... or by this many standard deviations of their means.
    SAME_ZERO_NOISE: f64 = 6.0, "n_zero", "1", Judgement;
    /// Rows of a tare from which its drift is identifiable.
    TARE_ROWS: usize = 6, "N_tare", "1", Judgement;
    /// A muscle is at its rest length to this part of it.
    AT_REST_LENGTH: f64 = 2e-3, "dL/L0", "1", Judgement;
    /// Ramps below this share of the lowest pressure level reach beyond every table and do not count.
    LEVEL_REACH: f64 = 0.8, "P/P_1", "1", Judgement;
    /// The pressure of a half-stroke is steady where it scatters by this share of its range.
    LEVEL_SPREAD: f64 = 0.02, "s_P/range", "1", Judgement;
    /// ... or of this share of its mean.
    LEVEL_SPREAD_OF_MEAN: f64 = 0.05, "range_min/P", "1", Judgement;
    /// Mean pressures closer than this share of the range are one level.
    SAME_LEVEL: f64 = 0.035, "dP/range", "1", Judgement;
    /// ... or closer than this.
    SAME_LEVEL_PRESSURE: f64 = 3e3, "dP", "Pa", Judgement;
    /// A level holds more than one of this many rows.
    LEVEL_ROWS: f64 = 200.0, "1/q_level", "1", Judgement;
    /// Pressures are levels where this many tenths of the rows are steady.
    LEVEL_TENTHS: usize = 6, "10 q_steady", "1", Judgement;
    /// Levels and groups left out are as many as this at most.
    MOST_LEVELS: usize = 12, "n_level", "1", Cost;
    /// Nodes over the range of a pressure that has no levels.
    RANGE_NODES: usize = 7, "n_node", "1", Judgement;
    /// Nodes closer than this share of the range are one.
    SAME_NODE: f64 = 0.02, "dP_node/range", "1", Judgement;
    /// A typical half-stroke lasts as long as this quantile of all.
    TYPICAL_BLOCK: f64 = 0.7, "q_block", "1", Judgement;
    /// A block lasts at least this part of a typical half-stroke.
    SHORTEST_BLOCK: f64 = 0.35, "t_block,min/t", "1", Judgement;
    /// ... and at most this many.
    LONGEST_BLOCK: f64 = 3.0, "t_block,max/t", "1", Judgement;
}
