//! Exact binomial intervals (C. J. Clopper, E. S. Pearson, doi 10.1093/biomet/26.4.404).

/// Probability of at most `k` of `n` at chance `p`.
pub fn at_most(k: usize, n: usize, p: f64) -> f64 {
    if p <= 0.0 {
        return 1.0;
    }
    if p >= 1.0 {
        return if k >= n { 1.0 } else { 0.0 };
    }
    let mut log = n as f64 * (1.0 - p).ln();
    let mut sum = log.exp();
    for i in 1..=k.min(n) {
        log += ((n - i + 1) as f64 / i as f64).ln() + (p / (1.0 - p)).ln();
        sum += log.exp();
    }
    sum.min(1.0)
}

/// The 95 % interval of a rate of `k` in `n`.
pub fn interval(k: usize, n: usize) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    let solve = |f: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if f(middle) > 0.025 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let upper = if k >= n { 1.0 } else { solve(&|p| at_most(k, n, p)) };
    let lower = if k == 0 { 0.0 } else { 1.0 - solve(&|q| at_most(n - k, n, q)) };
    (lower, upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_intervals_come_out() {
        // R: binom.test(18, 20)$conf.int and binom.test(0, 60)$conf.int
        let (a, b) = interval(18, 20);
        assert!((a - 0.6830).abs() < 1e-3 && (b - 0.9877).abs() < 1e-3, "{a} {b}");
        let (a, b) = interval(0, 60);
        assert!(a == 0.0 && (b - 0.0596).abs() < 1e-3, "{a} {b}");
        let (a, b) = interval(60, 60);
        assert!((a - 0.9404).abs() < 1e-3 && b == 1.0, "{a} {b}");
    }
}
