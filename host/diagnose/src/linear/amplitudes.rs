//! Amplitudes with signs, from products of few columns.

use nalgebra::{DMatrix, DVector};

use crate::criteria::candidates::MOST_AMPLITUDES;

/// Which signs an amplitude may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    /// Any sign, or zero.
    Free,
    /// Zero or more.
    Positive,
    /// Zero or less.
    Negative,
}

/// Amplitudes of few columns `z` against `r` by least squares under sign constraints, and the energy they remove.
///
/// All subsets of up to `most` columns are tried (there are few), so the constrained optimum is exact.
pub(crate) fn amplitudes(gram: &[Vec<f64>], moment: &[f64], signs: &[Sign], most: u32) -> (Vec<f64>, f64) {
    let n = moment.len();
    let mut best = (vec![0.0; n], 0.0);
    for subset in (1_u32..(1 << n.min(MOST_AMPLITUDES as usize))).filter(|s| s.count_ones() <= most) {
        let chosen: Vec<usize> = (0..n).filter(|i| subset & (1 << i) != 0).collect();
        let Some(solution) = solve_symmetric(gram, moment, &chosen) else { continue };
        let allowed = chosen.iter().zip(&solution).all(|(i, a)| match signs[*i] {
            Sign::Free => true,
            Sign::Positive => *a >= 0.0,
            Sign::Negative => *a <= 0.0,
        });
        let gain: f64 = chosen.iter().zip(&solution).map(|(i, a)| a * moment[*i]).sum();
        if allowed && gain > best.1 {
            let mut full = vec![0.0; n];
            for (i, a) in chosen.iter().zip(solution) {
                full[*i] = a;
            }
            best = (full, gain);
        }
    }
    best
}

/// Solves the sub-system of `chosen` unknowns by Cholesky; `None` where it is singular.
pub(crate) fn solve_symmetric(gram: &[Vec<f64>], moment: &[f64], chosen: &[usize]) -> Option<Vec<f64>> {
    let n = chosen.len();
    let scale: Vec<f64> = chosen.iter().map(|i| gram[*i][*i].sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let unit = DMatrix::from_fn(n, n, |i, j| gram[chosen[i]][chosen[j]] / (scale[i] * scale[j]));
    let factor = unit.cholesky()?;
    // The squared pivot is the part of a column that the ones before do not span.
    if factor.l_dirty().diagonal().iter().any(|root| root * root <= 1e-10) {
        return None;
    }
    let solved = factor.solve(&DVector::from_fn(n, |i, _| moment[chosen[i]] / scale[i]));
    Some(solved.iter().zip(&scale).map(|(x, s)| x / s).collect())
}
