//! The force before at a length between those of the reference, with the error of the interpolation.

use super::criteria::GRID;
use super::surface::{Curves, monotone_slopes};

/// Value and slope of the monotone piecewise cubic through points, at a place between the first and the last.
fn cubic(x: &[f64], y: &[f64], at: f64) -> (f64, f64) {
    let slopes = monotone_slopes(x, y);
    let i = x.partition_point(|v| *v <= at).clamp(1, x.len() - 1) - 1;
    let h = x[i + 1] - x[i];
    let t = (at - x[i]) / h;
    let (a, b) = (slopes[i] * h, slopes[i + 1] * h);
    let rise = y[i + 1] - y[i];
    let (c2, c3) = (3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise);
    (y[i] + t * (a + t * (c2 + t * c3)), (a + t * (2.0 * c2 + 3.0 * t * c3)) / h)
}

/// How far the force at a length is from what the other lengths give, N: each inner length is left out in turn. Lengths are further apart
/// then by half, and the error of a cubic grows with the fourth power of the distance at most; no allowance is made for that.
fn left_out(x: &[f64], y: &[f64]) -> f64 {
    let inner = 1..x.len() - 1;
    let count = inner.len().max(1) as f64;
    let square: f64 = inner
        .map(|k| {
            let pick = |v: &[f64]| {
                v.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, v)| *v).collect::<Vec<f64>>()
            };
            (cubic(&pick(x), &pick(y), x[k]).0 - y[k]).powi(2)
        })
        .sum();
    (square / count).sqrt()
}

/// The curves of a mounting that the reference does not have.
pub(super) fn curves(all: &[Curves], strokes: &[f64], recorded: &[usize], mounting: usize) -> Curves {
    let x: Vec<f64> = recorded.iter().map(|m| strokes[*m]).collect();
    let at = strokes[mounting];
    let mut made = Curves::default();
    for g in 0..GRID {
        let of =
            |curve: &dyn Fn(&Curves) -> f64| recorded.iter().map(|m| curve(&all[*m])).collect::<Vec<f64>>();
        let forces = of(&|c| c.force[g]);
        let (force, slope) = cubic(&x, &forces, at);
        made.force.push(force);
        made.by_stroke.push(slope);
        made.gap.push(cubic(&x, &of(&|c| c.gap[g]), at).0);
        made.by_pressure.push(cubic(&x, &of(&|c| c.by_pressure[g]), at).0);
        let error = left_out(&x, &forces).powi(2);
        for side in 0..2 {
            let own = of(&|c| c.variance[side][g]).into_iter().fold(0.0, f64::max);
            made.variance[side].push(error + own);
        }
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_between_its_points_is_met_within_the_error_that_is_stated() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let y = x.map(|v: f64| 10.0 - v * v);
        let (value, slope) = cubic(&x, &y, 1.5);
        assert!(
            (value - 7.75).abs() < left_out(&x, &y) && left_out(&x, &y) < 1.0,
            "{value} {}",
            left_out(&x, &y)
        );
        assert!((slope + 3.0).abs() < 0.5, "{slope}");
        assert!((cubic(&x, &x, 2.25).0 - 2.25).abs() < 1e-12 && left_out(&x, &x) < 1e-12);
    }
}
