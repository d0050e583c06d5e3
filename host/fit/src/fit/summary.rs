//! The figures of a fit, as text and as JSON.

use pam_data::statistics::{NORMAL_95, median};
use std::collections::BTreeSet;

use serde::Serialize;

use crate::table_file::FitQuality;
use model_core::table::MuscleTable;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, largest_force_of};

use super::by_recording::{self, RecordingResidual, recording_table};
use super::dimensions::Adjusted;
use super::errors::{ChunkError, errors};
use super::identifiability::{Correlations, DEADBAND, NotDetermined, not_determined};
use super::screen::{Outlier, PointUse};
use super::solution::Solution;
use super::uncertainty::{Uncertain, table_root};

/// The figures of a fit; its JSON form is `pam-fit/1`. Errors in percent are those of eq. 24 of the thesis: the model against the
/// mid-line of the loop, as a share of the blocked force at that pressure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)] // Units are spelled as units are.
pub struct Summary {
    /// The name of the JSON form, `pam-fit/1`.
    pub schema: &'static str,
    /// The name of the muscle description.
    pub muscle: String,
    /// Rows of all recordings.
    pub samples: usize,
    /// The deadband pressure `P0`, kPa.
    pub deadband_kPa: f64,
    /// Standard deviation (1 σ) of `P0`, kPa.
    pub deadband_std_kPa: f64,
    /// Friction-free force at rest length and the highest tested pressure, N.
    pub blocked_force_N: f64,
    /// Root mean square of the residuals of the rows that take part, N.
    pub rms_N: f64,
    /// Mean error over all pressures, percent of blocked force.
    pub mean_error_pct: f64,
    /// Largest error over all pressures, percent of blocked force.
    pub max_error_pct: f64,
    /// Mean error where each pressure is predicted from the others, percent of blocked force; absent with one pressure only.
    pub left_out_pressure_mean_error_pct: Option<f64>,
    /// The figures of each tested pressure.
    pub pressures: Vec<AtPressure>,
    /// The thesis's models side by side.
    pub models: Vec<ModelError>,
    /// How many rows took part, and why others did not.
    pub rows: RowUse,
    /// Weight of the penalty on the curvature of `E_k(P)` and of `k_F(P)`, relative to the data.
    pub smoothing: [f64; 2],
    /// Distance from a reversal within which rows are excluded, as a share of the ranges of stroke and pressure.
    #[serde(rename = "turn_zone")]
    pub reversal_zone: f64,
    /// Condition number of the scaled elastic columns; absent where they are dependent.
    pub condition: Option<f64>,
    /// Correlations of the table's parameters at the middle pressure.
    pub correlations: Correlations,
    /// Parameters that the recordings do not determine.
    pub not_determined: Vec<NotDetermined>,
    /// What the constraint that stress rises with strain costs, where it was requested.
    pub physical: Option<PhysicalCost>,
    /// Force readings outside the scatter of the others; they are not fitted.
    pub outliers: Vec<OutlierRow>,
    /// Fitted dimensions and mounting lengths.
    pub adjusted: Vec<Adjusted>,
    /// Residuals by recording and mounting.
    pub recordings: Vec<RecordingResidual>,
    /// The largest force that was measured, without readings that are not a measurement, N: a scale that no fit enters.
    pub largest_force_N: f64,
    /// What the user must know, one sentence or more each.
    pub warnings: Vec<String>,
    /// What makes the table useless for control; empty where nothing does ([`crate::table_faults`]).
    pub faults: Vec<String>,
}

/// The fit at one tested pressure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct AtPressure {
    /// The level, or the middle of an interval of a continuous range, kPa.
    pub pressure_kPa: f64,
    /// The elastic moduli `E_1 … E_M`, MPa.
    pub E_MPa: Vec<f64>,
    /// Their standard deviations (1 σ), MPa.
    pub E_std_MPa: Vec<f64>,
    /// The friction factor `k_F`.
    pub k_F: f64,
    /// Its standard deviation (1 σ).
    pub k_F_std: f64,
    /// Friction-free force at rest length, N.
    pub blocked_force_N: f64,
    /// Contraction at which the friction-free force is zero; absent where it lies beyond what the braid or the recordings
    /// reach.
    pub free_contraction: Option<f64>,
    /// Mean error, percent of blocked force.
    pub mean_error_pct: f64,
    /// Largest error, percent of blocked force.
    pub max_error_pct: f64,
    /// Mean error of this pressure predicted from the others, percent of blocked force.
    pub left_out_mean_error_pct: Option<f64>,
    /// Rows at this pressure.
    pub samples: usize,
}

