//! The law of the bladder's relaxing back pressure, fitted to the settled points of one muscle.
//!
//! ```text
//! F = S_m(P + c z̄)      dz_k/dt = (u − z_k)/τ_k      u = p_el clip((P − P_e)/max(|p_el|, ΔP_r), 0, 1)      p_el = P_th,m − P_b
//! ```
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | `c` | relaxed share of the back pressure over the whole spectrum, `c/5` a decade | – |
//! | `P_b` | pressure at which the bladder carries no axial stress | kPa |
//! | `P_e` | pressure from which the bladder is pressed against its braid and its part builds up | kPa |
//! | `P_th,m` | pressure at which the muscle begins to pull at the length of mounting `m` | kPa |
//! | `p_el` | part of the pressure that the bladder carries; negative where it is stretched | kPa |
//!
//! The law was found on isometric recordings at four lengths; under motion it is a prediction.

use pam_data::statistics::extremes;
use pam_fit::numerics::bspline::CubicSplines;
use rayon::prelude::*;

use super::campaign::Points;
use super::criteria::{
    BALANCE_FIRST, BALANCE_MOST, BALANCE_MOVES, BALANCE_START, DAMPING, ENGAGED, LAW_BALANCE_STEP,
    LAW_MOST_STEPS, LAW_NO_SIGN, LAW_NUDGE, LAW_SETTLED_SHARE, LAW_TELLS_BALANCE, LOADED, NEAR_BALANCE,
    PAUSES, RAMP, THRESHOLD_BEYOND, THRESHOLD_FROM, THRESHOLD_TO,
};
use super::memory::StateSteps;
use super::shift_fit::{self, ShiftFit};

/// Assumptions about times that are not recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    /// Which of the pauses.
    pub pause: usize,
    /// How long the muscle had been loaded before the first run, s.
    pub loaded: f64,
}

/// A campaign with all that the fits share.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    pub points: &'a Points,
    pub spline: CubicSplines,
    /// `P_th,m`, kPa.
    pub thresholds: Vec<f64>,
    /// Pauses between runs, s, with the steps of the states over each.
    pub clocks: Vec<(f64, StateSteps)>,
    /// Whether the recordings determine `P_b`.
    pub balance_is_free: bool,
}

/// The fitted law.
#[derive(Clone, Debug)]
pub(super) struct Law {
    /// `c`, then the coefficients of further columns.
    pub fit: ShiftFit,
    /// `P_b`, kPa.
    pub balance: f64,
    pub choice: Choice,
    /// Shifts per unit of each coefficient, kPa, at every point (also those left out).
    pub columns: Vec<Vec<f64>>,
    /// Sum of squared residuals over the points in use, N².
    pub squares: f64,
}

/// Pressures at which a muscle begins to pull, by the tangent to its static curve near the highest pressure.
pub(super) fn thresholds(points: &Points) -> Vec<f64> {
    thresholds_of(points, &vec![true; points.len()])
}

/// The same by the points in use; the highest pressure of a mounting that has none of them.
pub(super) fn thresholds_of(points: &Points, use_point: &[bool]) -> Vec<f64> {
    let highest = points.highest();
    let spline = shift_fit::static_spline(highest);
    (0..points.mountings.len())
        .map(|m| {
            let own = || (0..points.len()).filter(|i| points.mounting[*i] == m && use_point[*i]);
            let top = own().map(|i| points.pressure[i]).fold(0.0, f64::max).min(highest);
            let Some(curve) = shift_fit::static_curve(points, &spline, own()) else { return top };
            let tangents = (0..7).map(|k| {
                let p = top * (THRESHOLD_FROM + (THRESHOLD_TO - THRESHOLD_FROM) * f64::from(k) / 6.0);
                let local = spline.at(p);
                p - local.value(&curve) / local.slope(&curve)
            });
            let mean = tangents.sum::<f64>() / 7.0;
            // A muscle that never pulls at this length begins above what was tried.
            if mean.is_finite() { mean.clamp(-top, THRESHOLD_BEYOND * top) } else { top }
        })
        .collect()
}

impl<'a> Layer<'a> {
    pub(super) fn new(points: &'a Points, times: &[f64]) -> Self {
        let thresholds = thresholds(points);
        let pauses = if points.pauses_known() { &PAUSES[..1] } else { &PAUSES[..] };
        let clocks = pauses.iter().map(|p| (*p, StateSteps::new(points, *p, times))).collect();
        let (low, high) = extremes(&thresholds);
        // One mounting determines c (P_th − P_b) only; two determine P_b where their carried parts differ.
        let balance_is_free = low < NEAR_BALANCE * BALANCE_START && high - low > RAMP;
        let spline = shift_fit::shifted_spline(points.highest());
        Self { points, spline, thresholds, clocks, balance_is_free }
    }

    /// `z̄` per kPa of the carried part.
    fn unit_state(&self, balance: f64, choice: Choice) -> Vec<f64> {
        let p = self.points;
        let drive: Vec<f64> = (0..p.len())
            .map(|i| {
                let carried = self.carried(p.mounting[i], balance).abs();
                ((p.pressure[i] - ENGAGED) / carried.max(RAMP)).clamp(0.0, 1.0)
            })
            .collect();
        self.clocks[choice.pause].1.mean_state(&drive, choice.loaded)
    }

