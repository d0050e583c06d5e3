//! The figures of a fit, for people and for programs.

use serde::Serialize;

use crate::table_file::FitQuality;
use model_core::table::MuscleTable;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;

use super::determined::{Correlations, NotDetermined, not_determined};
use super::dimensions::Adjusted;
use super::errors::{ChunkError, errors};
use super::prepared::Prepared;
use super::screen::Use;
use super::uncertainty::{self, Uncertain};

/// The figures of a fit; its JSON form is `pam-fit/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)] // Units are spelled as units are.
pub struct Summary {
    /// `pam-fit/1`.
    pub schema: &'static str,
    /// The muscle's name.
    pub muscle: String,
    /// Rows of the recordings.
    pub samples: usize,
    /// `P0`.
    pub deadband_kPa: f64,
    /// Standard deviation of `P0`.
    pub deadband_std_kPa: f64,
    /// Friction-free force at rest length and the highest tested pressure.
    pub blocked_force_N: f64,
    /// Root mean square of residuals of the points that take part.
    pub rms_N: f64,
    /// By eq. 24, over all pressures.
    pub mean_error_pct: f64,
    /// By eq. 24, over all pressures.
    pub max_error_pct: f64,
    /// Each pressure predicted from the others, eq. 24; absent where there is but one.
    pub left_out_pressure_mean_error_pct: Option<f64>,
    /// Per tested pressure.
    pub pressures: Vec<AtPressure>,
    /// The thesis's models side by side.
    pub models: Vec<ModelError>,
    /// What became of the rows.
    pub rows: RowUse,
    /// Weight of the penalty on bending of `E_k(P)` and of `k_F(P)`.
    pub smoothing: [f64; 2],
    /// How far from a turn rows were set aside, share of the ranges of stroke and pressure.
    pub turn_zone: f64,
    /// Condition number of the scaled elastic columns; absent where they are dependent.
    pub condition: Option<f64>,
    /// How the numbers of the table at the middle pressure depend on each other.
    pub correlations: Correlations,
    /// Numbers that the recordings leave open.
    pub not_determined: Vec<NotDetermined>,
    /// What stress that rises with strain costs, where it was asked for.
    pub physical: Option<PhysicalCost>,
    /// Readings that do not belong to the rest.
    pub outliers: Vec<OutlierRow>,
    /// Dimensions and lengths that were found too.
    pub adjusted: Vec<Adjusted>,
    /// In words.
    pub warnings: Vec<String>,
}

/// The fit at one tested pressure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct AtPressure {
    /// The level, or the middle of an interval.
    pub pressure_kPa: f64,
    /// `E_1 …`.
    pub E_MPa: Vec<f64>,
    /// Their standard deviations.
    pub E_std_MPa: Vec<f64>,
    /// Friction factor.
    pub k_F: f64,
    /// Its standard deviation.
    pub k_F_std: f64,
    /// Friction-free force at rest length.
    pub blocked_force_N: f64,
    /// Contraction at which the friction-free force is zero; absent where it lies beyond what the braid or the recordings
    /// reach.
    pub free_contraction: Option<f64>,
    /// By eq. 24.
    pub mean_error_pct: f64,
    /// By eq. 24.
    pub max_error_pct: f64,
    /// By eq. 24, this pressure predicted from the others.
    pub left_out_mean_error_pct: Option<f64>,
    /// Rows at this pressure.
    pub samples: usize,
}

/// One model's errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelError {
    /// Its name.
    pub name: String,
    /// By eq. 24.
    pub mean_error_pct: f64,
    /// By eq. 24.
    pub max_error_pct: f64,
}

/// How many rows took part, and why others did not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RowUse {
    /// Took part.
    pub fitted: usize,
    /// Just after a turn.
    pub near_turn: usize,
    /// Direction of motion not known.
    pub unknown_direction: usize,
    /// Muscle slack.
    pub slack: usize,
    /// Force sensor at the end of its range.
    pub clipped: usize,
    /// Readings that do not belong.
    pub outliers: usize,
    /// The gauge alone fell out; absent where it did not.
    #[serde(skip_serializing_if = "nothing")]
    pub dropouts: usize,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn nothing(count: &usize) -> bool {
    *count == 0
}

/// The errors without the demand that stress rise with strain: what that demand costs is the difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhysicalCost {
    /// By eq. 24, over all pressures, stress free to fall.
    pub free_mean_error_pct: f64,
    /// By eq. 24, over all pressures, stress free to fall.
    pub free_max_error_pct: f64,
}

/// One outlier, for people.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct OutlierRow {
    /// The recording.
    pub recording: String,
    /// Row below the header, from 1.
    pub row: usize,
    /// s.
    pub time_s: f64,
    /// N.
    pub force_N: f64,
    /// How far off, N.
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
        // An interval of no width would claim that nothing is left open.
        let half = 1.96 * self.deadband_std_kPa;
        let places = (1..4).find(|p| half >= 0.5 * 10.0_f64.powi(-p)).unwrap_or(4) as usize;
        writeln!(
            f,
            "{}: {} rows, P0 {:.places$} ± {half:.places$} kPa, blocked force {:.1} N, rms {:.3} N",
            self.muscle, self.samples, self.deadband_kPa, self.blocked_force_N, self.rms_N
        )?;
        write!(
            f,
            "error of blocked force: {:.3} % mean, {:.3} % at most",
            self.mean_error_pct, self.max_error_pct
        )?;
        if let Some(left_out) = self.left_out_pressure_mean_error_pct {
            write!(f, "; {left_out:.3} % mean at pressures left out")?;
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
                "\nstress that rises with strain costs error: {:.3} % mean and {:.3} % at most, against {:.3} % and {:.3} % without",
                self.mean_error_pct, self.max_error_pct, free.free_mean_error_pct, free.free_max_error_pct
            )?;
        }
        for a in &self.adjusted {
            write!(
                f,
                "\n{}: {:.3} ± {:.3} {} (described {:.3}; {:.0} % determined by the recordings{})",
                a.name,
                a.value,
                1.96 * a.std,
                a.unit,
                a.nominal,
                100.0 * a.determined,
                if a.at_bound { ", at its bound" } else { "" }
            )?;
        }
        Ok(())
    }
}

