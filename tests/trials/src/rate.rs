//! Success rates with exact confidence intervals, and medians.

use crate::binomial_interval::interval;
use crate::score::Outcome;
use serde::Serialize;

/// `k` of `n` with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// How many.
    pub k: usize,
    /// Of how many.
    pub n: usize,
    /// Clopper–Pearson.
    pub interval: (f64, f64),
}

impl Rate {
    /// `k` of `n`.
    pub fn new(k: usize, n: usize) -> Self {
        Self { k, n, interval: interval(k, n) }
    }

    /// The share of some outcomes.
    pub fn of<'a>(items: impl Iterator<Item = &'a Outcome>, right: impl Fn(&Outcome) -> bool) -> Self {
        let (mut k, mut n) = (0, 0);
        for o in items {
            n += 1;
            k += usize::from(right(o));
        }
        Self::new(k, n)
    }

    /// The rate itself; NaN of nothing.
    pub fn value(&self) -> f64 {
        self.k as f64 / self.n as f64
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.n == 0 {
            return write!(f, "–");
        }
        let (a, b) = self.interval;
        write!(
            f,
            "{} of {} = {:.0} % ({:.0}–{:.0})",
            self.k,
            self.n,
            100.0 * self.value(),
            100.0 * a,
            100.0 * b
        )
    }
}

/// The middle of some values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Median {
    /// Itself; NaN of nothing.
    pub value: f64,
    /// Of how many.
    pub n: usize,
}

impl Median {
    /// Of some values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self { value: values.get(values.len() / 2).copied().unwrap_or(f64::NAN), n: values.len() }
    }
}

impl std::fmt::Display for Median {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.n == 0 { write!(f, "–") } else { write!(f, "{:.2} of {}", self.value, self.n) }
    }
}
