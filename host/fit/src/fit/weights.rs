//! How much each point counts.
//!
//! ```text
//! w = n_i / n_c / (σ²/n_c + (0.002 F_B(P))²)
//! ```
//! with `n_i` rows in the point, `n_c` in its chunk of stroke, pressure and direction, `σ` the noise of a row: a place where the
//! recording dwelled does not outweigh the others. `F_B(P)` is not fitted yet where weights are wanted first: it is the largest force
//! that was read, in proportion to `P − P0`, and at least a tenth of it. Far residuals count by their distance, not its square (P. J. Huber, Ann. Math.
//! Statist. 35 (1964) 73, doi 10.1214/aoms/1177703732).

use std::collections::HashMap;

use super::design::Row;
use super::points::{Point, Range, median};
use super::prepared::Prepared;
use super::screen::Use;

/// Of the blocked force: what the model may miss although it is the right one for the purpose; more rows do not help below it.
const INEXACT: f64 = 0.002;

impl Prepared {
    /// Weights from scratch: every chunk of stroke at every pressure and direction counts alike, as far as its rows carry it.
    pub(super) fn weigh(&mut self) {
        let deadband = self.design.origin + self.parameters.first().copied().unwrap_or(0.0);
        let stroke = self.points.stroke;
        let pressure = self.points.pressure;
        let chunk = |x: f64, range: Range, n: f64| {
            if range.span() > 0.0 { ((x - range.low) / range.span() * n).min(n - 1.0) as usize } else { 0 }
        };
        let (fine_p, fine_x) = (if self.pressures.held { 1.0 } else { 64.0 }, 64.0);
        let cell = |p: &Point, group: u32| {
            let place =
                if self.pressures.held { group as usize } else { chunk(p.pressure, pressure, fine_p) };
            let branch = (p.direction + 1.0) as usize;
            (place * 64 + chunk(p.stroke, stroke, fine_x)) * 3 + branch
        };
        let groups: Vec<u32> =
            self.design.rows.iter().map(|r| self.design.bins[r.bin as usize].group).collect();
        let mut counts: HashMap<usize, f64> = HashMap::new();
        for ((p, used), g) in self.points.list.iter().zip(&self.used).zip(&groups) {
            if *used == Use::Fitted {
                *counts.entry(cell(p, *g)).or_default() += f64::from(p.rows);
            }
        }
        self.cells = counts.len().max(1) as f64;
        let force = self.points.force.high.abs().max(self.points.force.low.abs());
        let noise = self.points.row_noise.max(1e-6 * force).powi(2);
        let scale = (pressure.high - deadband).max(0.1 * pressure.high.abs()).max(1.0);
        self.weights = self
            .points
            .list
            .iter()
            .zip(&self.used)
            .zip(&groups)
            .map(|((p, used), g)| {
                if *used != Use::Fitted {
                    return 0.0;
                }
                let n = counts.get(&cell(p, *g)).copied().unwrap_or(1.0).max(1.0);
                // Blocked force is proportional to P − P0: errors are judged against it, pressure by pressure.
                let blocked = force * ((p.pressure - deadband) / scale).clamp(0.1, 1.0);
                f64::from(p.rows) / n / (noise / n + (INEXACT * blocked).powi(2))
            })
            .collect();
    }

    /// Scatter of residuals about the model in each group, by the median.
    #[must_use]
    pub fn scatter(&self, residuals: &[f64]) -> Vec<f64> {
        let mut by_group: Vec<Vec<f64>> = vec![Vec::new(); self.design.groups.max(1)];
        for ((row, used), r) in self.design.rows.iter().zip(&self.used).zip(residuals) {
            if *used == Use::Fitted {
                by_group[self.design.bins[row.bin as usize].group as usize].push(r.abs());
            }
        }
        let force = self.points.force.span();
        by_group
            .iter_mut()
            .map(|r| (median(r) / 0.6745).max(self.points.row_noise).max(1e-6 * force))
            .collect()
    }

    /// Huber's weights, and the solution that belongs to them: what lies beyond four times the scatter counts in proportion to its
    /// distance, not its square. Weights and solution need each other, so they are found in turns: after one round the far
    /// readings would still hold the solution where they had pulled it.
    pub(super) fn solve_softened(&mut self) {
        const ROUNDS: usize = 20;
        let whole = self.weights.clone();
        let mut residuals = self.design.residuals(&self.parameters);
        for _ in 0..ROUNDS {
            let by_group = self.scatter(&residuals);
            let scatter_of = |row: &Row| by_group[self.design.bins[row.bin as usize].group as usize];
            let scatter: Vec<f64> = self.design.rows.iter().map(scatter_of).collect();
            let soft = |i: usize| whole[i] * (4.0 * scatter[i] / residuals[i].abs()).min(1.0);
            self.weights = (0..whole.len()).map(soft).collect();
            self.solve(self.smoothing, 8);
            let moved = self.design.residuals(&self.parameters);
            let settled = (0..whole.len()).all(|i| (moved[i] - residuals[i]).abs() <= 0.02 * scatter[i]);
            residuals = moved;
            if settled {
                break;
            }
        }
    }
}
