//! What the model can say without any further effect: the production baseline, whose tables are free over pressure, and
//! the stiff one, which knows a single bladder.
//!
//! ```text
//! F = ( (P − P0) g + Σ_k E_k(P) c_k ) (1 − k_F(P) s) + effects
//! ```
//! The flexible tables swallow physics (static effects lose more than 97 % of their trace in them); the stiff baseline keeps
//! it, but is itself wrong where a real bladder is. Both are linear once `k_F` is linearised about the last iterate, so a fit
//! is three or four orthogonal least-squares solutions.

use model_core::spline;
use rayon::prelude::*;

use super::linear::{Basis, dot, energy, weighted};
use super::rows::{ORDERS, Rows, YEOH};

/// Which baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `E_1…E_M` and `k_F` free at each pressure level.
    Flexible(usize),
    /// One bladder for all pressures: `E_1…E_6` and a Yeoh wall without pressure in them, `k_F` quadratic in pressure.
    Stiff,
}

/// A fitted baseline, with effects that were fitted beside it.
#[derive(Clone, Debug)]
pub(crate) struct Baseline {
    /// Which.
    pub kind: Kind,
    /// Basis of the baseline's own columns (and of the effects fitted beside it), weighted.
    pub basis: Basis,
    /// Measured less fitted, times the square root of the weight, N.
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
}

impl Baseline {
    /// Weighted root mean square of the residual, N.
    pub(crate) fn rms(&self, rows: &Rows) -> f64 {
        (energy(&self.residual) / energy(&rows.root_weight).max(1e-12)).sqrt()
    }
}

/// The cardinal functions of the natural spline on the levels, at pressure `p` (held at the ends).
fn cardinal(levels: &[f64], cubics: &[[spline::Cubic<f64>; spline::MAX_PIECES]], p: f64, out: &mut [f64]) {
    let places = spline::Nodes::<f64>::new(levels);
    let piece = places.place(p);
    for (o, c) in out.iter_mut().zip(cubics) {
        *o = spline::value(&c[piece], p - places.origin(piece));
    }
}

fn cardinal_cubics(levels: &[f64]) -> Vec<[spline::Cubic<f64>; spline::MAX_PIECES]> {
    (0..levels.len())
        .map(|j| {
            let unit: Vec<f64> = (0..levels.len()).map(|i| f64::from(u8::from(i == j))).collect();
            spline::Nodes::<f64>::pieces(levels, &unit)
        })
        .collect()
}

/// Pressure functions for the elastic and for the friction part, row by row.
struct OverPressure {
    elastic: Vec<Vec<f64>>,
    friction: Vec<Vec<f64>>,
}

fn over_pressure(rows: &Rows, kind: Kind) -> OverPressure {
    let n = rows.len();
    match kind {
        Kind::Flexible(_) => {
            let levels = &rows.levels;
            let cubics = cardinal_cubics(levels);
            let mut functions = vec![vec![0.0; n]; levels.len()];
            let mut at = vec![0.0; levels.len()];
            for i in 0..n {
                cardinal(levels, &cubics, rows.contexts[i].pressure, &mut at);
                for (f, a) in functions.iter_mut().zip(&at) {
                    f[i] = *a;
                }
            }
            OverPressure { elastic: functions.clone(), friction: functions }
        }
        Kind::Stiff => {
            let (lo, hi) =
                (rows.levels.first().copied().unwrap_or(0.0), rows.levels.last().copied().unwrap_or(1.0));
            let u = |p: f64| if hi > lo { (2.0 * (p - lo) / (hi - lo) - 1.0).clamp(-1.2, 1.2) } else { 0.0 };
            let degree = rows.levels.len().clamp(1, 3);
            let friction = (0..degree)
                .map(|d| rows.contexts.iter().map(|c| u(c.pressure).powi(d as i32)).collect())
                .collect();
            OverPressure { elastic: vec![vec![1.0; n]], friction }
        }
    }
}

/// Where the friction's coefficients begin in a solution: behind `P0`, the elastic and the Yeoh ones.
fn first_friction_of(order: usize, per_order: usize, yeoh: usize) -> usize {
    1 + order * per_order + yeoh
}

