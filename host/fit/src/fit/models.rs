//! The thesis's models side by side on one set of mid-lines, and two that it requires.
//!
//! | name | force | what is fitted |
//! | --- | --- | --- |
//! | `gaylord` | `P g(L)` | nothing |
//! | `gaylord-corrected` | `(P − P0) g(L′)` | P0 |
//! | `linear` | `(P − P0) g + E c_1`, E of the material | P0 |
//! | `m1-linear-part`, `m2-linear-part` | M = 1, 2 at each pressure alone | on the straight part of each load line |
//! | `m2`, `m3`, `m4` | M = 2, 3, 4 at each pressure alone | on the whole |
//! | `m4-tip` | M = 4 with `L′` in place of `L` | on the whole |
//! | `m4-friction` | M = 4 and k_F at each pressure, judged on both branches instead of the mid-line | on the whole |
//! | `yeoh` | `(P − P0) g − dU/dΔL`, one hyperelastic wall for all pressures | P0, C_1, C_2, C_3 |
//! | `material` | the same with `C_1 = E/6` of the material, `C_2 = C_3 = 0` | P0 |
//!
//! Errors are those of eq. 24. `P0` is that of the joint fit, except in `yeoh`. The straight part of a load line is the longest
//! stretch that a straight line describes to one percent of the blocked force.
//!
//! The hyperelastic wall (O. H. Yeoh, Rubber Chem. Technol. 66 (1993) 754) is a thick tube: with λ_z = L/L0 and every ring of the
//! wall keeping its volume, `r² = R² − (1 − u)(R0² − R_i²)/λ_z` for the material share `u` counted from the bore,
//!
//! ```text
//! I_1 = λ_z² + λ_θ² + (λ_z λ_θ)⁻²,  λ_θ = r/ρ      U = V_B ∫₀¹ Σ_i C_i (I_1 − 3)^i du
//! ```

use model_core::braid::{Braid, Geometry};
use model_core::table::MAX_ORDER;
use model_core::units::Length;

use super::basis::columns;
use super::design::Measured;
use super::midline::MidPoint;
use super::solution::Solution;
use crate::numerics::least_squares::least_squares;

/// Young's modulus of the thesis's silicone, Pa; the default where the description gives none.
pub(crate) const THESIS_MODULUS: f64 = 1.75e6;

/// A fitted constant: its name, the index of its pressure (`None` for all pressures), its value in SI units.
pub(crate) type Constant = (String, Option<u32>, f64);

/// A model evaluated on the mid-lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The name of the model.
    pub name: &'static str,
    /// Its friction-free force at every mid-point, N.
    pub force: Vec<f64>,
    /// The fitted constants.
    pub constants: Vec<Constant>,
    /// Mean error by eq. 24, percent.
    pub mean_error: f64,
    /// Largest error by eq. 24, percent.
    pub max_error: f64,
}

/// All models. `modulus` is Young's modulus of the bladder, Pa.
#[must_use]
pub fn side_by_side(solution: &Solution, mid: &[MidPoint], modulus: Option<f64>) -> Vec<Model> {
    let plain = with_tip(solution.problem.geometry, false);
    let tip = with_tip(solution.problem.geometry, true);
    let (Some(plain), Some(tip)) = (plain, tip) else { return Vec::new() };
    let p0 = solution.deadband();
    let e = modulus.unwrap_or(THESIS_MODULUS);
    let at = |name, force: Vec<f64>, constants| judge(name, mid, force, constants);
    let all = |braid: &Braid<f64>, f: &dyn Fn(&MidPoint, &super::basis::Columns) -> f64| -> Vec<f64> {
        mid.iter().map(|m| f(m, &columns(braid, m.stroke))).collect()
    };
    let whole = |_: &[usize]| None;
    let straight = |of: &[usize]| Some(straight_part(mid, of));
    let per_pressure = |name, braid: &Braid<f64>, order, part: &dyn Fn(&[usize]) -> Option<Vec<usize>>| {
        let (force, constants) = separate(solution, mid, braid, order, part);
        judge(name, mid, force, constants)
    };
    let deadband = || ("P0".to_owned(), None, p0);
    let mut models = vec![
        at("gaylord", all(&plain, &|m, c| m.pressure * c.area), Vec::new()),
        at("gaylord-corrected", all(&tip, &|m, c| (m.pressure - p0) * c.area), vec![deadband()]),
        at(
            "linear",
            all(&plain, &|m, c| (m.pressure - p0) * c.area + e * c.elastic[0]),
            vec![deadband(), ("E".into(), None, e)],
        ),
        per_pressure("m1-linear-part", &plain, 1, &straight),
        per_pressure("m2-linear-part", &plain, 2, &straight),
        per_pressure("m2", &plain, 2, &whole),
        per_pressure("m3", &plain, 3, &whole),
        per_pressure("m4", &plain, 4, &whole),
        per_pressure("m4-tip", &tip, 4, &whole),
    ];
    if solution.problem.design.friction
        && let Some(m4) = models.iter().find(|m| m.name == "m4").cloned()
    {
        models.push(with_friction(solution, mid, m4));
    }
    let wall: Vec<[f64; 3]> =
        mid.iter().map(|m| wall_columns(&solution.problem.geometry, &plain, m.stroke)).collect();
    models.push(yeoh(mid, &plain, &wall));
    let c1 = e / 6.0;
    let force = mid
        .iter()
        .zip(&wall)
        .map(|(m, w)| (m.pressure - p0) * columns(&plain, m.stroke).area - c1 * w[0])
        .collect();
    models.push(at("material", force, vec![deadband(), ("C1".into(), None, c1)]));
    models
}

