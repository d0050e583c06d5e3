//! Where an effect is concentrated, and whether a stated region agrees.

use crate::answer::Region;
use crate::ledger::name;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;
use virtual_bench::recording::Row;

/// Coordinates of the sealed trace, by the names that the tool uses.
const COORDINATES: [&str; 9] = [
    "recording",
    "time",
    "cycle",
    "pressure",
    "contraction",
    "direction",
    "speed",
    "force",
    "since-reversal",
];

/// The sealed trace of what is hidden: per kept row its coordinates and what a flexible base leaves of the effect.
pub fn trace(files: &[Vec<Row>], rest: &[Vec<f64>], rest_length: f64) -> String {
    let mut out = COORDINATES.join(",") + ",left_N\n";
    let total: usize = files.iter().map(Vec::len).sum();
    let step = (total / 4000).max(1);
    for (n, (file, left)) in files.iter().zip(rest).enumerate() {
        let (mut way, mut turned) = (0.0, file.first().map_or(0.0, |r| r.time));
        for i in 1..file.len().min(left.len()) {
            let (r, before) = (&file[i], &file[i - 1]);
            let moved = r.stroke - before.stroke;
            if moved != 0.0 && moved.signum() != way {
                (way, turned) = (moved.signum(), r.time);
            }
            if i % step != 0 {
                continue;
            }
            let speed = moved / (r.time - before.time).max(1e-6);
            let _ = writeln!(
                out,
                "{},{:.2},{},{:.1},{:.5},{way},{:.6},{:.3},{:.2},{:.5}",
                n + 1,
                r.time,
                r.cycle,
                r.pressure,
                r.stroke / rest_length,
                speed.abs(),
                r.force,
                r.time - turned,
                left[i]
            );
        }
    }
    out
}

/// How well a stated region meets the true one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Located {
    /// The effect's energy is denser there than elsewhere: half again as dense as the share of the rows, or more than half of the
    /// energy and denser than its rows.
    pub dense: bool,
    /// Rows in both regions over rows in either. The true region is the smallest interval of the same coordinate that holds
    /// the share of the effect's energy that the tool states for its own.
    pub overlap: f64,
}

/// Judge the first stated region that can be checked.
pub fn judge(set: &Path, id: usize, regions: &[Region]) -> Option<Located> {
    let text = std::fs::read_to_string(set.join("sealed").join(name(id)).join("trace.csv")).ok()?;
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|l| l.split(',').filter_map(|v| v.parse().ok()).collect()).collect();
    let rows: Vec<&Vec<f64>> = rows.iter().filter(|r| r.len() == COORDINATES.len() + 1).collect();
    let energy: Vec<f64> = rows.iter().map(|r| r[COORDINATES.len()].powi(2)).collect();
    let whole: f64 = energy.iter().sum();
    if whole <= 0.0 {
        return None;
    }
    for region in regions {
        let Some(column) = COORDINATES.iter().position(|c| *c == region.coordinate) else { continue };
        let (Some(mut from), Some(mut to)) = (region.from, region.to) else { continue };
        if from > to {
            std::mem::swap(&mut from, &mut to);
        }
        if column == 3 && to.abs() < 2000.0 {
            // A pressure of this size is meant in kPa.
            (from, to) = (from * 1e3, to * 1e3);
        }
        let edge = 1e-6 + 1e-6 * to.abs();
        let values: Vec<f64> = rows.iter().map(|r| r[column]).collect();
        let stated: Vec<bool> = values.iter().map(|v| *v >= from - edge && *v <= to + edge).collect();
        let n = stated.iter().filter(|s| **s).count() as f64 / rows.len() as f64;
        if n <= 0.0 || n >= 0.999 {
            continue;
        }
        let e = energy.iter().zip(&stated).filter(|(_, s)| **s).map(|(e, _)| e).sum::<f64>() / whole;
        let (low, high) = smallest(&values, &energy, whole * region.share.unwrap_or(0.5).clamp(0.2, 0.95));
        let truly = |v: f64| v >= low && v <= high;
        let both = values.iter().zip(&stated).filter(|(v, s)| truly(**v) && **s).count();
        let either = values.iter().zip(&stated).filter(|(v, s)| truly(**v) || **s).count();
        return Some(Located {
            dense: e / n >= 1.5 || (e > 0.5 && e > n),
            overlap: both as f64 / either.max(1) as f64,
        });
    }
    None
}

/// The interval of values that holds an amount of energy in the fewest rows.
fn smallest(values: &[f64], energy: &[f64], wanted: f64) -> (f64, f64) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let (mut best, mut fewest) = ((f64::NEG_INFINITY, f64::INFINITY), usize::MAX);
    let (mut first, mut held) = (0, 0.0);
    for last in 0..order.len() {
        held += energy[order[last]];
        while first < last && held - energy[order[first]] >= wanted {
            held -= energy[order[first]];
            first += 1;
        }
        if held >= wanted && last - first < fewest {
            fewest = last - first;
            best = (values[order[first]], values[order[last]]);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_interval_is_where_the_energy_is_dense() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let energy: Vec<f64> =
            values.iter().map(|v| if (40.0..50.0).contains(v) { 10.0 } else { 0.1 }).collect();
        assert_eq!(smallest(&values, &energy, 99.5), (40.0, 49.0));
        let all = smallest(&values, &energy, 1e9);
        assert!(all.0 == f64::NEG_INFINITY && all.1 == f64::INFINITY);
    }
}