/// The errors of one model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelError {
    /// The model's name.
    pub name: String,
    /// Mean error, percent of blocked force.
    pub mean_error_pct: f64,
    /// Largest error, percent of blocked force.
    pub max_error_pct: f64,
}

/// How many rows took part, and why others did not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RowUse {
    /// Rows that took part.
    pub fitted: usize,
    /// Rows just after a reversal.
    #[serde(rename = "near_turn")]
    pub near_reversal: usize,
    /// Rows whose direction of motion is unknown.
    pub unknown_direction: usize,
    /// Rows where the muscle is slack.
    pub slack: usize,
    /// Rows where the rig pushes the muscle; absent where it does not.
    #[serde(skip_serializing_if = "is_zero")]
    pub pushed: usize,
    /// Rows with the force sensor at the end of its range.
    pub clipped: usize,
    /// Rows whose force is outside the scatter of the others.
    pub outliers: usize,
    /// Rows where a sensor failed, or something other than the muscle held a constant load; absent where there are none.
    #[serde(skip_serializing_if = "is_zero")]
    pub dropouts: usize,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The errors of the fit without the constraint that stress rises with strain: the difference is what the constraint costs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhysicalCost {
    /// Mean error without the constraint, percent of blocked force.
    pub free_mean_error_pct: f64,
    /// Largest error without the constraint, percent of blocked force.
    pub free_max_error_pct: f64,
}

/// A force reading outside the scatter of the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct OutlierRow {
    /// The name of the recording.
    pub recording: String,
    /// The row below the header, from 1.
    pub row: usize,
    /// Time, s.
    pub time_s: f64,
    /// The reading, N.
    pub force_N: f64,
    /// The distance of the reading from the model, or from the other readings around it, N.
    pub off_N: f64,
}

impl Summary {
    /// The figures of merit, as a table file keeps them.
    #[must_use]
    pub fn quality(&self) -> FitQuality {
        FitQuality {
            samples: self.samples as u64,
            rms_newtons: self.rms_N,
            mean_error_percent: self.mean_error_pct,
            max_error_percent: self.max_error_pct,
            left_out_percent: self.left_out_pressure_mean_error_pct,
            warnings: self.warnings.clone(),
        }
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // An interval of zero width would claim certainty.
        let half = NORMAL_95 * self.deadband_std_kPa;
        let places = (1..4).find(|p| half >= 0.5 * 10.0_f64.powi(-p)).unwrap_or(4) as usize;
        let determined = self.not_determined.iter().all(|n| n.parameter != DEADBAND);
        let (interval, meaning) = if determined {
            (format!(" ± {half:.places$}"), " (±: 95 % confidence interval)")
        } else {
            (String::new(), "")
        };
        writeln!(
            f,
            "{}: {} of {} rows fitted, P0 {:.places$}{interval} kPa, blocked force {:.1} N, rms {:.3} N{meaning}",
            self.muscle, self.rows.fitted, self.samples, self.deadband_kPa, self.blocked_force_N, self.rms_N
        )?;
        write!(
            f,
            "largest measured force {:.1} N; rms is {:.2} % of it\nerror of the mid-lines, of blocked force: {:.3} % mean, {:.3} % at most",
            self.largest_force_N,
            100.0 * self.rms_N / self.largest_force_N,
            self.mean_error_pct,
            self.max_error_pct
        )?;
        if let Some(left_out) = self.left_out_pressure_mean_error_pct {
            write!(f, "; {left_out:.3} % mean with each pressure left out in turn")?;
        }
        write!(
            f,
            "\n{:>8} {:>8} {:>9} {:>7} {:>7} {:>7}  E_k MPa",
            "P kPa", "k_F", "F_B N", "free", "mean %", "max %"
        )?;
        for p in &self.pressures {
            let free = p.free_contraction.map_or("–".to_owned(), |c| format!("{c:.4}"));
            let moduli: Vec<String> = p.E_MPa.iter().map(|e| format!("{e:.4}")).collect();
            write!(
                f,
                "\n{:8.1} {:8.4} {:9.2} {free:>7} {:7.3} {:7.3}  {}",
                p.pressure_kPa,
                p.k_F,
                p.blocked_force_N,
                p.mean_error_pct,
                p.max_error_pct,
                moduli.join(" ")
            )?;
        }
        for open in &self.not_determined {
            write!(f, "\nnot determined: {open}")?;
        }
        if let Some(free) = &self.physical {
            write!(
                f,
                "\nwith stress constrained to rise with strain: error {:.3} % mean and {:.3} % at most; without {:.3} % and {:.3} %",
                self.mean_error_pct, self.max_error_pct, free.free_mean_error_pct, free.free_max_error_pct
            )?;
        }
        for a in &self.adjusted {
            write!(
                f,
                "\n{}: {:.3} ± {:.3} {} (description {:.3}; {:.0} % determined by the recordings{})",
                a.name,
                a.value,
                NORMAL_95 * a.std,
                a.unit,
                a.nominal,
                100.0 * a.determined,
                if a.at_bound { ", at its bound" } else { "" }
            )?;
        }
        let residuals = recording_table(&self.recordings);
        if !residuals.is_empty() {
            write!(f, "\n{residuals}")?;
        }
        Ok(())
    }
}

