//! F_AVG: the mid-line of the hysteresis loop, chunk by chunk.
//!
//! The thesis cuts the stroke into chunks, 500 per unit of contraction, and averages force and contraction in each over both
//! branches and all cycles. So here; branches are averaged first each by itself. A chunk with one branch only has that branch's
//! force with the fitted friction taken off.

use std::collections::BTreeMap;

use super::errors::{CHUNKS, least_rows};
use super::prepared::Prepared;

/// One chunk of a mid-line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MidPoint {
    /// The tested level, or the interval of a continuous range.
    pub group: u32,
    /// Mean pressure, Pa.
    pub pressure: f64,
    /// Mean stroke, m.
    pub stroke: f64,
    /// ΔL/L0.
    pub contraction: f64,
    /// `F_AVG`, N.
    pub force: f64,
    /// Mean force while shortening, N, where there is that branch.
    pub shortening: Option<f64>,
    /// Mean force while lengthening, N, where there is that branch.
    pub lengthening: Option<f64>,
    /// `F_B` at this pressure, N.
    pub blocked: f64,
}

#[derive(Default, Clone, Copy)]
struct Branch {
    rows: f64,
    pressure: f64,
    stroke: f64,
    force: f64,
}

/// The mid-lines of all pressures, in order of group, finer pressure and contraction.
#[must_use]
pub fn midline(prepared: &Prepared) -> Vec<MidPoint> {
    let l0 = prepared.braid.rest_length();
    let range = prepared.points.pressure;
    let least = 0.05 * prepared.blocked(range.high).abs();
    let mut chunks: BTreeMap<(u32, u32, i64), [Branch; 3]> = BTreeMap::new();
    for (i, p) in prepared.points.list.iter().enumerate() {
        if !prepared.counts(i) {
            continue;
        }
        let group = prepared.design.bins[prepared.design.rows[i].bin as usize].group;
        let fine = prepared.fine_pressure(p.pressure);
        let x = p.stroke + prepared.shift[i];
        let chunk = (x / l0 * CHUNKS).floor() as i64;
        let branches = chunks.entry((group, fine, chunk)).or_default();
        let b = &mut branches[if p.direction > 0.0 { 2 } else { usize::from(p.direction == 0.0) }];
        let n = f64::from(p.rows);
        b.rows += n;
        b.pressure += n * p.pressure;
        b.stroke += n * x;
        b.force += n * p.force;
    }
    let rows = |branches: &[Branch; 3]| branches.iter().map(|b| b.rows).sum::<f64>();
    let least_rows = least_rows(chunks.iter().map(|((group, ..), branches)| (*group, rows(branches))));
    chunks
        .into_iter()
        .filter(|((group, ..), branches)| rows(branches) >= least_rows[group])
        .map(|((group, _, _), branches)| {
            let present: Vec<&Branch> = branches.iter().filter(|b| b.rows > 0.0).collect();
            let n = present.len() as f64;
            let mean = |of: fn(&Branch) -> f64| present.iter().map(|b| of(b) / b.rows).sum::<f64>() / n;
            let pressure = mean(|b| b.pressure);
            let stroke = mean(|b| b.stroke);
            let force = |b: &Branch| (b.rows > 0.0).then(|| b.force / b.rows);
            let (lengthening, shortening) = (force(&branches[0]), force(&branches[2]));
            let friction = if prepared.design.friction { prepared.curves_at(pressure).1 } else { 0.0 };
            let mid = match (shortening, lengthening) {
                (Some(up), None) => up / (1.0 - friction),
                (None, Some(down)) => down / (1.0 + friction),
                _ => mean(|b| b.force),
            };
            MidPoint {
                group,
                pressure,
                stroke,
                contraction: stroke / l0,
                force: mid,
                shortening,
                lengthening,
                blocked: prepared.blocked(pressure).max(least),
            }
        })
        .collect()
}
