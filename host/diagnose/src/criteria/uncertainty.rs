//! Held-out rows, intervals of parameters, change points, calibration of probabilities.

pam_data::criteria! {
    "Held-out rows, intervals, probabilities":
    /// Held-out error with an effect must be less than this share of the error without it.
    HELD_OUT_LEAVES: f64 = 0.96, "e_with/e_without", "1", Derived("an effect that takes a third of the excess lowers the whole by more");
    /// ... and less by more than this many standard errors of the difference, over whole groups that are left out (over held lengths, where the length is held). A test by whole blocks that supports the effect is sufficient too.
    HELD_OUT_ERRORS: f64 = 1.0, "n_held", "1", Published("the one-standard-error rule: L. Breiman, J. H. Friedman, R. A. Olshen, C. J. Stone, Classification and Regression Trees, 1984");
    /// Groups from which a difference has a standard error.
    FEWEST_UNITS: usize = 3, "n_unit,min", "1", Derived("two degrees of freedom");
    /// An effect is named where its size differs from zero by more than this many of its standard deviations, by the scatter of whole half-strokes; where the length was held also with a pressure, a recording or a quarter of the time left out.
    SIZE_ERRORS: f64 = 1.96, "n_size", "1", Convention("its 95 % interval excludes zero");
    /// A value that cannot be is refused where it lies outside the possible range by more than this many standard deviations.
    RANGE_ERRORS: f64 = 1.96, "n_range", "1", Convention("its 95 % interval excludes the possible range");
    /// Rows at most from which the held-out error is taken.
    HELD_OUT_ROWS: usize = 6_000, "N_held", "1", Cost;
    /// No pressure is predicted from the others where the bladder differs between them by more than this share of the largest force.
    ONE_BLADDER: f64 = 5e-3, "V_one/F_max", "1", Judgement;
    /// A trace of which one group holds more than this share cannot be learnt from the others.
    SEEN_ONCE: f64 = 0.8, "q_once", "1", Judgement;
    /// Parts of the stroke that are left out by fours.
    STROKE_PARTS: f64 = 24.0, "n_part", "1", Judgement;
    /// Groups that are left out in turn.
    FOLDS: u32 = 4, "n_fold", "1", Convention("four-fold cross-validation");
    /// Recordings of a held length are left out by this many.
    RECORDING_FOLDS: u32 = 10, "n_rec", "1", Convention("ten-fold cross-validation");
    /// Recordings of held length from which they are left out by recordings.
    FEWEST_RECORDINGS: usize = 4, "n_rec,min", "1", Judgement;
    /// Recordings at one pressure are left out one by one where they are this few and this many.
    RECORDINGS_HELD_OUT: ((usize, usize)) = (2, 10), "n_rec,lim", "1", Derived("one is left to learn from; more than ten are many refits");
    /// Pressure levels from which a pressure can be left out.
    FEWEST_LEVELS_HELD_OUT: usize = 3, "n_P,min", "1", Derived("two others span a range to interpolate in");
    /// Held lengths from which a length can be left out; it is predicted where others lie on both sides.
    FEWEST_LENGTHS_HELD_OUT: usize = 3, "n_L,min", "1", Derived("two others span a range to interpolate in");
    /// Half-strokes from which cycles are left out.
    FEWEST_STROKES_HELD_OUT: usize = 16, "n_stroke,min", "1", Derived("four cycles, left out in turn");
    /// How far a parameter is off by its law's inexactness, as a share of it.
    LAW_DEVIATION: f64 = 0.07, "e_par", "1", Trials("of 57 given effects 53 intervals of 95 % held the truth with it");
    /// A parameter whose change moves the force by less than this share beyond the others is not identifiable.
    IDENTIFIABLE: f64 = 1e-3, "q_id", "1", Judgement;
    /// Relative change of a shape by which its tangent is taken.
    TANGENT_STEP: f64 = 0.02, "h", "1", Judgement;
    /// Groups of a jackknife, least.
    FEWEST_GROUPS: usize = 3, "n_jack,min", "1", Judgement;
    /// Twice the log-likelihood ratio that the true change point exceeds once in twenty.
    CHANGE_POINT_RATIO: f64 = 7.35, "LR", "1", Published("-2 ln(1 - sqrt 0.95): B. E. Hansen, Econometrica 68 (2000) 575-603, doi 10.1111/1468-0262.00124");
    /// Change points over the campaign that are tried for a second maximum of the likelihood.
    CHANGE_POINT_SCAN: usize = 250, "n_scan", "1", Cost;
    /// Calibration of a model weight w: p = w^B q, logit q = A + C logit(explained).
    CALIBRATION: ([f64; 3]) = [2.33, 0.62, 0.37], "A, B, C", "1", Trials("690 names of a development and two opened sets: on trials left out, log score 0.341 (0.359 without) and calibration error 0.026 (0.070). Learned on the development set alone, calibration errors of 0.054 and 0.049 on the opened ones. cargo run --release -p pam-diagnose --example calibrate_diagnosis -- SET...");
    /// Model weights and shares are kept this far from certainty.
    CERTAINTY: f64 = 0.01, "p_edge", "1", Judgement;
}
