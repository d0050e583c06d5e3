//! What distinguishes the muscles with one tag from the others: a batch of bladders, a rig with a late load cell.
//!
//! Muscles are independent of each other, so that muscles are what is counted. Shares of an effect are compared by Fisher's exact test,
//! quantities by the rank sum test of Wilcoxon with its normal approximation, dates by Spearman's rank correlation. All p values of a
//! fleet are multiplied by the number of tests (Bonferroni).

use std::collections::{BTreeMap, BTreeSet};

use pam_data::statistics::median;

use crate::fleet::{Fleet, Member};

/// Corrected p values below this one count as a difference.
pub(crate) const SIGNIFICANT: f64 = 0.01;
/// Fewer muscles with a tag are not compared with the others.
const SMALLEST_GROUP: usize = 4;
/// The tag that holds a date.
const DATE: &str = "date";

/// What differs.
#[derive(Debug, Clone, PartialEq)]
pub enum Difference {
    /// Share of muscles with an effect: in the group, and in the others.
    Effect {
        /// The effect.
        effect: String,
        /// Share in the group.
        inside: f64,
        /// Share in the others.
        outside: f64,
    },
    /// Median of a quantity: in the group, and in the others.
    Quantity {
        /// Position in [`Fleet::quantities`].
        quantity: usize,
        /// Median in the group.
        inside: f64,
        /// Median in the others.
        outside: f64,
    },
    /// A quantity that rises or falls with the date.
    Trend {
        /// Position in [`Fleet::quantities`].
        quantity: usize,
        /// Spearman's rank correlation.
        correlation: f64,
    },
}

/// A difference that is larger than chance explains.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The tag.
    pub key: String,
    /// Its value; empty for a trend.
    pub value: String,
    /// Muscles with this value.
    pub muscles: usize,
    /// What differs.
    pub difference: Difference,
    /// Probability of a difference as large by chance, times the number of tests.
    pub p: f64,
}

/// All differences that are larger than chance explains, the clearest first, and how many tests were made.
#[must_use]
pub(crate) fn differences(fleet: &Fleet) -> (Vec<Finding>, usize) {
    let mut all = Vec::new();
    for (key, value, inside) in groups(fleet) {
        let outside: Vec<&Member> =
            fleet.members.iter().filter(|m| m.tags.get(&key).is_some_and(|v| *v != value)).collect();
        if outside.len() < SMALLEST_GROUP {
            continue;
        }
        let found = effects(&inside, &outside).into_iter().chain(quantities(fleet, &inside, &outside));
        all.extend(found.map(|(difference, p)| Finding {
            key: key.clone(),
            value: value.clone(),
            muscles: inside.len(),
            difference,
            p,
        }));
    }
    all.extend(trends(fleet));
    let tests = all.len();
    for finding in &mut all {
        finding.p = (finding.p * tests as f64).min(1.0);
    }
    all.retain(|f| f.p < SIGNIFICANT);
    all.sort_by(|a, b| a.p.total_cmp(&b.p).then_with(|| (&a.key, &a.value).cmp(&(&b.key, &b.value))));
    (all, tests)
}

/// Every value of every tag with its muscles, if there are enough of them and other values too. Of two values only the first is compared:
/// the second would be the same comparison.
fn groups(fleet: &Fleet) -> Vec<(String, String, Vec<&Member>)> {
    let mut by_tag: BTreeMap<&str, BTreeMap<&str, Vec<&Member>>> = BTreeMap::new();
    for member in &fleet.members {
        for (key, value) in member.tags.iter().filter(|(key, _)| *key != DATE) {
            by_tag.entry(key).or_default().entry(value).or_default().push(member);
        }
    }
    let mut found = Vec::new();
    for (key, values) in by_tag {
        let compared = if values.len() == 2 { 1 } else { values.len() };
        for (value, members) in values.iter().take(compared).filter(|(_, m)| m.len() >= SMALLEST_GROUP) {
            if values.len() > 1 {
                found.push((key.to_owned(), (*value).to_owned(), members.clone()));
            }
        }
    }
    found
}

fn effects(inside: &[&Member], outside: &[&Member]) -> Vec<(Difference, f64)> {
    let diagnosed = |list: &[&Member]| list.iter().filter(|m| m.verdict.is_some()).count();
    let with = |list: &[&Member], effect: &str| {
        list.iter().filter(|m| m.effects.iter().any(|e| e.effect == effect)).count()
    };
    let names: BTreeSet<&str> =
        inside.iter().chain(outside).flat_map(|m| &m.effects).map(|e| e.effect.as_str()).collect();
    let (n, m) = (diagnosed(inside), diagnosed(outside));
    if n < SMALLEST_GROUP || m < SMALLEST_GROUP {
        return Vec::new();
    }
    let one = |effect: &str| {
        let (a, b) = (with(inside, effect), with(outside, effect));
        let difference = Difference::Effect {
            effect: effect.to_owned(),
            inside: a as f64 / n as f64,
            outside: b as f64 / m as f64,
        };
        (difference, fisher(a, n, b, m))
    };
    names.into_iter().map(one).collect()
}

