//! What a muscle remembers over a campaign of isometric staircases.
//!
//! "Eleven muscles" are the two public sets of isometric pressure staircases of a 10 mm fluidic muscle (eleven lengths). Law,
//! spectrum and clock were chosen on six of them and then run once on the other five.

pam_data::criteria! {
    "History of a campaign":
    /// Rows at least this far apart are settled points already.
    SETTLED_INTERVAL: f64 = 0.25, "Δt_s", "s", Derived("valve pulses ring for 0.2 to 0.3 s (20 Hz, damping 0.5)");
    /// Least number of settled points of a campaign.
    LEAST_POINTS: f64 = 40.0, "n_p", "1", Derived("some ten per spline of a mounting");
    /// Least number of runs of a campaign.
    LEAST_RUNS: f64 = 4.0, "n_r", "1", Derived("three degrees of freedom of the jackknife over runs");
    /// Least share of the campaign's pressure range that a run covers to count as a staircase.
    LEAST_SPAN: f64 = 0.3, "s_P", "1", Derived("definition of the protocol");
    /// A run shows no memory if more of its readings than this share are excluded as failures of a sensor.
    MOST_LOST: f64 = 0.02, "s_lost", "1", Judgement;
    /// Weight of squared second differences of spline coefficients.
    SMOOTHNESS: f64 = 0.02, "λ", "1", Measured("chosen on six muscles; flat optimum");
    /// The same for the static comparison.
    SMOOTHNESS_STATIC: f64 = 0.01, "λ_s", "1", Measured("chosen on six muscles; flat optimum");
    /// Weight of squared spline coefficients.
    RIDGE: f64 = 1e-6, "λ_0", "1", Derived("numerical rank only");
    /// Knots of a curve below the highest pressure, about: their distance is 1, 2 or 5 times a power of ten.
    KNOTS: f64 = 13.0, "n_knot", "1", Judgement;
    /// The tangent of the threshold starts at this share of the highest pressure.
    THRESHOLD_FROM: f64 = 0.84, "p_1", "1", Derived("the straight part of the pull");
    /// The tangent of the threshold ends at this share of the highest pressure.
    THRESHOLD_TO: f64 = 0.94, "p_2", "1", Derived("below the sparse last points");
    /// The threshold of a mounting that never pulls is at most this many times its highest pressure.
    THRESHOLD_BEYOND: f64 = 1.2, "p_th/p_max", "1", Judgement;
    /// Pressure from which the bladder carries its part.
    ENGAGED: f64 = 60.0, "P_e", "kPa", Measured("on the 29 cm muscle the squared residual is 3377 N² with it, 4396 N² with P_b in its place");
    /// Least pressure over which the bladder's carried part builds up.
    RAMP: f64 = 60.0, "ΔP_r", "kPa", Derived("width of the knee at full length");
    /// Start value of the stress-free pressure, and its value where it is not identifiable.
    BALANCE_START: f64 = 115.0, "P_b0", "kPa", Measured("best common value of eleven muscles");
    /// Largest stress-free pressure.
    BALANCE_MOST: f64 = 200.0, "P_b,max", "kPa", Measured("above it no muscle of the kind begins to pull");
    /// Where the stress-free pressure is identifiable, it starts at the threshold of the longest mounting within these shares of its usual start.
    BALANCE_FIRST: ((f64, f64)) = (0.5, 1.3), "r_P_b0", "1", Judgement;
    /// The search for the stress-free pressure ends at smaller steps.
    BALANCE_MOVES: f64 = 0.2, "ΔP_b", "kPa", Derived("a tenth of its usual standard error");
    /// P_b is identifiable when a mounting pulls from less than this times P_b.
    NEAR_BALANCE: f64 = 1.5, "r_b", "1", Derived("the sign of p_el must be seen");
    /// Share of each Gauss-Newton step that is taken.
    DAMPING: f64 = 0.9, "d", "1", Derived("steps across the knee overshoot");
    /// Time after the last row until a muscle counts as vented.
    VENT_TIME: f64 = 2.0, "t_v", "s", Derived("emptying of the last pulse");
    /// Vented time between an earlier load and the first run.
    VENTED_BEFORE: f64 = 30.0, "t_0", "s", Derived("change of a mounting; uncertain");
    /// Below this number of runs pause and earlier load are chosen again in every fold; with more runs one run does not decide them.
    NESTED_RUNS: f64 = 20.0, "n_n", "1", Cost;
    /// Of more runs, every n-th is left out together (delete-a-group jackknife); a standard error by 40 groups is itself known to 11 %.
    MOST_FOLDS: f64 = 40.0, "n_f", "1", Cost;
    /// A row is supported when another run of the mounting reaches its pressure less this.
    SUPPORT: f64 = 10.0, "ΔP_s", "kPa", Derived("half a pulse");
    /// Least relaxed share that is named (2 % a decade).
    MEMORY_LEAST_SHARE: f64 = 0.1, "c_min", "1", Measured("largest of 144 nulls 0.040; below what filled rubbers relax");
    /// First runs differ from all later ones by chance in one of as many ways as there are to choose them: at least this many.
    FIRST_RUN_WAYS: f64 = 20.0, "1/p_first", "1", Convention("p = 5 %");
    /// A muscle runs in if its first runs differ from the second by this many times what later runs differ by: creep continues.
    FIRST_RUN_APART: f64 = 3.0, "r_first", "1", Derived("creep with the logarithm of time gives at most ln 3 / ln(5/3) = 2.15 between runs of equal length");
    /// Least share of the squared unseen error that the memory must remove.
    LEAST_GAIN: f64 = 0.15, "g_min", "1", Measured("largest of 60 nulls with ten runs 0.10");
    /// Least number of runs of a mounting in which a lasting slip is looked for.
    SLIP_RUNS: f64 = 6.0, "n_s", "1", Derived("two levels and their scatter");
    /// A slip is at least this many standard errors.
    SLIP_ERRORS: f64 = 4.0, "t_s", "1", Measured("chosen on six muscles");
    /// Least shift of pressure that counts as a slip.
    SLIP_LEAST: f64 = 5.0, "Δp_s", "kPa", Derived("about 0.3 mm of length; changes of pulse width make up to 4 kPa");
    /// A slip lowers the mounting's unseen error (rms) at least by this share.
    SLIP_GAIN: f64 = 0.2, "g_s", "1", Measured("chosen on six muscles");
    /// Least number of runs of a mounting in which a single bad run is looked for.
    BAD_RUN_RUNS: f64 = 5.0, "n_b", "1", Derived("median and scatter of four others");
    /// A bad run is off by at least this many deviations of all runs.
    BAD_RUN_ERRORS: f64 = 4.0, "t_b", "1", Measured("none named on eleven muscles as recorded");
    /// Least offset of a bad run.
    BAD_RUN_LEAST: f64 = 3.0, "Δp_b", "kPa", Derived("about 0.2 mm of length");
    /// A bad run is off by this many times the next largest offset.
    BAD_RUN_NEXT: f64 = 2.0, "r_n", "1", Derived("one run, not a drift");
    /// A further effect is kept when the squared unseen error falls by this share.
    MEMORY_KEPT_GAIN: f64 = 0.1, "g_k", "1", Measured("chosen on six muscles");
    /// And when its coefficient is this many standard errors.
    KEPT_ERRORS: f64 = 3.0, "t_k", "1", Measured("chosen on six muscles");
    /// Changes of pressure over which friction may turn where it follows the pressure, half a decade apart.
    FOLLOWED_OVER: ([f64; 3]) = [3e3, 1e4, 3e4], "b", "Pa", Derived("half decades: over less friction turns with the drive, over more no pulse turns it");
    /// Time constants of a filter in the force channel that are tried, factors of two.
    FILTER_TIMES: ([f64; 4]) = [0.05, 0.1, 0.2, 0.4], "tau_f", "s", Derived("from a few samples of such recordings to a period of the pulses");
    /// A part of the pressure is read as force where the reading of a slack muscle follows the pressure over at least this range.
    SLACK_RANGE: f64 = 100.0, "dP_slack", "kPa", Derived("a reading of 1 % of the force at the highest pressure is then a converter's step");
    /// ... at pressures below this share of the one from which the muscle pulls: nearer to it a slack tube lifts.
    SLACK_PART: f64 = 0.6, "p_slack", "1", Judgement;
    /// ... and is more than this many times what a cell's zero must be off by to be named: a lifting tube makes as much.
    SLACK_FOLLOWS: f64 = 3.0, "r_slack", "1", Measured("a lifting tube makes up to 2.0 times as much on eleven muscles");
    /// The reading of a slack muscle is one of its zero only if it changes by less than this share of itself over the pressures at which it
    /// is taken: a pull that begins softly doubles there.
    SLACK_FLAT: f64 = 0.6, "r_flat", "1", Derived("from a to 2a the change is 0.67 of the mean");
    /// ... if it differs by less than this share of itself between filling and emptying, and a vented muscle reads more than this share of it in
    /// every mounting.
    SLACK_SAME: f64 = 0.4, "r_same", "1", Derived("a zero is the same; friction of a guide that the first length does not have makes a difference of 1");
    /// ... and if a ramp beyond the pressure from which the muscle seems to pull the slope has this share of its final value.
    SLACK_KNEE: f64 = 0.7, "q_knee", "1", Derived("a pull that begins over 100 kPa has 0.6 of it, one over 25 kPa 0.9");
    /// A load cell reads the pressure only if the slope of its readings grows by less than this factor from the lower to the upper half of the
    /// pressures far below the pull.
    SLACK_STRAIGHT: f64 = 2.5, "r_straight", "1", Derived("a pull that begins over 100 kPa grows by 2.7 from half to half of 200 kPa");
    /// Least slope of a mounting's curve, as a share of the steepest, by which a friction force becomes a shift of pressure.
    LEAST_AREA: f64 = 0.3, "a_min", "1", Derived("a braid's area at two thirds of its largest contraction, strands 29° from the axis");
    /// The memory is the cause of the gap between filling and emptying if it takes at least this share of it.
    GAP_EXPLAINED: f64 = 0.5, "g_gap", "1", Derived("most of it");
    /// The pressure stays at its top within this share of the highest: the plateau on which creep is read.
    PLATEAU_WITHIN: f64 = 0.006, "ΔP_top/P_max", "1", Judgement;
    /// Rows of such a plateau, at least.
    PLATEAU_ROWS: usize = 6, "n_top", "1", Derived("three coefficients and as many degrees of freedom");
    /// The clock of creep on a plateau begins this long before its first row: the last pulses led up to it.
    PLATEAU_FROM: f64 = 2.0, "t_top", "s", Judgement;
    /// Creep on a plateau is read where the pressure leaves this share of the variance of log time free.
    PLATEAU_FREE: f64 = 0.05, "q_free", "1", Judgement;
    /// A settled point pulls above this share of the largest force.
    PULLS: f64 = 0.0125, "f_p", "1", Derived("5 N of 400 N, above the offset of a load cell between sessions");
    /// Contrasts interpolate between points at most this many knots apart.
    NEIGHBOURS: f64 = 2.6, "Δk", "1", Derived("wider steps cut the knee");
    /// A mounting counts as shortened above this contraction.
    SHORTENED: f64 = 5e-3, "ε_s", "1", Derived("1 mm of 200 mm");
    /// Time constants of the memory, one a decade. The upper end is not identifiable beyond 1000 s.
    TIMES: ([f64; 5]) = [1.0, 10.0, 100.0, 1e3, 1e4], "tau_k", "s", Measured("one state alone is worse: 0.485 against 0.312 % of the largest force, mean of eleven muscles");
    /// Pauses between runs that are tried where the clock does not show them.
    PAUSES: ([f64; 4]) = [2.5, 5.0, 12.0, 30.0], "t_p", "s", Judgement;
    /// Times for which the muscle may have been loaded before the first run; longer ones trade against the relaxed share.
    LOADED: ([f64; 3]) = [0.0, 100.0, 1e3], "T_0", "s", Judgement;
    /// A single time constant is refuted when its unseen error (rms) is larger by this factor: a tenth of the squared error.
    ENTER_REFUTES: f64 = 1.054, "e_1/e_τ", "1", Judgement;
    /// Probability of the name then, and where a single time constant fits as well. Both are judgements, not calibrated on known truths.
    ENTER_SURE: f64 = 0.9, "p_sure", "1", Judgement;
    /// Probability of a name that the unseen runs support and another name shares.
    ENTER_UNSURE: f64 = 0.5, "p_unsure", "1", Judgement;
    /// An unseen error below this share of the largest force is within what the sensors of such benches resolve (0.683 N of 450 N).
    ENTER_RESOLVED: f64 = 1.5e-3, "e_res/F_max", "1", Judgement;
    /// The static search's own boundaries of a verdict.
    ENTER_EXPLAINED: f64 = 0.8, "q_expl", "1", Judgement;
    /// A muscle that had been loaded this long before the first run was not rested, s.
    JUDGE_LOADED_LONG: f64 = 1e3, "T_long", "s", Judgement;
    /// The pressure of the picture of force over time, as a share of the highest.
    JUDGE_PICTURED: f64 = 0.75, "P_pic/P_max", "1", Judgement;
    /// Below this the carried part has no sign of its own, kPa.
    LAW_NO_SIGN: f64 = 1.0, "Δp_0", "kPa", Judgement;
    /// Steps of a fit of the law with memory, at most.
    LAW_MOST_STEPS: usize = 10, "n_GN", "1", Judgement;
    /// Below this relaxed share the stress-free pressure is not identifiable.
    LAW_TELLS_BALANCE: f64 = 0.05, "c_b", "1", Judgement;
    /// Step of the numeric derivative in the stress-free pressure, kPa.
    LAW_NUDGE: f64 = 1.0, "h_b", "kPa", Judgement;
    /// Longest step of the stress-free pressure, kPa.
    LAW_BALANCE_STEP: f64 = 30.0, "ΔP_b,max", "kPa", Judgement;
    /// The relaxed share has settled when it changes by less.
    LAW_SETTLED_SHARE: f64 = 5e-4, "δc", "1", Judgement;
    /// Shuffles; the least p is one over this.
    PLACES_SHUFFLES: usize = 499, "n_shuffle", "1", Judgement;
    /// A place is reported when it holds at least this much more of the error than of the points.
    PLACES_CONCENTRATED: f64 = 1.5, "r_place", "1", Judgement;
    /// And when chance gives as much no more often than this.
    PLACES_SURE: f64 = 0.05, "p_place", "1", Judgement;
    /// Slopes below this do not show a shift, as a share of the largest.
    RUN_OFFSET_FLAT: f64 = 0.03, "r_flat,S", "1", Judgement;
    /// Fewest points from which an offset is taken.
    RUN_OFFSET_LEAST: usize = 5, "n_o", "1", Judgement;
    /// Weak prior that keeps a coefficient finite which no row determines.
    SHIFT_FIT_PRIOR: f64 = 1e-8, "λ_θ", "1", Judgement;
    /// Averages over this time where no pulses are found, s: longer than the ring of a pulse.
    STAIRCASE_WITHOUT_PULSES: f64 = 0.5, "t_avg", "s", Judgement;
    /// The pressure has turned when it has gone back by this share of the run's range: above a regulator's ripple.
    STAIRCASE_TURN: f64 = 0.04, "δ_turn", "1", Judgement;
    /// Widths of the contact that are tried in a table.
    TABLE_WIDTHS: ([f64; 3]) = [6e4, 9e4, 1.2e5], "P_c", "Pa", Derived("from the width of the knee at full length to the pressure at which a bladder carries no stress");
    /// Times for which the muscle may have been loaded before a mounting that follows another, half a decade apart: one branch of the memory
    /// is no finer.
    TABLE_LOADED: ([f64; 4]) = [3e1, 1e2, 3e2, 1e3], "T_m", "s", Judgement;
    /// Such a load was not recorded: it is assumed only if it removes this share of the squared error of left-out runs.
    TABLE_LOADED_GAIN: f64 = 0.25, "g_0", "1", Judgement;
    /// Least deadband of a table beside the contact: pretension of a mounted muscle pulls before any pressure.
    TABLE_LEAST_DEADBAND: f64 = -8e4, "P0_min", "Pa", Derived("a table refuses less than −100 kPa");
    /// Most rounds of a table's fit: friction and the wall's drive come from the last round.
    TABLE_ROUNDS: usize = 40, "n_round", "1", Cost;
    /// The rounds end when the layers of the table differ from those it was fitted with by less than this share of the largest force.
    TABLE_SETTLED: f64 = 2e-4, "δ_round", "1", Derived("the remaining difference is below the noise of the readings");
    /// Least number of points at which a mounting is slack, whose median is the reading of the load cell there.
    SLACK_POINTS: usize = 3, "n_slack,m", "1", Derived("a median that one outlier does not decide");
    /// Least number of slack points whose median is the zero of the load cell.
    TABLE_LEAST_SLACK: usize = 20, "n_slack", "1", Derived("a median that one run does not decide");
    /// Nodes of a table of held lengths over the pressures that pull.
    HELD_NODES: usize = 10, "n_node", "1", Derived("a knee of 60 kPa among 600 kPa; the penalties decide, not their number");
    /// The highest pressure that may be commanded has a node where it is this many node distances above those recorded, at most this many above them.
    HELD_LAST_NODE: ((f64, f64)) = (0.3, 2.0), "d_node", "1", Judgement;
    /// Most elastic coefficients of it.
    HELD_ORDER: (usize) = 4, "M", "1", Derived("the base model's order");
    /// Weights of second differences of its curves that are tried, per point.
    HELD_SMOOTHNESS: ([f64; 5]) = [1e-3, 1e-2, 1e-1, 1.0, 10.0], "lambda_2", "1", Derived("chosen by leaving out runs");
    /// Weights of first differences, as shares of those: a wall of one material has moduli that do not depend on pressure.
    HELD_FLATNESS: ([f64; 3]) = [1e-3, 1e-2, 1e-1], "lambda_1", "1", Derived("chosen by leaving out runs");
    /// Groups of runs that are left out in turn.
    HELD_FOLDS: usize = 12, "n_fold", "1", Cost;
    /// Standard deviation of the area's scale: 5 % of the diameter.
    HELD_GAMMA_ERROR: f64 = 0.1, "s_gamma", "1", Derived("as the prior of the diameter in a fit");
    /// Prior mean of the deadband, as a share of the highest pressure.
    HELD_DEADBAND: f64 = 0.1, "P_0/P_max", "1", Judgement;
    /// Prior deviation of the deadband, as a share of the highest pressure.
    HELD_DEADBAND_ERROR: f64 = 1.0, "s_P_0/P_max", "1", Derived("the whole range: it binds nothing");
    /// Standard deviation of the part that each elastic coefficient after the first gives, as a share of that of the one before.
    HELD_NEXT_COEFFICIENT: f64 = 0.2, "r_E", "1", Derived("a wall whose stress is nearly proportional to strain; decides only where lengths are missing");
    /// Residual that weighs the priors, as a share of the largest force.
    HELD_RESIDUAL: f64 = 0.005, "s_r", "1", Derived("what repeats on benches of this kind");
    /// Rounds in which slack readings join the bounds.
    HELD_BOUND_ROUNDS: usize = 6, "n_bound", "1", Cost;
    /// How far a held length may be from the one that was set.
    LENGTH_ERROR: f64 = 1e-3, "delta_L", "m", Derived("a tape measure; the bound of a fit of lengths");
    /// Lengths that such a search tries over this range, to both sides.
    LENGTH_STEPS: usize = 17, "n_L", "1", Cost;
    /// Runs that are predicted from the others by tables: of more, every n-th is left out together.
    TABLE_FOLDS: usize = 12, "n_fold,T", "1", Cost;
    /// Single time constants that the spectrum is tried against.
    MEMORY_SINGLE_TIMES: ([f64; 2]) = [30.0, 300.0], "tau_1", "s", Judgement;
}
