//! The sentences and the CSV of an actuator's history over campaigns.

use std::fmt::Write;

use pam_data::date::{DateSource, day};
use pam_diagnose::reference::ChangeReport;
use pam_diagnose::timeline::change_points::{Change, ChangePoints, How};
use pam_diagnose::timeline::series::{Point, Quantity, Series, What};
use pam_diagnose::timeline::{Timeline, Visit};

use pam_data::statistics::NORMAL_95;

/// Where a date is from, as in the JSON.
#[must_use]
pub fn dated_by(source: DateSource) -> &'static str {
    match source {
        DateSource::Name => "name",
        DateSource::Column => "column",
        DateSource::Modified => "modification-time",
    }
}

/// The name of a quantity or effect.
#[must_use]
pub fn name(what: &What) -> String {
    match what {
        What::Effect { name, .. } => name.clone(),
        What::Quantity(q) => match q {
            Quantity::LargestForce => "largest-force",
            Quantity::Hysteresis => "hysteresis",
            Quantity::Threshold => "threshold-pressure",
            Quantity::Area => "force-per-pressure",
            Quantity::Deadband => "deadband",
            Quantity::FrictionFactor => "friction-factor-of-table",
            Quantity::BlockedForce => "blocked-force",
            Quantity::MiddleForce => "force-at-half-contraction",
        }
        .to_owned(),
    }
}

/// What a quantity means.
#[must_use]
pub fn meaning(what: &What) -> String {
    match what {
        What::Effect { parameter, .. } => format!("change against the reference campaign: {parameter}"),
        What::Quantity(q) => match q {
            Quantity::LargestForce => "mean of both directions at the highest pressure and the shortest stroke that all campaigns share",
            Quantity::Hysteresis => "half the force between emptying and filling, or lengthening and shortening, at equal pressure and stroke",
            Quantity::Threshold => "pressure from which the actuator pulls: a tenth of the reference's largest force at held lengths, the line's zero of strokes",
            Quantity::Area => "slope of the force over pressure",
            Quantity::Deadband => "P0 of the table fitted to the campaign",
            Quantity::FrictionFactor => "k_F of the fitted table, mean over the tested pressures",
            Quantity::BlockedForce => "friction-free force of the fitted table at rest length and the highest pressure that all campaigns share",
            Quantity::MiddleForce => "friction-free force of the fitted table at half of the contraction that all campaigns reach",
        }
        .to_owned(),
    }
}

/// Factor and name of the unit that people use instead of the SI unit.
#[must_use]
pub(crate) fn usual_unit(unit: &str) -> (f64, &'static str) {
    match unit {
        "Pa" => (1e-3, "kPa"),
        "m" => (1e3, "mm"),
        "s" => (1e3, "ms"),
        "m²" => (1e6, "mm²"),
        "m/N" => (1e6, "µm/N"),
        "N" => (1.0, "N"),
        _ => (100.0, "%"),
    }
}

/// A value with the digits that its half interval leaves, in the usual unit.
fn with_interval(value: f64, half: Option<f64>, unit: &str) -> String {
    // The reference does not differ from itself.
    if value == 0.0 && half == Some(0.0) {
        return "0".to_owned();
    }
    let (scale, name) = usual_unit(unit);
    let (value, half) = (scale * value, half.map(|h| scale * h));
    let digits = match half {
        Some(h) if h > 0.0 && h.is_finite() => (1.0 - h.log10().floor()).clamp(0.0, 6.0) as usize,
        _ => 3,
    };
    let text = match half {
        Some(h) => format!("{value:.digits$} ± {h:.digits$} {name}"),
        None => format!("{value:.digits$} {name}"),
    };
    text.trim_end().to_owned()
}

/// A point in the usual unit.
#[must_use]
pub(crate) fn point(p: &Point, unit: &str) -> String {
    with_interval(p.value, p.std.map(|s| NORMAL_95 * s), unit)
}

