//! At which pressures a muscle was worked.

use super::Rows;
use crate::criteria::rows::{
    LEVEL_ROWS, LEVEL_SPREAD, LEVEL_SPREAD_OF_MEAN, LEVEL_TENTHS, MOST_LEVELS, RANGE_NODES, SAME_LEVEL,
    SAME_LEVEL_PRESSURE, SAME_NODE,
};
use crate::linear::quantile;

/// Pressure levels: blocks of nearly constant pressure, clustered; without them up to eight quantiles of the pressure.
pub(super) fn find(rows: &mut Rows, range: (f64, f64)) {
    let span = (range.1 - range.0).max(1.0);
    let mut means: Vec<(f64, f64)> = Vec::new(); // pressure, rows
    let mut steady = 0;
    let mut from = 0;
    let n = rows.len();
    for i in 1..=n {
        if i == n || rows.block[i] != rows.block[from] {
            let block = &rows.contexts[from..i];
            let mean = block.iter().map(|c| c.pressure).sum::<f64>() / block.len() as f64;
            let spread =
                (block.iter().map(|c| (c.pressure - mean).powi(2)).sum::<f64>() / block.len() as f64).sqrt();
            if spread < LEVEL_SPREAD * span.max(LEVEL_SPREAD_OF_MEAN * mean.abs()) {
                means.push((mean, (i - from) as f64));
                steady += i - from;
            }
            from = i;
        }
    }
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<(f64, f64)> = Vec::new();
    for (p, w) in means {
        match found.last_mut() {
            Some(last) if p - last.0 < (SAME_LEVEL * span).max(SAME_LEVEL_PRESSURE) => {
                last.0 = (last.0 * last.1 + p * w) / (last.1 + w);
                last.1 += w;
            }
            _ => found.push((p, w)),
        }
    }
    found.retain(|(_, w)| *w * LEVEL_ROWS > n as f64);
    if steady * 10 >= n * LEVEL_TENTHS && (1..=MOST_LEVELS).contains(&found.len()) {
        rows.levels = found.iter().map(|f| f.0).collect();
        rows.steady = true;
    } else {
        let mut all: Vec<f64> = rows.contexts.iter().map(|c| c.pressure).collect();
        let mut levels: Vec<f64> =
            (0..RANGE_NODES).map(|k| quantile(&mut all, k as f64 / (RANGE_NODES - 1) as f64)).collect();
        // Spread evenly rather than by how long the pressure dwelt: curves need nodes where the range is.
        let (lo, hi) = (levels[0], levels[RANGE_NODES - 1]);
        for (k, level) in levels.iter_mut().enumerate() {
            *level = 0.5 * *level + 0.5 * (lo + (hi - lo) * k as f64 / (RANGE_NODES - 1) as f64);
        }
        levels.dedup_by(|a, b| (*a - *b).abs() < SAME_NODE * span);
        rows.levels = levels;
    }
    let nearest = |p: f64| {
        rows.levels
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1 - p).abs().total_cmp(&(b.1 - p).abs()))
            .map_or(0, |(i, _)| i as u32)
    };
    rows.level = rows.contexts.iter().map(|c| nearest(c.pressure)).collect();
}
