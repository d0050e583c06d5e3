//! All pressures together: `P0`, every `E_kj` and `k_F,j`, by Gauss–Newton on sufficient statistics.
//!
//! The model ([`super::design`]) is linear in `(P0, ẽ, a)` at a given `k_F` and the reverse: from any sensible start a few steps
//! converge quadratically.

use super::design::Design;
use super::normal_equations::NormalEquations;
use crate::numerics::symmetric::{Symmetric, dot};

impl Design {
    /// Gauss–Newton from `parameters`, in place; returns the normal equations at the end.
    ///
    /// A step that raises the objective is halved. It ends when a step would lower the objective by less than a thousand-millionth
    /// of it or by less than rounding may move it, or after `most` steps: what is reached then is still the best so far.
    pub fn solve(
        &self,
        parameters: &mut Vec<f64>,
        weights: &[f64],
        penalty: &Symmetric,
        most: usize,
    ) -> NormalEquations {
        let normal = self.normal(parameters, weights);
        self.solve_from(normal, parameters, weights, penalty, most)
    }

    /// As [`Design::solve`], where the normal equations at the start are known.
    pub(super) fn solve_from(
        &self,
        mut normal: NormalEquations,
        parameters: &mut Vec<f64>,
        weights: &[f64],
        penalty: &Symmetric,
        most: usize,
    ) -> NormalEquations {
        let objective = |normal: &NormalEquations, at: &[f64]| normal.misfit + penalty.quadratic(at);
        let mut best = objective(&normal, parameters);
        for _ in 0..most {
            let mut matrix = normal.matrix.clone();
            matrix.add_scaled(penalty, 1.0);
            let pull = penalty.times(parameters);
            let right: Vec<f64> = normal.right.iter().zip(&pull).map(|(b, p)| b - p).collect();
            let mut step = matrix.factor().solve(&right);
            // What the step would gain by the linear model: nothing, where the solution is reached.
            let least = (1e-9 * best).max(penalty.quadratic_rounding(parameters));
            if !(dot(&step, &right) > least) {
                break;
            }
            let mut accepted = false;
            for _ in 0..8 {
                let trial: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p + s).collect();
                let at_trial = self.normal(&trial, weights);
                let value = objective(&at_trial, &trial);
                if value <= best * (1.0 + 1e-12) {
                    *parameters = trial;
                    normal = at_trial;
                    best = value;
                    accepted = true;
                    break;
                }
                for s in &mut step {
                    *s *= 0.5;
                }
            }
            if !accepted {
                break;
            }
        }
        normal
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fit::design::Measured;
    use model_core::braid::miniature;
    use model_core::table::MAX_ORDER;

    /// Loops of a known table at six pressures: a parametrised truth for the solver.
    pub(crate) fn known_design(order: usize) -> (Design, Vec<f64>) {
        let braid = miniature().build().expect("a valid geometry");
        let levels: Vec<f64> = (0..6).map(|i| 207e3 + 69e3 * f64::from(i)).collect();
        let mut points = Vec::new();
        for p in &levels {
            for direction in [1.0, -1.0] {
                points.extend((0..60).map(|i| Measured {
                    pressure: *p,
                    stroke: f64::from(i) * 5e-5,
                    direction,
                    force: 0.0,
                }));
            }
        }
        let mut design = Design::at_levels(&points, &braid, order, true);
        let layout = design.layout();
        let mut truth = design.start(76.5e3);
        for k in 0..order {
            for j in 0..6 {
                truth[layout.elastic(k, j)] = -8.0 / (1.0 + k as f64) - 0.3 * j as f64 * (k as f64 - 1.0);
            }
        }
        for j in 0..6 {
            truth[layout.friction(j)] = 0.14 - 0.018 * j as f64;
        }
        let curves = design.curves(&truth);
        for i in 0..design.rows.len() {
            design.rows[i].force = design.evaluate(i, &truth, &curves).force;
        }
        (design, truth)
    }

