//! From log evidences to probabilities, a set and a leader.

use std::collections::BTreeMap;

use super::contrast::log_sum;
use super::criteria::{NAMED, PRIOR_UNKNOWN, SET};
use super::shapes::{Change, Class};

/// What is tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Cause {
    None,
    Unknown,
    Named(Change),
}

impl Cause {
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Unknown => "unknown",
            Self::Named(change) => change.name(),
        }
    }
}

/// Probabilities in falling order.
#[derive(Debug, Clone, Default)]
pub(super) struct Posterior {
    pub all: Vec<(Cause, f64)>,
    /// Log evidence of all causes together, priors included.
    pub evidence: f64,
}

impl Posterior {
    /// `none` is the prior probability of no change; names share what none and unknown leave.
    pub fn of(evidence: &[(Cause, f64)], none: f64) -> Self {
        let names = evidence.iter().filter(|(c, _)| matches!(c, Cause::Named(_))).count().max(1) as f64;
        let unknown = PRIOR_UNKNOWN.min(1.0 - none);
        let prior = |cause: Cause| match cause {
            Cause::None => none,
            Cause::Unknown => unknown,
            Cause::Named(_) => (1.0 - none - unknown) / names,
        };
        let logs: Vec<f64> =
            evidence.iter().map(|(c, l)| prior(*c).max(f64::MIN_POSITIVE).ln() + l).collect();
        let total = log_sum(&logs);
        let one = |(e, l): (&(Cause, f64), &f64)| {
            let p = (l - total).exp();
            (e.0, if p.is_finite() { p } else { 0.0 })
        };
        let mut all: Vec<(Cause, f64)> = evidence.iter().zip(&logs).map(one).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        Self { all, evidence: total }
    }

    /// The mean of several, by their weights.
    pub fn mean(several: &[(f64, &Self)]) -> Self {
        let total: f64 = several.iter().map(|(w, _)| w).sum();
        let mut sums: BTreeMap<Cause, f64> = BTreeMap::new();
        for (weight, one) in several {
            one.all.iter().for_each(|(c, p)| *sums.entry(*c).or_insert(0.0) += weight / total * p);
        }
        let mut all: Vec<(Cause, f64)> = sums.into_iter().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        Self { all, evidence: several.first().map_or(0.0, |(_, p)| p.evidence) }
    }

    pub fn probability(&self, cause: Cause) -> f64 {
        self.all.iter().find(|(c, _)| *c == cause).map_or(0.0, |(_, p)| *p)
    }

    /// Causes in falling order until they hold [`SET`].
    pub fn set(&self) -> Vec<Cause> {
        let mut sum = 0.0;
        let mut set = Vec::new();
        for (cause, p) in &self.all {
            set.push(*cause);
            sum += p;
            if sum >= SET {
                break;
            }
        }
        set
    }

    /// Probability of every class.
    pub fn classes(&self) -> BTreeMap<Class, f64> {
        let mut classes = BTreeMap::new();
        for (cause, p) in &self.all {
            if let Cause::Named(change) = cause {
                *classes.entry(change.class()).or_insert(0.0) += p;
            }
        }
        classes
    }

    /// The best name of the class that is more probable than not.
    pub fn leader(&self) -> Option<(Change, f64)> {
        let classes = self.classes();
        self.all.iter().find_map(|(cause, p)| match cause {
            Cause::Named(change) if classes.get(&change.class()).is_some_and(|c| *c >= NAMED) => {
                Some((*change, *p))
            }
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(name: &str) -> Change {
        Change::from_name(name).expect("listed")
    }

    #[test]
    fn a_class_leads_although_none_of_its_names_does() {
        let named = |c, l| (Cause::Named(c), l);
        let p = Posterior::of(
            &[
                (Cause::None, 0.0),
                (Cause::Unknown, 0.0),
                named(change("force-gain"), 9.0),
                named(change("gauge-gain"), 8.9),
            ],
            0.8,
        );
        assert_eq!(p.leader().map(|l| l.0), Some(change("force-gain")));
        let total: f64 = p.all.iter().map(|a| a.1).sum();
        assert!((total - 1.0).abs() < 1e-12);
        assert!(p.set().contains(&Cause::Named(change("gauge-gain"))));
    }

    #[test]
    fn without_evidence_the_prior_is_kept() {
        let p = Posterior::of(&[(Cause::None, -3.0), (Cause::Named(change("force-gain")), -3.0)], 0.8);
        assert!(p.probability(Cause::None) > 0.8 && p.leader().is_none());
        assert_eq!(p.set()[0], Cause::None);
    }
}
