//! What a controller's sums of its load cell against its table say.

pam_data::criteria! {
    "Health of a table":
    /// Changes are not distinguished below this difference of χ².
    DISTINCT_CHANGES: f64 = 5.99, "Δχ²", "1", Derived("odds of 20 to 1");
    /// A second change explains at least this much χ² beyond the first.
    SECOND_CHANGE: f64 = 25.0, "Δχ²_2", "1", Derived("five standard errors");
    /// The highest correlation of neighbouring blocks that is used; above it blocks are never independent.
    HEALTH_CORRELATION: f64 = 0.99, "ρ_max", "1", Derived("an effective number of blocks of at most a two-hundredth");
}
