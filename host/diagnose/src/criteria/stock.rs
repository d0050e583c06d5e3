//! Muscles of one stock.

pam_data::criteria! {
    "Stock of muscles":
    /// A law between muscles cannot be distinguished from the one that is taken where its error on left-out muscles is at most this many times
    /// as large.
    EXCHANGEABLE: f64 = 1.05, "e/e_0", "1", Derived("exchanging one of four to ten muscles changes the ratio by about as much");
    /// The pull begins where the shared force exceeds this share of the largest force.
    ONSET: f64 = 0.02, "F/F_max", "1", Derived("above the zero of a load cell");
    /// Contractions at which the shared force is described.
    PLACES: usize = 5, "n_place", "1", Derived("quarters of the recorded range");
    /// The slope of the blocked force over pressure is taken over this share of the range of pressure, below the highest one.
    SLOPE_RANGE: f64 = 0.25, "ΔP/P", "1", Derived("away from the onset, where the curve bends");
    /// With fewer left-out mountings, nothing is concluded about their lengths.
    FEWEST_MOUNTINGS: usize = 8, "n_m", "1", Derived("with seven degrees of freedom the quantile of Student's t exceeds the normal one by a fifth");
    /// A length of its own for each left-out mounting must remove this share of their squared error.
    LENGTH_GAIN: f64 = 0.5, "g_d", "1", Derived("more than all other causes together");
    /// Probability of such a gain by chance over the mountings.
    LENGTH_ALPHA: f64 = 0.01, "α_d", "1", Convention("one in a hundred stocks");
    /// Lengths that follow the contraction to this share of their squares are a property of the muscle, not of its mountings.
    LENGTH_TREND: f64 = 0.5, "s_d", "1", Derived("more than half");
    /// The zero of a pressure sensor may differ between mountings by this share of the highest pressure.
    GAUGE_ZERO: f64 = 0.025, "p_0/P_max", "1", Measured("accuracy of an integrated pressure sensor over temperature, MPX5700 data sheet");
    /// Intervals of pressure in which the onset of the pull is looked for.
    ONSET_STEPS: u32 = 400, "n_P", "1", Derived("a quarter of a percent of the range");
}
