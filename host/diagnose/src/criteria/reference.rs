//! The comparison of recordings with a reference of the same actuator.
//!
//! "Development half" are the recordings of six 10 mm fluidic muscles (three of 2021, three of 2022) on which constants were chosen; what
//! is claimed is measured on the other five. "By principle" means that no data chose it.

use crate::reference::repeatability::Repeats;
use crate::reference::stroked::StrokeRepeats;

pam_data::criteria! {
    "Comparison with a reference":
    /// Pressure bins of a point: finer than any curve needs, coarser than rows.
    POINT_BINS: (usize) = 64, "n_pt", "1", Judgement;
    /// Intervals of the reference spline over the pressure range.
    SPLINE_INTERVALS: (usize) = 14, "n_int", "1", Judgement;
    /// Factor of the penalty on the gap between the directions: it is smoother than the curve.
    GAP_PENALTY: f64 = 10.0, "λ_gap/λ", "1", Judgement;
    /// Ridge on the gap, which decides where one direction has no data.
    GAP_RIDGE: f64 = 1e-3, "ρ_gap", "1", Judgement;
    /// (Noise of a point / size of a run effect)²: run effects are about five times the noise of a point.
    RUN_RIDGE: f64 = 0.04, "ρ_run", "1", Judgement;
    /// Price of a degree of freedom in the generalised cross-validation, above 1 against undersmoothing (Kim and Gu 2004).
    GCV_PRICE: f64 = 1.4, "γ", "1", Published("Kim and Gu 2004");
    /// Pressures of the tabulated surface.
    GRID: usize = 101, "n_grid", "1", Cost;
    /// AFTER may reach this share of the range beyond BEFORE's pressures; the rest is not comparable.
    BEYOND: f64 = 0.05, "δ_P", "1", Judgement;
    /// A steep slope over the pressure is this quantile of all slopes of the reference.
    USUAL_SLOPE_QUANTILE: f64 = 0.95, "q_S", "1", Judgement;
    /// The usual slope is the median of those above this share of the steep one: where the actuator pulls.
    USUAL_SLOPE_SHARE: f64 = 0.3, "S_pull/S_q", "1", Judgement;
    /// An end slope of a monotone cubic is at most this many times the secant beside it.
    MONOTONE_END: f64 = 3.0, "r_end", "1", Published("F. N. Fritsch, R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238-246, doi 10.1137/0717021");
    /// Residual cells per direction.
    CELLS: (usize) = 6, "n_cell", "1", Judgement;
    /// Strokes nearer than this are one mounting (tape measure).
    SAME_STROKE: f64 = 1e-3, "δ_x", "m", Convention("tape measure, 1 mm");
    /// Lengths of the reference from which on the force between two of them is interpolated: fewer do not show an error.
    INTERPOLATE_FROM: usize = 3, "n_L", "1", Judgement;
    /// Fewer common cells and a mounting is not comparable.
    FEWEST_CELLS: usize = 4, "n_cell,min", "1", Judgement;
    /// More cells are joined in pairs of runs, so that the covariance stays quick.
    MOST_CELLS: usize = 840, "n_cell,max", "1", Cost;
    /// Unknown pauses between runs.
    PAUSE: f64 = 12.0, "t_p", "s", Judgement;
    /// Where the logarithmic clocks of creep begin.
    CREEP_START: f64 = 1.0, "t_0", "s", Judgement;
    /// A longer pause on a shared clock, and the actuator counts as remounted.
    NEW_VISIT: f64 = 3600.0, "t_visit", "s", Judgement;
    /// First-order lags and delays that are tried on the rows of a run.
    LAGS: ([f64; 16]) = [0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.17, 0.23, 0.3, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0], "τ_k", "s", Judgement;
    /// How many of them are tried first beside recordings: the others where the longest of these is the best.
    LAGS_FIRST: usize = 13, "n_τ", "1", Cost;
    /// A row further than this many median intervals from the one before does not show lags.
    LAG_GAP: f64 = 3.0, "n_gap", "1", Judgement;
    /// The highest correlation of neighbouring residuals that is used for the variance of a lag.
    LAG_CORRELATION: f64 = 0.99, "ρ_τ", "1", Derived("an effective number of rows of at least a two-hundredth");
    /// A run weighs in the lag score by what a lag of this size would change in its force.
    LAG_WEIGHED_BY: f64 = 0.05, "τ_w", "s", Judgement;
    /// Multiple of the longest lag tried first. Beside a change of friction, rows within that time after a reversal do not show lags:
    /// e⁻³ of a jump is left.
    LAG_AFTER_TURN: f64 = 3.0, "t_turn/τ", "1", Derived("e^-3 = 5 %");
    /// Residuals of the lag score are clipped at this share of the largest force.
    LAG_CLIP: f64 = 0.1, "e_clip/F_max", "1", Judgement;
    /// Spread of the lag score between runs that is always allowed: what valve timing does.
    LAG_FLOOR: f64 = 0.010, "s_τ", "s", Judgement;
    /// Runs that `LAG_FLOOR` is worth.
    LAG_RUNS: f64 = 4.0, "ν_τ", "1", Judgement;
    /// Lags of runs further than this many robust deviations from their mounting's are clipped there: they are few, and outliers among them widen the spread.
    LAG_SPREADS: f64 = 3.0, "c_τ", "1", Convention("three standard deviations");
    /// The sizes of lags that are equally likely a priori.
    LAG_SIZES: ([f64; 5]) = [0.02, 0.05, 0.1, 0.2, 0.4], "Δτ", "s", Judgement;
    /// The size of a lag is known from the rows in motion; the settled cells may put it right by this share of it.
    LAG_CORRECTED: f64 = 0.3, "r_τ", "1", Judgement;
    /// Settled cells that contradict a lag change its log evidence by no less than this: its trace in them is uncertain.
    LAG_CONTRADICTED: f64 = -5.0, "ln B_τ,min", "1", Derived("odds of 150 to 1 against the lag");
    /// Loss of closed valves: time since the last fast move of the pressure from which on its slope counts.
    LOSS_AFTER: f64 = 0.1, "t_loss", "s", Judgement;
    /// The shortest rest whose slope counts.
    LOSS_SHORTEST: f64 = 0.1, "t_loss,min", "s", Judgement;
    /// Rows of such a rest, at least.
    LOSS_ROWS: usize = 3, "n_loss", "1", Derived("a line and one degree of freedom");
    /// Rests at pressures below this share of the largest lose too little to count.
    LOSS_PRESSURE: f64 = 0.1, "P_loss/P_max", "1", Judgement;
    /// Two rests are similar where their pressures differ by no more than this share of the range ...
    LOSS_ALIKE_PRESSURE: f64 = 0.05, "dP_alike/ΔP", "1", Judgement;
    /// ... and the steps before them by no more than this share: pulses of another length differ by more.
    LOSS_ALIKE_STEP: f64 = 0.2, "dS/S", "1", Measured("pulses of 10 and 5 ms, 30 to 60 ms");
    /// Share of a run's rests that have a similar one in BEFORE; with fewer the valves were set otherwise, and nothing is concluded.
    LOSS_ALIKE_SHARE: f64 = 0.8, "q_alike", "1", Convention("as UPDATE_COVERED");
    /// Similar rests on both sides that a run must have.
    LOSS_RESTS: usize = 6, "n_rest", "1", Judgement;
    /// How often the weights of the rests are taken again.
    LOSS_REWEIGHTED: usize = 5, "n_w", "1", Cost;
    /// Slopes further than this many robust deviations from the line count less.
    LOSS_CLIP: f64 = 2.0, "c_κ", "1", Convention("Huber, two standard deviations");
    /// Spread of the rate between campaigns that is always allowed: 12 kPa in two minutes at 500 kPa.
    LOSS_FLOOR: f64 = 2e-4, "s_κ", "1/s", Judgement;
    /// Prior spread between runs ...
    LOSS_SPREAD: f64 = 2e-3, "s_κ,run", "1/s", Measured("development half, 0.001 to 0.003");
    /// ... and the runs that it is worth.
    LOSS_RUNS: f64 = 4.0, "ν_κ", "1", Judgement;
    /// The sizes of a change of the rate that are equally likely a priori: half a minute to half an hour until a third is left.
    LOSS_SIZES: ([f64; 4]) = [5e-4, 2e-3, 8e-3, 3.2e-2], "Δκ", "1/s", Measured("leak-downs of fluidic muscles, 3e-4 to 1.5e-2");
    /// Variance of a median over that of a mean.
    MEDIAN_VARIANCE: f64 = 1.57, "v_med", "1", Derived("pi/2");
    /// Own error of a cell where the actuator is slack, as a share of that where it pulls.
    CELL_SLACK: f64 = 0.2, "a_0", "1", Judgement;
    /// The mean of this many rows has twice the variance of a cell of many rows.
    CELL_ROWS: f64 = 2.0, "n_a", "1", Judgement;
    /// The values for fluidic muscles; for another actuator they are a prior, and the common scale adapts.
    REPEATS: (Repeats) = Repeats {
        creep: 0.386,
        creep_common: 0.273,
        within: 2.073,
        within_common: 1.976,
        run: 0.202,
        run_common: 0.159,
        group: 0.224,
        group_common: 0.069,
        offset: 0.10,
        cell: 0.10,
        length: 0.277,
        directions: 0.566,
    }, "σ_rep", "1", Measured("restricted maximum likelihood on untouched runs of the development half, rounded; floors as stated");
    /// A remounting by tape measure.
    REMOUNT: f64 = 1e-3, "σ_x", "m", Convention("tape measure, 1 mm");
    /// Observations that the prior scale is worth.
    SCALE_PRIOR: f64 = 10.0, "ν_0", "1", Judgement;
    /// Independent directions that a run can determine.
    DIRECTIONS_PER_RUN: f64 = 4.0, "ν_run", "1", Judgement;
    /// Never believe that this actuator repeats more than √2 better than its class.
    LEAST_SCALE: f64 = 0.5, "s²_min", "1", Judgement;
    /// Sizes of a change that are equally likely a priori, share of the largest force rms: heavy-tailed and scale-free over what is of interest; below 1 % a change has no practical effect.
    SIZES: ([f64; 4]) = [0.01, 0.02, 0.04, 0.08], "s/F_max", "1", Judgement;
    /// Prior probability that nothing changed: four of five pairs of campaigns.
    PRIOR_NONE: f64 = 0.80, "p_none", "1", Judgement;
    /// Prior probability of a change without a name.
    PRIOR_UNKNOWN: f64 = 0.05, "p_unk", "1", Judgement;
    /// Least and largest prior probability of no change that a user can state.
    PRIOR_LIMITS: ((f64, f64)) = (0.01, 0.99), "p_none,lim", "1", Convention("no statement of a user makes a change impossible or certain");
    /// Bayes factor that must be left when any one mounting is set aside: "strong evidence" (Kass and Raftery 1995).
    GATE: f64 = 20.0, "B_gate", "1", Published("Kass and Raftery 1995");
    /// Mountings from which on the gate can ask.
    GATE_MOUNTINGS: usize = 3, "n_gate", "1", Judgement;
    /// A probability from which on something is named.
    NAMED: f64 = 0.5, "p_named", "1", Convention("more probable than not");
    /// A probability from which on a cause counts as possible.
    POSSIBLE: f64 = 0.05, "p_poss", "1", Convention("1 - 95 %");
    /// The set of names holds so much probability.
    SET: f64 = 0.95, "p_set", "1", Convention("95 %");
    /// A change is detectable from the size on that is named with the power of this normal quantile.
    DETECTABLE_POWER: f64 = 1.28, "z_β", "1", Convention("normal quantile of a power of 90 %");
    /// Log evidence by which a name must lead beyond its prior odds to be called detectable.
    DETECTABLE_LEAD: f64 = 3.0, "ln B_det", "1", Convention("e^3 = 20, strong evidence as for GATE");
    /// Error of the slopes ∂F/∂P and ∂F/∂x, share of the size: by principle, they are estimated from the same recordings.
    SLOPE_ERROR: f64 = 0.05, "ε_S", "1", Judgement;
    /// Error of the whole shape of a change that is named already, share of its size: what it leaves is not evidence of another one.
    NAMED_SHAPE_ERROR: f64 = 0.1, "ε_named", "1", Judgement;
    /// The same for a step within AFTER beside a table, by the slope that AFTER shows, which the step itself has altered.
    OWN_SLOPE_ERROR: f64 = 0.15, "ε_own", "1", Judgement;
    /// How often that slope is taken again with the step out of it.
    OWN_SLOPE_ROUNDS: usize = 3, "n_own", "1", Cost;
    /// The same where the slopes are a table's.
    TABLE_SLOPE_ERROR: f64 = 0.2, "ε_T", "1", Measured("development half, sizes of changes put in");
    /// Widens intervals beside a table: its error is larger in some muscles than its four sizes allow.
    TABLE_INTERVAL: f64 = 1.4, "f_T", "1", Measured("development half, 34 of 43 sizes within without it");
    /// The same over the length, along which a table was fitted at three to five lengths.
    TABLE_SLOPE_OVER_LENGTH: f64 = 0.5, "ε_T,x", "1", Measured("development half, sizes of changes put in");
    /// Prior probability that a change was there from the beginning of AFTER: four of five, as for no change at all. A step and a ramp
    /// within AFTER share the rest.
    COURSE_WHOLE: f64 = 0.8, "p_whole", "1", Judgement;
    /// A change that began outside this part of AFTER has too little on one side to determine its course.
    COURSE_PART: ((f64, f64)) = (0.03, 0.97), "u_start", "1", Judgement;
    /// Log evidence by which one profile over time must lead the other to be reported: e³ = 20.
    COURSE_LEAD: f64 = 3.0, "ln B_course", "1", Convention("e^3 = 20");
    /// The stretch of likely starts of a change holds this probability.
    COURSE_INTERVAL: f64 = 0.95, "p_start", "1", Convention("95 %");
    /// Pairs of changes that are tested in full where one name leaves something, the likeliest first.
    PAIRS_TRIED: usize = 3, "n_pairs", "1", Cost;
    /// Names in one answer, at most.
    MOST_CHANGES: usize = 3, "n_max", "1", Cost;
    /// Residual rms as a share of the largest force from which on another actuator is suspected.
    OTHER_ACTUATOR: f64 = 0.25, "e_other/F_max", "1", Judgement;
    /// Force ratios within this range do not raise the suspicion.
    FORCE_RATIO: ((f64, f64)) = (0.7, 1.4), "r_F", "1", Judgement;
    /// Force ratios are judged where the largest pressures of both sides differ by less than this share.
    SAME_PRESSURES: f64 = 0.1, "dP_max/P_max", "1", Judgement;
    /// Factors between units that are often confused, with their names.
    UNIT_FACTORS: ([(f64, &str); 8]) = [
        (1e3, "a thousand (such as N and kN, Pa and kPa)"),
        (1e6, "a million (such as Pa and MPa)"),
        (1e2, "a hundred (such as kPa and bar)"),
        (1e5, "a hundred thousand (such as Pa and bar)"),
        (4.448_222, "4.448 (N and lbf)"),
        (9.806_65, "9.807 (N and kgf)"),
        (6.894_757, "6.895 (kPa and psi)"),
        (14.503_8, "14.50 (bar and psi)"),
    ], "f_unit", "1", Derived("definitions of the units");
    /// How near a ratio must be to a factor between units to be taken for one.
    UNIT_NEAR: f64 = 0.05, "δ_unit", "1", Judgement;
    /// A column smaller than what a table gives by this factor is in another unit, where the factor is one between units.
    UNIT_FAR: f64 = 50.0, "r_unit", "1", Judgement;
    /// Two recordings that share this part of the smaller one's rows in motion overlap: rows in motion agree by chance in far fewer.
    SHARED_ROWS: f64 = 0.1, "q_shared", "1", Judgement;
    /// Recordings that reach over this share of the pressures and of the contractions that a table was tested at are a campaign: the table is
    /// fitted again to them.
    UPDATE_COVERED: f64 = 0.8, "q_cover", "1", Judgement;
    /// Pressures, or lengths, of such a campaign.
    UPDATE_LEVELS: usize = 3, "n_upd", "1", Derived("a curve over the pressure");
    /// Laws of one effect that are tried for one size, at most.
    UPDATE_LAWS: usize = 2, "n_law", "1", Cost;
    /// Rest lengths that differ by more than this share are of two actuators: a tape measure errs by less.
    OTHER_LENGTH: f64 = 0.02, "dL_0/L_0", "1", Judgement;
    /// A recording shows a change where its rms is more than this share of that in the recording that shows it most.
    SHOWS: f64 = 0.1, "q_show", "1", Judgement;
    /// Share of the difference's energy on held-out recordings that names must remove; below it they describe something else.
    UNSEEN_LEAST: f64 = 0.1, "q_unseen", "1", Convention("as FURTHER_SHARE of the forward selection");
    /// The same from which on the names explain the difference; below it they explain a part.
    UNSEEN_EXPLAINED: f64 = 0.5, "q_expl", "1", Convention("the larger part");
    /// The residual of the names, or a difference that remounting explains, stands out above this many times what untouched recordings differ by.
    STANDS_OUT: f64 = 2.0, "e/s_rep", "1", Convention("two standard deviations");
    /// With a difference that suspects another actuator, names that leave more than this share of the largest force are withdrawn.
    LEFT_BY_NAMES: f64 = 0.1, "e_left/F_max", "1", Judgement;
    /// Strokes: bins over the middle of the stroke.
    STROKE_BINS: (usize) = 6, "n_x", "1", Judgement;
    /// Share of the stroke left out at either end.
    STROKE_ENDS: f64 = 0.15, "q_end", "1", Judgement;
    /// Rows slower than this share of the 70th percentile of speed are left out: turns and holds.
    STROKE_SPEED: f64 = 0.3, "v/v_q", "1", Judgement;
    /// ... the quantile of the speed that this share is taken of: most rows move.
    STROKE_SPEED_QUANTILE: f64 = 0.7, "q_v", "1", Judgement;
    /// Neighbouring mean pressures that differ by less than this share of the largest are one level.
    LEVEL: f64 = 0.04, "dP_level/P_max", "1", Judgement;
    /// A recording whose stroke stays within this is held.
    HELD: f64 = 1e-3, "x_held", "m", Judgement;
    /// Rows of a hold that counts as a recording at a held length.
    STAGES_FEWEST_ROWS: usize = 20, "n_stage", "1", Judgement;
    /// Share of a recording's time in such holds from which it counts as one of held lengths.
    STAGES_SHARE: f64 = 0.5, "q_stage", "1", Convention("the larger part");
    /// What repeats between campaigns of strokes: shares of the largest force, or of friction.
    STROKE_REPEATS: (StrokeRepeats) = StrokeRepeats {
        zero: 0.002,
        gain: 0.005,
        level: 0.002,
        along: 0.002,
        friction: 0.05,
        friction_level: 0.10,
        friction_along: 0.10,
    }, "σ_str", "1", Judgement;
    /// Correlation length along the stroke, share of its range.
    STROKE_LENGTH: f64 = 0.3, "ℓ_x", "1", Judgement;
    /// Prior probability of no change for strokes, where nothing of the spread between campaigns is learned.
    STROKE_PRIOR_NONE: f64 = 0.5, "p_none,x", "1", Judgement;
    /// Strokes without a name are unexplained where the probability of no change is below this.
    STROKE_UNEXPLAINED: f64 = 0.1, "p_none,x,min", "1", Convention("odds of 9 to 1 for some change");
    /// Sets of changes of strokes that are compared with each other: 0 zero and 1 gain of the force, 2 friction, 3 friction that grows with pressure.
    STROKE_SETS: ([&[usize]; 9]) = [&[], &[0], &[1], &[2], &[3], &[2, 3], &[1, 2], &[1, 3], &[1, 2, 3]], "S", "1", Judgement;
    /// Log evidence that lies this much below none needs no gate.
    GATE_WORTH_ASKING: f64 = -1.0, "ln B_ask", "1", Judgement;
    /// A part of the cells is reported where it holds this much more of the energy than of the cells.
    LOCALISE_STANDS_OUT: f64 = 1.2, "r_place", "1", Judgement;
    /// Below this share of the usual slope the elastic part is not distinguished from slack.
    REPEATABILITY_PULLS: f64 = 0.05, "S/S_usual", "1", Judgement;
    /// Share of the largest pressure within which a regulated one stays.
    REPORT_REGULATED: f64 = 0.3, "ΔP_reg/P_max", "1", Judgement;
    /// ... between these quantiles of it: single strokes may begin and end elsewhere.
    REGULATED_QUANTILES: ((f64, f64)) = (0.1, 0.9), "q_reg", "1", Judgement;
    /// Coefficients of one curve.
    SPLINE_COEFFICIENTS: (usize) = SPLINE_INTERVALS + 3, "n_c", "1", Derived("cubic splines");
    /// Numerical floor of the diagonal, share of the largest force.
    STROKED_FLOOR: f64 = 1e-4, "s_0/F_max", "1", Judgement;
    /// Rows that a stroke must have in a cell.
    STROKES_FEWEST_ROWS: usize = 3, "n_row", "1", Judgement;
    /// The speed is a mean over so long.
    STROKES_SPEED_OVER: f64 = 0.1, "t_v", "s", Judgement;
    /// Percentiles of the stroke that count as its ends.
    STROKES_ENDS: ((f64, f64)) = (0.02, 0.98), "q_x", "1", Judgement;
    /// With more strokes than this the first pair is left out: run-in of the seal at the level.
    STROKES_RUN_IN: usize = 4, "n_in", "1", Judgement;
    /// Error of a table that states none, share of the largest force: what tables of fluidic muscles state.
    UNSTATED_ERROR: f64 = 0.02, "e_T", "1", Measured("tables of the development half, 0.01 to 0.02");
    /// Error of a table in the compared cells over its stated rms error, each as likely as the others a priori: rows are not spread
    /// evenly over the cells.
    TABLE_ERROR_FACTORS: ([f64; 4]) = [1.0, 1.5, 2.25, 3.4], "f_e", "1", Measured("development half, 0.9 to 2.4");
    /// Share of the variance of a table's error that all lengths have in common.
    TABLE_ERROR_COMMON: f64 = 0.3, "q_T", "1", Measured("development half, 0.1 to 0.3");
    /// Correlation of a table's error between the directions.
    TABLE_ERROR_DIRECTIONS: f64 = 0.75, "ρ_dir", "1", Measured("development half, 0.7 to 0.9");
    /// Error of a table's friction factor: it was fitted to rows in motion and at rest, and is compared at rest.
    TABLE_ERROR_FRICTION: f64 = 0.1, "e_k", "1", Measured("development half, 0.02 to 0.11");
    /// Correlation length of a table's error over the pressure, share of the range.
    TABLE_ERROR_LENGTH: f64 = 0.3, "ℓ_T", "1", Judgement;
    /// Error of a table where the actuator is slack, as a share of that where it pulls.
    TABLE_ERROR_SLACK: f64 = 0.3, "e_slack/e_T", "1", Measured("development half");
    /// Zero of the load cell when the table was made, as a share of the table's error: no table has a zero.
    TABLE_ERROR_ZERO: f64 = 0.3, "e_0/e_T", "1", Measured("development half");
    /// Step of the slope over the length, m.
    TABLE_SURFACE_STEP: f64 = 1e-4, "h_x", "1", Judgement;
    /// Strokes of a described muscle: parts of the contraction of a level.
    CATALOGUE_BINS: usize = 8, "n_ε", "1", Judgement;
    /// Fewer common cells cannot be compared.
    CATALOGUE_FEWEST_CELLS: usize = 24, "n_c,min", "1", Judgement;
    /// Error of a cell's mean that is always allowed, share of the largest force: what a load cell of 0.02 % resolves.
    CATALOGUE_FLOOR: f64 = 2e-4, "s_c/F_max", "1", Convention("load cell, 0.02 %");
    /// Cells that the spread of all kinds of motion is worth for that of one kind.
    CATALOGUE_PRIOR: f64 = 10.0, "ν_c", "1", Judgement;
    /// Differences of cells from the mean of their state are clipped at this many robust deviations before their variance is taken: single cells, as after a restart, must not decide it, and fewer than one in ten thousand normal ones are touched.
    CATALOGUE_CLIP: f64 = 4.0, "c_c", "1", Judgement;
    /// The shortest rest, s; longer ones count by decades.
    CATALOGUE_REST: f64 = 1.0, "t_rest", "s", Judgement;
    /// In a rest friction has slipped where the force has moved by more than this share of friction that neither the strokes beside it nor the
    /// other rests have.
    CATALOGUE_SLIP: f64 = 0.15, "dk/k", "1", Judgement;
    /// ... and by more than this many robust deviations of all rests.
    CATALOGUE_SLIP_SPREADS: f64 = 5.0, "n_slip", "1", Judgement;
    /// Speeds that differ by less than about this factor count as one.
    CATALOGUE_SPEED_STEP: f64 = 4.0, "r_v", "1", Judgement;
    /// Slower rows count as this share of the usual speed.
    CATALOGUE_SLOWEST: f64 = 1e-3, "v_min/v", "1", Judgement;
    /// What campaigns usually differ by without a change, share of the largest force: a load cell's zero, gain, gauge and friction.
    CATALOGUE_USUAL: f64 = 5e-4, "u/F_max", "1", Judgement;
    /// A change that is named already may have any size: prior deviation, in largest forces.
    CATALOGUE_TAKEN: f64 = 30.0, "u_named/F_max", "1", Derived("thirty largest forces bind nothing");
    /// How inexact the law of an effect may be, share of its trace in each state, each as likely as the others a priori: from a law that is
    /// nearly exact to one that is good to a fifth. A difference that no law describes better has no name.
    CATALOGUE_LAW_ERRORS: ([f64; 3]) = [0.05, 0.1, 0.2], "e_l", "1", Judgement;
    /// How inexact it usually is. Laws whose traces differ by less are not distinguished.
    CATALOGUE_LAW_ERROR: f64 = 0.15, "e_law", "1", Judgement;
    /// Correlation of neighbouring states that is believed at most.
    CATALOGUE_CORRELATED: f64 = 0.97, "ρ_max", "1", Judgement;
    /// Pairs of neighbours that a correlation is estimated from, at least.
    CATALOGUE_NEIGHBOURS: usize = 4, "n_ρ", "1", Judgement;
    /// Independent pieces that the difference of a law from the actuator amounts to, at most; their number is estimated.
    CATALOGUE_INDEPENDENT: f64 = 24.0, "n_ind", "1", Judgement;
    /// Steps of the refinement of shapes.
    CATALOGUE_REFINED: usize = 6, "n_ref", "1", Cost;
    /// First step of that refinement, as a part of the range of a shape.
    CATALOGUE_STEP: f64 = 0.06, "du_1", "1", Judgement;
    /// An effect of this probability is listed beside the one that is named.
    CATALOGUE_COMPETITOR: f64 = 0.02, "p_comp", "1", Judgement;
    /// All names together have at least this prior probability.
    CATALOGUE_LEAST_PRIOR: f64 = 1e-3, "p_names,min", "1", Judgement;
    /// Length and pressure move together: parts of the stroke, each of which counts as a held length.
    COMBINED_LENGTHS: usize = 5, "n_part", "1", Judgement;
    /// The same: spans of time, whose differences show how far the actuator repeats.
    COMBINED_SPANS: usize = 6, "n_span", "1", Cost;
    /// Rows that a part of the stroke must have in a span.
    COMBINED_FEWEST_ROWS: usize = 10, "n_part,min", "1", Judgement;
    /// Ridge on the coefficients of the force over pressure and stroke, share of the rows.
    COMBINED_RIDGE: f64 = 1e-6, "ρ_c", "1", Judgement;
    /// The force over pressure and stroke is held constant this far beyond their ranges, in half-ranges.
    COMBINED_BEYOND: f64 = 1.1, "u_max", "1", Judgement;
    /// Error of the shapes where length and pressure move together, share of their size: slopes are those of five coarse parts.
    COMBINED_SHAPE_ERROR: f64 = 0.2, "ε_c", "1", Judgement;
    /// A table is compared where it gives more than this share of its largest force: it is fitted where the muscle pulls.
    COMBINED_PULLS: f64 = 0.05, "F_c/F_max", "1", Judgement;
    /// After a reversal the stroke must come back by this share of its range before friction counts as turned.
    COMBINED_TURNED: f64 = 0.1, "δ_x,turn", "1", Judgement;
    /// Mean square of the stroke's steps from row to row over its variance, below which it is a motion; of white noise it is 2.
    COMBINED_SMOOTH: f64 = 0.2, "r_smooth", "1", Derived("white noise gives 2");
    /// A stroke that swings comes back by this share of its range, and at one pressure varies by so much of it.
    COMBINED_SWING: f64 = 0.5, "q_swing", "1", Judgement;
    /// Turns of a stroke that swings.
    COMBINED_TURNS: usize = 4, "n_turn", "1", Judgement;
    /// Range of the pressure within a stroke, share of the largest, from which on it is not regulated.
    COMBINED_UNREST: f64 = 0.1, "ΔP_x/P_max", "1", Judgement;
    /// Correlation length over pressure, share of the range, and correlation between the directions of an unknown surface.
    UNKNOWN_SMOOTH: ((f64, f64)) = (0.25, 0.5), "ℓ_u, ρ_u", "1", Judgement;
    /// Eigenvectors below this share of the largest are left out.
    UNKNOWN_LEAST: f64 = 1e-2, "λ_u/λ_max", "1", Judgement;
}
