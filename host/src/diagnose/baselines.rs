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

use super::linear::{Basis, add_scaled, dot, energy, weighted};
use super::rows::{ORDERS, Rows, YEOH};

/// How much one bladder may differ between pressures, and how unsure a row is: what a soft baseline takes for granted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Give {
    /// Rms that the elastic surface may differ by from one pressure to the next, N.
    pub elastic: f64,
    /// The same of the friction, N.
    pub friction: f64,
    /// Standard deviation of a row by which a sum over rows is judged, N: noise times the root of how many rows are worth one.
    pub row: f64,
}

impl Give {
    /// Tables that are free at every pressure.
    pub(crate) fn free(blocked: f64) -> Self {
        Self { elastic: 1e3 * blocked, friction: 1e3 * blocked, row: 1e-3 * blocked }
    }
}

/// Which baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// `E_1…E_M` and `k_F` free at each pressure level.
    Flexible(usize),
    /// One bladder for all pressures: `E_1…E_6` and a Yeoh wall without pressure in them, `k_F` quadratic in pressure.
    Stiff,
    /// One bladder that may differ a little between pressures: the stiff baseline, and beyond it the flexible one's columns with
    /// a prior of zero mean on each.
    Soft(Give),
}

impl Kind {
    /// Whether pressures are tied together.
    pub(crate) fn reaches_over_pressures(self) -> bool {
        !matches!(self, Self::Flexible(_))
    }
}

/// What a baseline can express: fully (hard), within a prior (soft), and by effects fitted beside it.
///
/// In the soft directions a misfit is partly the bladder's own: the whitened space shrinks them by `keep`, so that inner products
/// there are those of generalised least squares with the prior integrated out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reach {
    /// Columns with free coefficients, weighted.
    pub hard: Basis,
    /// Unit directions of the flexible tables beyond, orthogonal to the hard ones.
    pub soft: Vec<Vec<f64>>,
    /// Whether a soft direction is friction's.
    pub of_friction: Vec<bool>,
    /// What remains of each soft direction.
    pub keep: Vec<f64>,
    /// The effects beside it, whitened.
    pub chosen: Basis,
    /// The effects beside it, freed of the hard columns only.
    pub chosen_core: Vec<Vec<f64>>,
}

impl Reach {
    /// Takes out of a weighted column what the baseline can express.
    pub(crate) fn project_out(&self, v: &mut [f64]) {
        self.whiten(v);
        self.chosen.project_out(v);
    }

    /// The same without the effects.
    fn whiten(&self, v: &mut [f64]) {
        self.hard.project_out(v);
        for (q, keep) in self.soft.iter().zip(&self.keep) {
            let c = dot(q, v);
            add_scaled(v, -(1.0 - keep) * c, q);
        }
    }

    /// A column's components along the soft directions.
    pub(crate) fn components(&self, v: &[f64]) -> Vec<f64> {
        self.soft.iter().map(|q| dot(q, v)).collect()
    }
}

/// Every column weighted and freed of what a baseline expresses.
pub(crate) fn projected(columns: &[Vec<f64>], root_weight: &[f64], span: &Reach) -> Vec<Vec<f64>> {
    columns
        .par_iter()
        .map(|c| {
            let mut v = weighted(c, root_weight);
            span.project_out(&mut v);
            v
        })
        .collect()
}

/// A fitted baseline, with effects that were fitted beside it.
#[derive(Clone, Debug)]
pub(crate) struct Baseline {
    /// Which.
    pub kind: Kind,
    /// What the baseline and the effects beside it express.
    pub span: Reach,
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
}

impl Baseline {
    /// Weighted root mean square of the residual, N.
    pub(crate) fn rms(&self, rows: &Rows) -> f64 {
        self.per_row(rows).sqrt()
    }

    /// Weighted mean square of the residual, N².
    pub(crate) fn per_row(&self, rows: &Rows) -> f64 {
        energy(&self.residual) / energy(&rows.root_weight).max(1e-12)
    }
}

