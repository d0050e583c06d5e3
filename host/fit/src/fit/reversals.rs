//! How far from a reversal of motion friction has changed sign completely: nearer points are excluded.

use super::problem::Problem;
use super::screen::{PointUse, Screen};

/// The screen with points excluded that are nearer to a reversal than `zone`, a share of the ranges of stroke and pressure.
pub(super) fn with_zone(problem: &Problem, screen: &Screen, zone: f64) -> Screen {
    let used = problem.points.list.iter().zip(&screen.used).map(|(p, used)| match *used {
        PointUse::Fitted if p.since_reversal < zone => PointUse::NearReversal,
        PointUse::NearReversal if p.since_reversal >= zone => PointUse::Fitted,
        other => other,
    });
    Screen { reversal_zone: zone, ..screen.with_use(used.collect()) }
}

/// The distance from a reversal within which a solution lacks friction; zero where no friction is fitted.
pub(super) fn zone(problem: &Problem, screen: &Screen, parameters: &[f64]) -> f64 {
    let (design, points) = (&problem.design, &problem.points);
    if !design.friction {
        return 0.0;
    }
    let curves = design.curves(parameters);
    let noise = points.row_noise;
    let force = points.force.span();
    let shares = (0..points.list.len()).filter_map(|i| {
        let p = &points.list[i];
        if !matches!(screen.used[i], PointUse::Fitted | PointUse::NearReversal) {
            return None;
        }
        let e = design.evaluate(i, parameters, &curves);
        let friction = (1.0 - e.grip) * e.quasi * p.direction;
        let residual = p.direction * (p.force - e.force);
        // A friction below the noise does not show where it changes sign.
        (friction > 2.0 * noise && friction > 1e-3 * force)
            .then(|| (p.since_reversal, residual / friction, f64::from(p.rows) * friction * friction))
    });
    zone_of(shares)
}

/// The distance from a reversal at which friction has changed sign completely, as a share of the ranges (see
/// [`super::points::Point::since_reversal`]).
///
/// `missing` gives, per point after a reversal, its distance, the share of friction that its residual lacks (`s r / (k_F q)`), and a
/// weight. Right after a reversal that share is near 2, far from it near 0. The zone ends where the mean stays below a tenth.
fn zone_of(missing: impl IntoIterator<Item = (f64, f64, f64)>) -> f64 {
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
    // A misfit that the model has everywhere is not caused by reversals.
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
    fn the_zone_ends_where_friction_has_changed_sign() {
        let exponential = (0..4000).map(|i| {
            let d = f64::from(i) * 1e-4;
            (d, 2.0 * (-d / 0.01).exp() + 0.02 * (f64::from(i) * 2.1).sin(), 1.0)
        });
        // 2 e^(−d/0.01) falls below a tenth at 0.03.
        let zone = zone_of(exponential);
        assert!((0.03..0.05).contains(&zone), "{zone}");
        assert!(zone_of((0..100).map(|i| (f64::from(i) * 0.01, 0.0, 1.0))) < 0.01);
    }
}
