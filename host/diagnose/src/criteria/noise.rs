//! Noise: repeats, memory, instruments.

pam_data::criteria! {
    "Noise":
    /// Contractions that differ by less are one held length.
    SAME_LENGTH: f64 = 1e-3, "d_eps", "1", Judgement;
    /// Load cells and gauges scatter by less than this share of the blocked force.
    INSTRUMENT_NOISE: f64 = 5e-3, "s_inst/F_b", "1", Measured("load cells and gauges, 0.02 to 0.5 % of full scale (catalogue, I3 and P1)");
    /// The noise of an instrument alone is uncorrelated beyond this many readings.
    INSTRUMENT_MEMORY: f64 = 3.0, "t_inst/dt", "1", Judgement;
    /// Bins of contraction in which cycles are compared.
    REPEAT_BINS: f64 = 25.0, "n_eps", "1", Judgement;
    /// Bins per unit of the logarithm of the speed.
    REPEAT_SPEED_BINS: f64 = 1.5, "n_ln v", "1", Judgement;
    /// Bins of pressure in which recordings of a held length are compared.
    REPEAT_PRESSURE_BINS: f64 = 40.0, "n_P", "1", Judgement;
    /// Comparisons of later cycles from which the first cycle is left out.
    LATER_REPEATS: usize = 30, "n_later", "1", Judgement;
    /// Comparisons from which repeats give the noise.
    FEWEST_REPEATS: usize = 20, "n_repeat", "1", Derived("a variance of 20 differences has a relative deviation of 0.32");
    /// Quantile of the squared differences above which they count as outliers.
    REPEAT_OUTLIERS: f64 = 0.95, "q_repeat", "1", Convention("95 %");
    /// The autocorrelation is summed until it falls below this.
    CORRELATION_END: f64 = 0.05, "rho_end", "1", Convention("5 %");
    /// Lags of the autocorrelation grow by this factor.
    LAG_GROWTH: f64 = 1.4, "f_lag", "1", Cost;
    /// The longest lag is one of this many parts of the rows.
    LONGEST_LAG: usize = 3, "N/lag", "1", Convention("a third of the series");
    /// Statistics, and throws of signs, whose products are taken together.
    FAMILY_PART: usize = 64, "n_family", "1", Cost;
}
