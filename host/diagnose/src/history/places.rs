//! Where the error of static curves on held-out runs is concentrated: run within mounting, time since mounting, mounting.
//!
//! How likely a concentration is by chance comes from shuffling whole runs: within each mounting for the order, over all for the mounting.

use super::campaign::Points;
use super::criteria::{PLACES_CONCENTRATED, PLACES_SHUFFLES, PLACES_SURE};
use super::unseen::Unseen;
use crate::linear::Random;
use crate::verdict::Region;

/// Number of a run within its mounting, from 1.
pub(super) const RUN_IN_MOUNTING: &str = "run-in-mounting";

/// The places, the most informative first.
pub(super) fn regions(points: &Points, unseen: &Unseen, since: &[f64]) -> Vec<Region> {
    let energy: Vec<f64> = points
        .runs
        .iter()
        .map(|r| {
            let own = (r.points.0..r.points.1).map(|i| unseen.error(points, i)).filter(|e| e.is_finite());
            own.map(|e| e * e).sum()
        })
        .collect();
    let all: f64 = energy.iter().sum();
    if !(all > 0.0) {
        return Vec::new();
    }
    let count = |runs: &[usize]| -> f64 {
        runs.iter().map(|r| (points.runs[*r].points.1 - points.runs[*r].points.0) as f64).sum()
    };
    let share = |runs: &[usize]| runs.iter().map(|r| energy[*r]).sum::<f64>() / all;
    let first: Vec<usize> = points
        .mountings
        .iter()
        .filter(|m| m.runs.len() > 1)
        .filter_map(|m| m.runs.first().copied())
        .collect();
    let p_first = chance(points, &energy, true, share(&first) * all, |e| first.iter().map(|r| e[*r]).sum());
    let rows = |runs: &[usize]| count(runs) / points.len() as f64;
    let is_concentrated =
        |runs: &[usize], p: f64| share(runs) >= PLACES_CONCENTRATED * rows(runs) && p <= PLACES_SURE;
    let mut found = Vec::new();
    if is_concentrated(&first, p_first) {
        let (share, rows) = (share(&first), rows(&first));
        let region = |coordinate: &str, from: f64, to: f64, unit: &str| Region {
            coordinate: coordinate.into(),
            from,
            to,
            share,
            rows,
            p: p_first,
            unit: unit.into(),
            recordings: Vec::new(),
        };
        let ends = first.iter().map(|r| points.runs[*r].points.1.saturating_sub(1));
        let end = ends.map(|i| since[i]).fold(0.0, f64::max);
        found.push(region(RUN_IN_MOUNTING, 1.0, 1.0, ""));
        found.push(region("time-since-mounting", 0.0, end, "s"));
    }
    let own = |m: &usize| share(&points.mountings[*m].runs);
    let worst = (0..points.mountings.len()).max_by(|a, b| own(a).total_cmp(&own(b)));
    if let Some(m) = worst.filter(|_| points.mountings.len() > 1) {
        let runs = &points.mountings[m].runs;
        let largest = |e: &[f64]| {
            let sums = points.mountings.iter().map(|m| m.runs.iter().map(|r| e[*r]).sum::<f64>());
            sums.fold(0.0, f64::max)
        };
        let p = chance(points, &energy, false, share(runs) * all, largest);
        if is_concentrated(runs, p) {
            let number = (m + 1) as f64;
            let (share, rows) = (share(runs), rows(runs));
            found.push(Region {
                coordinate: "mounting".into(),
                from: number,
                to: number,
                share,
                rows,
                p,
                unit: String::new(),
                recordings: Vec::new(),
            });
        }
    }
    found
}

/// How often shuffled runs give at least as much.
fn chance(
    points: &Points,
    energy: &[f64],
    within: bool,
    measured: f64,
    statistic: impl Fn(&[f64]) -> f64,
) -> f64 {
    let mut random = Random(0x5eed);
    let mut as_much = 1;
    let groups: Vec<Vec<usize>> = if within {
        points.mountings.iter().map(|m| m.runs.clone()).collect()
    } else {
        vec![(0..points.runs.len()).collect()]
    };
    for _ in 0..PLACES_SHUFFLES {
        let mut shuffled = energy.to_vec();
        for group in &groups {
            for k in (1..group.len()).rev() {
                shuffled.swap(group[k], group[random.below(k + 1)]);
            }
        }
        // Sums of the same numbers in another order differ by rounding.
        as_much += usize::from(statistic(&shuffled) >= measured * (1.0 - 1e-12));
    }
    as_much as f64 / (PLACES_SHUFFLES + 1) as f64
}
