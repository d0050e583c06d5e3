//! Rests among strokes: where friction is at another place of its gap than a model holds it at.
//!
//! While the length is held, friction can be anywhere between its two directions. A regulator's drift makes the braid slip, in some rests and
//! not in others, and the force then moves towards the other direction by up to twice the friction.

use std::collections::BTreeMap;

use super::super::criteria::{CATALOGUE_SLIP, CATALOGUE_SLIP_SPREADS};
use super::cells::{Cell, REST, VENTED};
use crate::rows::Rows;
use pam_data::statistics::{deviation_from_median, median};

/// Rows at rest whose direction the pressure has turned since the muscle moved. The drift of a regulator turns it by chance, in one campaign and
/// not in the other, while friction does not follow before the pressure has driven the braid through twice its friction.
pub(super) fn reversed(rows: &Rows) -> Vec<bool> {
    let (mut recording, mut way) = (None, 0.0);
    let one = |i: usize| {
        if recording != Some(rows.recording[i]) {
            (recording, way) = (Some(rows.recording[i]), 0.0);
        }
        if rests(rows, i) {
            return way * rows.sign[i] < 0.0;
        }
        way = rows.sign[i];
        false
    };
    (0..rows.len()).map(one).collect()
}

fn rests(rows: &Rows, i: usize) -> bool {
    rows.contexts()[i].resting > 0.5
}

/// Number of the rest that each row belongs to, from 1; zero where the muscle moves.
pub(super) fn numbers(rows: &Rows) -> Vec<usize> {
    let (mut number, mut resting) = (0, false);
    let one = |i: usize| {
        let begins = i == 0 || rows.recording[i] != rows.recording[i - 1] || !resting;
        resting = rests(rows, i);
        number += usize::from(resting && begins);
        if resting { number } else { 0 }
    };
    (0..rows.len()).map(one).collect()
}

fn is_rest(cell: &Cell) -> bool {
    (REST..VENTED).contains(&cell.key.3)
}

/// Weighted means of the difference while the muscle moves, by level, direction and place.
fn moving(cells: &[Cell], difference: &[f64], variance: &[f64]) -> BTreeMap<(u32, bool, usize), f64> {
    let mut sums: BTreeMap<(u32, bool, usize), (f64, f64)> = BTreeMap::new();
    for (i, cell) in cells.iter().enumerate().filter(|(_, c)| c.key.3 < REST) {
        let sum = sums.entry((cell.key.0, cell.key.1, cell.key.2)).or_default();
        *sum = (sum.0 + difference[i] / variance[i], sum.1 + 1.0 / variance[i]);
    }
    sums.into_iter().map(|(key, (sum, weight))| (key, sum / weight)).collect()
}

/// Which cells belong to a rest in which friction has slipped. `half_gap`: friction of each cell, N.
///
/// What a change does to all rests, as creep does, is common to them; what the strokes beside a rest show as well is not a slip. A slip is what a
/// rest has of its own beyond both.
pub(super) fn slipped(cells: &[Cell], difference: &[f64], variance: &[f64], half_gap: &[f64]) -> Vec<bool> {
    let beside = moving(cells, difference, variance);
    let own = |i: usize| {
        let (level, way, bin, _) = cells[i].key;
        let near = [Some(bin), bin.checked_sub(1), Some(bin + 1)];
        let moved = near.into_iter().flatten().find_map(|b| beside.get(&(level, way, b)))?;
        let share = cells[i].direction * (difference[i] - moved) / half_gap[i];
        share.is_finite().then_some((i, share))
    };
    let shares: Vec<(usize, f64)> =
        (0..cells.len()).filter(|i| is_rest(&cells[*i])).filter_map(own).collect();
    let middle = median(&mut shares.iter().map(|s| s.1).collect::<Vec<f64>>());
    let mut sizes: Vec<f64> = shares.iter().map(|s| (s.1 - middle).abs()).collect();
    let spread = deviation_from_median(median(&mut sizes));
    let limit = (CATALOGUE_SLIP_SPREADS * spread).max(CATALOGUE_SLIP);
    let outside: Vec<usize> =
        shares.iter().filter(|s| (s.1 - middle).abs() > limit).map(|s| cells[s.0].rest).collect();
    cells.iter().map(|c| is_rest(c) && outside.contains(&c.rest)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strokes and one rest at each of eight levels, rests on shortening.
    fn cells() -> Vec<Cell> {
        let cell = |level: u32, kind: i32, rest: usize| Cell {
            key: (level, true, 3, kind),
            recording: level as usize,
            rows: vec![0],
            rest,
            time: 0.0,
            force: 100.0,
            stroke: 0.01,
            direction: 1.0,
        };
        (0..8)
            .flat_map(|l| [cell(l, 0, 0), cell(l, REST, 1 + l as usize), cell(l, REST + 1, 1 + l as usize)])
            .collect()
    }

    fn slips(of: impl Fn(u32, bool) -> f64) -> Vec<usize> {
        let cells = cells();
        let ripple = |l: u32| 0.1 * f64::from(l % 3);
        let difference: Vec<f64> = cells.iter().map(|c| of(c.key.0, is_rest(c)) + ripple(c.key.0)).collect();
        let n = cells.len();
        let slipped = slipped(&cells, &difference, &vec![0.04; n], &vec![10.0; n]);
        let mut rests: Vec<usize> =
            cells.iter().zip(slipped).filter(|(_, s)| *s).map(|(c, _)| c.rest).collect();
        rests.dedup();
        rests
    }

    #[test]
    fn one_rest_of_its_own_has_slipped() {
        assert_eq!(slips(|l, rest| if rest && l == 2 { 8.0 } else { 0.0 }), [3]);
    }

    #[test]
    fn a_difference_of_all_rests_or_of_a_level_is_not_a_slip() {
        assert!(slips(|_, rest| if rest { 8.0 } else { 0.0 }).is_empty());
        assert!(slips(|l, _| if l == 2 { 8.0 } else { 0.0 }).is_empty());
    }
}