/// Every change with its series, by date.
#[must_use]
pub fn by_date(found: &Timeline) -> Vec<(&Series, &Change)> {
    let mut all: Vec<(&Series, &Change)> =
        found.changed().flat_map(|(s, c)| c.changes.iter().map(move |change| (s, change))).collect();
    all.sort_by_key(|(_, c)| (c.from, c.to));
    all
}

/// One change as a sentence without a full stop.
#[must_use]
pub fn change(visits: &[Visit], series: &Series, change: &Change) -> String {
    let between = |from: &Visit, to: &Visit| format!("{} and {}", dated(from), dated(to));
    let (from, to) = (&visits[change.from], &visits[change.to]);
    let when = match change.how {
        How::AtOnce => format!("in one step, between {}", between(from, to)),
        How::Gradual => format!("gradually, between {}", between(from, to)),
        How::NotDetermined => {
            format!("in one step or gradually, around {}", dated(to))
        }
    };
    format!(
        "{} changed by {}, {when}; probability {:.2}",
        name(&series.what),
        with_interval(change.size, Some(NORMAL_95 * change.std), &series.unit),
        change.probability
    )
}

/// The date of a campaign, and its name where that is another.
fn dated(visit: &Visit) -> String {
    let date = day(visit.date);
    if visit.name == date { date } else { format!("{date} (`{}`)", visit.name) }
}

/// Warnings for the reader.
#[must_use]
pub fn warnings(visits: &[Visit], found: &Timeline) -> Vec<String> {
    let mut all = Vec::new();
    let doubtful: Vec<String> = visits
        .iter()
        .filter(|v| v.dated_by == DateSource::Modified)
        .map(|v| format!("`{}`", v.name))
        .collect();
    if !doubtful.is_empty() {
        all.push(format!(
            "the order of {} is by the time at which the files were modified, which a copy may have changed: write the date into the name",
            super::list(&doubtful)
        ));
    }
    let equal = visits.windows(2).any(|w| w[0].date == w[1].date);
    if equal {
        all.push("some campaigns have the same date; they are listed in the order given".to_owned());
    }
    if found.series.iter().any(|(_, c)| c.too_few) {
        all.push(
            "quantities of fewer than four campaigns are shown without a test for changes; each campaign is still compared with the reference"
                .to_owned(),
        );
    }
    for (i, why) in &found.left_out {
        all.push(format!("no table for `{}`: {why}", visits[*i].name));
    }
    all
}

fn verdict(report: Option<&ChangeReport>) -> String {
    let Some(r) = report else { return "the reference".to_owned() };
    let names: Vec<String> = r
        .missing
        .iter()
        .map(|m| {
            let size = m.parameters.first().map(super::change::size);
            format!("{} {}", m.effect, size.unwrap_or_default()).trim_end().to_owned()
        })
        .collect();
    if names.is_empty() {
        match r.verdict {
            pam_diagnose::reference::Verdict::Consistent => "nothing changed".to_owned(),
            _ => "something changed that no name describes".to_owned(),
        }
    } else {
        names.join(", ")
    }
}

/// The text on each campaign.
#[must_use]
pub fn campaigns(visits: &[Visit], found: &Timeline) -> Vec<[String; 4]> {
    let one = |(v, r): (&Visit, &Option<ChangeReport>)| {
        [day(v.date), v.name.clone(), dated_by(v.dated_by).to_owned(), verdict(r.as_ref())]
    };
    visits.iter().zip(&found.comparisons).map(one).collect()
}

/// The sentence that stands first.
#[must_use]
pub fn headline(found: &Timeline) -> String {
    let named = found.comparisons.iter().flatten().any(|r| !r.missing.is_empty());
    let unexplained = found
        .comparisons
        .iter()
        .flatten()
        .any(|r| r.missing.is_empty() && r.verdict != pam_diagnose::reference::Verdict::Consistent);
    let mut names: Vec<String> = found.changed().map(|(s, _)| name(&s.what)).collect();
    names.dedup();
    if !names.is_empty() {
        format!("What changed over these campaigns: {}.", super::list(&names))
    } else if named {
        "Some campaigns differ from the reference; too few for a trend over time.".to_owned()
    } else if unexplained {
        "Some campaigns differ from the reference in a way that no known change describes.".to_owned()
    } else {
        "No change over these campaigns beyond the normal repeatability of the actuator.".to_owned()
    }
}

