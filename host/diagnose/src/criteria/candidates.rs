//! The fit of one candidate effect beside a base.

pam_data::criteria! {
    "Candidate fit":
    /// Change points of a trace that are tried first, over the campaign.
    CHANGE_POINTS: usize = 40, "n_t", "1", Cost;
    /// Grid points along each shape parameter, by the number of shape parameters (none or one, two, three, more).
    SHAPE_GRID: ([usize; 4]) = [9, 5, 4, 3], "n_shape", "1", Cost;
    /// A parameter's range is divided by its logarithm where its ends differ by more than this factor.
    LOGARITHMIC_RANGE: f64 = 4.0, "high/low", "1", Judgement;
    /// A shape within this first part of its range is at the low end, where a law becomes a simpler one.
    LOW_END: f64 = 1e-3, "u_low", "1", Judgement;
    /// A step of refining may leave a shape's range by this part before it is clamped.
    RANGE_OVERSHOOT: f64 = 0.02, "du", "1", Judgement;
    /// Halvings of the step while a shape is refined.
    REFINEMENT_HALVINGS: usize = 5, "n_halve", "1", Cost;
    /// Steps of refining at each step size.
    REFINEMENT_STEPS: usize = 2, "n_step", "1", Cost;
    /// The first step is at least this part of the range.
    REFINEMENT_STEP: f64 = 0.05, "du_1", "1", Judgement;
    /// A step is taken where the score rises by more than this.
    REFINEMENT_GAIN: f64 = 1e-3, "dD_min", "1", Derived("far below any difference of score that decides");
    /// How inexact a law is, as a share of its trace: first order in sensitivities, shapes from another muscle.
    LAW_ERROR: f64 = 0.03, "e_law", "1", Judgement;
    /// An error of a law repeats itself: it counts as no more independent rows than this.
    SYSTEMATIC_ROWS: f64 = 100.0, "n_sys", "1", Judgement;
    /// An amplitude may exceed its known range by this factor; beyond, another cause has its name.
    AMPLITUDE_BEYOND: f64 = 10.0, "a/a_max", "1", Judgement;
    /// The typical amplitude is the geometric mean of its range, whose low end counts as at least this share of the high one.
    TYPICAL_LEAST: f64 = 1e-3, "a_least/a_max", "1", Judgement;
    /// Amplitudes of one law that are fitted together, at most.
    MOST_AMPLITUDES: u32 = 6, "n_a", "1", Cost;
    /// The share of a column's energy outside the base from which it is judged at all.
    INVISIBLE: f64 = 1e-5, "q_vis", "1", Derived("below it the trace's root mean square outside the base is 0.3 % of its own, a tenth of a law's error");
    /// Pure error of a row, in blocked forces, at least.
    LEAST_SIGMA: f64 = 1e-6, "s_min/F_b", "1", Derived("about the resolution of a 20-bit converter");
}
