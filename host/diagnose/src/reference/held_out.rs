//! How much of the difference is gone on recordings that the sizes were not fitted to.

use nalgebra::{DMatrix, DVector};

use super::cells::Cell;
use super::contrast::Contrast;
use super::criteria::SHOWS;

/// What AFTER differs by from what was to be expected without a change, N: one value for each cell of AFTER, in order.
pub(super) fn difference(cells: &[Cell], contrast: &Contrast) -> DVector<f64> {
    let after: Vec<usize> = (0..cells.len()).filter(|i| cells[*i].after).collect();
    let mut inner = contrast.projector.select_columns(&after).select_rows(&after);
    let floor = 1e-9 * inner.diagonal().max().max(f64::MIN_POSITIVE);
    for i in 0..after.len() {
        inner[(i, i)] += floor;
    }
    let projected = contrast.projected.select_rows(&after);
    inner.cholesky().map_or_else(|| DVector::zeros(after.len()), |f| f.solve(&projected))
}

/// Root mean squares before and after, N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Unseen {
    pub before: f64,
    pub after: f64,
    /// Whether any recording was held out: none can be where a change shows in one recording only.
    pub held: bool,
}

impl Unseen {
    /// Share of the difference's energy that is gone.
    pub fn share(&self) -> f64 {
        if self.before > 0.0 { (1.0 - (self.after / self.before).powi(2)).clamp(-1.0, 1.0) } else { 0.0 }
    }
}

/// Sizes by generalised least squares of the shapes' columns.
fn sizes(contrast: &Contrast, shapes: &DMatrix<f64>) -> Option<DVector<f64>> {
    let inner = shapes.tr_mul(&(&contrast.projector * shapes));
    Some(inner.cholesky()?.solve(&shapes.tr_mul(&contrast.projected)))
}

/// Which changes a run shows: not where it has a small share of what the run that shows it most has, as before the moment at which it
/// begins. `rms`: of each change, by run.
pub(super) fn shown(rms: &[Vec<f64>]) -> Vec<Vec<bool>> {
    let changes = rms.first().map_or(0, Vec::len);
    let most: Vec<f64> = (0..changes).map(|c| rms.iter().map(|r| r[c]).fold(0.0, f64::max)).collect();
    rms.iter().map(|r| (0..changes).map(|c| r[c] > SHOWS * most[c]).collect()).collect()
}

/// Which of the two parts every run belongs to, so that both show every change: a change that begins within AFTER shows in the runs after
/// its moment only. `None` for a run that alone shows some change: what it says cannot be judged by others. `shows`: by run and change.
pub(super) fn parts(shows: &[Vec<bool>]) -> Vec<Option<usize>> {
    let changes = shows.first().map_or(0, Vec::len);
    let total: Vec<usize> = (0..changes).map(|c| shows.iter().filter(|s| s[c]).count()).collect();
    let mut seen = vec![[0.0_f64; 2]; changes];
    let mut last = 1;
    let mut part = |own: &Vec<bool>| {
        let showing = || (0..changes).filter(|c| own[*c]);
        if showing().any(|c| total[c] < 2) {
            return None;
        }
        // The part that has fewer of what this run shows, rare changes first; otherwise alternately.
        let more: f64 = showing().map(|c| (seen[c][0] - seen[c][1]) / (total[c] as f64).powi(2)).sum();
        let side = if more == 0.0 { 1 - last } else { usize::from(more > 0.0) };
        last = side;
        showing().for_each(|c| seen[c][side] += 1.0);
        Some(side)
    };
    shows.iter().map(&mut part).collect()
}