fn with_tip(geometry: Geometry, tip_correction: bool) -> Option<Braid<f64>> {
    Geometry { tip_correction, ..geometry }.build().ok()
}

fn judge(name: &'static str, mid: &[MidPoint], force: Vec<f64>, constants: Vec<Constant>) -> Model {
    let errors = mid.iter().zip(&force).map(|(m, f)| 100.0 * (f - m.force).abs() / m.blocked);
    let max_error = errors.clone().fold(0.0, f64::max);
    let mean_error = errors.sum::<f64>() / mid.len().max(1) as f64;
    Model { name, force, constants, mean_error, max_error }
}

/// M moduli at each pressure alone, least squares on the mid-points that `part` picks of each group (all where `None`).
fn separate(
    solution: &Solution,
    mid: &[MidPoint],
    braid: &Braid<f64>,
    order: usize,
    part: &dyn Fn(&[usize]) -> Option<Vec<usize>>,
) -> (Vec<f64>, Vec<Constant>) {
    let p0 = solution.deadband();
    let mut force = vec![0.0; mid.len()];
    let mut constants = Vec::new();
    for group in 0..solution.problem.design.groups as u32 {
        let of: Vec<usize> = (0..mid.len()).filter(|i| mid[*i].group == group).collect();
        if of.is_empty() {
            continue;
        }
        let fitted = part(&of).unwrap_or_else(|| of.clone());
        let measured = |i: &usize| {
            let MidPoint { pressure, stroke, force, .. } = mid[*i];
            Measured { pressure, stroke, direction: 0.0, force }
        };
        let points: Vec<Measured> = fitted.iter().map(measured).collect();
        let moduli = moduli_at_one_pressure(&points, &vec![1.0; points.len()], braid, p0, order);
        for i in of {
            let c = columns(braid, mid[i].stroke);
            let elastic: f64 = moduli.iter().zip(c.elastic).map(|(e, c)| e * c).sum();
            force[i] = (mid[i].pressure - p0) * c.area + elastic;
        }
        constants.extend(moduli.iter().enumerate().map(|(k, e)| (format!("E_{}", k + 1), Some(group), *e)));
    }
    (force, constants)
}