/// Fits a baseline together with given effect columns (N per unit amplitude, unweighted).
pub(crate) fn fit(rows: &Rows, kind: Kind, effects: &[Vec<f64>]) -> Baseline {
    let n = rows.len();
    let functions = over_pressure(rows, kind);
    let order = match kind {
        Kind::Flexible(m) => m.clamp(1, ORDERS),
        Kind::Stiff => ORDERS,
    };
    let yeoh = if kind == Kind::Stiff { YEOH } else { 0 };
    let per_order = functions.elastic.len();
    let live: Vec<f64> = rows.vented.iter().map(|v| if *v { 0.0 } else { 1.0 }).collect();

    let mut friction = vec![0.0; n];
    let mut friction_coefficients = vec![0.0; functions.friction.len()];
    let mut quasi: Vec<f64> = rows.contexts.iter().map(|c| c.pressure * c.area).collect();
    let mut out: Option<Baseline> = None;
    for _ in 0..4 {
        let factor: Vec<f64> =
            (0..n).map(|i| live[i] * (1.0 - friction[i] * rows.contexts[i].direction)).collect();
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(2 + order * per_order + yeoh + effects.len());
        columns.push((0..n).map(|i| -factor[i] * rows.shapes[i].area).collect());
        for k in 0..order {
            for f in &functions.elastic {
                columns.push((0..n).map(|i| factor[i] * rows.shapes[i].elastic[k] * f[i]).collect());
            }
        }
        for k in 0..yeoh {
            columns.push((0..n).map(|i| factor[i] * rows.shapes[i].yeoh[k]).collect());
        }
        for f in &functions.friction {
            columns.push((0..n).map(|i| -live[i] * rows.contexts[i].direction * quasi[i] * f[i]).collect());
        }
        // At a few held lengths a tenth of a degree in the braid's angle, or a millimetre in the mounting, cannot be told from a
        // scale of the effective area; where the muscle moves it shows in the shape and is held against the geometry.
        let scaled = rows.isometric;
        if scaled {
            columns
                .push((0..n).map(|i| factor[i] * rows.shapes[i].area * rows.contexts[i].pressure).collect());
            columns.push(
                (0..n).map(|i| factor[i] * rows.shapes[i].area_slope * rows.contexts[i].pressure).collect(),
            );
        }
        // A settling that is not quite exponential.
        let settles = rows.settling.iter().any(|s| *s != 0.0);
        if settles {
            columns.push((0..n).map(|i| -live[i] * rows.sign[i] * quasi[i] * rows.settling[i]).collect());
        }
        let own = columns.len();
        columns.extend(effects.iter().cloned());
        let y: Vec<f64> = (0..n)
            .map(|i| {
                (rows.force[i] - factor[i] * rows.shapes[i].area * rows.contexts[i].pressure)
                    * rows.root_weight[i]
            })
            .collect();
        let basis = Basis::new(&columns, &rows.root_weight);
        let solution = basis.solve(&y);
        let deadband = solution[0];
        // The model itself, not its linearisation, is what the residual is taken from.
        let first_friction = first_friction_of(order, per_order, yeoh);
        let settling_share = if settles { solution[own - 1] } else { 0.0 };
        let first_scale = first_friction_of(order, per_order, yeoh) + functions.friction.len();
        let scale = if scaled { [solution[first_scale], solution[first_scale + 1]] } else { [0.0; 2] };
        for (c, d) in friction_coefficients
            .iter_mut()
            .zip(&solution[first_friction..first_friction + functions.friction.len()])
        {
            *c += d;
        }
        let mut gaylord = vec![0.0; n];
        let mut stiffness = vec![0.0; n];
        for i in 0..n {
            let (shape, p) = (&rows.shapes[i], rows.contexts[i].pressure);
            gaylord[i] = (p - deadband + scale[0] * p) * shape.area + scale[1] * p * shape.area_slope;
            stiffness[i] = (p - deadband + scale[0] * p) * shape.area_slope;
            let mut elastic = 0.0;
            for k in 0..order {
                let e: f64 = functions
                    .elastic
                    .iter()
                    .enumerate()
                    .map(|(j, f)| solution[1 + k * per_order + j] * f[i])
                    .sum();
                elastic += e * shape.elastic[k];
                stiffness[i] += e * shape.elastic_slope[k];
            }
            for k in 0..yeoh {
                let c = solution[1 + order * per_order + k];
                elastic += c * shape.yeoh[k];
                stiffness[i] += c * shape.yeoh_slope[k];
            }
            quasi[i] = gaylord[i] + elastic;
            let k_f: f64 = functions.friction.iter().zip(&friction_coefficients).map(|(f, c)| f[i] * c).sum();
            friction[i] = k_f.clamp(-0.4, 0.8);
        }
        let amplitudes = solution[own..].to_vec();
        let raw_residual: Vec<f64> = (0..n)
            .map(|i| {
                let settling = if settles { settling_share * rows.sign[i] * rows.settling[i] } else { 0.0 };
                let model = live[i] * quasi[i] * (1.0 - friction[i] * rows.contexts[i].direction - settling);
                let added: f64 = effects.iter().zip(&amplitudes).map(|(e, a)| a * e[i]).sum();
                rows.force[i] - model - added
            })
            .collect();
        out = Some(Baseline {
            kind,
            basis,
            residual: weighted(&raw_residual, &rows.root_weight),
            raw_residual,
            amplitudes,
            deadband,
            quasi: quasi.clone(),
            gaylord,
            friction: friction.clone(),
            stiffness,
            elastic_nodes: (0..order)
                .map(|k| solution[1 + k * per_order..1 + (k + 1) * per_order].to_vec())
                .collect(),
            friction_nodes: friction_coefficients.clone(),
        });
    }
    let mut fitted = out.unwrap_or_else(|| unreachable!("the loop above runs"));
    // What little the linearisation left in the span of the base is no misfit.
    fitted.basis.project_out(&mut fitted.residual);
    fitted
}

