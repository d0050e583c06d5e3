//! Two methods on the same trials: McNemar's exact test (doi 10.1007/BF02295996).

use crate::binomial_interval::at_most;

/// Probability of a split at least as uneven where both are equally good, of the trials that only one or only the other has right.
pub fn mcnemar(only_one: usize, only_other: usize) -> f64 {
    (2.0 * at_most(only_one.min(only_other), only_one + only_other, 0.5)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SciPy: `binomtest(k, n).pvalue`.
    #[test]
    fn agrees_with_the_binomial_test() {
        for (one, other, p) in
            [(15, 1, 0.000_518_798_828_125), (7, 1, 0.070_312_5), (3, 3, 1.0), (0, 0, 1.0), (0, 5, 0.0625)]
        {
            assert!((mcnemar(one, other) - p).abs() < 1e-12, "{one} : {other}: {}", mcnemar(one, other));
        }
    }
}