/// `E_1 … E_M` in pascals at one pressure, `P0` given: weighted least squares,
///
/// ```text
/// min Σ_i w_i (F_i − (P_i − P0) g_i − Σ_k E_k c_k,i)²
/// ```
/// With `w_i = F_i⁻²` it is the objective of the thesis (eq. 23), which is linear in the `E_k`.
///
/// ```
/// use pam_fit::{Measured, columns, moduli_at_one_pressure};
/// use model_core::braid::miniature;
///
/// let braid = miniature().build()?;
/// let points: Vec<Measured> = (0..20)
///     .map(|i| {
///         let stroke = 1e-4 * f64::from(i);
///         let c = columns(&braid, stroke);
///         let force = (414e3 - 76.5e3) * c.area + 2e6 * c.elastic[0] - 1e6 * c.elastic[1];
///         Measured { pressure: 414e3, stroke, direction: 0.0, force }
///     })
///     .collect();
/// let moduli = moduli_at_one_pressure(&points, &[1.0; 20], &braid, 76.5e3, 2);
/// assert!((moduli[0] - 2e6).abs() < 1.0 && (moduli[1] + 1e6).abs() < 10.0);
/// # Ok::<(), model_core::braid::GeometryError>(())
/// ```
#[must_use]
pub fn moduli_at_one_pressure(
    points: &[Measured],
    weights: &[f64],
    braid: &Braid<f64>,
    deadband: f64,
    order: usize,
) -> Vec<f64> {
    let rows = points.iter().zip(weights).map(|(p, w)| {
        let c = columns(braid, p.stroke);
        let root = w.max(0.0).sqrt();
        (c.elastic.map(|c| root * c), root * (p.force - (p.pressure - deadband) * c.area))
    });
    least_squares(&rows.collect::<Vec<_>>(), order.min(MAX_ORDER))
}

/// The longest stretch of a load line (mid-points `of` one group, by contraction) that stays within one percent of the blocked
/// force of a straight line.
fn straight_part(mid: &[MidPoint], of: &[usize]) -> Vec<usize> {
    let mut sorted = of.to_vec();
    sorted.sort_by(|a, b| mid[*a].contraction.total_cmp(&mid[*b].contraction));
    let fits = |from: usize, to: usize| {
        let part = &sorted[from..to];
        let n = part.len() as f64;
        let mx = part.iter().map(|i| mid[*i].contraction).sum::<f64>() / n;
        let my = part.iter().map(|i| mid[*i].force).sum::<f64>() / n;
        let (mut xx, mut xy) = (0.0, 0.0);
        for i in part {
            let dx = mid[*i].contraction - mx;
            xx += dx * dx;
            xy += dx * (mid[*i].force - my);
        }
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        part.iter().all(|i| {
            let line = my + slope * (mid[*i].contraction - mx);
            (mid[*i].force - line).abs() <= 0.01 * mid[*i].blocked
        })
    };
    // The end moves on while the stretch fits; where it does not, the beginning follows.
    let (mut from, mut best) = (0, (0, sorted.len().min(2)));
    for to in 1..=sorted.len() {
        while from + 2 < to && !fits(from, to) {
            from += 1;
        }
        if to - from > best.1 - best.0 {
            best = (from, to);
        }
    }
    sorted[best.0..best.1].to_vec()
}

/// The model with friction on both branches: one error for each branch of each chunk.
fn with_friction(solution: &Solution, mid: &[MidPoint], m4: Model) -> Model {
    let mut sum = (0.0, 0.0, 0.0_f64);
    for (m, f) in mid.iter().zip(&m4.force) {
        let k = solution.curves_at(m.pressure).1;
        for (measured, model) in [(m.shortening, f * (1.0 - k)), (m.lengthening, f * (1.0 + k))] {
            if let Some(measured) = measured {
                let e = 100.0 * (measured - model).abs() / m.blocked;
                sum = (sum.0 + e, sum.1 + 1.0, sum.2.max(e));
            }
        }
    }
    Model { name: "m4-friction", mean_error: sum.0 / f64::max(sum.1, 1.0), max_error: sum.2, ..m4 }
}

/// `V_B d⟨(I_1 − 3)^i⟩/dΔL` for i = 1, 2, 3, m²: what a hyperelastic constant of 1 Pa pushes with, N.
#[must_use]
pub(crate) fn wall_columns(geometry: &Geometry, braid: &Braid<f64>, stroke: f64) -> [f64; 3] {
    // Central differences of a smooth function at 10⁻⁵ of its scale: nine digits.
    let h = 1e-5 * braid.rest_length();
    let (after, before) = (invariants(geometry, braid, stroke + h), invariants(geometry, braid, stroke - h));
    std::array::from_fn(|i| braid.bladder_volume() * (after[i] - before[i]) / (2.0 * h))
}

