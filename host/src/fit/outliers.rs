//! Readings that do not belong to the rest: found, taken out, and listed.

use crate::recording::Campaign;

use super::points::{Points, median};
use super::prepared::Prepared;
use super::screen::{Outlier, Use};

/// Finds single rows that jump out of their piece and takes them out of its mean.
///
/// Only pieces whose own spread is far above that of the others are looked at row by row.
pub fn despike(campaign: &Campaign, points: &mut Points) -> Vec<Outlier> {
    let mut spreads: Vec<f64> =
        points.list.iter().filter(|p| p.rows >= 3).map(|p| p.force_range.1 - p.force_range.0).collect();
    let typical = median(&mut spreads).max(4.0 * points.row_noise);
    let mut found = Vec::new();
    if typical <= 0.0 {
        return found;
    }
    for p in points.list.iter_mut().filter(|p| p.rows >= 3) {
        if p.force_range.1 - p.force_range.0 < 6.0 * typical {
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
        for i in stray {
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

impl Prepared {
    /// Points far off the model for a moment only: spikes. A long stretch off the model is a misfit, and stays.
    pub(super) fn find_outliers(&mut self) {
        let residuals = self.design.residuals(&self.parameters);
        let scatter = self.scatter(&residuals);
        let group = |i: usize| self.design.bins[self.design.rows[i].bin as usize].group as usize;
        let force = self.points.force.span();
        let far = |i: usize| {
            residuals[i].abs() > (8.0 * scatter[group(i)]).max(0.01 * force) && self.used[i] == Use::Fitted
        };
        let n = self.used.len();
        let mut i = 0;
        let mut marked = Vec::new();
        while i < n {
            if !far(i) {
                i += 1;
                continue;
            }
            let start = i;
            while i < n && far(i) {
                i += 1;
            }
            // The neighbours on both sides must be well: then it is a spike of the reading.
            let calm = |k: usize| residuals[k].abs() < 4.0 * scatter[group(k)];
            if i - start <= 3 && start > 0 && i < n && calm(start - 1) && calm(i) {
                marked.extend(start..i);
            }
        }
        for i in marked {
            self.used[i] = Use::Outlier;
            let p = &self.points.list[i];
            self.outliers.push(Outlier {
                recording: p.recording,
                row: p.first_row,
                time: p.time,
                force: p.force,
                off: residuals[i],
            });
        }
    }
}
