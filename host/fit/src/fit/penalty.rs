//! The penalty on the curvature of the curves: they bend no more than the points require.

use super::design::{Design, Layout};
use super::normal_equations::NormalEquations;
use super::smoothing::Smoothing;
use crate::numerics::symmetric::Symmetric;

impl Design {
    /// The penalty on curves that bend, and on unknowns that nothing else holds.
    ///
    /// `bend_elastic` and `bend_friction` weigh the squared second differences of `ẽ_k` (N) and of `k_F` (times the
    /// typical force, N) between neighbouring nodes against the data's mean weight.
    #[must_use]
    pub fn penalty(&self, data: &NormalEquations, bend_elastic: f64, bend_friction: f64) -> Symmetric {
        let layout = self.layout();
        let nodes = self.basis.nodes();
        let mut penalty = Symmetric::zeros(layout.len());
        let scale = data.weight / layout.nodes as f64;
        // Σ w q² over points, from the diagonal of the friction columns: the scale of force in k_F's own equations.
        let force_squared = {
            let all: f64 = (0..layout.nodes)
                .map(|i| {
                    (0..layout.nodes)
                        .map(|j| data.matrix.at(layout.friction(i), layout.friction(j)))
                        .sum::<f64>()
                })
                .sum();
            if data.weight > 0.0 { all / data.weight } else { 0.0 }
        };
        let span = nodes.last().unwrap_or(&0.0) - nodes.first().unwrap_or(&0.0);
        let mean = span / (nodes.len().max(2) - 1) as f64;
        for k in 0..=layout.order {
            let weight =
                if k < layout.order { bend_elastic * scale } else { bend_friction * scale * force_squared };
            let place = |j: usize| layout.elastic(k, j);
            for j in 1..nodes.len().saturating_sub(1) {
                let (before, after) = (nodes[j] - nodes[j - 1], nodes[j + 1] - nodes[j]);
                // ∫ (f″)² over the nodes' share, in units where equal spacing gives the plain second difference.
                let share = 0.5 * (before + after) / mean;
                let unit = mean / (0.5 * (before + after));
                let (a, c) = (unit * mean / before, unit * mean / after);
                let row = [(place(j - 1), a), (place(j), -a - c), (place(j + 1), c)];
                penalty.add_row(&row, weight * share);
            }
            if k < layout.order && self.level > 0.0 {
                for j in 1..nodes.len() {
                    penalty.add_row(&[(place(j - 1), -1.0), (place(j), 1.0)], self.level * scale);
                }
            }
            if k == layout.order {
                // Beyond the data friction tends to stay: a trend continued for long would pass zero or one. So weakly that it never
                // contradicts data: noise requires stiff curves, and a pull as stiff as these would flatten k_F over pressure.
                let stay = 0.02 * bend_friction.min(Smoothing::START.friction) * scale * force_squared;
                for j in 1..nodes.len() {
                    penalty.add_row(&[(place(j - 1), -1.0), (place(j), 1.0)], stay);
                }
            }
        }
        penalty.add(Layout::DEADBAND, Layout::DEADBAND, self.hold_deadband);
        if let Some(held) = &self.held {
            penalty.add_scaled(held, 1.0);
        }
        // Ten digits below the data: only what nothing else determines is held by it.
        let hold = 1e-10 * data.weight;
        for k in 0..layout.order {
            for j in 0..layout.nodes {
                penalty.add(layout.elastic(k, j), layout.elastic(k, j), hold);
            }
        }
        for j in 0..layout.nodes {
            let weight =
                if self.friction { 1e-10 * data.weight * force_squared } else { data.weight.max(1.0) };
            penalty.add(layout.friction(j), layout.friction(j), weight);
        }
        for (m, p) in self.extra_prior.iter().enumerate() {
            penalty.add(layout.extra(m), layout.extra(m), *p);
        }
        penalty
    }
}

#[cfg(test)]
mod tests {
    use crate::fit::gauss_newton::tests::known_design;

    #[test]
    fn a_steep_straight_friction_stays_steep_however_stiff_the_curve() {
        let (design, truth) = known_design(3);
        let weights = vec![1.0; design.rows.len()];
        let mut found = truth.clone();
        let data = design.normal(&found, &weights);
        let penalty = design.penalty(&data, 0.0, 1e3);
        design.solve(&mut found, &weights, &penalty, 30);
        let layout = design.layout();
        for j in 0..6 {
            let (f, t) = (found[layout.friction(j)], truth[layout.friction(j)]);
            assert!((f - t).abs() < 2e-4, "k_F {f} for {t}");
        }
    }
}