/// `⟨(I_1 − 3)^i⟩` over the wall's material.
fn invariants(geometry: &Geometry, braid: &Braid<f64>, stroke: f64) -> [f64; 3] {
    // Gauss–Legendre on [0, 1], five points.
    const NODES: [(f64, f64); 5] = [
        (0.046_910_077_030_668, 0.118_463_442_528_094_5),
        (0.230_765_344_947_158_4, 0.239_314_335_249_683_2),
        (0.5, 0.284_444_444_444_444_4),
        (0.769_234_655_052_841_6, 0.239_314_335_249_683_2),
        (0.953_089_922_969_332, 0.118_463_442_528_094_5),
    ];
    let posture = braid.posture(Length::from_metres(stroke));
    let r0 = braid.rest_radius();
    let bore = r0 - geometry.wall.metres();
    let area = r0 * r0 - bore * bore;
    let axial = posture.length / braid.rest_length();
    let mut sums = [0.0; 3];
    for (u, weight) in NODES {
        let reference = bore * bore + u * area;
        let present = (posture.radius * posture.radius - (1.0 - u) * area / axial).max(1e-6 * area);
        let hoop_squared = present / reference;
        let i1 = axial * axial + hoop_squared + 1.0 / (axial * axial * hoop_squared) - 3.0;
        sums[0] += weight * i1;
        sums[1] += weight * i1 * i1;
        sums[2] += weight * i1 * i1 * i1;
    }
    sums
}

fn yeoh(mid: &[MidPoint], braid: &Braid<f64>, wall: &[[f64; 3]]) -> Model {
    let area: Vec<f64> = mid.iter().map(|m| columns(braid, m.stroke).area).collect();
    // Errors count against the blocked force of each pressure, so the equations are divided by it.
    let row = |((m, area), wall): ((&MidPoint, &f64), &[f64; 3])| {
        let mut columns = [0.0; MAX_ORDER];
        columns[0] = -area / m.blocked;
        for (to, w) in columns[1..].iter_mut().zip(wall) {
            *to = -w / m.blocked;
        }
        (columns, (m.force - m.pressure * area) / m.blocked)
    };
    let rows: Vec<_> = mid.iter().zip(&area).zip(wall).map(row).collect();
    let x = least_squares(&rows, 4);
    let force = (0..mid.len())
        .map(|i| (mid[i].pressure - x[0]) * area[i] - (0..3).map(|k| x[k + 1] * wall[i][k]).sum::<f64>())
        .collect();
    let names = ["P0", "C1", "C2", "C3"];
    let constants = names.iter().zip(&x).map(|(n, v)| ((*n).to_owned(), None, *v)).collect();
    judge("yeoh", mid, force, constants)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::braid::miniature;

    #[test]
    fn a_thin_wall_at_small_strain_is_the_linear_one() {
        // For I_1 − 3 ≈ small strains of an incompressible wall, C1 = E/6 is Hooke's law: the force per modulus
        // is then V_B (4 ε_z² + 4 ε_z ε_x + 4 ε_x²)/6 differentiated, by virtual work.
        let mut geometry = miniature();
        geometry.wall = Length::from_millimetres(0.005);
        let braid = geometry.build().expect("a valid geometry");
        let energy = |x: f64| {
            let p = braid.posture(Length::from_metres(x));
            let mean = (p.radius - 0.5 * p.wall) / (braid.rest_radius() - 0.5 * geometry.wall.metres()) - 1.0;
            braid.bladder_volume() * 4.0 * (p.axial_strain.powi(2) + p.axial_strain * mean + mean * mean)
        };
        let x = 0.02e-3;
        let h = 1e-7;
        let expected = (energy(x + h) - energy(x - h)) / (2.0 * h);
        let found = wall_columns(&geometry, &braid, x)[0];
        assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    }

    #[test]
    fn the_straight_part_is_found() {
        let mid: Vec<MidPoint> = (0..100)
            .map(|i| {
                let c = f64::from(i) * 1e-3;
                let bend = (0.02 - c).max(0.0) * 2000.0;
                MidPoint {
                    group: 0,
                    pressure: 3e5,
                    stroke: c,
                    contraction: c,
                    force: 100.0 - 900.0 * c + bend,
                    shortening: None,
                    lengthening: None,
                    blocked: 100.0,
                }
            })
            .collect();
        let part = straight_part(&mid, &(0..100).collect::<Vec<_>>());
        assert_eq!(*part.last().expect("a part"), 99);
        assert!((17..22).contains(&part[0]), "{}", part[0]);
    }
}
