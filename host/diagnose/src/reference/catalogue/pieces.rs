//! How many independent pieces of evidence the states amount to, by the correlation of what a law leaves in them.
//!
//! Neighbouring states show the same error: they share the noise of a half-stroke, and what a law misses it misses over a part of the stroke. The
//! evidence is a sum of squares over the states, which has `n²/Σρ²` equivalent degrees of freedom (Satterthwaite 1946), with `ρ` the
//! correlation of each two of `n` states. `ρ` falls exponentially with the distance in level, direction, place and kind of motion, each as
//! the neighbours along it say.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::super::criteria::{CATALOGUE_CORRELATED, CATALOGUE_NEIGHBOURS};
use super::cells::{Cells, VENTED};

/// Level, direction, place and kind of motion.
type Place = [i64; 4];

/// The residual of each state, N: the mean over its cells, by their certainty.
fn by_state(cells: &Cells, residual: &DVector<f64>) -> Vec<(Place, f64)> {
    let mut sums = vec![([0; 4], 0.0, 0.0); cells.groups];
    for (i, cell) in cells.cells.iter().enumerate() {
        let (level, way, bin, kind) = cell.key;
        let weight = 1.0 / cells.variance[i];
        let sum = &mut sums[cells.group[i]];
        let place = [i64::from(level), i64::from(way), bin as i64, i64::from(kind)];
        *sum = (place, sum.1 + weight * residual[i], sum.2 + weight);
    }
    let moves = |place: &Place| place[3] < i64::from(VENTED);
    sums.into_iter()
        .filter(|s| moves(&s.0) && s.2 > 0.0)
        .map(|(place, sum, weight)| (place, sum / weight))
        .collect()
}

/// Correlation of neighbours along one coordinate; zero where there are too few to decide.
fn of_neighbours(states: &[(Place, f64)], coordinate: usize) -> f64 {
    let at: BTreeMap<Place, f64> = states.iter().copied().collect();
    let next = |place: &Place| {
        let mut next = *place;
        next[coordinate] += 1;
        at.get(&next)
    };
    let pairs: Vec<(f64, f64)> = states.iter().filter_map(|(place, a)| Some((*a, *next(place)?))).collect();
    let energy: f64 = pairs.iter().map(|(a, b)| 0.5 * (a * a + b * b)).sum();
    if pairs.len() < CATALOGUE_NEIGHBOURS || !(energy > 0.0) {
        return 0.0;
    }
    let rho = pairs.iter().map(|(a, b)| a * b).sum::<f64>() / energy;
    rho.clamp(-CATALOGUE_CORRELATED, CATALOGUE_CORRELATED)
}

fn of_states(states: &[(Place, f64)]) -> f64 {
    let squares: Vec<f64> = (0..4).map(|k| of_neighbours(states, k).powi(2)).collect();
    let n = states.len() as f64;
    let both = |a: &Place, b: &Place| -> f64 {
        let along = |k: usize| {
            let distance = a[k].abs_diff(b[k]);
            if distance == 0 { 1.0 } else { squares[k].powi(distance.min(1000) as i32) }
        };
        (0..4).map(along).product()
    };
    let sum: f64 =
        states.iter().flat_map(|a| states.iter().map(move |b| (a, b))).map(|(a, b)| both(&a.0, &b.0)).sum();
    if sum > 0.0 { n * n / sum } else { 1.0 }
}

/// The number of independent pieces, by what the best law leaves.
pub(super) fn independent(cells: &Cells, residual: &DVector<f64>) -> f64 {
    of_states(&by_state(cells, residual)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six levels, two directions, eight places, one speed.
    fn states(of: impl Fn(&Place) -> f64) -> Vec<(Place, f64)> {
        let places = (0..6).flat_map(|l| (0..2).flat_map(move |d| (0..8).map(move |b| [l, d, b, 0])));
        places.map(|p| (p, of(&p))).collect()
    }

    #[test]
    fn states_without_correlation_count_singly() {
        // Numbers without order (SplitMix64).
        let pieces = of_states(&states(|p| {
            let mut z = ((p[0] * 16 + p[1] * 8 + p[2] + 1) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        }));
        assert!((60.0..=96.0).contains(&pieces), "{pieces}");
    }

    #[test]
    fn an_error_common_to_all_states_counts_as_few_pieces() {
        let pieces = of_states(&states(|_| 1.0));
        assert!((1.0..2.0).contains(&pieces), "{pieces}");
        // An error of each level of its own, with no order among levels: six pieces.
        let pieces = of_states(&states(|p| [3.0, -2.0, 2.5, 2.0, -3.0, -1.5][p[0] as usize]));
        assert!((4.0..9.0).contains(&pieces), "{pieces}");
    }

    #[test]
    fn an_error_that_turns_with_the_direction_is_as_correlated() {
        let (same, other) =
            (of_states(&states(|_| 1.0)), of_states(&states(|p| if p[1] == 0 { 1.0 } else { -1.0 })));
        assert!((same - other).abs() < 1e-9, "{same} {other}");
    }
}
