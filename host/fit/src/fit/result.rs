//! What a fit gives: the table, its errors, and what is said about it.

use model_core::muscle::Muscle;
use model_core::table::{Kind as TableKind, MuscleTable, Tested};
use model_core::units::{Force, Length, Pressure};

use crate::error::FitCode;
use crate::table_file::Uncertainty;
use pam_data::error::{Error, Result};
use pam_data::muscle_description::{Kind, MuscleDescription};
use pam_data::progress::Progress;
use pam_data::recording::Campaign;

use super::Options;
use super::errors::{ChunkError, chunks};
use super::left_out::left_out;
use super::midline::{MidPoint, midline};
use super::models::{self, Model};
use super::prepared::Prepared;
use super::summary::{ModelError, Summary, summarise};
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

impl Fit {
    /// Draws everything from a solved problem.
    ///
    /// # Errors
    /// [`FitCode::FitUnderdetermined`] where no usable table comes out.
    pub fn of(
        prepared: Prepared,
        campaign: &Campaign,
        muscle: &MuscleDescription,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Self> {
        progress.stage("leaving out stretches, for the intervals", 0);
        let table = table(&prepared, muscle)?;
        let data = prepared.design.normal(&prepared.parameters, &prepared.weights);
        let penalty = prepared.design.penalty(&data, prepared.smoothing.elastic, prepared.smoothing.friction);
        let uncertain = uncertainty::jackknife(&prepared, &penalty);
        let table_root = uncertainty::of_table(&prepared, &uncertain.root, &prepared.pressures.nodes);
        let residuals = table_residuals(&prepared, &table)?;
        let chunks = chunks(&prepared, &residuals, |_| true);
        let left_out = left_out(&prepared, options, progress);
        progress.stage("comparing the models", 0);
        let midline = midline(&prepared);
        let modulus = muscle.young_modulus();
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

/// What a muscle pulls where it pulls most, as a share of what its braid alone makes of the pressure; deadband and elasticity take from it.
const POSSIBLE: (f64, f64) = (0.2, 2.0);

/// The table's numbers from the solution, checked.
fn table(prepared: &Prepared, muscle: &MuscleDescription) -> Result<MuscleTable> {
    let unusable = |what: &str| {
        let share = prepared.share_of_braid();
        let units = share.filter(|s| !(POSSIBLE.0..POSSIBLE.1).contains(s)).map(|s| {
            let times = if s > 0.1 { format!("{s:.1} times") } else { format!("{s:.1e} times") };
            format!("the force is {times} what this braid makes of the pressure that was read: ")
        });
        Error::new(FitCode::FitUnderdetermined, format!("the recordings lead to no usable table: {what}")).help(format!(
            "{}check the muscle's dimensions and the recording's units; a longer stroke or more pressures determine more",
            units.unwrap_or_default()
        ))
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
        Muscle::<f64>::build(table).map_err(|e| Error::new(FitCode::FitUnderdetermined, e.to_string()))?;
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
