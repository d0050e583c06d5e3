//! Effects that are possible, how probable each is, and how uncertain the name is among them.

use model_core::effects::{Imitates, MEMORY};
use pam_fit::bench::Candidate;

/// One effect that the diagnosis holds possible, and how probable it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hypothesis {
    /// The effect.
    pub law: Candidate,
    /// Its probability within its set.
    pub weight: f64,
    /// Its parameters where they were fitted: amplitudes, then shapes.
    pub parameters: Option<Vec<f64>>,
}

/// Distance of hypotheses that a check of the bench decides between: certainty, for all purposes.
pub(crate) const DECIDED: f64 = 64.0;

/// Expected entropy of a set whose members lie so far apart.
pub(crate) fn entropy(set: &[Hypothesis], apart: impl Fn(usize, usize) -> f64) -> f64 {
    let n = set.len();
    let mut sum = 0.0;
    for i in 0..n {
        let own = set[i].weight.max(1e-6);
        let mut others = 1.0;
        for j in 0..n {
            if i != j {
                // As far apart as the nearer view says: either may be the truth.
                let d = apart(i, j).min(apart(j, i));
                others += set[j].weight.max(1e-6) / own * (-d / 8.0).exp();
            }
        }
        sum += own * others.ln();
    }
    sum
}

/// Effects that a campaign checks for: all but those that only the order of the polynomial imitates.
#[must_use]
pub(crate) fn candidates() -> Vec<Candidate> {
    Candidate::all()
        .filter(|l| l.traits().imitates != Some(Imitates::ElasticOrders) && !l.traits().between_recordings)
        .collect()
}

/// Memory of an effect that has no past.
pub(crate) const NO_PAST: [f64; MEMORY] = [0.0; MEMORY];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_separates_leaves_less_doubt() {
        let set: Vec<Hypothesis> = ["viscous-damping", "sensor-delay"]
            .iter()
            .map(|n| Hypothesis { law: Candidate::from_name(n).unwrap(), weight: 0.5, parameters: None })
            .collect();
        let open = entropy(&set, |_, _| 0.0);
        assert!((open - 2.0_f64.ln()).abs() < 1e-12);
        assert!(entropy(&set, |_, _| 10.0) < 0.6 * open && entropy(&set, |_, _| DECIDED) < 1e-3);
    }
}
