//! Means over conditions with standard errors from repeats.

/// Values of repeats, by condition (mounting, level).
#[derive(Debug, Clone, Default)]
pub(super) struct Repeats(Vec<(usize, Vec<f64>)>);

impl Repeats {
    pub(super) fn push(&mut self, condition: usize, value: f64) {
        if !value.is_finite() {
            return;
        }
        match self.0.iter_mut().find(|(c, _)| *c == condition) {
            Some((_, values)) => values.push(value),
            None => self.0.push((condition, vec![value])),
        }
    }

    /// Only these conditions, so that all campaigns are averaged over the same ones.
    pub(super) fn keep(&mut self, conditions: &[usize]) {
        self.0.retain(|(c, _)| conditions.contains(c));
    }

    pub(super) fn conditions(&self) -> Vec<usize> {
        self.0.iter().map(|(c, _)| *c).collect()
    }

    /// Sum of squares about the conditions' means, and its degrees of freedom.
    pub(super) fn scatter(&self) -> (f64, usize) {
        self.0.iter().fold((0.0, 0), |(sum, freedom), (_, values)| {
            let m = mean(values);
            (sum + values.iter().map(|v| (v - m).powi(2)).sum::<f64>(), freedom + values.len() - 1)
        })
    }

    /// Mean over the conditions; its standard error from a variance between repeats.
    pub(super) fn mean(&self, variance: Option<f64>) -> Option<(f64, Option<f64>)> {
        let n = self.0.len();
        if n == 0 {
            return None;
        }
        let value = self.0.iter().map(|(_, v)| mean(v)).sum::<f64>() / n as f64;
        let share: f64 = self.0.iter().map(|(_, v)| 1.0 / v.len() as f64).sum::<f64>() / (n * n) as f64;
        Some((value, variance.map(|v| (v * share).sqrt())))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Means of all campaigns over the conditions that all of them have. The variance between repeats is pooled over the campaigns: one of them
/// alone has two or three runs, which say little.
pub(super) fn pooled(mut all: Vec<Repeats>) -> Vec<Option<(f64, Option<f64>)>> {
    let mut common: Vec<usize> = all.first().map(Repeats::conditions).unwrap_or_default();
    for repeats in all.iter().filter(|r| !r.0.is_empty()) {
        let own = repeats.conditions();
        common.retain(|c| own.contains(c));
    }
    all.iter_mut().for_each(|r| r.keep(&common));
    let (sum, freedom) = all.iter().map(Repeats::scatter).fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let variance = (freedom > 0).then(|| sum / freedom as f64);
    all.iter().map(|r| r.mean(variance)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_that_of_the_mean_of_repeats() {
        let mut a = Repeats::default();
        [1.0, 3.0].into_iter().for_each(|v| a.push(0, v));
        [11.0, 13.0].into_iter().for_each(|v| a.push(1, v));
        let mut b = Repeats::default();
        b.push(0, 5.0);
        // Variance 2 of one reading; b shares condition 0 only.
        let means = pooled(vec![a, b]);
        assert_eq!(means[0], Some((2.0, Some(1.0))));
        assert_eq!(means[1], Some((5.0, Some(2.0_f64.sqrt()))));
    }
}
