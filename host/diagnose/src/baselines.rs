//! The base model without any effect: the production baseline, whose tables are free over pressure, and
//! the stiff one, which knows a single bladder.
//!
//! ```text
//! F = ( (P − P0) g + Σ_k E_k(P) c_k ) (1 − k_F(P) s) + effects
//! ```
//! The flexible tables absorb physics (static effects lose more than 97 % of their trace in them); the stiff baseline keeps
//! it, but is itself wrong where a real bladder is. Both are linear once `k_F` is linearised about the last iterate, so a fit
//! is three or four orthogonal least-squares solutions.

mod absorbable;
mod plan;
mod slack;

use std::ops::Range;

use model_core::effects::Context;
use rayon::prelude::*;

pub(crate) use self::absorbable::{Absorbable, PriorDeviations, cosine, keeps, projected, shrink};
use self::plan::{Part, Plan};
pub(crate) use self::slack::{PushedRows, without_load, without_slack};
use super::criteria::baseline::{
    CACHED_ROWS, DISTINCT_DIRECTION, FRICTION_LIMITS, LINEARISATIONS, PRODUCT_PART,
};
use super::linear::{Basis, energy, weighted};
use super::rows::{ORDERS, Rows};

/// Which baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// `E_1…E_M` and `k_F` free at each pressure level.
    Flexible(usize),
    /// One bladder for all pressures: `E_1…E_6` and a Yeoh wall without pressure in them, `k_F` quadratic in pressure.
    Stiff,
    /// One bladder that may differ a little between pressures: the stiff baseline, and beyond it the flexible one's columns with
    /// a prior of zero mean on each.
    Soft(PriorDeviations),
}

impl Kind {
    /// Whether pressures are tied together.
    pub(crate) fn reaches_over_pressures(self) -> bool {
        !matches!(self, Self::Flexible(_))
    }
}

/// A fitted baseline, with effects that were fitted beside it.
#[derive(Clone, Debug)]
pub(crate) struct Baseline {
    /// Which baseline was fitted.
    pub kind: Kind,
    /// What the baseline and the effects beside it express.
    pub span: Absorbable,
    /// What is to be explained, weighted and freed of the hard columns only.
    pub core: Vec<f64>,
    /// Measured less fitted, times the square root of the weight, whitened, N.
    pub residual: Vec<f64>,
    /// Measured less fitted on every row, N, whatever its weight.
    pub raw_residual: Vec<f64>,
    /// Amplitudes of the effects fitted beside it.
    pub amplitudes: Vec<f64>,
    /// `P0`, Pa.
    pub deadband: f64,
    /// Friction-free force of the model, N.
    pub quasi: Vec<f64>,
    /// `F_G(P′, L)`, N.
    pub gaylord: Vec<f64>,
    /// `k_F` at each row.
    pub friction: Vec<f64>,
    /// `∂F_quasi/∂(ΔL)`, N/m.
    pub stiffness: Vec<f64>,
    /// `E_k` per node (outer: k) of a flexible baseline, Pa.
    pub elastic_nodes: Vec<Vec<f64>>,
    /// `k_F` per node of a flexible baseline.
    pub friction_nodes: Vec<f64>,
    /// Shares of friction that turn over each of the changes of pressure, where the length was held throughout.
    pub turning: Vec<f64>,
    /// Places of friction in its gap, one for each stretch of [`RestFriction::rest`](crate::rows::RestFriction), beyond what the model holds.
    pub places: Vec<f64>,
}

impl Baseline {
    /// Weighted root mean square of the residual, N.
    pub(crate) fn rms(&self, rows: &Rows) -> f64 {
        self.per_row(rows).sqrt()
    }

    /// Weighted mean square of the residual, N².
    pub(crate) fn per_row(&self, rows: &Rows) -> f64 {
        energy(&self.residual) / energy(rows.root_weight()).max(1e-12)
    }
}

/// Weighted root mean square of the measured force itself, N: the error of a model that always predicts zero.
pub(crate) fn measured_rms(rows: &Rows) -> f64 {
    let sum: f64 = rows.force.iter().zip(rows.root_weight()).map(|(f, w)| (f * w).powi(2)).sum();
    (sum / energy(rows.root_weight()).max(1e-12)).sqrt()
}

/// What friction and friction-free force a round of the fit is linearised about.
struct Iterate {
    friction: Vec<f64>,
    quasi: Vec<f64>,
}