/// The answer for a terminal.
#[must_use]
pub fn summary(visits: &[Visit], found: &Timeline) -> String {
    let mut text = headline(found);
    text.push('\n');
    for (series, c) in by_date(found) {
        let _ = writeln!(text, "  {}", super::sentence(&change(visits, series, c)));
    }
    let rows = campaigns(visits, found);
    let width = rows.iter().map(|r| r[1].chars().count()).max().unwrap_or(0);
    text.push_str("\nAgainst the reference campaign:\n");
    for [date, name, _, verdict] in &rows {
        let _ = writeln!(text, "  {date}  {name:width$}  {verdict}");
    }
    let repeated = found.series.iter().any(|(s, _)| s.points.iter().flatten().any(|p| p.std.is_some()));
    text.push_str(if repeated {
        "\nQuantities (95 % intervals by repeats within a campaign):\n"
    } else {
        "\nQuantities (without intervals, as no campaign repeats a recording):\n"
    });
    for (series, change_points) in &found.series {
        let ends: Vec<String> = [series.points.first(), series.points.last()]
            .into_iter()
            .flatten()
            .map(|p| p.as_ref().map_or_else(|| "–".to_owned(), |p| point(p, &series.unit)))
            .collect();
        let _ = writeln!(
            text,
            "  {:26} {}  ({})",
            name(&series.what),
            ends.join(" → "),
            judged(series, change_points)
        );
    }
    for warning in warnings(visits, found) {
        let _ = writeln!(text, "note: {warning}");
    }
    text
}

/// Whether two values have intervals that do not overlap: something differs, be it a change or the scatter between campaigns.
fn beyond_repeats(series: &Series) -> bool {
    let intervals: Vec<(f64, f64)> = series.points.iter().flatten().filter_map(Point::interval).collect();
    let highest = intervals.iter().map(|i| i.0).fold(f64::NEG_INFINITY, f64::max);
    let lowest = intervals.iter().map(|i| i.1).fold(f64::INFINITY, f64::min);
    highest > lowest
}

/// The text on the trend of a quantity.
#[must_use]
pub(crate) fn judged(series: &Series, change_points: &ChangePoints) -> String {
    match (change_points.too_few, change_points.changes.len()) {
        (true, _) => "too few campaigns to judge".to_owned(),
        (_, 0) if beyond_repeats(series) => format!(
            "no change named, probability of none {:.2}; values differ by more than their repeats: record more campaigns",
            change_points.none
        ),
        (_, 0) => format!("no change named, probability of none {:.2}", change_points.none),
        (_, 1) => "one change".to_owned(),
        (_, n) => format!("{n} changes"),
    }
}

/// One row per campaign and quantity, SI units.
#[must_use]
pub fn csv(visits: &[Visit], found: &Timeline) -> String {
    let quoted = |text: &str| {
        if text.contains([',', '"', '\n']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text.to_owned()
        }
    };
    let mut text = "campaign,date,dated_by,quantity,unit,value,low,high,named\n".to_owned();
    for (i, visit) in visits.iter().enumerate() {
        for (series, _) in &found.series {
            let Some(p) = series.points.get(i).and_then(Option::as_ref) else { continue };
            let (low, high) =
                p.interval().map_or((String::new(), String::new()), |(l, h)| (l.to_string(), h.to_string()));
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{low},{high},{}",
                quoted(&visit.name),
                day(visit.date),
                dated_by(visit.dated_by),
                name(&series.what),
                series.unit,
                p.value,
                p.named
            );
        }
    }
    text
}
