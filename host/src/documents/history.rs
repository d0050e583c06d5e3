//! `host history --json`, `pam-history/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_data::statistics::NORMAL_95;
use serde::Serialize;

use pam_data::date::day;
use pam_data::muscle_description::MuscleDescription;
use pam_diagnose::reference::ChangeReport;
use pam_diagnose::timeline::change_points::{self, ChangePoints, How};
use pam_diagnose::timeline::series::{Kind, Series};
use pam_diagnose::timeline::{Timeline, Visit};
use pam_report::wording::timeline as wording;

/// An actuator over several campaigns. Values are in SI units; `low` and `high` are the ends of 95 % intervals.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct History {
    schema: &'static str,
    muscle: Option<String>,
    /// Name of the campaign that the others are compared with.
    reference: String,
    /// In the order of their dates.
    campaigns: Vec<Campaign>,
    quantities: Vec<Quantity>,
    /// Every change of every quantity, by date.
    changes: Vec<Change>,
    warnings: Vec<String>,
}

/// One campaign.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Campaign {
    name: String,
    /// Year, month, day.
    date: String,
    /// Seconds since 1970.
    date_s: f64,
    /// name, column or modification-time.
    dated_by: &'static str,
    files: Vec<String>,
    samples: usize,
    /// Of the comparison with the reference; null for the reference.
    comparison: Option<Comparison>,
}

/// The comparison of a campaign with the reference, in short.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Comparison {
    /// consistent, explained, partly-explained or unexplained.
    verdict: String,
    /// Root mean square of the difference, N.
    misfit_rms_N: f64,
    /// What repeats, N.
    noise_N: f64,
    /// Named changes.
    missing: Vec<NamedChange>,
}

/// A named change of a campaign against the reference.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct NamedChange {
    effect: String,
    probability: f64,
    value: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    unit: Option<String>,
}

/// A quantity over the campaigns.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Quantity {
    name: String,
    /// effect (against the reference), measured (from the recordings), or fitted (a table for each campaign).
    kind: &'static str,
    /// SI unit; empty for a number.
    unit: String,
    meaning: String,
    /// One for each campaign, null where it could not be determined.
    values: Vec<Option<Value>>,
    /// Probability that nothing (more) changed; null with too few campaigns for a judgement.
    probability_no_change: Option<f64>,
    /// How much more the campaigns scatter than their own repeats show.
    scatter: Option<f64>,
}

/// A value in one campaign.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Value {
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
    /// Whether the effect is named in this campaign; false for quantities.
    named: bool,
}

/// A change of a quantity.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Change {
    quantity: String,
    /// at-once, gradual or not-determined.
    how: &'static str,
    /// The last campaign before it; of a gradual one the first.
    from: String,
    /// The first campaign after it; of a gradual one the last.
    to: String,
    from_date: String,
    to_date: String,
    size: f64,
    low: f64,
    high: f64,
    unit: String,
    probability: f64,
    words: String,
}

impl History {
    /// Of a timeline.
    pub(crate) fn of(visits: &[Visit], found: &Timeline, muscle: Option<&MuscleDescription>) -> Self {
        Self {
            schema: "pam-history/1",
            muscle: muscle.map(|m| m.name.clone()),
            reference: visits[found.reference].name.clone(),
            campaigns: visits.iter().zip(&found.comparisons).map(|(v, c)| campaign(v, c.as_ref())).collect(),
            quantities: found.series.iter().map(|(s, c)| quantity(s, c)).collect(),
            changes: wording::by_date(found).into_iter().map(|(s, c)| change(visits, s, c)).collect(),
            warnings: wording::warnings(visits, found),
        }
    }
}

fn campaign(visit: &Visit, comparison: Option<&ChangeReport>) -> Campaign {
    let mut files: Vec<String> =
        visit.campaign.recordings.iter().map(|r| r.source.display().to_string()).collect();
    files.dedup();
    let verdict = |r: &ChangeReport| {
        serde_json::to_value(r.verdict).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
    };
    Campaign {
        name: visit.name.clone(),
        date: day(visit.date),
        date_s: visit.date,
        dated_by: wording::dated_by(visit.dated_by),
        files,
        samples: visit.campaign.samples(),
        comparison: comparison.map(|r| Comparison {
            verdict: verdict(r),
            misfit_rms_N: r.misfit_rms_N,
            noise_N: r.noise_N,
            missing: r
                .missing
                .iter()
                .map(|m| {
                    let size = m.parameters.first();
                    NamedChange {
                        effect: m.effect.clone(),
                        probability: m.probability,
                        value: size.map(|s| s.value),
                        low: size.map(|s| s.low),
                        high: size.map(|s| s.high),
                        unit: size.map(|s| s.unit.clone()),
                    }
                })
                .collect(),
        }),
    }
}

fn quantity(series: &Series, change_points: &ChangePoints) -> Quantity {
    let value = |p: &pam_diagnose::timeline::series::Point| {
        let interval = p.interval();
        Value { value: p.value, low: interval.map(|i| i.0), high: interval.map(|i| i.1), named: p.named }
    };
    Quantity {
        name: wording::name(&series.what),
        kind: match series.kind {
            Kind::Effect => "effect",
            Kind::Measured => "measured",
            Kind::Fitted => "fitted",
        },
        unit: series.unit.clone(),
        meaning: wording::meaning(&series.what),
        values: series.points.iter().map(|p| p.as_ref().map(value)).collect(),
        probability_no_change: (!change_points.too_few).then_some(change_points.none),
        scatter: change_points.scatter,
    }
}

fn change(visits: &[Visit], series: &Series, change: &change_points::Change) -> Change {
    let half = NORMAL_95 * change.std;
    Change {
        quantity: wording::name(&series.what),
        how: match change.how {
            How::AtOnce => "at-once",
            How::Gradual => "gradual",
            How::NotDetermined => "not-determined",
        },
        from: visits[change.from].name.clone(),
        to: visits[change.to].name.clone(),
        from_date: day(visits[change.from].date),
        to_date: day(visits[change.to].date),
        size: change.size,
        low: change.size - half,
        high: change.size + half,
        unit: series.unit.clone(),
        probability: change.probability,
        words: wording::change(visits, series, change),
    }
}