fn quantities(fleet: &Fleet, inside: &[&Member], outside: &[&Member]) -> Vec<(Difference, f64)> {
    let one = |quantity: usize| {
        let of = |list: &[&Member]| list.iter().filter_map(|m| m.values[quantity]).collect::<Vec<f64>>();
        let (mut a, mut b) = (of(inside), of(outside));
        if a.len() < SMALLEST_GROUP || b.len() < SMALLEST_GROUP {
            return None;
        }
        let p = rank_sum(&a, &b);
        let difference = Difference::Quantity { quantity, inside: median(&mut a), outside: median(&mut b) };
        Some((difference, p))
    };
    (0..fleet.quantities.len()).filter_map(one).collect()
}

fn trends(fleet: &Fleet) -> Vec<Finding> {
    let one = |quantity: usize| {
        let dated: Vec<(f64, f64)> = fleet
            .members
            .iter()
            .filter_map(|m| Some((day(m.tags.get(DATE)?)?, m.values[quantity]?)))
            .collect();
        if dated.len() < 2 * SMALLEST_GROUP {
            return None;
        }
        let (days, values): (Vec<f64>, Vec<f64>) = dated.into_iter().unzip();
        let correlation = spearman(&days, &values)?;
        // Normal approximation of Spearman's statistic.
        let z = correlation * ((days.len() - 1) as f64).sqrt();
        Some(Finding {
            key: DATE.to_owned(),
            value: String::new(),
            muscles: days.len(),
            difference: Difference::Trend { quantity, correlation },
            p: two_sided(z),
        })
    };
    (0..fleet.quantities.len()).filter_map(one).collect()
}

/// Days since 1 March of year 0 of a date such as 2026-03-31, in the proleptic Gregorian calendar; a time behind it is ignored.
#[must_use]
pub(crate) fn day(date: &str) -> Option<f64> {
    let mut parts = date.get(..10)?.splitn(3, '-');
    let year: i64 = parts.next()?.parse().ok()?;
    let month: i64 = parts.next()?.parse().ok().filter(|m| (1..=12).contains(m))?;
    let day: i64 = parts.next()?.parse().ok().filter(|d| (1..=31).contains(d))?;
    // A year that begins in March has its leap day at the end.
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let days = 365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some((days + (153 * month + 2) / 5 + day - 1) as f64)
}

/// Two-sided p value of Fisher's exact test for `a` of `n` against `b` of `m`.
fn fisher(a: usize, n: usize, b: usize, m: usize) -> f64 {
    let total = a + b;
    let logs: Vec<f64> = std::iter::once(0.0)
        .chain((1..=n + m).scan(0.0, |sum, k| {
            *sum += (k as f64).ln();
            Some(*sum)
        }))
        .collect();
    let choose = |n: usize, k: usize| logs[n] - logs[k] - logs[n - k];
    let probability = |k: usize| (choose(n, k) + choose(m, total - k) - choose(n + m, total)).exp();
    let seen = probability(a);
    let possible = total.saturating_sub(m)..=total.min(n);
    // Equal probabilities may differ in their last digits.
    possible.map(probability).filter(|p| *p <= seen * (1.0 + 1e-9)).sum::<f64>().min(1.0)
}

/// Ranks from 1; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut at = 0;
    while at < order.len() {
        let same = order[at..].iter().take_while(|i| values[**i] == values[order[at]]).count().max(1);
        let mean = at as f64 + (same as f64 + 1.0) / 2.0;
        order[at..at + same].iter().for_each(|i| ranks[*i] = mean);
        at += same;
    }
    ranks
}

/// Two-sided p value of the rank sum test, with its correction for equal values.
fn rank_sum(a: &[f64], b: &[f64]) -> f64 {
    let all: Vec<f64> = a.iter().chain(b).copied().collect();
    let ranks = ranks(&all);
    let (n, m, total) = (a.len() as f64, b.len() as f64, all.len() as f64);
    let sum: f64 = ranks[..a.len()].iter().sum();
    let mean = n * (total + 1.0) / 2.0;
    // The variance of the ranks as they are: equal values reduce it.
    let spread: f64 = ranks.iter().map(|r| (r - (total + 1.0) / 2.0).powi(2)).sum();
    let variance = n * m / (total * (total - 1.0)) * spread;
    if !(variance > 0.0) {
        return 1.0;
    }
    let off = (sum - mean).abs() - 0.5;
    two_sided(off.max(0.0) / variance.sqrt())
}

