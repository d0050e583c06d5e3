//! The next experiment, and what a planned protocol shows.

pam_data::criteria! {
    "Next experiment, protocol simulation":
    /// A difference below this share of the noise is not worth an experiment.
    WORTHWHILE_DIFFERENCE: f64 = 0.3, "dF/s", "1", Judgement;
    /// Noise that is reckoned with at least, in blocked forces.
    EXPECTED_NOISE: f64 = 1e-3, "s/F_b", "1", Judgement;
    /// Traces with this cosine, once the tables are refitted, cannot be distinguished.
    INDISTINGUISHABLE: f64 = 0.9, "cos", "1", Convention("26 degrees; the catalogue's classes are made with it");
    /// Rows at most on which a protocol is judged.
    PROTOCOL_ROWS: usize = 12_000, "N_prot", "1", Cost;
    /// Samples of a simulated protocol, at most.
    PROTOCOL_SAMPLES: usize = 400_000, "N_max", "1", Cost;
    /// Powers of pressure in the tables that a protocol is judged against.
    PLAN_POWERS: (i32) = 3, "n_plan", "1", Judgement;
    /// Grid points of a competitor's only shape.
    COMPETITOR_GRID: usize = 5, "n_1", "1", Cost;
    /// Grid points of each of several shapes of a competitor.
    COMPETITOR_GRID_SEVERAL: usize = 3, "n_2", "1", Cost;
    /// Time of a slow half-stroke over the free stroke.
    SLOW_STROKE: f64 = 27.0, "t_slow", "s", Judgement;
    /// Low and high pressure of the menu, as shares of the range.
    MENU_PRESSURES: ([f64; 2]) = [0.35, 0.9], "P_menu", "1", Judgement;
    /// Largest contraction that is searched for the free stroke, least and most.
    FREE_STROKE: ((f64, f64)) = (0.01, 0.6), "eps_free", "1", Judgement;
}