/// What a summary draws from beside the solution.
pub(super) struct Results<'a> {
    pub table: &'a MuscleTable,
    pub uncertain: &'a Uncertain,
    /// `F − F_model` of every point by the table, N.
    pub residuals: &'a [f64],
    pub chunks: &'a [ChunkError],
    /// The mean error of each pressure predicted from the others, percent.
    pub left_out: &'a [Option<f64>],
}

pub(super) fn summarise(
    solution: &Solution,
    campaign: &Campaign,
    muscle: &MuscleDescription,
    results: &Results<'_>,
) -> Summary {
    let Results { table, uncertain, residuals, chunks, left_out } = *results;
    let Solution { problem, screen, .. } = solution;
    let all = errors(chunks, |_| true);
    let levels = &problem.pressures.levels;
    let known: Vec<f64> = left_out.iter().copied().flatten().collect();
    let pressures = at_levels(solution, results);
    let deadband_std = table_root(solution, &uncertain.root, levels).std(0);
    // A recording in another unit was left out.
    let indices: BTreeSet<u32> = problem.points.list.iter().map(|p| p.recording).collect();
    let used = indices.iter().filter_map(|i| campaign.recordings.get(*i as usize));
    Summary {
        schema: "pam-fit/1",
        muscle: muscle.name.clone(),
        samples: problem.points.rows,
        deadband_kPa: solution.deadband() / 1e3,
        deadband_std_kPa: deadband_std / 1e3,
        blocked_force_N: f64::from(table.blocked_force.newtons()),
        rms_N: rms(solution, residuals),
        mean_error_pct: all.mean,
        max_error_pct: all.max,
        left_out_pressure_mean_error_pct: (!known.is_empty())
            .then(|| known.iter().sum::<f64>() / known.len() as f64),
        pressures,
        models: vec![ModelError { name: "table".into(), mean_error_pct: all.mean, max_error_pct: all.max }],
        rows: row_use(solution),
        smoothing: [solution.smoothing.elastic, solution.smoothing.friction],
        reversal_zone: screen.reversal_zone,
        condition: Some(problem.design.orthonormal.condition).filter(|c| c.is_finite()),
        correlations: Correlations::at(solution, &uncertain.root, median(&mut levels.to_vec())),
        not_determined: not_determined(solution, &uncertain.root),
        physical: None,
        outliers: screen.outliers.iter().map(|o| outlier_row(o, campaign)).collect(),
        adjusted: problem.adjusted.clone(),
        warnings: super::warnings::warnings(solution, all.mean, left_out),
        recordings: by_recording::of_fit(solution, campaign, residuals),
        largest_force_N: largest_force_of(used),
        faults: Vec::new(),
    }
}

