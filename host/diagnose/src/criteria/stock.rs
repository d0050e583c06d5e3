//! Muscles of one stock.

pam_data::criteria! {
    "Stock of muscles":
    /// A law between muscles cannot be distinguished from the one that is taken where its error on left-out muscles is at most this many times
    /// as large.
    EXCHANGEABLE: f64 = 1.05, "e/e_0", "1", Derived("exchanging one of four to ten muscles changes the ratio by about as much");
    /// The pull begins where the shared force exceeds this share of the largest force.
    ONSET: f64 = 0.02, "F/F_max", "1", Derived("above the zero of a load cell");
    /// Contractions at which the shared force is described.
    PLACES: usize = 5, "n", "1", Derived("quarters of the recorded range");
    /// The slope of the blocked force over pressure is taken over this share of the range of pressure, below the highest one.
    SLOPE_RANGE: f64 = 0.25, "ΔP/P", "1", Derived("away from the onset, where the curve bends");
    /// Half of a 95 % interval, in standard errors, where the number of independent values is not known.
    NORMAL_95: f64 = 1.96, "z", "1", Derived("97.5 % quantile of the normal distribution");
    /// Intervals of pressure in which the onset of the pull is looked for.
    ONSET_STEPS: u32 = 400, "n", "1", Derived("a quarter of a percent of the range");
}
