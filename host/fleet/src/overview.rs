//! The fleet in figures: distributions, outlying muscles, effects, groups that differ. The page and the JSON show this.

use std::collections::BTreeMap;

use pam_data::statistics::quantile;

use crate::fleet::Fleet;
use crate::groups::{self, Finding};
use crate::robust::{Centre, threshold};

/// Distribution of one quantity over the fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Position in [`Fleet::quantities`].
    pub quantity: usize,
    /// Muscles with a value.
    pub muscles: usize,
    /// Robust centre and scale; `None` for small fleets.
    pub centre: Option<Centre>,
    /// Quantiles at 5, 25, 50, 75 and 95 %.
    pub quantiles: [f64; 5],
}

/// A muscle outside the fleet's distribution of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlying {
    /// Position in [`Fleet::members`].
    pub member: usize,
    /// Position in [`Fleet::quantities`].
    pub quantity: usize,
    /// The value.
    pub value: f64,
    /// Its robust z score.
    pub z: f64,
}

/// How many muscles an effect was named for.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its name.
    pub effect: String,
    /// Whether it is the bench's.
    pub bench: bool,
    /// Number of muscles with this effect.
    pub muscles: usize,
    /// Share of the diagnosed muscles.
    pub share: f64,
}

/// The fleet in figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Overview {
    /// One for every quantity.
    pub distributions: Vec<Distribution>,
    /// The size of z beyond which a muscle is outlying.
    pub limit: f64,
    /// Sorted by size of z.
    pub outlying: Vec<Outlying>,
    /// Diagnosed muscles.
    pub diagnosed: usize,
    /// Verdicts and their numbers.
    pub verdicts: BTreeMap<String, usize>,
    /// The most frequent first.
    pub effects: Vec<Effect>,
    /// What distinguishes groups.
    pub differences: Vec<Finding>,
    /// Tests behind `differences`.
    pub tests: usize,
    /// Codes of failures and their numbers.
    pub failures: BTreeMap<String, usize>,
}

impl Overview {
    /// Of a fleet.
    #[must_use]
    pub fn of(fleet: &Fleet) -> Self {
        let distributions: Vec<Distribution> =
            (0..fleet.quantities.len()).map(|quantity| distribution(fleet, quantity)).collect();
        let compared = distributions.iter().filter(|d| d.centre.is_some());
        let muscles = compared.clone().map(|d| d.muscles).min().unwrap_or(0);
        let limit = threshold(muscles, compared.count());
        let (differences, tests) = groups::differences(fleet);
        let diagnosed = fleet.diagnosed().count();
        let mut verdicts = BTreeMap::new();
        fleet
            .members
            .iter()
            .filter_map(|m| m.verdict.clone())
            .for_each(|v| *verdicts.entry(v).or_insert(0) += 1);
        let mut failures = BTreeMap::new();
        let codes = fleet.members.iter().flat_map(|m| &m.failures).map(|f| f.code.clone());
        codes.for_each(|code| *failures.entry(code).or_insert(0) += 1);
        Self {
            outlying: outlying(fleet, &distributions, limit),
            distributions,
            limit,
            diagnosed,
            verdicts,
            effects: effects(fleet, diagnosed),
            differences,
            tests,
            failures,
        }
    }

    /// How many muscles are outlying in at least one quantity.
    #[must_use]
    pub(crate) fn outlying_muscles(&self) -> usize {
        let mut members: Vec<usize> = self.outlying.iter().map(|o| o.member).collect();
        members.sort_unstable();
        members.dedup();
        members.len()
    }
}

fn distribution(fleet: &Fleet, quantity: usize) -> Distribution {
    let mut values: Vec<f64> = fleet.members.iter().filter_map(|m| m.values[quantity]).collect();
    let quantiles = match values.is_empty() {
        true => [f64::NAN; 5],
        false => [0.05, 0.25, 0.5, 0.75, 0.95].map(|share| quantile(&mut values, share)),
    };
    Distribution { quantity, muscles: values.len(), centre: Centre::of(&values), quantiles }
}

fn outlying(fleet: &Fleet, distributions: &[Distribution], limit: f64) -> Vec<Outlying> {
    let mut found = Vec::new();
    for d in distributions {
        let Some(centre) = d.centre else { continue };
        for (member, m) in fleet.members.iter().enumerate() {
            let Some(value) = m.values[d.quantity] else { continue };
            let z = centre.z(value);
            if z.abs() > limit {
                found.push(Outlying { member, quantity: d.quantity, value, z });
            }
        }
    }
    found.sort_by(|a, b| b.z.abs().total_cmp(&a.z.abs()).then(a.member.cmp(&b.member)));
    found
}

fn effects(fleet: &Fleet, diagnosed: usize) -> Vec<Effect> {
    let mut counts: BTreeMap<&str, (usize, bool)> = BTreeMap::new();
    for member in &fleet.members {
        for effect in &member.effects {
            let entry = counts.entry(&effect.effect).or_insert((0, effect.bench));
            entry.0 += 1;
        }
    }
    let mut list: Vec<Effect> = counts
        .into_iter()
        .map(|(effect, (muscles, bench))| Effect {
            effect: effect.to_owned(),
            bench,
            muscles,
            share: muscles as f64 / diagnosed.max(1) as f64,
        })
        .collect();
    list.sort_by(|a, b| b.muscles.cmp(&a.muscles).then_with(|| a.effect.cmp(&b.effect)));
    list
}
