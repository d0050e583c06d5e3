//! How far from a turn of the motion friction has turned round: points before that are set aside.

use super::prepared::Prepared;
use super::screen::Use;

impl Prepared {
    pub(super) fn mark_turns(&mut self, zone: f64) {
        self.turn_zone = zone;
        for (p, used) in self.points.list.iter().zip(&mut self.used) {
            match *used {
                Use::Fitted if p.since_turn < zone => *used = Use::NearTurn,
                Use::NearTurn if p.since_turn >= zone => *used = Use::Fitted,
                _ => {}
            }
        }
    }

    pub(super) fn size_turn_zone(&mut self) {
        if !self.design.friction {
            self.mark_turns(0.0);
            return;
        }
        let curves = self.design.curves(&self.parameters);
        let noise = self.points.row_noise;
        let force = self.points.force.span();
        let shares = (0..self.points.list.len()).filter_map(|i| {
            let p = &self.points.list[i];
            if !matches!(self.used[i], Use::Fitted | Use::NearTurn) {
                return None;
            }
            let e = self.design.evaluate(i, &self.parameters, &curves);
            let friction = (1.0 - e.grip) * e.quasi * p.direction;
            let residual = p.direction * (p.force - e.force);
            // A friction below the noise tells nothing about where it turned.
            (friction > 2.0 * noise && friction > 1e-3 * force)
                .then(|| (p.since_turn, residual / friction, f64::from(p.rows) * friction * friction))
        });
        let zone = turn_zone(shares.collect::<Vec<_>>());
        self.mark_turns(zone);
    }
}

/// How far from a turn friction is fully turned round, as a share of the ranges (see [`super::points::Point::since_turn`]).
///
/// `missing` gives, per point after a turn, its distance and the share of friction that its residual lacks
/// (`s r / (k_F q)`), with a weight. Right after a turn that share is near 2, far from it near 0. The zone ends where
/// the mean stays below a tenth.
#[must_use]
pub fn turn_zone(missing: impl IntoIterator<Item = (f64, f64, f64)>) -> f64 {
    const BIN: f64 = 0.0025;
    const BINS: usize = 100;
    const LEAST: f64 = 0.005;
    let mut sums = [(0.0, 0.0); BINS];
    let mut far = (0.0, 0.0);
    for (distance, share, weight) in missing {
        let bin = (distance / BIN) as usize;
        let to = if bin < BINS { &mut sums[bin] } else { &mut far };
        to.0 += weight * share;
        to.1 += weight;
    }
    let mean = |s: (f64, f64)| if s.1 > 0.0 { s.0 / s.1 } else { 0.0 };
    // Whatever misfit the model has everywhere is no sign of a turn.
    let base = mean(far);
    let last = (0..BINS).take_while(|i| {
        let here: Vec<f64> = sums[*i..(*i + 3).min(BINS)].iter().map(|s| mean(*s) - base).collect();
        here.iter().any(|v| *v > 0.1)
    });
    let bins = last.count();
    if bins == 0 { LEAST } else { (bins as f64 + 1.0) * BIN * 1.2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zone_ends_where_friction_has_turned() {
        let exponential = (0..4000).map(|i| {
            let d = f64::from(i) * 1e-4;
            (d, 2.0 * (-d / 0.01).exp() + 0.02 * (f64::from(i) * 2.1).sin(), 1.0)
        });
        // 2 e^(−d/0.01) falls below a tenth at 0.03.
        let zone = turn_zone(exponential);
        assert!((0.03..0.05).contains(&zone), "{zone}");
        assert!(turn_zone((0..100).map(|i| (f64::from(i) * 0.01, 0.0, 1.0))) < 0.01);
    }
}
