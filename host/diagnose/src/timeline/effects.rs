//! Each campaign against the reference campaign.

use std::collections::BTreeMap;

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use rayon::prelude::*;

use super::series::{Kind, Point, Series, What};
use super::{Options, Visit, of_campaign};
use crate::reference::{self, Against, ChangeReport};
use pam_data::statistics::NORMAL_95;

/// The comparisons, in the order of the campaigns; `None` for the reference.
///
/// # Errors
/// Campaigns that cannot be compared.
pub(super) fn comparisons(visits: &[Visit], options: &Options<'_>) -> Result<Vec<Option<ChangeReport>>> {
    let before = &visits[options.reference].campaign;
    let asked = reference::Options {
        muscle: options.muscle.map(|m| m.name.clone()),
        rest_length: options.muscle.map(MuscleDescription::rest_length),
        mounted: options.mounted,
        ..reference::Options::default()
    };
    let one = |(i, visit): (usize, &Visit)| -> Result<Option<ChangeReport>> {
        if i == options.reference {
            return Ok(None);
        }
        let compared = reference::compare(&visit.campaign, Against::Recordings(before), &asked);
        compared.map(Some).map_err(|e| of_campaign(visit, e))
    };
    visits.par_iter().enumerate().map(one).collect()
}

/// Effects that are named in some campaign, over all of them. Where nothing is named, the size that the effect would have alone;
/// where only others are named, nothing.
pub(super) fn series(comparisons: &[Option<ChangeReport>]) -> Vec<Series> {
    let mut named: BTreeMap<&str, (&str, &str)> = BTreeMap::new();
    for m in comparisons.iter().flatten().flat_map(|r| &r.missing) {
        if let Some(size) = m.parameters.first() {
            named.insert(&m.effect, (&size.name, &size.unit));
        }
    }
    let point = |report: &Option<ChangeReport>, name: &str| {
        let Some(r) = report else { return Some(Point { value: 0.0, std: Some(0.0), named: false }) };
        let of = |size: &reference::answer::Size, named| Point {
            value: size.value,
            std: Some((size.high - size.low) / 2.0 / NORMAL_95),
            named,
        };
        match r.missing.iter().find(|m| m.effect == name) {
            Some(m) => m.parameters.first().map(|s| of(s, true)),
            None if r.missing.is_empty() => {
                r.alone.iter().find(|(n, _)| n == name).map(|(_, s)| of(s, false))
            }
            None => None,
        }
    };
    let one = |(name, (parameter, unit)): (&&str, &(&str, &str))| Series {
        what: What::Effect { name: (*name).to_owned(), parameter: (*parameter).to_owned() },
        kind: Kind::Effect,
        unit: (*unit).to_owned(),
        points: comparisons.iter().map(|r| point(r, name)).collect(),
    };
    named.iter().map(one).collect()
}
