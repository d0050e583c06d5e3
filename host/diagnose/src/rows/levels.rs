//! At which pressures a muscle was worked.

use model_core::effects::Context;

use crate::criteria::rows::{
    LEVEL_ROWS, LEVEL_SPREAD, LEVEL_SPREAD_OF_MEAN, LEVEL_TENTHS, MOST_LEVELS, RANGE_NODES, SAME_LEVEL,
    SAME_LEVEL_PRESSURE, SAME_NODE,
};
use pam_data::statistics::quantile;

/// The pressures of a campaign.
pub(super) struct Levels {
    /// Mean pressure of each level, Pa, increasing.
    pub pressures: Vec<f64>,
    /// Whether they are pressures at which the muscle was worked (else they are places on the pressure's range).
    pub steady: bool,
}

impl Levels {
    /// Half-strokes of nearly constant pressure, clustered; without them up to eight quantiles of the pressure.
    pub(super) fn find(contexts: &[Context<f64>], piece: &[u32], range: (f64, f64)) -> Self {
        let span = (range.1 - range.0).max(1.0);
        let mut means: Vec<(f64, f64)> = Vec::new(); // pressure, rows
        let mut steady = 0;
        let mut from = 0;
        let n = contexts.len();
        for i in 1..=n {
            if i == n || piece[i] != piece[from] {
                let block = &contexts[from..i];
                let mean = block.iter().map(|c| c.pressure).sum::<f64>() / block.len() as f64;
                let spread = (block.iter().map(|c| (c.pressure - mean).powi(2)).sum::<f64>()
                    / block.len() as f64)
                    .sqrt();
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
            Self { pressures: found.iter().map(|f| f.0).collect(), steady: true }
        } else {
            Self { pressures: nodes(contexts, span), steady: false }
        }
    }

    /// The level nearest to each row's pressure.
    pub(super) fn of_rows(&self, contexts: &[Context<f64>]) -> Vec<u32> {
        let nearest = |p: f64| {
            let away = self.pressures.iter().map(|level| (level - p).abs()).enumerate();
            away.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i as u32)
        };
        contexts.iter().map(|c| nearest(c.pressure)).collect()
    }
}

/// Places on the range of a pressure that has no levels: curves need nodes where the range is, spread evenly rather than by how long
/// the pressure dwelt.
fn nodes(contexts: &[Context<f64>], span: f64) -> Vec<f64> {
    let mut all: Vec<f64> = contexts.iter().map(|c| c.pressure).collect();
    let last = RANGE_NODES - 1;
    let mut nodes: Vec<f64> = (0..RANGE_NODES).map(|k| quantile(&mut all, k as f64 / last as f64)).collect();
    let (lo, hi) = (nodes[0], nodes[last]);
    for (k, node) in nodes.iter_mut().enumerate() {
        *node = 0.5 * *node + 0.5 * (lo + (hi - lo) * k as f64 / last as f64);
    }
    nodes.dedup_by(|a, b| (*a - *b).abs() < SAME_NODE * span);
    nodes
}
