//! What friction does while the length is held.

pam_data::criteria! {
    "Friction at rest":
    /// Settling times of friction that are tried.
    SETTLING_TIMES: ([f64; 8]) = [0.3, 0.7, 1.5, 3.0, 6.0, 12.0, 30.0, 100.0], "tau", "s", Derived("factors of about two over the lengths of usual holds");
    /// Changes of pressure that static friction carries, half-widths of the play that are tried.
    CARRIED_PRESSURES: ([f64; 8]) = [0.0, 500.0, 1.0e3, 1.5e3, 2.0e3, 2.6e3, 4.0e3, 7.0e3], "h", "Pa", Judgement;
    /// Changes of pressure over which friction reaches the other branch, tried.
    FOLLOWING_PRESSURES: ([f64; 7]) = [100.0, 300.0, 1.0e3, 3.0e3, 1.0e4, 3.0e4, 1.0e5], "b", "Pa", Derived("half decades");
    /// Changes of pressure over which a part of friction turns in a muscle that was held throughout; the shares of the parts are fitted.
    TURNING_PRESSURES: ([f64; 4]) = [3.0e3, 1.0e4, 3.0e4, 1.0e5], "b_k", "Pa", Derived("half decades, from a regulator's ripple to the range of most tests");
    /// The unknown place of friction at the beginning of a recording is followed until this part of it is left.
    BEGINNING_LEFT: f64 = 0.01, "dz", "1", Derived("a hundredth of a friction of 10 % of the force is 0.1 % of it");
    /// Rows at the beginning of a recording are not judged while more than this part of it is left ...
    BEGINNING_UNKNOWN: f64 = 0.3, "z_begin", "1", Judgement;
    /// ... unless that would leave out more than this share of all rows.
    MOST_BEGINNINGS: f64 = 0.2, "q_begin", "1", Judgement;
    /// Of a muscle that was held throughout this many rows decide how friction follows the pressure.
    HELD_ROWS: usize = 6000, "N_held", "1", Cost;
    /// Rows each way over which the pressure is smoothed, tried.
    PRESSURE_SMOOTHING: ([usize; 3]) = [0, 1, 3], "m_P", "1", Judgement;
    /// Factors by which the best law is varied, coarse and fine.
    NEARBY_FACTORS: ([[f64; 4]; 2]) = [[0.7, 0.87, 1.15, 1.4], [0.9, 0.95, 1.05, 1.1]], "f", "1", Derived("halves the grid's distances twice");
    /// A row rests from this time after the last motion.
    RESTING_AFTER: f64 = 1.0, "t_rest", "s", Judgement;
    /// Rest friction is examined where more than one of this many rows rest.
    RESTING_ROWS: usize = 50, "1/q_rest", "1", Judgement;
    /// A hold has more rows than this.
    HOLD_ROWS: usize = 4, "N_hold", "1", Judgement;
    /// Rows at rest that leave this many times the mean square of moving rows, and follow no law, are fitted rest by rest.
    NO_LAW_RATIO: f64 = 4.0, "S_rest/S_move", "1", Derived("twice the standard deviation");
    /// A change of the friction's direction that ends one rest and begins another.
    REST_JUMP: f64 = 0.1, "ds", "1", Judgement;
    /// Rests fitted singly beyond one for each hold, at most.
    MOST_RESTS: usize = 100, "n_rest", "1", Cost;
    /// Friction and bladder are known from this many moving rows on.
    FEWEST_MOVING_ROWS: usize = 400, "N_move", "1", Judgement;
    /// A law replaces the model's where it leaves less than this share of the error at rest.
    REST_LAW_LEAVES: f64 = 0.7, "S_law/S_0", "1", Judgement;
    /// A step of the force at rest exceeds this many deviations of the readings' noise ...
    STEP_NOISE: f64 = 6.0, "n_step", "1", Judgement;
    /// ... and this share of the gap between the branches.
    STEP_OF_GAP: f64 = 0.2, "dF/gap", "1", Judgement;
    /// A step is sharp where this part of it happens within its rows; relaxation and drift continue.
    STEP_SHARPNESS: f64 = 0.7, "q_sharp", "1", Derived("an exponential relaxation has 0.63 of its change within its time constant");
    /// Rows each way within which a step happens.
    STEP_ROWS: ([usize; 4]) = [1, 2, 4, 8], "m_step", "1", Derived("doubling widths");
    /// A burst of slips lasts no longer than this.
    STEP_TIME: f64 = 1.5, "t_step", "s", Judgement;
    /// Rows each way over which the force before and after a step is taken, at least.
    STEP_BESIDE: usize = 5, "m_beside", "1", Judgement;
    /// Rows before a step soon after a hold's beginning, at least.
    STEP_BEFORE: usize = 2, "m_before", "1", Judgement;
    /// A hold with ramps is examined from this many rows on at which the muscle pulls.
    RAMP_ROWS: usize = 50, "N_ramp", "1", Derived("eight rows for each of the six numbers that are fitted to a hold");
    /// Changes of pressure that static friction carries on a ramp, half-widths of the play that are tried.
    RAMP_CARRIED: ([f64; 3]) = [0.0, 1.0e3, 3.0e3], "h_ramp", "Pa", Judgement;
    /// Shares of friction that turn later than the rest, tried.
    LATER_SHARES: ([f64; 2]) = [0.25, 0.5], "q_late", "1", Judgement;
    /// Over how many times the change of pressure they turn. A decade is not distinguishable from the table's own error over the pressure.
    LATER_TIMES: f64 = 3.0, "b_late/b", "1", Derived("half a decade");
    /// Friction turns slowly on a ramp where the law of it leaves less than this share of the error of a law without any delay.
    RAMP_LAW_LEAVES: f64 = 0.7, "S_ramp/S_0", "1", Judgement;
    /// A row of a ramp is judged once friction is within this of its full direction.
    RAMP_TURNED: f64 = 0.1, "1 - z_ramp", "1", Judgement;
    /// The change of pressure by which friction has turned is found to this part of the change of pressure over which it turns.
    RAMP_PRECISION: f64 = 1e-3, "dP/b", "1", Cost;
}