    /// `p_el`, kPa.
    pub(super) fn carried(&self, mounting: usize, balance: f64) -> f64 {
        let carried = self.thresholds[mounting] - balance;
        if carried.abs() < LAW_NO_SIGN { LAW_NO_SIGN } else { carried }
    }

    /// Shift per unit of `c`, kPa.
    fn column(&self, balance: f64, choice: Choice) -> Vec<f64> {
        let mut column = self.unit_state(balance, choice);
        for (q, m) in column.iter_mut().zip(&self.points.mounting) {
            *q *= self.carried(*m, balance);
        }
        column
    }

    /// The law at one choice of unrecorded times: Gauss–Newton in `c`, further coefficients and, where it is free, `P_b`.
    fn fit_at(&self, use_point: &[bool], choice: Choice, further: &[Vec<f64>], start: Option<&Law>) -> Law {
        let p = self.points;
        let first = self.thresholds[p.longest()]
            .clamp(BALANCE_FIRST.0 * BALANCE_START, BALANCE_FIRST.1 * BALANCE_START);
        let mut balance = match start {
            Some(law) => law.balance,
            None if self.balance_is_free => first,
            None => BALANCE_START,
        };
        let mut theta = start.map_or_else(|| vec![0.0; 1 + further.len()], |law| law.fit.theta.clone());
        let mut columns = vec![self.column(balance, choice)];
        columns.extend_from_slice(further);
        if start.is_none() {
            theta = shift_fit::fit(p, &self.spline, use_point, &columns, &theta, 2).theta;
        }
        let mut curves: Option<Vec<Vec<f64>>> = None;
        for _ in 0..LAW_MOST_STEPS {
            let shifts: Vec<f64> = (0..p.len()).map(|i| shift_fit::shift(&columns, &theta, i)).collect();
            let slopes = curves
                .take()
                .unwrap_or_else(|| shift_fit::solve(p, &self.spline, use_point, &shifts, &[], None).1);
            let share = theta[0];
            let moves_balance = self.balance_is_free && share > LAW_TELLS_BALANCE;
            let mut derivatives = columns.clone();
            if moves_balance {
                let [above, below] = [1.0, -1.0].map(|s| self.column(balance + s * LAW_NUDGE, choice));
                let slope = above.iter().zip(&below).map(|(a, b)| share * (a - b) / (2.0 * LAW_NUDGE));
                derivatives.push(slope.collect());
            }
            let (change, next) =
                shift_fit::solve(p, &self.spline, use_point, &shifts, &derivatives, Some(&slopes));
            theta.iter_mut().zip(&change).for_each(|(t, c)| *t += DAMPING * c);
            let mut moved = 0.0;
            if let Some(c) = change.last().filter(|_| moves_balance) {
                let to = (balance + DAMPING * c.clamp(-LAW_BALANCE_STEP, LAW_BALANCE_STEP))
                    .clamp(0.0, BALANCE_MOST);
                moved = to - balance;
                balance = to;
                columns[0] = self.column(balance, choice);
            }
            curves = Some(next);
            if change[0].abs() < LAW_SETTLED_SHARE && moved.abs() < BALANCE_MOVES {
                break;
            }
        }
        let fit = shift_fit::fit(p, &self.spline, use_point, &columns, &theta, 1);
        let squares = (0..p.len())
            .filter(|i| use_point[*i])
            .map(|i| (shift_fit::predict(p, &self.spline, &columns, &fit, i) - p.force[i]).powi(2))
            .sum();
        Law { fit, balance, choice, columns, squares }
    }

    /// The law at the best choice of unrecorded times, or at a given one.
    pub(super) fn fit(
        &self,
        use_point: &[bool],
        choice: Option<Choice>,
        further: &[Vec<f64>],
        start: Option<&Law>,
    ) -> Law {
        if let Some(choice) = choice {
            return self.fit_at(use_point, choice, further, start);
        }
        let choices: Vec<Choice> = (0..self.clocks.len())
            .flat_map(|pause| LOADED.iter().map(move |loaded| Choice { pause, loaded: *loaded }))
            .collect();
        let fits: Vec<Law> = choices.par_iter().map(|c| self.fit_at(use_point, *c, further, start)).collect();
        let first = Choice { pause: 0, loaded: 0.0 };
        let best = fits
            .into_iter()
            .min_by(|a, b| a.squares.total_cmp(&b.squares))
            .unwrap_or_else(|| self.fit_at(use_point, first, further, start));
        // From nothing the steps are many; the choice needed fewer than the answer does.
        (0..if start.is_some() { 0 } else { 2 })
            .fold(best, |law, _| self.fit_at(use_point, law.choice, further, Some(&law)))
    }

    /// What a law predicts at a point, N.
    pub(super) fn predict(&self, law: &Law, i: usize) -> f64 {
        shift_fit::predict(self.points, &self.spline, &law.columns, &law.fit, i)
    }

    /// `dS/dP` at a point, N/kPa.
    pub(super) fn slope(&self, law: &Law, i: usize) -> f64 {
        shift_fit::slope(self.points, &self.spline, &law.columns, &law.fit, i)
    }
}