/// Spearman's rank correlation; `None` where one side is constant.
fn spearman(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let middle = (a.len() as f64 + 1.0) / 2.0;
    let product =
        |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - middle) * (y - middle)).sum::<f64>();
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}

/// Two-sided p value of a normal deviate: the complementary error function by its continued fraction, and by its series near zero
/// (M. Abramowitz and I. A. Stegun, 7.1.14 and 7.1.5).
fn two_sided(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    if !(x < 26.0) {
        return 0.0;
    }
    let root_pi = std::f64::consts::PI.sqrt();
    if x < 2.0 {
        let (mut term, mut sum) = (x, x);
        for k in 1..60 {
            term *= -x * x / f64::from(k);
            sum += term / f64::from(2 * k + 1);
        }
        return 1.0 - 2.0 / root_pi * sum;
    }
    let fraction = (1..60).rev().fold(0.0, |tail, k| f64::from(k) / 2.0 / (x + tail));
    (-x * x).exp() / root_pi / (x + fraction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::{NamedEffect, Quantity};

    #[test]
    fn p_values_are_those_of_exact_computations() {
        // erfc(z / √2) of the C library.
        for (z, p) in [(0.5, 0.617_075_1), (1.96, 0.049_995_8), (3.0, 0.002_699_796), (6.0, 1.973_175e-9)] {
            assert!((two_sided(z) / p - 1.0).abs() < 1e-5, "{z}: {}", two_sided(z));
        }
        // Fisher's tea tasting, 34/70; and 8 of 10 against 1 of 10 by exact binomial coefficients.
        assert!((fisher(3, 4, 1, 4) - 0.485_714).abs() < 1e-5);
        assert!((fisher(8, 10, 1, 10) - 0.005_477).abs() < 1e-5, "{}", fisher(8, 10, 1, 10));
        // Ranks 1, 2, 4, 5, 6: U = 3 with mean 12.5 and variance 275/12; with the continuity correction z = 1.880.
        let p = rank_sum(&[1.1, 2.2, 3.3, 4.4, 5.5], &[3.0, 6.6, 7.7, 8.8, 9.9]);
        assert!((p - 0.060_103).abs() < 1e-4, "{p}");
        assert_eq!(spearman(&[1.0, 2.0, 3.0], &[5.0, 7.0, 6.0]), Some(0.5));
    }

    #[test]
    fn days_are_counted_across_months_and_leap_years() {
        let between = |a: &str, b: &str| day(b).expect("a date") - day(a).expect("a date");
        assert_eq!(between("2023-12-31", "2024-01-01"), 1.0);
        assert_eq!(between("2024-02-28", "2024-03-01T12:00:00Z"), 2.0);
        assert_eq!(between("2000-01-01", "2026-11-23"), 9823.0);
        assert!(day("spring").is_none() && day("2026-13-01").is_none() && day("é").is_none());
    }

    /// Muscles of two rigs and three batches; batch `B2` has another `k_F`, rig 1 an effect.
    fn fleet(shift: f64, late: bool) -> Fleet {
        let member = |i: usize| {
            let (batch, rig) = (i % 3, i % 2);
            let noise = ((i * 7919) % 101) as f64 / 101.0;
            let named = NamedEffect { effect: "sensor-delay".into(), probability: 0.9, bench: true };
            Member {
                muscle: format!("m{i}"),
                tags: [("batch", format!("B{batch}")), ("rig", rig.to_string()), ("serial", i.to_string())]
                    .map(|(k, v)| (k.to_owned(), v))
                    .into(),
                values: vec![Some(0.1 + 0.01 * noise + if batch == 2 { shift } else { 0.0 })],
                verdict: Some("consistent".into()),
                effects: if late && rig == 1 { vec![named] } else { Vec::new() },
                ..Member::default()
            }
        };
        Fleet {
            members: (0..60).map(member).collect(),
            quantities: vec![Quantity { name: "k_F".into(), label: "k_{F}".into(), unit: "" }],
            pressure_kPa: Some(300.0),
        }
    }

    #[test]
    fn a_different_batch_and_a_late_rig_are_found_and_nothing_else() {
        let found = |fleet: &Fleet| {
            differences(fleet).0.into_iter().map(|f| format!("{}={}", f.key, f.value)).collect::<Vec<_>>()
        };
        assert_eq!(found(&fleet(0.0, false)), Vec::<String>::new());
        assert_eq!(found(&fleet(0.02, false))[0], "batch=B2");
        assert_eq!(found(&fleet(0.0, true)), ["rig=0"]);
    }
}