    #[test]
    fn without_noise_the_truth_is_found_to_the_last_digits() {
        let (design, truth) = known_design(4);
        let weights = vec![1.0; design.rows.len()];
        let mut found = design.start(30e3);
        let normal = design.normal(&found, &weights);
        let mut penalty = design.penalty(&normal, 0.0, 0.0);
        penalty.a.fill(0.0);
        design.solve(&mut found, &weights, &penalty, 30);
        assert!((found[0] - truth[0]).abs() < 1e-3, "P0 {} Pa", found[0]);
        let layout = design.layout();
        for j in 0..6 {
            let (f, t) = (found[layout.friction(j)], truth[layout.friction(j)]);
            assert!((f - t).abs() < 1e-8, "k_F {f} {t}");
        }
        for r in design.residuals(&found) {
            assert!(r.abs() < 1e-6, "{r} N");
        }
    }

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let (mut design, mut at) = known_design(3);
        design.extras = 1;
        design.extra = (0..design.rows.len()).map(|i| (i as f64 * 0.37).sin()).collect();
        design.extra_prior = vec![0.0];
        at.push(0.5);
        for i in [0, 77, 300, 500] {
            let analytic = design.gradient(i, &at, &design.curves(&at));
            for u in 0..at.len() {
                let h = if u == 0 { 10.0 } else { 1e-5 };
                let force = |by: f64| {
                    let mut moved = at.clone();
                    moved[u] += by;
                    design.evaluate(i, &moved, &design.curves(&moved)).force
                };
                let numeric = (force(h) - force(-h)) / (2.0 * h);
                assert!((analytic[u] - numeric).abs() < 1e-6 * (1.0 + numeric.abs()), "row {i}, unknown {u}");
            }
        }
    }

    #[test]
    fn sums_by_bin_are_the_sums_of_rows() {
        for order in 1..=MAX_ORDER {
            for extras in [0, 1] {
                let (mut design, mut at) = known_design(order);
                at[3] += 0.7;
                at[0] += 3e3;
                design.extras = extras;
                design.extra = (0..extras * design.rows.len()).map(|i| (i as f64 * 0.37).sin()).collect();
                design.extra_prior = vec![0.0; extras];
                at.extend(vec![0.5; extras]);
                assert_sums(&design, &at);
            }
        }
    }

    #[test]
    fn leaving_a_group_out_of_the_sums_is_giving_its_points_no_weight() {
        let (mut design, mut at) = known_design(4);
        at[3] += 0.7;
        // Points of all pressures in turn, so that the sums of a bin are not those of one stretch of rows.
        let n = design.rows.len();
        design.rows = (0..n).map(|i| design.rows[i * 77 % n]).collect();
        let weights: Vec<f64> = (0..n).map(|i| 0.3 + (i % 4) as f64).collect();
        let sums = design.bin_sums(&at, &weights);
        let bits = |of: &NormalEquations| -> Vec<u64> {
            let all = of.matrix.a.iter().chain(&of.right).chain([&of.misfit, &of.weight]);
            all.map(|v| v.to_bits()).collect()
        };
        for left_out in 0..design.groups {
            let group = |i: usize| design.bins[design.rows[i].bin as usize].group as usize;
            let without: Vec<f64> =
                (0..n).map(|i| if group(i) == left_out { 0.0 } else { weights[i] }).collect();
            let direct = design.normal(&at, &without);
            assert!(direct.weight > 0.0);
            let by_sums = design.normal_of_groups(&sums, |g| g != left_out);
            assert_eq!(bits(&by_sums), bits(&direct), "group {left_out}");
        }
        assert_eq!(
            bits(&design.normal_of_groups(&sums, |_| true)),
            bits(&design.normal_of(0..n, &at, &design.curves(&at), &weights))
        );
    }

    fn assert_sums(design: &Design, at: &[f64]) {
        let weights: Vec<f64> = (0..design.rows.len()).map(|i| (i % 4) as f64).collect();
        let normal = design.normal(at, &weights);
        let curves = design.curves(at);
        let mut direct = NormalEquations::zeros(design.layout().len());
        for (i, w) in weights.iter().enumerate() {
            let j: Vec<(usize, f64)> = design.gradient(i, at, &curves).into_iter().enumerate().collect();
            let r = design.rows[i].force - design.evaluate(i, at, &curves).force;
            direct.matrix.add_row(&j, *w);
            for (k, v) in &j {
                direct.right[*k] += w * v * r;
            }
            direct.misfit += w * r * r;
            direct.weight += w;
        }
        let layout = format!("{:?}", design.layout());
        let (pairs, rights) =
            (normal.matrix.a.iter().zip(&direct.matrix.a), normal.right.iter().zip(&direct.right));
        let single = [(&normal.misfit, &direct.misfit), (&normal.weight, &direct.weight)];
        for (a, b) in pairs.chain(rights).chain(single) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} {b}, {layout}");
        }
    }
}
