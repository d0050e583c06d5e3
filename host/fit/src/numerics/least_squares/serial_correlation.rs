//! Blocks that follow each other share the slow part of the noise: their errors are then correlated.
//!
//! The noise is taken for an exponentially correlated one, `ρ(d) = exp(−d/τ)`. Its time τ comes from the residuals; with it follows what
//! the coefficients vary by, beyond what a jackknife of independent blocks says, and how many independent blocks the residuals are worth
//! (F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110, doi 10.2307/3002019).

use nalgebra::{DMatrix, DVector};
use pam_data::statistics::median;

/// Rows from which τ is estimated, at most; more are downsampled.
const ROWS: usize = 1500;
/// Width of a bin of time differences, in sampling intervals.
const BIN: f64 = 5.0;
/// Share of the variance that neighbouring rows must have in common for the noise to count as correlated.
const IN_COMMON: f64 = 0.05;
/// A fit takes part of slow noise with it, so that the residuals forget too soon: the time t at which their correlation has fallen to 1/e
/// is about `τ/(1 + 12 τ/T)` over a span T. Simulated with offset, slope, and drift over 13 stays; the test repeats it.
const TAKEN_BY_THE_FIT: f64 = 12.0;

/// How much further than independent blocks say the coefficients vary, and what the residuals are worth.
pub(super) struct Correlated {
    /// Factor of each coefficient's standard deviation, at least one.
    pub factors: Vec<f64>,
    /// Degrees of freedom of the residuals.
    pub freedom: f64,
}

/// One block as a single observation: the mean of its rows.
struct Blocks {
    rows: Vec<f64>,
    begin: Vec<f64>,
    end: Vec<f64>,
    of_row: Vec<usize>,
}

impl Blocks {
    fn of(block: &[usize], time: &[f64]) -> Self {
        let mut b = Self { rows: Vec::new(), begin: Vec::new(), end: Vec::new(), of_row: Vec::new() };
        for (i, t) in time.iter().enumerate() {
            if i == 0 || block[i] != block[i - 1] {
                b.rows.push(0.0);
                b.begin.push(*t);
                b.end.push(*t);
            }
            let last = b.rows.len() - 1;
            b.rows[last] += 1.0;
            b.end[last] = *t;
            b.of_row.push(last);
        }
        b
    }

    fn means(&self, column: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.rows.len()];
        for (v, b) in column.iter().zip(&self.of_row) {
            means[*b] += v / self.rows[*b];
        }
        means
    }

    /// Covariance of the means of noise with unit variance and the time τ, each over its block.
    fn covariance(&self, tau: f64) -> DMatrix<f64> {
        let n = self.rows.len();
        let length = |b: usize| (self.end[b] - self.begin[b]) / tau;
        // The integral of exp(−t) from 0 to x, over x.
        let average = |x: f64| if x > 1e-6 { (1.0 - (-x).exp()) / x } else { 1.0 };
        DMatrix::from_fn(n, n, |a, b| {
            if a == b {
                let x = length(a);
                return if x > 1e-3 { 2.0 * (1.0 - average(x)) / x } else { 1.0 };
            }
            let (first, second) = (a.min(b), a.max(b));
            let gap = (self.begin[second] - self.end[first]).max(0.0) / tau;
            (-gap).exp() * average(length(a)) * average(length(b))
        })
    }
}

/// Time over which the residuals forget, corrected for what the fit took; `None` for noise without memory.
fn correlation_time(residual: &[f64], time: &[f64]) -> Option<f64> {
    let stride = residual.len().div_ceil(ROWS).max(1);
    let rows: Vec<(f64, f64)> = time.iter().zip(residual).step_by(stride).map(|(t, e)| (*t, *e)).collect();
    let span = rows.last()?.0 - rows.first()?.0;
    let mut steps: Vec<f64> = rows.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let step = median(&mut steps);
    if !(step > 0.0 && span > 0.0) {
        return None;
    }
    let bins = ((span / 3.0) / (BIN * step)) as usize + 1;
    let (mut sums, mut counts) = (vec![0.0; bins + 1], vec![0.0; bins + 1]);
    let (mut near, mut near_count) = (0.0, 0.0);
    for (i, (t, e)) in rows.iter().enumerate() {
        for (later, f) in &rows[i + 1..] {
            let lag = (later - t) / step;
            if lag < 3.5 {
                near += e * f;
                near_count += 1.0;
            }
            let bin = (lag / BIN).round() as usize;
            if bin > bins {
                break;
            }
            sums[bin] += e * f;
            counts[bin] += 1.0;
        }
    }
    let variance = rows.iter().map(|(_, e)| e * e).sum::<f64>() / rows.len() as f64;
    let in_common = near / f64::max(near_count, 1.0);
    if !(in_common > IN_COMMON * variance) {
        return None;
    }
    let forgotten =
        (1..=bins).find(|b| counts[*b] > 0.0 && sums[*b] / counts[*b] < in_common / std::f64::consts::E);
    let seen = forgotten.unwrap_or(bins) as f64 * BIN * step;
    Some((seen / (1.0 - (TAKEN_BY_THE_FIT * seen / span).min(0.9))).min(span / 3.0))
}

