//! The size from which effects are noticed: a logistic curve over the logarithm of the size, with resampled intervals.

use serde::Serialize;
use virtual_bench::rng::Rng;

/// Sizes at which half and nine tenths are noticed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    /// Trials behind it.
    pub trials: usize,
    /// Size noticed in half of the trials, percent of blocked force, with its 95 % interval.
    pub half: (f64, f64, f64),
    /// Size noticed in nine tenths.
    pub nine_tenths: (f64, f64, f64),
}

/// Sizes beyond this (percent) were never tried: what lies there is reported as "more".
pub const LARGEST: f64 = 8.0;

/// Fit `1/(1 + exp(−a − b ln s))` to (size in percent, noticed); a weak prior keeps b finite where sizes separate.
fn curve(points: &[(f64, bool)]) -> (f64, f64) {
    let (mut a, mut b) = (0.0, 1.0);
    for _ in 0..60 {
        let (mut ga, mut gb, mut haa, mut hab, mut hbb) = (-0.02 * a, -0.02 * (b - 1.0), 0.02, 0.0, 0.02);
        for &(size, noticed) in points {
            let x = size.max(1e-3).ln();
            let p = 1.0 / (1.0 + (-(a + b * x)).exp());
            let (rest, w) = (f64::from(u8::from(noticed)) - p, (p * (1.0 - p)).max(1e-9));
            (ga, gb) = (ga + rest, gb + rest * x);
            (haa, hab, hbb) = (haa + w, hab + w * x, hbb + w * x * x);
        }
        let det = haa * hbb - hab * hab;
        let (da, db) = ((ga * hbb - gb * hab) / det, (gb * haa - ga * hab) / det);
        let step = (1.0 / da.abs().max(db.abs()).max(1e-9)).min(1.0);
        (a, b) = (a + step * da, b + step * db);
    }
    (a, b)
}

fn size_at(points: &[(f64, bool)], part: f64) -> f64 {
    let (a, b) = curve(points);
    // A curve that does not rise never reaches its part.
    if b <= 0.05 { f64::INFINITY } else { (((part / (1.0 - part)).ln() - a) / b).exp() }
}

/// The limits from (size in percent, noticed); intervals by resampling trials.
pub fn limit(points: &[(f64, bool)]) -> Option<Limit> {
    if points.len() < 8 {
        return None;
    }
    let mut r = Rng::new(90);
    let draws: Vec<Vec<(f64, bool)>> =
        (0..300).map(|_| points.iter().map(|_| points[r.index(points.len())]).collect()).collect();
    let of = |part: f64| {
        let mut sizes: Vec<f64> = draws.iter().map(|d| size_at(d, part)).collect();
        sizes.sort_by(f64::total_cmp);
        (size_at(points, part), sizes[7], sizes[292])
    };
    Some(Limit { trials: points.len(), half: of(0.5), nine_tenths: of(0.9) })
}

/// Description of a size.
pub fn said(size: f64) -> String {
    if size > LARGEST { format!("> {LARGEST:.0}") } else { format!("{size:.2}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_curve_comes_back() {
        let mut r = Rng::new(1);
        let points: Vec<(f64, bool)> = (0..4000)
            .map(|_| {
                let size = r.log_range(0.3, 8.0);
                let p = 1.0 / (1.0 + (-(3.0 * (size / 1.5f64).ln())).exp());
                (size, r.chance(p))
            })
            .collect();
        let l = limit(&points).expect("enough");
        assert!((l.half.0 - 1.5).abs() < 0.1 && l.half.1 < 1.5 && l.half.2 > 1.5, "{l:?}");
        assert!((l.nine_tenths.0 - 1.5 * 9f64.powf(1.0 / 3.0)).abs() < 0.3, "{l:?}");
        let never: Vec<(f64, bool)> = points.iter().map(|p| (p.0, false)).collect();
        assert!(size_at(&never, 0.5) > LARGEST);
    }
}
