//! What a controller's sums of its load cell against its table say.

pam_data::criteria! {
    "Health of a table":
    /// Changes are not distinguished below this difference of χ².
    DISTINCT_CHANGES: f64 = 5.99, "Δχ²", "1", Derived("odds of 20 to 1");
    /// A second change explains at least this much χ² beyond the first.
    SECOND_CHANGE: f64 = 25.0, "Δχ²_2", "1", Derived("five standard errors");
    /// The highest correlation of neighbouring blocks that is used; above it blocks are never independent.
    HEALTH_CORRELATION: f64 = 0.99, "ρ_max", "1", Derived("an effective number of blocks of at most a two-hundredth");
    /// A change whose trace is smaller than this in root mean square was not shown.
    HEALTH_SHOWN: f64 = 1e-6, "f_rms,min", "N", Derived("single precision of the sums");
    /// Changes are fitted together where the least eigenvalue of their normalised traces exceeds this.
    HEALTH_DISTINCT: f64 = 1e-5, "λ_min", "1", Derived("the sums have single precision, 6e-8, and some hundred terms of it");
    /// Serial correlation is known where neighbouring blocks make up this share of all.
    HEALTH_PAIRS: f64 = 0.25, "n_pair/n", "1", Judgement;
}