/// Fits the shapes to one part of the runs of AFTER and judges them on the other, both ways: over all of AFTER, and over the held-out runs
/// in which the shapes show.
pub(super) fn unseen(cells: &[Cell], contrast: &Contrast, shapes: &[DVector<f64>]) -> (Unseen, Unseen) {
    let difference = difference(cells, contrast);
    let after: Vec<usize> = (0..cells.len()).filter(|i| cells[*i].after).collect();
    let rms = |v: &DVector<f64>| (v.norm_squared() / v.len().max(1) as f64).sqrt();
    let before = rms(&difference);
    if shapes.is_empty() {
        let none = Unseen { before, after: before, held: false };
        return (none, none);
    }
    let columns: Vec<DVector<f64>> = shapes.iter().map(|s| s / s.amax().max(f64::MIN_POSITIVE)).collect();
    let shapes = DMatrix::from_columns(&columns);
    let mut runs: Vec<usize> = after.iter().map(|i| cells[*i].run).collect();
    runs.dedup();
    let of_run = |run: &usize| -> Vec<f64> {
        let own: Vec<usize> = after.iter().copied().filter(|i| cells[*i].run == *run).collect();
        columns.iter().map(|c| rms(&c.select_rows(&own))).collect()
    };
    let shown = shown(&runs.iter().map(of_run).collect::<Vec<_>>());
    let parts = parts(&shown);
    let place = |i: usize| runs.iter().position(|r| *r == cells[i].run).unwrap_or(0);
    let judged = |i: usize| parts[place(i)].is_some() && shown[place(i)].contains(&true);
    let held = after.iter().any(|i| judged(*i));
    let part = |i: usize| if held { parts[place(i)] } else { None };
    let mut left = difference.clone();
    for side in [Some(0), Some(1), None] {
        let own: Vec<usize> = (0..after.len()).filter(|k| part(after[*k]) == side).collect();
        if own.is_empty() {
            continue;
        }
        // What cannot be held out is in every fit.
        let dropped: Vec<usize> = own.iter().map(|k| after[*k]).filter(|_| side.is_some()).collect();
        let Some(found) = contrast.without_cells(&dropped).and_then(|c| sizes(&c, &shapes)) else { continue };
        for k in own {
            left[k] -= (0..shapes.ncols()).map(|c| shapes[(after[k], c)] * found[c]).sum::<f64>();
        }
    }
    let where_shown: Vec<usize> = (0..after.len()).filter(|k| judged(after[*k])).collect();
    let over = |v: &DVector<f64>| rms(&v.select_rows(&where_shown));
    let all = Unseen { before, after: rms(&left), held };
    (all, if held { Unseen { before: over(&difference), after: over(&left), held } } else { all })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_parts_show_every_change_and_a_run_alone_is_in_none() {
        let of = |all: &[u8]| all.iter().map(|s| vec![s & 1 > 0, s & 2 > 0]).collect::<Vec<_>>();
        // Alternately, where all show one change.
        assert_eq!(parts(&of(&[1, 1, 1, 1])), [Some(0), Some(1), Some(0), Some(1)]);
        // The second change begins late, and its two runs would be in one part by alternation.
        let two = parts(&of(&[1, 3, 1, 3]));
        assert_ne!(two[1], two[3], "{two:?}");
        assert_eq!(parts(&of(&[0, 0, 2]))[2], None);
    }

    #[test]
    fn recordings_that_alone_show_a_change_are_judged_by_one_another() {
        // Four recordings of AFTER; the second and the fourth show the change, at three and at one times its size.
        let cells: Vec<Cell> = (0..8).map(|i| Cell { run: i / 2, after: true, ..Cell::default() }).collect();
        let shape = DVector::from_fn(8, |i, _| if i / 2 % 2 == 1 { 1.0 } else { 0.0 });
        let y = DVector::from_fn(8, |i, _| [0.0, 3.0, 0.0, 1.0][i / 2]);
        let contrast = Contrast::new(DMatrix::identity(8, 8), None, y, 4.0).expect("definite");
        let (all, where_shown) = unseen(&cells, &contrast, &[shape]);
        // Three predicts one, and one predicts three.
        assert!(all.held && (where_shown.share() - 0.2).abs() < 1e-6, "{all:?} {where_shown:?}");
    }
}