/// The figures of every tested pressure.
fn at_levels(solution: &Solution, results: &Results<'_>) -> Vec<AtPressure> {
    let problem = &solution.problem;
    let levels = &problem.pressures.levels;
    let root = table_root(solution, &results.uncertain.root, levels);
    let order = problem.design.layout().order;
    let mut rows = vec![0_usize; levels.len()];
    for (i, p) in problem.points.list.iter().enumerate() {
        rows[problem.group_of(i)] += p.rows as usize;
    }
    let at = |(i, &p): (usize, &f64)| {
        let (moduli, friction) = solution.curves_at(p);
        let e = errors(results.chunks, |c| c.group as usize == i);
        AtPressure {
            pressure_kPa: p / 1e3,
            E_MPa: moduli.iter().map(|e| e / 1e6).collect(),
            E_std_MPa: (0..order).map(|k| root.std(1 + k * levels.len() + i) / 1e6).collect(),
            k_F: friction,
            k_F_std: root.std(1 + order * levels.len() + i),
            blocked_force_N: solution.blocked(p),
            free_contraction: free_contraction(solution, p),
            mean_error_pct: e.mean,
            max_error_pct: e.max,
            left_out_mean_error_pct: results.left_out.get(i).copied().flatten(),
            samples: rows[i],
        }
    };
    levels.iter().enumerate().map(at).collect()
}

fn row_use(solution: &Solution) -> RowUse {
    let mut rows = RowUse::default();
    for (p, used) in solution.problem.points.list.iter().zip(&solution.screen.used) {
        *match used {
            PointUse::Fitted => &mut rows.fitted,
            PointUse::NearReversal => &mut rows.near_reversal,
            PointUse::UnknownDirection => &mut rows.unknown_direction,
            PointUse::Slack => &mut rows.slack,
            PointUse::Pushed => &mut rows.pushed,
            PointUse::Clipped => &mut rows.clipped,
            PointUse::Outlier => &mut rows.outliers,
            PointUse::Dropout => &mut rows.dropouts,
        } += p.rows as usize;
    }
    rows
}

/// Root mean square of the residuals of all rows that count, N.
fn rms(solution: &Solution, residuals: &[f64]) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for (i, p) in solution.problem.points.list.iter().enumerate().filter(|(i, _)| solution.counts(*i)) {
        let n = f64::from(p.rows);
        square += n * residuals[i] * residuals[i];
        count += n;
    }
    (square / f64::max(count, 1.0)).sqrt()
}

fn outlier_row(o: &Outlier, campaign: &Campaign) -> OutlierRow {
    let recording = &campaign.recordings[o.recording as usize];
    let row = recording.rows.as_ref().map_or(o.row as usize, |r| r[o.row as usize] as usize);
    OutlierRow {
        recording: recording.name.clone(),
        row: row + 1,
        time_s: o.time,
        force_N: o.force,
        off_N: o.off,
    }
}

/// The contraction at which the friction-free force is zero, searched for up to 1.3 times the tested range: an extrapolated polynomial
/// means nothing further out.
fn free_contraction(solution: &Solution, pressure: f64) -> Option<f64> {
    let l0 = solution.problem.braid.rest_length();
    let end =
        (1.3 * solution.problem.points.stroke.high / l0).min(solution.problem.braid.neutral_contraction());
    let force = |c: f64| solution.quasi(pressure, c * l0);
    if !(force(0.0) > 0.0 && end > 0.0) {
        return None;
    }
    let steps = 200;
    let after = (1..=steps).map(|i| end * f64::from(i) / f64::from(steps)).find(|c| force(*c) <= 0.0)?;
    let (mut low, mut high) = (after - end / f64::from(steps), after);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if force(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}
