//! Forward selection: when an effect is taken, what it must explain, what it cannot be distinguished from.

pam_data::criteria! {
    "Forward selection":
    /// Family-wise error probability that a selected effect may have, by whole blocks.
    FAMILY_ALPHA: f64 = 0.01, "alpha", "1", Convention("one false selection in a hundred campaigns without a missing effect");
    /// Random signs of the blocks behind a family-wise p.
    SIGN_FLIPS: usize = 1999, "n_flip", "1", Derived("p = 0.01 is then known to 0.002");
    /// How much the deviance must fall, beyond what the free numbers cost.
    LEAST_SCORE: f64 = 12.0, "D_min", "1", Derived("chance in 400 candidate fits gives 2 ln 400 = 12 once in e");
    /// The same where no test by whole blocks supports it.
    LEAST_SCORE_ALONE: f64 = 25.0, "D_alone", "1", Derived("2 ln 400 and nearly three times 2 ln 10 = 4.6: once in about seven hundred");
    /// Error below this share of the blocked force is the base model's own, and nothing is selected for it.
    SELECTION_FLOOR: f64 = 4e-4, "e_sel/F_b", "1", Trials("four elastic orders leave 0.03 to 0.06 %, friction by its sign alone about as much");
    /// The same where a test by blocks, or a vented muscle, supports a high and narrow trace.
    NARROW_FLOOR: f64 = 0.4, "e_narrow/e_sel", "1", Judgement;
    /// The same where neither supports it.
    ALONE_FLOOR: f64 = 2.0, "e_alone/e_sel", "1", Judgement;
    /// A trace as high as this share of the blocked force counts although few rows have it.
    NARROW_PEAK: f64 = 0.01, "F_narrow/F_b", "1", Judgement;
    /// ... where its score exceeds that of an effect without support by this factor.
    NARROW_SCORE: f64 = 2.0, "D_narrow/D_alone", "1", Judgement;
    /// A static effect is selected from this peak on, in blocked forces.
    STATIC_PEAK: f64 = 0.015, "F_static/F_b", "1", Derived("an error of a tenth of a degree of the braid angle makes the same surface");
    /// ... and where it moves the fit by this, root mean square in blocked forces.
    STATIC_MOVED: f64 = 1e-3, "e_static/F_b", "1", Judgement;
    /// Below this share of its energy outside the flexible tables an effect is concealed by them.
    CONCEALED: f64 = 0.04, "q_conceal", "1", Derived("a root mean square of a fifth");
    /// Below this share the tables are the very same surface.
    TWIN_OF_TABLES: f64 = 2e-4, "q_twin", "1", Judgement;
    /// A trace larger than this share of the blocked force, nearly all of it cancelled by the tables, explains nothing.
    LARGEST_PEAK: f64 = 0.25, "F_cancel/F_b", "1", Judgement;
    /// An effect must explain this share of the excess error that it finds.
    LEAST_SHARE: f64 = 0.4, "q_first", "1", Judgement;
    /// Where nothing is named, effects are listed that would remove this share of the squared error.
    UNCONFIRMED_SHARE: f64 = 0.5, "q_open", "1", Convention("half");
    /// A further effect must also explain this share of all excess error: more than the first law leaves by its inexactness.
    FURTHER_SHARE: f64 = 0.03, "q_further", "1", Derived("17 % of the error; laws are off by 3 to 7 % of their traces");
    /// Effects with which pairs are tried where no effect explains enough alone.
    FIRSTS_OF_PAIRS: usize = 3, "n_pair", "1", Cost;
    /// Effects that are selected at most.
    MOST_SELECTED: usize = 5, "n_max", "1", Judgement;
    /// An effect is not selected where one that is concealed scores this many times as much.
    SHADOW: f64 = 2.0, "D_hidden/D", "1", Judgement;
    /// Independent rows of any campaign, at least.
    FEWEST_INDEPENDENT: f64 = 8.0, "n_min", "1", Judgement;
    /// Spans of time with a free zero, in each memory of the residual.
    ZEROS_PER_MEMORY: f64 = 2.0, "n_zero", "1", Derived("within half of its correlation time a drift is nearly constant");
    /// Free zeros of a whole campaign at most.
    MOST_ZEROS: usize = 64, "n_zeros", "1", Cost;
    /// Candidates that may fail in the joint fit before the selection ends.
    MOST_EXCLUDED: usize = 4, "n_barred", "1", Cost;
    /// Selections that may fail on held-out rows before none is made.
    MOST_REFUSED: usize = 3, "n_refused", "1", Cost;
    /// Evidence comes from the first strokes where they hold more than this share of it.
    FIRST_STROKES: f64 = 0.7, "q_strokes", "1", Judgement;
    /// Candidates whose shapes are refined at every step.
    REFINED: usize = 12, "n_refine", "1", Cost;
    /// Rounds in which a law that replaces a part of the base is refined about the base beside it.
    RENEWALS: usize = 2, "n_renew", "1", Cost;
    /// A linearisation that leaves more than this times the error of the one before is rejected.
    WORSE: f64 = 1.25, "S_new/S_old", "1", Judgement;
    /// The joint fit must keep this share of the gain that the single fit promised.
    KEPT_GAIN: f64 = 0.6, "q_kept", "1", Judgement;
    /// An exchanged effect must leave less than this share of what the present one leaves.
    EXCHANGE_LEAVES: f64 = 0.8, "q_exchange", "1", Judgement;
    /// Excess error is at least this share of the error, so that shares of it stay finite.
    LEAST_EXCESS: f64 = 0.02, "q_excess", "1", Judgement;
    /// A competitor of this weight keeps the effect from being selected itself; an exchanged effect counts with it. An effect of less weight
    /// among all of its competitors is not selected.
    CONFUSABLE: f64 = 0.1, "w_conf", "1", Trials("sets of names made with it held the truth, with 3.3 members on average");
    /// A competitor of this weight is reported beside the selected effect.
    REPORTED_COMPETITOR: f64 = 0.15, "w_rep", "1", Trials("of 62 larger effects of a sealed set 59 sets held the truth, with 1.6 members (docs/src/proof.md)");
    /// Competitors reported at most.
    MOST_REPORTED: usize = 8, "n_rep", "1", Cost;
    /// A competitor of this weight explains what the selected effect explains.
    ALIKE: f64 = 0.5, "w_alike", "1", Judgement;
    /// An effect moves the force by at least this share of what the steps of a coarse displacement are worth: smoothing removes about half.
    RESOLUTION_FLOOR: f64 = 0.5, "q_res", "1", Judgement;
    /// Competitors of less weight than this are dropped unless their traces are parallel.
    NEGLIGIBLE_COMPETITOR: f64 = 0.01, "w_min", "1", Judgement;
    /// With more competitors than this no effect is selected.
    MOST_COMPETITORS: usize = 10, "n_comp", "1", Judgement;
    /// A trace with this cosine to the selected one, once the base is refitted, is kept as a competitor at any weight.
    PARALLEL: f64 = 0.95, "cos", "1", Convention("18 degrees");
    /// How inexact a right law is, as a share of the excess error it explains, when competitors are compared.
    COMPETITOR_FLOOR: f64 = 0.05, "e_comp", "1", Judgement;
    /// How fast the weight of a competitor falls with the logarithm of its residual beyond that.
    COMPETITOR_SHARPNESS: f64 = 7.0, "kappa", "1", Judgement;
    /// What each further free number costs in the logarithm of the weight.
    COMPETITOR_COST: f64 = 0.3, "c_number", "1", Judgement;
}
