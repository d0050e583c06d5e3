//! What a fit gives: the table, its errors, and what is said about it.

use model_core::muscle::Muscle;
use model_core::table::{Kind as TableKind, MuscleTable, Tested};
use model_core::units::{Force, Length, Pressure};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Code, Error, Result};
use crate::muscle_description::{Kind, MuscleDescription};
use crate::recording::Campaign;
use crate::table_file::{FitQuality, Uncertainty};

use super::Options;
use super::errors::{ChunkError, Sample, by_chunk, errors};
use super::geometry::Adjusted;
use super::midline::{MidPoint, midline};
use super::models::{self, Model};
use super::prepare::Prepared;
use super::screen::Use;
use super::smoothing;
use super::uncertainty::{self, Root, Uncertain};

/// A finished fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// What the controller gets.
    pub table: MuscleTable,
    /// The solved problem behind it.
    pub prepared: Prepared,
    /// How uncertain the parameters are.
    pub uncertain: Uncertain,
    /// Root of the covariance of the table's numbers: `P0`, `E_k` at the nodes, `k_F` at the nodes.
    pub table_root: Root,
    /// Every chunk's error by eq. 24.
    pub chunks: Vec<ChunkError>,
    /// F_AVG, chunk by chunk.
    pub midline: Vec<MidPoint>,
    /// Every model on the mid-lines.
    pub models: Vec<Model>,
    /// The figures, as they are written to JSON.
    pub summary: Summary,
}

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

impl Fit {
    /// Draws everything from a solved problem.
    ///
    /// # Errors
    /// [`Code::FitUnderdetermined`] where no usable table comes out.
    pub fn of(
        prepared: Prepared,
        campaign: &Campaign,
        muscle: &MuscleDescription,
        options: &Options,
    ) -> Result<Self> {
        let table = table(&prepared, muscle)?;
        let data = prepared.design.normal(&prepared.parameters, &prepared.weights);
        let penalty = prepared.design.penalty(&data, prepared.smoothing.elastic, prepared.smoothing.friction);
        let uncertain = uncertainty::jackknife(&prepared, &penalty);
        let table_root = uncertainty::of_table(&prepared, &uncertain.root, &prepared.pressures.nodes);
        let residuals = table_residuals(&prepared, &table)?;
        let chunks = chunks(&prepared, &residuals, |_| true);
        let left_out = left_out(&prepared, options);
        let midline = midline(&prepared);
        let modulus = muscle.young_modulus_MPa.map(|e| e * 1e6);
        let models = models::side_by_side(&prepared, &midline, modulus);
        let mut summary =
            summarise(&prepared, &table, campaign, muscle, &uncertain, &residuals, &chunks, &left_out);
        summary.models.splice(
            0..0,
            models.iter().map(|m| ModelError {
                name: m.name.into(),
                mean_error_pct: m.mean_error,
                max_error_pct: m.max_error,
            }),
        );
        Ok(Self { table, prepared, uncertain, table_root, chunks, midline, models, summary })
    }
}

