//! An actuator over several campaigns.

pam_data::criteria! {
    "Timeline of campaigns":
    /// Fewer campaigns are not a history.
    FEWEST_CAMPAIGNS: usize = 2, "n_camp", "1", Derived("one comparison");
    /// Fewer known values do not show a change: with three, one scatter between campaigns fits any.
    FEWEST_POINTS: usize = 4, "n_pt", "1", Derived("a level, a change, and two degrees of freedom of scatter");
    /// Bins of pressure of a profile at a held length.
    PRESSURE_BINS: usize = 12, "n_P", "1", Judgement;
    /// Share of the common pressures left out at either end, where the direction at a reversal is uncertain.
    TURN_MARGIN: f64 = 0.02, "m_P", "1", Derived("twice TURN_HOLD");
    /// Share of the reference's largest force at which the actuator counts as pulling.
    THRESHOLD_SHARE: f64 = 0.1, "F/F_max", "1", Convention("ten per cent, as of rise times");
    /// Probability that a series does not change, before any evidence.
    COURSE_PRIOR_NONE: f64 = 0.8, "p_0", "1", Convention("four of five pairs of campaigns, as in the comparison of two");
    /// Observations that the standard errors are worth as a prior of the scatter between campaigns: few, because remounting is not in them.
    COURSE_SCALE_PRIOR: f64 = 1.0, "nu_0", "1", Judgement;
    /// The same for effects against the reference campaign: their intervals hold what repeats between campaigns, remounting included.
    COURSE_EFFECT_PRIOR: f64 = 10.0, "nu_e", "1", Derived("SCALE_PRIOR of the comparison of two campaigns");
    /// Sizes of a change that are equally likely a priori, in units of the scatter.
    COURSE_SIZES: ([f64; 4]) = [1.0, 3.0, 10.0, 30.0], "delta/s", "1", Judgement;
    /// Probability of a change from which on it is named: several series are tested together.
    COURSE_CHANGED: f64 = 0.95, "p", "1", Convention("5 %");
    /// Share of a change's probability that a step must have to be distinguished from a slope.
    AT_ONCE: f64 = 0.9, "p_step", "1", Convention("10 %");
    /// Changes of one series, at most.
    COURSE_MOST_CHANGES: usize = 4, "n_ch", "1", Cost;
    /// Standard errors below this share of the usual one are raised to the usual one.
    SMALLEST_ERROR: f64 = 0.1, "s/s_mean", "1", Judgement;
}