/// What the blocks of a fit by these columns share; `None` for noise without memory, or where there are as few blocks as columns.
pub(super) fn correlated(
    columns: &[Vec<f64>],
    residual: &[f64],
    block: &[usize],
    time: &[f64],
) -> Option<Correlated> {
    let tau = correlation_time(residual, time)?;
    let blocks = Blocks::of(block, time);
    let n = blocks.rows.len();
    let means: Vec<Vec<f64>> = columns.iter().map(|c| blocks.means(c)).collect();
    let x = DMatrix::from_fn(n, columns.len(), |b, j| means[j][b]);
    let weighted = DMatrix::from_fn(columns.len(), n, |j, b| means[j][b] * blocks.rows[b]);
    let solve = (&weighted * &x).try_inverse()? * &weighted;
    let left = DMatrix::identity(n, n) - &x * &solve;
    let together = blocks.covariance(tau);
    let alone = DMatrix::from_diagonal(&together.diagonal());
    let weight = DMatrix::from_diagonal(&DVector::from_vec(blocks.rows.clone()));
    // The residual of the noise after the fit, weighted as the fit weighs it.
    let squares = |v: &DMatrix<f64>| &weight * &left * v * left.transpose();
    let (spread, spread_alone) = (squares(&together), squares(&alone));
    let seen = spread.trace() / spread_alone.trace();
    let freedom = spread.trace().powi(2) / (&spread * &spread).trace();
    if !(seen > 0.0 && freedom > 0.0) {
        return None;
    }
    let factors = (0..columns.len())
        .map(|j| {
            let c = solve.row(j);
            let (all, single) = ((c * &together * c.transpose())[0], (c * &alone * c.transpose())[0]);
            (all / single / seen).sqrt().max(1.0)
        })
        .collect();
    Some(Correlated { factors, freedom })
}

#[cfg(test)]
mod tests {
    use super::super::by_blocks;
    use crate::numerics::student::half_width;

    /// Numbers that look normally distributed, the same in every run.
    fn normal(seed: &mut u64) -> f64 {
        let uniform = |s: &mut u64| {
            *s ^= *s << 13;
            *s ^= *s >> 7;
            *s ^= *s << 17;
            (*s >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform(seed)).sum::<f64>() - 6.0
    }

    /// Of many checks with 13 stays of five seconds whose noise has this time constant and no gain: the share that claims one at p = 0.01.
    fn false_claims(tau: f64, with_time: bool) -> f64 {
        let weights = [0.0, 1.0, 2.0, 3.0, 4.0, 2.0, 0.0, 1.0, 2.0, 3.0, 4.0, 2.0, 0.0];
        let rows: Vec<(usize, f64)> =
            (0..13).flat_map(|b| (0..25).map(move |i| (b, 6.0 * b as f64 + 0.2 * f64::from(i)))).collect();
        let block: Vec<usize> = rows.iter().map(|r| r.0).collect();
        let time: Vec<f64> = rows.iter().map(|r| r.1).collect();
        let columns = [
            block.iter().map(|b| weights[*b]).collect::<Vec<f64>>(),
            vec![1.0; rows.len()],
            time.iter().map(|t| t - 39.0).collect(),
        ];
        let (mut seed, mut claims) = (0x9e37_79b9_7f4a_7c15, 0);
        let many = 1000;
        for _ in 0..many {
            let (mut noise, mut before) = (normal(&mut seed), time[0]);
            let y: Vec<f64> = time
                .iter()
                .map(|t| {
                    let kept = (-(t - before) / tau).exp();
                    noise = kept * noise + (1.0 - kept * kept).sqrt() * normal(&mut seed);
                    before = *t;
                    noise
                })
                .collect();
            let found = by_blocks(&columns, &y, &block, with_time.then_some(&time)).expect("solvable");
            claims +=
                usize::from(found.values[0].abs() > half_width(0.01, found.freedom) * found.deviations[0]);
        }
        claims as f64 / f64::from(many)
    }

    #[test]
    fn slow_noise_makes_fewer_false_claims_where_its_memory_counts() {
        for tau in [5.0, 10.0] {
            let (without, with) = (false_claims(tau, false), false_claims(tau, true));
            assert!(without > 0.02, "slow noise is a danger: {without} at {tau} s");
            assert!(with < 0.6 * without && with < 0.016, "{without} to {with} at {tau} s");
        }
        // Noise without memory pays nothing for it.
        let (without, with) = (false_claims(0.01, false), false_claims(0.01, true));
        assert!((without - with).abs() < 0.003 && with < 0.02, "{without} {with}");
    }
}