/// Fits a baseline together with given effect columns (N per unit amplitude, unweighted).
///
/// It begins from the model that the rows are linearised about, where there is one.
pub(crate) fn fit(rows: &Rows, kind: Kind, effects: &[Vec<f64>]) -> Baseline {
    let plan = Plan::new(rows, kind);
    let live: Vec<f64> = rows.vented.iter().map(|v| if *v { 0.0 } else { 1.0 }).collect();
    let contexts = rows.contexts();
    let begun = contexts.iter().any(|c| c.quasi != 0.0);
    let first = Iterate {
        friction: contexts.iter().map(|c| c.friction).collect(),
        quasi: contexts.iter().map(|c| if begun { c.quasi } else { c.pressure * c.area }).collect(),
    };
    let mut fitted = round(rows, kind, effects, &plan, &live, &first);
    for _ in 1..if begun { LINEARISATIONS.1 } else { LINEARISATIONS.0 } {
        let about = Iterate { friction: fitted.friction, quasi: fitted.quasi };
        fitted = round(rows, kind, effects, &plan, &live, &about);
    }
    fitted.span.chosen.project_out(&mut fitted.residual);
    fitted
}

/// A weighted column, from the first row that it covers; it is zero on all others.
type Covering = (usize, Vec<f64>);

/// One column of a baseline.
fn column(rows: &Rows, plan: &Plan, live: &[f64], at: &Iterate, factor: &[f64], part: &Part) -> Covering {
    let (shapes, contexts, w) = (&rows.shapes, rows.contexts(), rows.root_weight());
    let Iterate { friction, quasi } = at;
    let rubbing = |i: usize| -live[i] * friction[i] * quasi[i];
    let whole = match *part {
        Part::Rest(from, to) => {
            let to = to.min(rows.len());
            return (from, (from..to).map(|i| rubbing(i) * part.departure(rows, i) * w[i]).collect());
        }
        Part::Deadband => weighted_rows(w, |i| -factor[i] * shapes[i].area),
        Part::Elastic(k, f) => weighted_rows(w, |i| factor[i] * shapes[i].elastic[k] * plan.functions[f][i]),
        Part::Yeoh(k) => weighted_rows(w, |i| factor[i] * shapes[i].yeoh[k]),
        Part::Friction(f) => {
            weighted_rows(w, |i| -live[i] * contexts[i].direction * quasi[i] * plan.functions[f][i])
        }
        Part::Area => weighted_rows(w, |i| factor[i] * shapes[i].area * contexts[i].pressure),
        Part::AreaSlope => weighted_rows(w, |i| factor[i] * shapes[i].area_slope * contexts[i].pressure),
        Part::Settling => {
            weighted_rows(w, |i| -live[i] * rows.sign[i] * quasi[i] * rows.at_rest().settling[i])
        }
        Part::Unsettled | Part::Ramping | Part::Turning(_) => {
            weighted_rows(w, |i| rubbing(i) * part.departure(rows, i))
        }
    };
    (0, whole)
}

/// A value of each row times the root of the row's weight.
fn weighted_rows(root_weight: &[f64], value: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    let weighted = |(i, w): (usize, &f64)| value(i) * w;
    if root_weight.len() <= PRODUCT_PART {
        root_weight.iter().enumerate().map(weighted).collect()
    } else {
        root_weight.par_iter().enumerate().map(weighted).collect()
    }
}

/// What the baseline and the effects beside it express, and the basis of all its columns.
fn column_space(
    rows: &Rows,
    kind: Kind,
    effects: &[Vec<f64>],
    plan: &Plan,
    column: impl Fn(&Part) -> Covering,
) -> (Absorbable, Basis) {
    let mut joint = Basis::default();
    for part in &plan.hard {
        let (from, values) = column(part);
        if values.len() == rows.len() {
            joint.push(values);
        } else {
            joint.push_stretch(from, values, rows.len());
        }
    }
    let hard = joint.clone();
    for part in &plan.soft {
        joint.push_beyond(column(part).1, DISTINCT_DIRECTION);
    }
    let soft = joint.columns(hard.rank(), rows.len());
    let of_friction: Vec<bool> = joint.kept()[hard.rank()..]
        .iter()
        .map(|j| matches!(plan.soft[j - plan.hard.len()], Part::Friction(_)))
        .collect();
    let keep = match kind {
        Kind::Soft(prior) => keeps(prior, &of_friction, energy(rows.root_weight())),
        _ => Vec::new(),
    };
    let mut span = Absorbable { hard, soft, of_friction, keep, ..Absorbable::default() };
    for effect in effects {
        let mut core = weighted(effect, rows.root_weight());
        span.hard.project_out(&mut core);
        let mut z = core.clone();
        span.whiten(&mut z);
        span.chosen.push(z);
        span.chosen_core.push(core);
    }
    (span, joint)
}