#[allow(clippy::too_many_arguments)] // Everything that was found flows into one summary.
pub(super) fn summarise(
    prepared: &Prepared,
    table: &MuscleTable,
    campaign: &Campaign,
    muscle: &MuscleDescription,
    uncertain: &Uncertain,
    residuals: &[f64],
    chunks: &[ChunkError],
    left_out: &[Option<f64>],
) -> Summary {
    let all = errors(chunks, |_| true);
    let levels = &prepared.pressures.levels;
    let root = uncertainty::of_table(prepared, &uncertain.root, levels);
    let order = prepared.design.layout().order;
    let mut rows_at = vec![0_usize; levels.len()];
    let mut rows = RowUse::default();
    let (mut square, mut count) = (0.0, 0.0);
    for i in 0..prepared.points.list.len() {
        let n = prepared.points.list[i].rows as usize;
        rows_at[prepared.design.bins[prepared.design.rows[i].bin as usize].group as usize] += n;
        *match prepared.used[i] {
            Use::Fitted => &mut rows.fitted,
            Use::NearTurn => &mut rows.near_turn,
            Use::UnknownDirection => &mut rows.unknown_direction,
            Use::Slack => &mut rows.slack,
            Use::Clipped => &mut rows.clipped,
            Use::Outlier => &mut rows.outliers,
            Use::Dropout => &mut rows.dropouts,
        } += n;
        if prepared.counts(i) {
            square += n as f64 * residuals[i] * residuals[i];
            count += n as f64;
        }
    }
    let pressures = levels
        .iter()
        .enumerate()
        .map(|(i, &p)| {
            let (moduli, friction) = prepared.curves_at(p);
            let e = errors(chunks, |c| c.group as usize == i);
            AtPressure {
                pressure_kPa: p / 1e3,
                E_MPa: moduli.iter().map(|e| e / 1e6).collect(),
                E_std_MPa: (0..order).map(|k| root.std(1 + k * levels.len() + i) / 1e6).collect(),
                k_F: friction,
                k_F_std: root.std(1 + order * levels.len() + i),
                blocked_force_N: prepared.blocked(p),
                free_contraction: free_contraction(prepared, p),
                mean_error_pct: e.mean,
                max_error_pct: e.max,
                left_out_mean_error_pct: left_out.get(i).copied().flatten(),
                samples: rows_at[i],
            }
        })
        .collect();
    let known: Vec<f64> = left_out.iter().copied().flatten().collect();
    let outliers = prepared
        .outliers
        .iter()
        .map(|o| {
            let recording = &campaign.recordings[o.recording as usize];
            let row = recording.rows.as_ref().map_or(o.row as usize, |r| r[o.row as usize] as usize);
            OutlierRow {
                recording: recording.name.clone(),
                row: row + 1,
                time_s: o.time,
                force_N: o.force,
                off_N: o.off,
            }
        })
        .collect();
    Summary {
        schema: "pam-fit/1",
        muscle: muscle.name.clone(),
        samples: prepared.points.rows,
        deadband_kPa: prepared.deadband() / 1e3,
        deadband_std_kPa: root.std(0) / 1e3,
        blocked_force_N: f64::from(table.blocked_force.newtons()),
        rms_N: (square / f64::max(count, 1.0)).sqrt(),
        mean_error_pct: all.mean,
        max_error_pct: all.max,
        left_out_pressure_mean_error_pct: (!known.is_empty())
            .then(|| known.iter().sum::<f64>() / known.len() as f64),
        pressures,
        models: vec![ModelError { name: "table".into(), mean_error_pct: all.mean, max_error_pct: all.max }],
        rows,
        smoothing: [prepared.smoothing.elastic, prepared.smoothing.friction],
        turn_zone: prepared.turn_zone,
        condition: Some(prepared.design.orthonormal.condition).filter(|c| c.is_finite()),
        correlations: Correlations::at(prepared, &uncertain.root, levels[levels.len() / 2]),
        not_determined: not_determined(prepared, &uncertain.root),
        physical: None,
        outliers,
        adjusted: prepared.adjusted.clone(),
        warnings: super::warnings::warnings(prepared, all.mean, left_out),
    }
}

/// The contraction at which the friction-free force vanishes, looked for up to a little beyond the tested range: further
/// out a polynomial says nothing.
fn free_contraction(prepared: &Prepared, pressure: f64) -> Option<f64> {
    let l0 = prepared.braid.rest_length();
    let end = (1.3 * prepared.points.stroke.high / l0).min(prepared.braid.neutral_contraction());
    let force = |c: f64| prepared.quasi(pressure, c * l0);
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
