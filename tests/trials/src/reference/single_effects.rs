//! A simpler method on the same pairs: the one effect whose least squares lower the BIC most, as a practitioner would do it.
//!
//! Differences of mean force by mounting, direction and bin of pressure; one effect at a time, cells taken as independent. Its columns are
//! the very laws and slopes by which changes were put in, which is an advantage over the diagnosis.

use super::injection::{EFFECTS, Slopes, added, ways};
use super::staircases::Run;

/// Bins of pressure.
pub(super) const BINS: usize = 24;
/// Pa: their width.
const WIDTH: f64 = 27e3;
/// An effect is named when it lowers the BIC by more: "very strong" (Kass and Raftery 1995).
const LEAD: f64 = 10.0;
/// Part of AFTER from which on a slip is assumed.
const MIDDLE: f64 = 0.5;

/// Sums of a column by mounting, direction and bin.
pub(super) fn means(runs: &[Run], column: &dyn Fn(usize) -> Vec<f64>, mountings: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); mountings * 2 * BINS];
    for (k, run) in runs.iter().enumerate() {
        let ways = ways(&run.pressure);
        for ((p, way), v) in run.pressure.iter().zip(ways).zip(column(k)) {
            let bin = ((p / WIDTH).max(0.0) as usize).min(BINS - 1);
            let sum = &mut sums[(run.mounting * 2 + usize::from(way < 0.0)) * BINS + bin];
            *sum = (sum.0 + v, sum.1 + 1.0);
        }
    }
    sums.into_iter().map(|(s, n)| if n > 0.0 { s / n } else { f64::NAN }).collect()
}

/// The name that it gives; `none` where no effect lowers the BIC enough.
pub fn name(before: &[Run], after: &[Run], slopes: &Slopes) -> &'static str {
    let mountings = before.iter().chain(after).map(|r| r.mounting).max().map_or(0, |m| m + 1);
    let force = |runs: &[Run]| means(runs, &|k| runs[k].force.clone(), mountings);
    let difference: Vec<f64> = force(after).iter().zip(force(before)).map(|(a, b)| a - b).collect();
    let known: Vec<usize> = (0..difference.len()).filter(|i| difference[*i].is_finite()).collect();
    let n = known.len() as f64;
    let all: f64 = known.iter().map(|i| difference[*i].powi(2)).sum();
    let lowered = |effect: &'static str| {
        let traces = added(after, effect, slopes, MIDDLE);
        let x = means(after, &|k| traces[k].clone(), mountings);
        let (mut xx, mut xy) = (0.0, 0.0);
        for i in &known {
            xx += x[*i] * x[*i];
            xy += x[*i] * difference[*i];
        }
        let left = if xx > 0.0 { all - xy * xy / xx } else { all };
        n * (left / all).max(1e-12).ln() + n.ln()
    };
    let best = EFFECTS.into_iter().map(|e| (e, lowered(e))).min_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|(_, bic)| *bic < -LEAD).map_or("none", |(e, _)| e)
}