/// Rows at which the muscle hangs slack (no force although the pressure would give some) lose their weight; returns how
/// many. A slack muscle's force is its floor, not the model's.
pub(crate) fn mask_slack(rows: &mut Rows, fitted: &Baseline) -> usize {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let mut masked = 0;
    for i in 0..rows.len() {
        let slack = fitted.quasi[i] < 0.015 * strongest && rows.force[i] < 0.02 * strongest;
        if slack && !rows.vented[i] && rows.root_weight[i] > 0.0 {
            rows.root_weight[i] = 0.0;
            masked += 1;
        }
    }
    masked
}

/// Settling times of friction at rest that are tried, s.
const SETTLING: [f64; 8] = [0.3, 0.7, 1.5, 3.0, 6.0, 12.0, 30.0, 100.0];

/// Lets friction fade at rest as the recordings say: `s → s e^(−t/τ)`, `t` since the braid last moved.
fn fade(rows: &mut Rows, time: f64) {
    for i in 0..rows.len() {
        let left = if rows.still[i] > 0.0 { (-rows.still[i] / time).exp() } else { 1.0 };
        rows.contexts[i].direction = rows.sign[i] * left;
        rows.settling[i] = if rows.still[i] > 0.0 { (-3.0 * rows.still[i] / time).exp() - left } else { 0.0 };
    }
}

/// Finds out whether, and how fast, the gap between the branches closes while the muscle rests. A regulator's ripple shakes the
/// braid, so that friction ends near the middle although the model holds it: that is no missing physics, but
/// without it every effect that fades at rest would be mistaken for it.
pub(crate) fn settle_friction(rows: &mut Rows) -> Option<f64> {
    rows.settling = vec![0.0; rows.len()];
    let resting = rows.still.iter().zip(&rows.root_weight).filter(|(s, w)| **s > 1.0 && **w > 0.0).count();
    if rows.isometric || resting * 50 < rows.effective() {
        return None;
    }
    let kind = Kind::Flexible(4);
    let held = energy(&fit(rows, kind, &[]).residual);
    let tried: Vec<(f64, f64)> = SETTLING
        .par_iter()
        .map(|time| {
            let mut faded = rows.clone();
            fade(&mut faded, *time);
            (*time, energy(&fit(&faded, kind, &[]).residual))
        })
        .collect();
    let (time, left) = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    if left < 0.8 * held {
        fade(rows, time);
        return Some(time);
    }
    None
}

/// Writes the baseline's forces and slopes into the rows' contexts, where effects look for them.
pub(crate) fn into_contexts(rows: &mut Rows, fitted: &Baseline) {
    for (i, c) in rows.contexts.iter_mut().enumerate() {
        let live = if rows.vented[i] { 0.0 } else { 1.0 };
        c.corrected_pressure = c.pressure - fitted.deadband;
        c.friction = fitted.friction[i];
        c.gaylord = live * fitted.gaylord[i];
        c.quasi = live * fitted.quasi[i];
        c.elastic = c.quasi - c.gaylord;
        c.stiffness = live * fitted.stiffness[i];
        c.pressure_slope = c.area;
    }
}

/// Cosine of two columns after weighting and projection.
pub(crate) fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let size = (energy(a) * energy(b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}
