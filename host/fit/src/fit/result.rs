//! The result of a fit: the table, its errors and its summary.

use model_core::muscle::Muscle;
use model_core::table::{Kind as TableKind, MuscleTable, Tested};
use model_core::units::{Force, Length, Pressure};

use crate::error::FitCode;
use crate::table_faults::{far_from_measured, table_faults};
use crate::table_file::{About, TableFile, Uncertainty, stored_mountings};
use pam_data::error::{Error, Result};
use pam_data::muscle_description::{Kind, MuscleDescription};
use pam_data::progress::Progress;
use pam_data::recording::Campaign;

use super::Options;
use super::cross_validation::predict_left_out;
use super::errors::{ChunkError, chunks};
use super::midline::{MidPoint, midline};
use super::models::{self, Model};
use super::solution::Solution;
use super::summary::{ModelError, Results, Summary, summarise};
use super::table_friction::with_friction;
use super::uncertainty::{Uncertain, jackknife, table_root};
use crate::numerics::covariance_root::CovarianceRoot;

/// A finished fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The table as the controller gets it.
    pub table: MuscleTable,
    /// The solved problem behind it.
    pub solution: Solution,
    /// The uncertainty of the parameters.
    pub uncertain: Uncertain,
    /// Root of the covariance of the table's numbers: `P0`, `E_k` at the nodes, `k_F` at the nodes.
    pub table_root: CovarianceRoot,
    /// The error of every chunk by eq. 24, percent of blocked force.
    pub chunks: Vec<ChunkError>,
    /// The mid-line of the hysteresis loop (F_AVG), chunk by chunk.
    pub midline: Vec<MidPoint>,
    /// The models to compare with, on the mid-lines.
    pub models: Vec<Model>,
    /// The figures, as they are written to JSON.
    pub summary: Summary,
}

impl Fit {
    /// Derives table, uncertainty, errors and summary from a solution.
    ///
    /// # Errors
    /// [`FitCode::FitUnderdetermined`] where no usable table comes out.
    pub fn of(
        solution: Solution,
        campaign: &Campaign,
        muscle: &MuscleDescription,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Self> {
        progress.stage("jackknife of the confidence intervals", 0);
        let table = table(&solution, muscle)?;
        let Solution { problem, screen, weights, parameters, .. } = &solution;
        let data = problem.design.normal(parameters, weights);
        let equations = (&data, &problem.penalty(&data, solution.smoothing));
        let uncertain = jackknife(problem, screen, weights, parameters, equations, solution.deadband_std);
        let table_root = table_root(&solution, &uncertain.root, &solution.problem.pressures.nodes);
        let residuals = table_residuals(&solution, &table)?;
        let chunks = chunks(&solution, &residuals, |_| true);
        let left_out = predict_left_out(&solution, options, progress);
        progress.stage("comparing the models", 0);
        let midline = midline(&solution);
        let modulus = muscle.young_modulus();
        let models = models::side_by_side(&solution, &midline, modulus);
        let results = Results {
            table: &table,
            uncertain: &uncertain,
            residuals: &residuals,
            chunks: &chunks,
            left_out: &left_out,
        };
        let mut summary = summarise(&solution, campaign, muscle, &results);
        summary.models.splice(
            0..0,
            models.iter().map(|m| ModelError {
                name: m.name.into(),
                mean_error_pct: m.mean_error,
                max_error_pct: m.max_error,
            }),
        );
        let mut fit = Self { table, solution, uncertain, table_root, chunks, midline, models, summary };
        let quality = fit.summary.quality();
        fit.summary.faults = table_faults(&fit.table, Some(&fit.stored_uncertainty()), &quality);
        let far = far_from_measured(&quality, fit.summary.blocked_force_N, fit.summary.largest_force_N);
        fit.summary.faults.extend(far);
        Ok(fit)
    }
}

impl Fit {
    /// The table as a file keeps it, with all that the fit says of it. Date, sources and corrections are the caller's.
    #[must_use]
    pub fn table_file(&self, tool: String) -> TableFile {
        let about = About {
            muscle: self.summary.muscle.clone(),
            tool,
            fit: self.summary.quality(),
            uncertainty: Some(self.stored_uncertainty()),
            mountings: stored_mountings(&self.solution.problem),
            ..About::default()
        };
        TableFile { table: self.table.clone(), about }
    }

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

/// The largest force of a muscle as a share of what its braid alone would make of the pressure; deadband and elasticity reduce it.
const SHARE_OF_BRAID: (f64, f64) = (0.2, 2.0);

impl Solution {
    /// The force as a share of what such a braid makes of the pressure, where no muscle has that share.
    fn unusual_share(&self) -> Option<f64> {
        self.problem.share_of_braid().filter(|s| !(SHARE_OF_BRAID.0..SHARE_OF_BRAID.1).contains(s))
    }

