//! A bladder whose stress rises with strain, where the user asks for one.

use model_core::units::Length;

use super::linear::{Symmetric, dot};
use super::points::Range;
use super::prepared::Prepared;
use super::screen::Use;

impl Prepared {
    /// Makes the bladder's stress `Σ E_k ε^k` rise with strain wherever the recordings strained it, in hoop and in axial
    /// direction, at every node: slopes that would fall are held at zero by a penalty that grows until they do.
    pub(super) fn make_physical(&mut self) {
        let used = |u: &Use| matches!(u, Use::Fitted | Use::NearTurn);
        let strokes = Range::of(
            self.points
                .list
                .iter()
                .zip(&self.used)
                .zip(&self.shift)
                .filter(|((_, u), _)| used(u))
                .map(|((p, _), s)| p.stroke + s),
        );
        let at = |x: f64| self.braid.posture(Length::from_metres(x));
        let (a, b) = (at(strokes.low), at(strokes.high));
        let layout = self.design.layout();
        let order = layout.order;
        let t = self.design.orthonormal.t.clone();
        let strains: Vec<f64> = (0..=24)
            .flat_map(|i| {
                let part = f64::from(i) / 24.0;
                let between = |x: f64, y: f64| x + (y - x) * part;
                [between(a.radial_strain, b.radial_strain), between(a.axial_strain, b.axial_strain)]
            })
            .collect();
        // dσ/dε = Σ_i i E_i ε^(i−1) with E = T ẽ.
        let slopes: Vec<Vec<f64>> = strains
            .iter()
            .map(|e| {
                (0..order)
                    .map(|k| (0..=k).map(|i| (i + 1) as f64 * e.powi(i as i32) * t[i * order + k]).sum())
                    .collect()
            })
            .collect();
        let mut weight = 10.0;
        for _ in 0..10 {
            let data = self.design.normal(&self.parameters, &self.weights);
            let scale = data.weight / layout.nodes as f64;
            let mut held = Symmetric::zeros(layout.len());
            let mut worst = 0.0_f64;
            for j in 0..layout.nodes {
                for a in &slopes {
                    let size = dot(a, a).sqrt();
                    let row: Vec<(usize, f64)> =
                        a.iter().enumerate().map(|(k, v)| (layout.elastic(k, j), v / size)).collect();
                    let slope: f64 = row.iter().map(|(i, v)| v * self.parameters[*i]).sum();
                    worst = worst.min(slope);
                    if slope < 0.0 {
                        held.add_row(&row, weight * scale);
                    }
                }
            }
            if worst > -1e-4 * self.points.force.span() {
                break;
            }
            // What was held stays held, or the next step would fall back.
            match &mut self.design.held {
                Some(all) => all.add_scaled(&held, 1.0),
                none => *none = Some(held),
            }
            weight *= 2.0;
            self.solve(self.smoothing, 6);
        }
    }
}