/// One round of the fit: least squares with the friction linearised about the last round.
fn round(rows: &Rows, kind: Kind, effects: &[Vec<f64>], plan: &Plan, live: &[f64], at: &Iterate) -> Baseline {
    let n = rows.len();
    let (contexts, w) = (rows.contexts(), rows.root_weight());
    let Iterate { friction, quasi } = at;
    let factor: Vec<f64> = (0..n).map(|i| live[i] * (1.0 - friction[i] * contexts[i].direction)).collect();
    let (span, joint) = column_space(rows, kind, effects, plan, |p| column(rows, plan, live, at, &factor, p));
    // With friction's coefficients counted from zero, not from the last round, so that a prior holds for the whole.
    let y: Vec<f64> = (0..n)
        .map(|i| {
            let pressed = factor[i] * rows.shapes[i].area * contexts[i].pressure;
            let rubbed = live[i] * contexts[i].direction * quasi[i] * friction[i];
            (rows.force[i] - pressed - rubbed) * w[i]
        })
        .collect();
    let mut white = y.clone();
    span.whiten(&mut white);
    let amplitudes = span.chosen.solve(&white);
    let mut freed = y.clone();
    for (effect, a) in effects.iter().zip(&amplitudes) {
        for i in 0..n {
            freed[i] -= a * effect[i] * w[i];
        }
    }
    let mut core = y;
    span.hard.project_out(&mut core);
    let mut coefficients = joint.along(&freed);
    for (c, keep) in coefficients[span.hard.rank()..].iter_mut().zip(&span.keep) {
        *c *= 1.0 - keep * keep;
    }
    let solution = joint.unravel(&coefficients);
    let fitted = values(rows, plan, &solution, live);
    let raw_residual: Vec<f64> = (0..n)
        .map(|i| {
            let added: f64 = effects.iter().zip(&amplitudes).map(|(e, a)| a * e[i]).sum();
            rows.force[i] - fitted.force[i] - added
        })
        .collect();
    let nodes = |wanted: &dyn Fn(&Part) -> bool| -> Vec<f64> {
        plan.hard.iter().zip(&solution).filter(|(p, _)| wanted(p)).map(|(_, v)| *v).collect()
    };
    let orders = 0..ORDERS;
    Baseline {
        kind,
        residual: white,
        core,
        raw_residual,
        amplitudes,
        deadband: fitted.deadband,
        quasi: fitted.quasi,
        gaylord: fitted.gaylord,
        friction: fitted.friction,
        stiffness: fitted.stiffness,
        elastic_nodes: orders
            .map(|k| nodes(&|p| matches!(p, Part::Elastic(order, _) if *order == k)))
            .collect(),
        friction_nodes: nodes(&|p| matches!(p, Part::Friction(_))),
        turning: nodes(&|p| matches!(p, Part::Turning(_))),
        places: nodes(&|p| matches!(p, Part::Rest(..))),
        span,
    }
}

/// A baseline's forces at every row.
#[derive(Default)]
struct Values {
    force: Vec<f64>,
    quasi: Vec<f64>,
    gaylord: Vec<f64>,
    friction: Vec<f64>,
    stiffness: Vec<f64>,
    deadband: f64,
}

impl Values {
    fn zeros(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            force: zeros(),
            quasi: zeros(),
            gaylord: zeros(),
            friction: zeros(),
            stiffness: zeros(),
            deadband: 0.0,
        }
    }

    /// Rows that follow these.
    fn append(&mut self, next: &Self) {
        self.force.extend(&next.force);
        self.quasi.extend(&next.quasi);
        self.gaylord.extend(&next.gaylord);
        self.friction.extend(&next.friction);
        self.stiffness.extend(&next.stiffness);
        self.deadband = next.deadband;
    }
}