    /// What is wrong where the force is not what such a braid makes of the pressure: units or dimensions. `None` where it is usual.
    #[must_use]
    pub fn unusual_share_of_braid(&self) -> Option<String> {
        let (least, most) = SHARE_OF_BRAID;
        let share = self.unusual_share()?;
        Some(format!(
            "the force is {share:.2} times what the described braid makes of the recorded pressure; {least} to {most} is usual: check the \
             units of force and pressure, and the muscle's dimensions"
        ))
    }
}

/// The table's numbers from the solution, checked.
///
/// # Errors
/// [`FitCode::FitUnderdetermined`] where no usable table comes out.
pub(super) fn table(solution: &Solution, muscle: &MuscleDescription) -> Result<MuscleTable> {
    let unusable = |what: &str| {
        let units = solution.unusual_share().map(|s| {
            let times = if s > 0.1 { format!("{s:.1} times") } else { format!("{s:.1e} times") };
            format!("the force is {times} what this braid makes of the recorded pressure: ")
        });
        Error::new(FitCode::FitUnderdetermined, format!("the recordings give no usable table: {what}")).help(format!(
            "{}check the muscle's dimensions and the units of the recordings, or record longer strokes and more pressures",
            units.unwrap_or_default()
        ))
    };
    let nodes = &solution.problem.pressures.nodes;
    let at: Vec<(Vec<f64>, f64)> = nodes.iter().map(|p| solution.curves_at(*p)).collect();
    let order = solution.problem.design.layout().order;
    let elastic = (0..order).map(|k| at.iter().map(|(e, _)| e[k] as f32).collect()).collect();
    let max_pressure = muscle.max_pressure_kPa.map_or(solution.problem.points.pressure.high, |kpa| kpa * 1e3);
    let last = solution.problem.pressures.levels.last().copied().filter(|_| solution.problem.pressures.held);
    let highest = last.unwrap_or(solution.problem.points.pressure.high);
    let l0 = solution.problem.braid.rest_length();
    let (range, stroke) = (solution.problem.points.pressure, solution.problem.points.stroke);
    let table = MuscleTable {
        kind: match muscle.kind {
            Kind::Contractile => TableKind::Contractile,
            Kind::Push => TableKind::Push,
        },
        geometry: solution.problem.geometry.cast(),
        deadband: Pressure::from_pascals(solution.deadband() as f32),
        goes_slack: solution.screen.goes_slack,
        nodes: nodes.iter().map(|p| *p as f32).collect(),
        elastic,
        friction: heapless::Vec::new(),
        tested: Tested {
            pressure_low: Pressure::from_pascals(range.low as f32),
            pressure_high: Pressure::from_pascals(range.high as f32),
            contraction_low: (stroke.low / l0) as f32,
            contraction_high: (stroke.high / l0) as f32,
        },
        max_pressure: Pressure::from_pascals(max_pressure as f32),
        blocked_force: Force::from_newtons(solution.blocked(highest) as f32),
        effects: heapless::Vec::new(),
    };
    let friction: Vec<f64> = at.iter().map(|(_, k)| *k).collect();
    with_friction(table, &friction).map_err(|e| unusable(&e.to_string()))
}

/// `F − F_model` of every point by the table itself, as the controller would have it, N.
fn table_residuals(solution: &Solution, table: &MuscleTable) -> Result<Vec<f64>> {
    let muscle =
        Muscle::<f64>::build(table).map_err(|e| Error::new(FitCode::FitUnderdetermined, e.to_string()))?;
    let directed = solution.problem.design.friction;
    Ok(solution
        .problem
        .points
        .list
        .iter()
        .zip(&solution.problem.shift)
        .map(|(p, shift)| {
            let direction = if directed { p.direction } else { 0.0 };
            let stroke = Length::from_metres(p.stroke + shift);
            let model = muscle.force(Pressure::from_pascals(p.pressure), stroke, direction);
            p.force - model.newtons()
        })
        .collect())
}