/// Weighted root mean square of the measured force itself, N: the error of a model that knows nothing.
pub(crate) fn measured_rms(rows: &Rows) -> f64 {
    let sum: f64 = rows.force.iter().zip(&rows.root_weight).map(|(f, w)| (f * w).powi(2)).sum();
    (sum / energy(&rows.root_weight).max(1e-12)).sqrt()
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

/// One column of a baseline.
#[derive(Clone, Copy, Debug)]
enum Part {
    Deadband,
    /// `E_k` over a function of pressure: order (from 0), function.
    Elastic(usize, usize),
    Yeoh(usize),
    /// `k_F` over a function of pressure.
    Friction(usize),
    /// A scale of the effective area, and of its slope.
    Area,
    AreaSlope,
    /// A settling of friction that is not quite exponential.
    Settling,
    /// How much of friction does not settle at rest: a friction that needs speed leaves a rest's gap half closed for another reason,
    /// and what it leaves must not be taken for settling.
    Unsettled,
    /// Where in the gap between the branches friction rests over these rows: what a wandering pressure made of it nobody measured.
    Rest(usize, usize),
    /// How much further than at a turn of the stroke, or less far, friction turns while the pressure ramps at held length.
    Ramping,
}

impl Part {
    /// By how much friction's direction departs at a row from what the model holds, per unit of a part of this kind.
    fn departure(self, rows: &Rows, i: usize) -> f64 {
        match self {
            Self::Unsettled => rows.unsettled[i],
            Self::Rest(from, to) if (from..to).contains(&i) => 1.0,
            Self::Ramping if rows.on_ramp[i] => rows.sign[i],
            _ => 0.0,
        }
    }
}

/// The stretches of rows with the same number other than zero.
fn rests(of: &[u32]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let mut from = 0;
    of.chunk_by(|a, b| a == b).filter_map(move |stretch| {
        let begun = from;
        from += stretch.len();
        (stretch[0] != 0).then_some((begun, from))
    })
}

/// The columns of a baseline: those with free coefficients, those with a prior, and the functions of pressure in them.
struct Plan {
    hard: Vec<Part>,
    soft: Vec<Part>,
    functions: Vec<Vec<f64>>,
}

impl Plan {
    fn new(rows: &Rows, kind: Kind) -> Self {
        let n = rows.len();
        let mut functions = Vec::new();
        let cardinals = |functions: &mut Vec<Vec<f64>>| {
            let levels = &rows.levels;
            let cubics = cardinal_cubics(levels);
            let first = functions.len();
            functions.extend(vec![vec![0.0; n]; levels.len()]);
            let mut at = vec![0.0; levels.len()];
            for i in 0..n {
                cardinal(levels, &cubics, rows.contexts[i].pressure, &mut at);
                for (f, a) in functions[first..].iter_mut().zip(&at) {
                    f[i] = *a;
                }
            }
            first..first + levels.len()
        };
        let tables = |order: usize, over: std::ops::Range<usize>| {
            let elastic = over.clone();
            (0..order)
                .flat_map(move |k| elastic.clone().map(move |f| Part::Elastic(k, f)))
                .chain(over.map(Part::Friction))
                .collect::<Vec<Part>>()
        };
        let mut hard: Vec<Part> = rests(&rows.rest).map(|(from, to)| Part::Rest(from, to)).collect();
        hard.push(Part::Deadband);
        let mut soft = Vec::new();
        if let Kind::Flexible(order) = kind {
            let over = cardinals(&mut functions);
            hard.extend(tables(order.clamp(1, ORDERS), over));
        } else {
            let (lo, hi) =
                (rows.levels.first().copied().unwrap_or(0.0), rows.levels.last().copied().unwrap_or(1.0));
            let u = |p: f64| if hi > lo { (2.0 * (p - lo) / (hi - lo) - 1.0).clamp(-1.2, 1.2) } else { 0.0 };
            for degree in 0..rows.levels.len().clamp(1, 3) {
                functions.push(rows.contexts.iter().map(|c| u(c.pressure).powi(degree as i32)).collect());
            }
            hard.extend((0..ORDERS).map(|k| Part::Elastic(k, 0)));
            hard.extend((0..YEOH).map(Part::Yeoh));
            hard.extend((0..functions.len()).map(Part::Friction));
            if matches!(kind, Kind::Soft(_)) && rows.levels.len() > 1 {
                let over = cardinals(&mut functions);
                soft = tables(4, over);
            }
        }
        // At a few held lengths a tenth of a degree in the braid's angle, or a millimetre in the mounting, cannot be told from a
        // scale of the effective area; where the muscle moves it shows in the shape and is held against the geometry.
        if rows.isometric {
            hard.extend([Part::Area, Part::AreaSlope]);
        }
        if rows.settling.iter().any(|s| *s != 0.0) {
            hard.push(Part::Settling);
        }
        if rows.unsettled.iter().any(|u| *u != 0.0) {
            hard.push(Part::Unsettled);
        }
        if rows.on_ramp.iter().any(|r| *r) {
            hard.push(Part::Ramping);
        }
        Self { hard, soft, functions }
    }
}

/// A soft direction must stand out from the others by this share of itself.
const DISTINCT: f64 = 1e-3;

/// Fits a baseline together with given effect columns (N per unit amplitude, unweighted).
pub(crate) fn fit(rows: &Rows, kind: Kind, effects: &[Vec<f64>]) -> Baseline {
    let n = rows.len();
    let plan = Plan::new(rows, kind);
    let live: Vec<f64> = rows.vented.iter().map(|v| if *v { 0.0 } else { 1.0 }).collect();
    // From what was fitted before, where there is anything.
    let begun = rows.contexts.iter().any(|c| c.quasi != 0.0);
    let mut friction: Vec<f64> = rows.contexts.iter().map(|c| c.friction).collect();
    let mut quasi: Vec<f64> =
        rows.contexts.iter().map(|c| if begun { c.quasi } else { c.pressure * c.area }).collect();
    let mut out: Option<Baseline> = None;
    for _ in 0..if begun { 3 } else { 4 } {
        let factor: Vec<f64> =
            (0..n).map(|i| live[i] * (1.0 - friction[i] * rows.contexts[i].direction)).collect();
        let column = |part: &Part| -> Vec<f64> {
            let (shapes, contexts, w) = (&rows.shapes, &rows.contexts, &rows.root_weight);
            let of = |value: &dyn Fn(usize) -> f64| (0..n).map(|i| value(i) * w[i]).collect::<Vec<f64>>();
            match *part {
                Part::Deadband => of(&|i| -factor[i] * shapes[i].area),
                Part::Elastic(k, f) => of(&|i| factor[i] * shapes[i].elastic[k] * plan.functions[f][i]),
                Part::Yeoh(k) => of(&|i| factor[i] * shapes[i].yeoh[k]),
                Part::Friction(f) => {
                    of(&|i| -live[i] * contexts[i].direction * quasi[i] * plan.functions[f][i])
                }
                Part::Area => of(&|i| factor[i] * shapes[i].area * contexts[i].pressure),
                Part::AreaSlope => of(&|i| factor[i] * shapes[i].area_slope * contexts[i].pressure),
                Part::Settling => of(&|i| -live[i] * rows.sign[i] * quasi[i] * rows.settling[i]),
                Part::Unsettled | Part::Rest(..) | Part::Ramping => {
                    of(&|i| -live[i] * friction[i] * quasi[i] * part.departure(rows, i))
                }
            }
        };
        let mut joint = Basis::default();
        for part in &plan.hard {
            joint.push(column(part));
        }
        let hard = joint.clone();
        for part in &plan.soft {
            joint.push_beyond(column(part), DISTINCT);
        }
        let soft = joint.columns(hard.rank(), n);
        let of_friction: Vec<bool> = joint.kept()[hard.rank()..]
            .iter()
            .map(|j| matches!(plan.soft[j - plan.hard.len()], Part::Friction(_)))
            .collect();
        let keep = match kind {
            Kind::Soft(give) => keeps(give, &of_friction, energy(&rows.root_weight)),
            _ => Vec::new(),
        };
        // With friction's coefficients counted from zero, not from the last round, so that a prior holds for the whole.
        let y: Vec<f64> = (0..n)
            .map(|i| {
                let pressed = factor[i] * rows.shapes[i].area * rows.contexts[i].pressure;
                let rubbed = live[i] * rows.contexts[i].direction * quasi[i] * friction[i];
                (rows.force[i] - pressed - rubbed) * rows.root_weight[i]
            })
            .collect();
        let mut span = Reach { hard, soft, of_friction, keep, ..Reach::default() };
        let mut white = y.clone();
        span.whiten(&mut white);
        for effect in effects {
            let mut core = weighted(effect, &rows.root_weight);
            span.hard.project_out(&mut core);
            let mut z = core.clone();
            span.whiten(&mut z);
            span.chosen.push(z);
            span.chosen_core.push(core);
        }
        let amplitudes = span.chosen.solve(&white);
        let mut freed = y.clone();
        for (effect, a) in effects.iter().zip(&amplitudes) {
            for i in 0..n {
                freed[i] -= a * effect[i] * rows.root_weight[i];
            }
        }
        let mut core = y;
        span.hard.project_out(&mut core);
        let mut coefficients = joint.along(&freed);
        for (c, keep) in coefficients[span.hard.rank()..].iter_mut().zip(&span.keep) {
            *c *= 1.0 - keep * keep;
        }
        let solution = joint.unravel(&coefficients);
        let fitted = values(rows, &plan, &solution, &live);
        quasi.clone_from(&fitted.quasi);
        friction.clone_from(&fitted.friction);
        let raw_residual: Vec<f64> = (0..n)
            .map(|i| {
                let added: f64 = effects.iter().zip(&amplitudes).map(|(e, a)| a * e[i]).sum();
                rows.force[i] - fitted.force[i] - added
            })
            .collect();
        let nodes = |order: usize| -> Vec<f64> {
            let parts = plan.hard.iter().zip(&solution);
            parts.filter(|(p, _)| matches!(p, Part::Elastic(k, _) if *k == order)).map(|(_, v)| *v).collect()
        };
        out = Some(Baseline {
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
            elastic_nodes: (0..ORDERS).map(nodes).collect(),
            friction_nodes: plan
                .hard
                .iter()
                .zip(&solution)
                .filter(|(p, _)| matches!(p, Part::Friction(_)))
                .map(|(_, v)| *v)
                .collect(),
            span,
        });
    }
    let mut fitted = out.unwrap_or_else(|| unreachable!("the loop above runs"));
    fitted.span.chosen.project_out(&mut fitted.residual);
    fitted
}

/// What remains of each soft direction, when the bladder may differ as much as `give` says.
pub(crate) fn keeps(give: Give, of_friction: &[bool], weight: f64) -> Vec<f64> {
    let friction = of_friction.iter().filter(|f| **f).count().max(1) as f64;
    let elastic = of_friction.iter().filter(|f| !**f).count().max(1) as f64;
    let noise = give.row * give.row;
    of_friction
        .iter()
        .map(|f| {
            let own =
                weight * if *f { give.friction.powi(2) / friction } else { give.elastic.powi(2) / elastic };
            (noise / (noise + own).max(1e-300)).sqrt()
        })
        .collect()
}

/// A baseline's forces at every row.
struct Values {
    force: Vec<f64>,
    quasi: Vec<f64>,
    gaylord: Vec<f64>,
    friction: Vec<f64>,
    stiffness: Vec<f64>,
    deadband: f64,
}

fn values(rows: &Rows, plan: &Plan, solution: &[f64], live: &[f64]) -> Values {
    let n = rows.len();
    let mut v = Values {
        force: vec![0.0; n],
        quasi: vec![0.0; n],
        gaylord: vec![0.0; n],
        friction: vec![0.0; n],
        stiffness: vec![0.0; n],
        deadband: 0.0,
    };
    let mut settling = 0.0;
    let (mut elastic, mut departure) = (vec![0.0; n], vec![0.0; n]);
    for (part, c) in plan.hard.iter().chain(&plan.soft).zip(solution).filter(|(_, c)| **c != 0.0) {
        if let Part::Deadband = part {
            v.deadband = *c;
        }
        for i in 0..n {
            let (shape, context) = (&rows.shapes[i], &rows.contexts[i]);
            match *part {
                Part::Deadband => {
                    v.gaylord[i] -= c * shape.area;
                    v.stiffness[i] -= c * shape.area_slope;
                }
                Part::Elastic(k, f) => {
                    elastic[i] += c * plan.functions[f][i] * shape.elastic[k];
                    v.stiffness[i] += c * plan.functions[f][i] * shape.elastic_slope[k];
                }
                Part::Yeoh(k) => {
                    elastic[i] += c * shape.yeoh[k];
                    v.stiffness[i] += c * shape.yeoh_slope[k];
                }
                Part::Friction(f) => v.friction[i] += c * plan.functions[f][i],
                Part::Area => {
                    v.gaylord[i] += c * context.pressure * shape.area;
                    v.stiffness[i] += c * context.pressure * shape.area_slope;
                }
                Part::AreaSlope => v.gaylord[i] += c * context.pressure * shape.area_slope,
                Part::Settling => settling = *c,
                Part::Unsettled | Part::Rest(..) | Part::Ramping => {
                    departure[i] += c * part.departure(rows, i)
                }
            }
        }
    }
    for i in 0..n {
        let (shape, context) = (&rows.shapes[i], &rows.contexts[i]);
        v.gaylord[i] += context.pressure * shape.area;
        v.stiffness[i] += context.pressure * shape.area_slope;
        v.quasi[i] = v.gaylord[i] + elastic[i];
        v.friction[i] = v.friction[i].clamp(-0.4, 0.8);
        let late = settling * rows.sign[i] * rows.settling[i];
        let direction = context.direction + departure[i];
        v.force[i] = live[i] * v.quasi[i] * (1.0 - v.friction[i] * direction - late);
    }
    v
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
