//! Force readings outside the scatter of the others: found, excluded, and listed.

use pam_data::recording::Campaign;

use super::points::Points;
use super::problem::Problem;
use super::screen::{Outlier, PointUse, Screen};
use super::weights::scatter;
use pam_data::statistics::median;

/// Finds single rows far from the others of their point and takes them out of its mean.
///
/// Only points whose range is far above that of the others are examined row by row. Such rows beside a reversal belong to the other
/// branch, as noise of the stroke hides a reversal by a row or two: they leave the mean too, but are not reported as outliers.
pub(super) fn despike(campaign: &Campaign, points: &mut Points) -> Vec<Outlier> {
    let mut spreads: Vec<f64> =
        points.list.iter().filter(|p| p.rows >= 3).map(|p| p.force_range.1 - p.force_range.0).collect();
    let typical = median(&mut spreads).max(4.0 * points.row_noise);
    let mut found = Vec::new();
    if typical <= 0.0 {
        return found;
    }
    for index in 0..points.list.len() {
        let reversals = points.beside_reversal(index);
        let p = &mut points.list[index];
        if p.dropout || p.rows < 3 || p.force_range.1 - p.force_range.0 < 6.0 * typical {
            continue;
        }
        let Some(force) = campaign.recordings.get(p.recording as usize).and_then(|r| r.force.as_ref()) else {
            continue;
        };
        let (first, last) = (p.first_row as usize, (p.first_row + p.rows) as usize);
        let Some(rows) = force.get(first..last) else { continue };
        let middle = median(&mut rows.to_vec());
        let stray: Vec<usize> =
            (0..rows.len()).filter(|i| (rows[*i] - middle).abs() > 4.0 * typical).collect();
        // Many strays are a real jump, not spikes.
        if stray.is_empty() || stray.len() * 5 > rows.len() {
            continue;
        }
        let kept = rows.iter().enumerate().filter(|(i, _)| !stray.contains(i)).map(|(_, f)| *f);
        p.force = kept.sum::<f64>() / (rows.len() - stray.len()) as f64;
        let others_before =
            if reversals.0 { stray.iter().zip(0..).take_while(|(s, k)| **s == *k).count() } else { 0 };
        let to_the_end = stray.iter().rev().zip((0..rows.len()).rev());
        let others_after = if reversals.1 { to_the_end.take_while(|(s, k)| **s == *k).count() } else { 0 };
        for &i in &stray[others_before..stray.len() - others_after] {
            found.push(Outlier {
                recording: p.recording,
                row: (first + i) as u32,
                time: campaign.recordings[p.recording as usize].time[first + i],
                force: rows[i],
                off: rows[i] - middle,
            });
        }
    }
    found
}

/// Excludes points far from the model for a moment only: spikes of the reading. A long stretch far from the model is a misfit, and
/// stays.
pub(super) fn find(problem: &Problem, screen: &Screen, parameters: &[f64]) -> Screen {
    let points = &problem.points;
    let residuals = problem.design.residuals(parameters);
    // A point of few rows scatters as rows do, also where most points are means over many. Of a million rows of normal noise none
    // lies beyond eight standard deviations.
    let within = points.scatter_within();
    let scatter: Vec<f64> = scatter(problem, screen, &residuals).iter().map(|s| s.hypot(within)).collect();
    let group = |i: usize| problem.group_of(i);
    let force = points.force.span();
    let far = |i: usize| {
        residuals[i].abs() > (8.0 * scatter[group(i)]).max(0.01 * force) && screen.used[i] == PointUse::Fitted
    };
    let n = screen.used.len();
    let mut found = screen.clone();
    let mut i = 0;
    while i < n {
        if !far(i) {
            i += 1;
            continue;
        }
        let start = i;
        while i < n && far(i) {
            i += 1;
        }
        // The neighbours on both sides must agree with the model: then it is a spike of the reading.
        let calm = |k: usize| residuals[k].abs() < 4.0 * scatter[group(k)];
        if !(i - start <= 3 && start > 0 && i < n && calm(start - 1) && calm(i)) {
            continue;
        }
        // Beside a reversal they are rows of the other branch, not spikes.
        if points.beside_reversal(start).0 || points.beside_reversal(i - 1).1 {
            found.used[start..i].fill(PointUse::NearReversal);
            continue;
        }
        found.used[start..i].fill(PointUse::Outlier);
        found.outliers.extend((start..i).map(|k| {
            let p = &points.list[k];
            Outlier {
                recording: p.recording,
                row: p.first_row,
                time: p.time,
                force: p.force,
                off: residuals[k],
            }
        }));
    }
    found
}
