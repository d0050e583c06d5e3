//! Preconditions, verdict, findings, the refitted table.

pam_data::criteria! {
    "Preconditions, verdict, findings":
    /// Rows from which anything is judged.
    FEWEST_ROWS: usize = 60, "N_min", "1", Derived("the base has up to thirty coefficients: two rows for each");
    /// Half-strokes from which anything is judged.
    FEWEST_BLOCKS: usize = 6, "n_block,min", "1", Derived("six blocks agree in sign by chance once in 32");
    /// A gauge that never reads more than this is dead, or the muscle was vented throughout.
    DEAD_GAUGE: f64 = 1e3, "P_dead", "Pa", Measured("a muscle pulls from its deadband of some kPa on");
    /// A force that varies by less than this share of the blocked force is constant.
    CONSTANT_FORCE: f64 = 1e-6, "dF/F_b", "1", Derived("about the resolution of a 20-bit converter");
    /// The largest force sets the scale up to this many times pressure times effective area; beyond, it is an outlier.
    FORCE_SCALE: f64 = 1.3, "F_b/(P g)", "1", Judgement;
    /// Friction is judged where the rarer direction has more than one of this many rows.
    ONE_WAY_ROWS: usize = 50, "1/q_way", "1", Judgement;
    /// Lack of fit that the model admits, root mean square in blocked forces: friction by its sign alone, four elastic orders.
    LACK_OF_FIT: f64 = 1.5e-3, "e_fit/F_b", "1", Judgement;
    /// ... and this share of the noise.
    LACK_OF_FIT_NOISE: f64 = 0.6, "e_fit/s", "1", Judgement;
    /// The verdict is explained from this share of the excess error on.
    EXPLAINED: f64 = 0.8, "q_expl", "1", Convention("four fifths");
    /// ... and partly explained from this one on.
    PARTLY_EXPLAINED: f64 = 0.25, "q_part", "1", Convention("a quarter");
    /// ... and only if the effects remove this share of the excess error on held-out rows, too.
    EXPLAINED_UNSEEN: f64 = 0.5, "q_unseen", "1", Convention("half: more remains than is explained below it");
    /// ... and leave no more than this multiple of the noise there.
    EXPLAINED_REST: f64 = 2.0, "s_unseen/s", "1", Convention("twice the noise: the rest is no larger than what noise and model leave elsewhere");
    /// ... and do not raise the error by more than this factor where the rows about each reversal count, too.
    EXPLAINED_TURNS: f64 = 1.05, "s_turns/s_0", "1", Judgement;
    /// p from which a line of the spectrum is real.
    LINE_ALPHA: f64 = 0.02, "p_line", "1", Convention("2 %, the second smallest p of 99 shuffles");
    /// ... that holds this share of the residual's energy.
    LINE_SHARE: f64 = 0.15, "q_line", "1", Judgement;
    /// A line of this share makes a verdict of consistent impossible.
    LINE_UNEXPLAINED: f64 = 0.3, "q_line,max", "1", Judgement;
    /// A region is the place of an error that lasts like noise from this share of its energy on.
    PLACE_SHARE: f64 = 0.25, "q_place", "1", Convention("a quarter");
    /// A fault that a check of the bench measured matters from this peak on, in blocked forces.
    MATERIAL_FAULT: f64 = 2.5e-3, "F_fault/F_b", "1", Measured("data sheets of good instruments allow as much");
    /// Probability of a name that a check of the bench measured.
    CHECKED_PROBABILITY: f64 = 0.99, "p_check", "1", Judgement;
    /// Share of the error below which the effect of checks on it is not resolved.
    CHECK_RESOLUTION: f64 = 1e-3, "q_check", "1", Judgement;
    /// Standard deviations at which an effect would be detected.
    DETECTION: f64 = 3.5, "z_det", "1", Derived("sqrt of the least score, 12");
    /// Independent rows on which a detection is reckoned, at least.
    DETECTION_ROWS: f64 = 4.0, "n_det", "1", Judgement;
    /// Sizes from which an effect would be named are tried in steps of this factor.
    SIZE_STEP: f64 = 1.1, "r_size", "1", Cost;
    /// A hidden effect larger than this share of the blocked force would be noticed by a user who knows the muscle.
    ABSURD_SIZE: f64 = 0.5, "F_absurd/F_b", "1", Judgement;
    /// An effect that could be hidden with more than this share of the blocked force is not excluded.
    RELEVANT_SIZE: f64 = 0.01, "F_rel/F_b", "1", Judgement;
    /// Levels from which the tables' course over pressure is read.
    FEWEST_LEVELS_READ: usize = 4, "n_read", "1", Judgement;
    /// Friction coefficients follow 1/P where this share of their variance does ...
    INVERSE_SHARE: f64 = 0.97, "R2_inv", "1", Judgement;
    /// ... more by this than a straight line ...
    INVERSE_ADVANTAGE: f64 = 0.02, "dR2", "1", Judgement;
    /// ... and the part with 1/P exceeds this share of the constant one at the lowest pressure.
    INVERSE_PART: f64 = 0.5, "b/(a P_1)", "1", Judgement;
    /// The first modulus follows a straight line over pressure where this share of its variance does ...
    STRAIGHT_SHARE: f64 = 0.9, "R2_lin", "1", Judgement;
    /// ... and changes by more than this share of itself.
    STRAIGHT_CHANGE: f64 = 0.3, "dE/E", "1", Judgement;
    /// Other dimensions of the muscle are tried where a fit of them leaves less than this share of the excess error of the described ones.
    DIMENSIONS_LEAVE: f64 = 0.1, "e_dim/e", "1", Judgement;
    /// Effects listed that would make the tables' surface, at most.
    MOST_LISTED: usize = 6, "n_list", "1", Cost;
    /// Rounds of fitting the table to the force without the effects.
    REFIT_ROUNDS: usize = 3, "n_refit", "1", Judgement;
    /// A fault that a check measured may cost the refitted table this factor on the same recordings.
    CHECKED_COST: f64 = 1.1, "e_check/e", "1", Judgement;
    /// An effect that predicts a left-out pressure no worse may cost this factor.
    PREDICTIVE_COST: f64 = 1.1, "e_pred/e", "1", Judgement;
    /// Points of the residual over time that are kept for a picture.
    TRACE_POINTS: usize = 1_500, "n_trace", "1", Cost;
}