/// Rows are taken in blocks that stay in the cache while one part after the other is added.
fn values(rows: &Rows, plan: &Plan, solution: &[f64], live: &[f64]) -> Values {
    let blocks: Vec<usize> = (0..rows.len()).step_by(CACHED_ROWS).collect();
    let of =
        |from: &usize| values_within(rows, plan, solution, live, *from..(from + CACHED_ROWS).min(rows.len()));
    let found: Vec<Values> = if rows.len() <= PRODUCT_PART {
        blocks.iter().map(of).collect()
    } else {
        blocks.par_iter().map(of).collect()
    };
    let mut all = Values::default();
    found.iter().for_each(|v| all.append(v));
    all
}

fn values_within(rows: &Rows, plan: &Plan, solution: &[f64], live: &[f64], within: Range<usize>) -> Values {
    let n = within.len();
    let mut v = Values::zeros(n);
    let mut settling = 0.0;
    let (mut elastic, mut departure) = (vec![0.0; n], vec![0.0; n]);
    let (shapes, contexts) = (&rows.shapes[within.clone()], &rows.contexts()[within.clone()]);
    // How the force changes with the length differs between pressures by more than noise only where the length changes.
    let hard = plan.hard.iter().map(|part| (part, 1.0));
    let soft = plan.soft.iter().map(|part| (part, if rows.isometric { 0.0 } else { 1.0 }));
    for ((part, sloped), c) in hard.chain(soft).zip(solution).filter(|(_, c)| **c != 0.0) {
        match *part {
            Part::Deadband => {
                v.deadband = *c;
                for (i, shape) in shapes.iter().enumerate() {
                    v.gaylord[i] -= c * shape.area;
                    v.stiffness[i] -= c * shape.area_slope;
                }
            }
            Part::Elastic(k, f) => {
                for (i, (shape, f)) in shapes.iter().zip(&plan.functions[f][within.clone()]).enumerate() {
                    elastic[i] += c * f * shape.elastic[k];
                    v.stiffness[i] += sloped * c * f * shape.elastic_slope[k];
                }
            }
            Part::Yeoh(k) => {
                for (i, shape) in shapes.iter().enumerate() {
                    elastic[i] += c * shape.yeoh[k];
                    v.stiffness[i] += c * shape.yeoh_slope[k];
                }
            }
            Part::Friction(f) => {
                v.friction.iter_mut().zip(&plan.functions[f][within.clone()]).for_each(|(v, f)| *v += c * f);
            }
            Part::Area => {
                for (i, (shape, context)) in shapes.iter().zip(contexts).enumerate() {
                    v.gaylord[i] += c * context.pressure * shape.area;
                    v.stiffness[i] += c * context.pressure * shape.area_slope;
                }
            }
            Part::AreaSlope => {
                for (i, (shape, context)) in shapes.iter().zip(contexts).enumerate() {
                    v.gaylord[i] += c * context.pressure * shape.area_slope;
                }
            }
            Part::Settling => settling = *c,
            Part::Rest(from, to) if to <= within.start || from >= within.end => {}
            Part::Unsettled | Part::Rest(..) | Part::Ramping | Part::Turning(_) => {
                departure
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, d)| *d += c * part.departure(rows, within.start + i));
            }
        }
    }
    for i in 0..n {
        let (shape, context, row) = (&shapes[i], &contexts[i], within.start + i);
        v.gaylord[i] += context.pressure * shape.area;
        v.stiffness[i] += context.pressure * shape.area_slope;
        v.quasi[i] = v.gaylord[i] + elastic[i];
        v.friction[i] = v.friction[i].clamp(FRICTION_LIMITS.0, FRICTION_LIMITS.1);
        let late = settling * rows.sign[row] * rows.at_rest().settling[row];
        let direction = context.direction + departure[i];
        v.force[i] = live[row] * v.quasi[i] * (1.0 - v.friction[i] * direction - late);
    }
    v
}

/// The rows linearised about a baseline: their contexts then hold its forces and slopes, which effects use.
pub(crate) fn linearised(rows: &Rows, fitted: &Baseline) -> Rows {
    let about = |(i, c): (usize, &Context<f64>)| {
        let live = if rows.vented[i] { 0.0 } else { 1.0 };
        let (quasi, gaylord) = (live * fitted.quasi[i], live * fitted.gaylord[i]);
        Context {
            corrected_pressure: c.pressure - fitted.deadband,
            friction: fitted.friction[i],
            gaylord,
            quasi,
            elastic: quasi - gaylord,
            stiffness: live * fitted.stiffness[i],
            pressure_slope: c.area,
            ..*c
        }
    };
    rows.with_contexts(rows.contexts().iter().enumerate().map(about).collect())
}