impl Fit {
    /// The uncertainty as a table file keeps it: no more columns than numbers.
    #[must_use]
    pub fn stored_uncertainty(&self) -> Uncertainty {
        let root = self.table_root.compact();
        Uncertainty {
            rows: root.rows as u32,
            columns: root.columns as u32,
            root: root.s,
            residual_newtons: self.summary.rms_N,
        }
    }
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
        writeln!(
            f,
            "{}: {} rows, P0 {:.1} ± {:.1} kPa, blocked force {:.1} N, rms {:.3} N",
            self.muscle,
            self.samples,
            self.deadband_kPa,
            1.96 * self.deadband_std_kPa,
            self.blocked_force_N,
            self.rms_N
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

/// The table's numbers from the solution, checked.
fn table(prepared: &Prepared, muscle: &MuscleDescription) -> Result<MuscleTable> {
    let unusable = |what: &str| {
        Error::new(Code::FitUnderdetermined, format!("the recordings lead to no usable table: {what}"))
            .help("check the muscle's dimensions and the recording's units; a longer stroke or more pressures determine more")
    };
    let nodes = &prepared.pressures.nodes;
    let at: Vec<(Vec<f64>, f64)> = nodes.iter().map(|p| prepared.curves_at(*p)).collect();
    let order = prepared.design.layout().order;
    let elastic = (0..order).map(|k| at.iter().map(|(e, _)| e[k] as f32).collect()).collect();
    let max_pressure = muscle.max_pressure_kPa.map_or(prepared.points.pressure.high, |kpa| kpa * 1e3);
    let last = prepared.pressures.levels.last().copied().filter(|_| prepared.pressures.held);
    let highest = last.unwrap_or(prepared.points.pressure.high);
    let l0 = prepared.braid.rest_length();
    let (range, stroke) = (prepared.points.pressure, prepared.points.stroke);
    let table = MuscleTable {
        kind: match muscle.kind {
            Kind::Contractile => TableKind::Contractile,
            Kind::Push => TableKind::Push,
        },
        geometry: prepared.geometry.cast(),
        deadband: Pressure::from_pascals(prepared.deadband() as f32),
        goes_slack: prepared.goes_slack,
        nodes: nodes.iter().map(|p| *p as f32).collect(),
        elastic,
        friction: at.iter().map(|(_, k)| k.clamp(-0.5, 0.95) as f32).collect(),
        tested: Tested {
            pressure_low: Pressure::from_pascals(range.low as f32),
            pressure_high: Pressure::from_pascals(range.high as f32),
            contraction_low: (stroke.low / l0) as f32,
            contraction_high: (stroke.high / l0) as f32,
        },
        max_pressure: Pressure::from_pascals(max_pressure as f32),
        blocked_force: Force::from_newtons(prepared.blocked(highest) as f32),
        effects: heapless::Vec::new(),
    };
    table.check().map_err(|e| unusable(&e.to_string()))?;
    Ok(table)
}

/// `F − F_model` of every point by the table itself, as the controller would have it, N.
fn table_residuals(prepared: &Prepared, table: &MuscleTable) -> Result<Vec<f64>> {
    let muscle =
        Muscle::<f64>::build(table).map_err(|e| Error::new(Code::FitUnderdetermined, e.to_string()))?;
    let directed = prepared.design.friction;
    Ok(prepared
        .points
        .list
        .iter()
        .zip(&prepared.shift)
        .map(|(p, shift)| {
            let direction = if directed { p.direction } else { 0.0 };
            let stroke = Length::from_metres(p.stroke + shift);
            let model = muscle.force(Pressure::from_pascals(p.pressure), stroke, direction);
            p.force - model.newtons()
        })
        .collect())
}

/// Errors by eq. 24 of points that took part and that `take` accepts.
pub fn chunks(prepared: &Prepared, residuals: &[f64], take: impl Fn(u32) -> bool) -> Vec<ChunkError> {
    let l0 = prepared.braid.rest_length();
    let pressure = prepared.points.pressure;
    let least = 0.05 * prepared.blocked(pressure.high).abs();
    let samples = (0..prepared.points.list.len()).filter_map(|i| {
        let p = &prepared.points.list[i];
        let group = prepared.design.bins[prepared.design.rows[i].bin as usize].group;
        (prepared.counts(i) && take(group)).then(|| Sample {
            group,
            fine: prepared.fine_pressure(p.pressure),
            contraction: (p.stroke + prepared.shift[i]) / l0,
            direction: p.direction,
            rows: f64::from(p.rows),
            residual: residuals[i],
            // Below the deadband there is no blocked force to compare with.
            blocked: prepared.blocked(p.pressure).max(least),
        })
    });
    by_chunk(samples)
}

/// Each tested pressure predicted from the others by refitting without it, its smoothing chosen anew. Per group, the mean
/// error.
fn left_out(prepared: &Prepared, options: &Options) -> Vec<Option<f64>> {
    let groups = prepared.design.groups;
    let used: Vec<bool> = {
        let mut used = vec![false; groups];
        for (row, w) in prepared.design.rows.iter().zip(&prepared.weights) {
            used[prepared.design.bins[row.bin as usize].group as usize] |= *w > 0.0;
        }
        used
    };
    if used.iter().filter(|u| **u).count() < 2 {
        return vec![None; groups];
    }
    (0..groups)
        .into_par_iter()
        .map(|g| {
            if !used[g] {
                return None;
            }
            let weights: Vec<f64> = prepared
                .design
                .rows
                .iter()
                .zip(&prepared.weights)
                .map(
                    |(row, w)| {
                        if prepared.design.bins[row.bin as usize].group as usize == g { 0.0 } else { *w }
                    },
                )
                .collect();
            let mut parameters = prepared.parameters.clone();
            let smoothing = if options.smoothing.is_some() {
                prepared.smoothing
            } else {
                smoothing::choose(&prepared.design, &parameters, &weights).0
            };
            let data = prepared.design.normal(&parameters, &weights);
            let penalty = prepared.design.penalty(&data, smoothing.elastic, smoothing.friction);
            prepared.design.solve(&mut parameters, &weights, &penalty, 6);
            let residuals = prepared.design.residuals(&parameters);
            let chunks = chunks(prepared, &residuals, |group| group as usize == g);
            (!chunks.is_empty()).then(|| errors(&chunks, |_| true).mean)
        })
        .collect()
}

#[allow(clippy::too_many_arguments)] // Everything that was found flows into one summary.
fn summarise(
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
        outliers,
        adjusted: prepared.adjusted.clone(),
        warnings: super::warnings::warnings(prepared, left_out),
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
