//! The report of an actuator over several campaigns: one picture per quantity, its changes, and each campaign in a line.

use super::wording::timeline::{
    by_date, campaigns, change, headline, judged, meaning, name, point, usual_unit, warnings,
};
use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone};
use pam_data::date::day;
use pam_data::statistics::NORMAL_95;
use pam_diagnose::timeline::change_points::ChangePoints;
use pam_diagnose::timeline::series::{Kind, Series};
use pam_diagnose::timeline::{Timeline, Visit};

/// s of a day.
const DAY: f64 = 86_400.0;

/// The page of a history.
#[must_use]
pub fn page(visits: &[Visit], found: &Timeline) -> Page {
    let span = visits.first().zip(visits.last()).map_or_else(String::new, |(a, b)| {
        format!("{} campaigns from {} to {}", visits.len(), day(a.date), day(b.date))
    });
    let mut page = Page::new("An actuator over its campaigns", span);
    let changes = by_date(found);
    page.verdict(if changes.is_empty() { Tone::Good } else { Tone::Caution }, headline(found));
    page.fact("changes", changes.len().to_string(), "of all quantities", Tone::Plain);
    let mut first = Section::new("What changed, and when").summarised();
    first.list(changes.iter().map(|(s, c)| change(visits, s, c)));
    if changes.is_empty() {
        first.text(headline(found));
    }
    first.list(warnings(visits, found));
    page.push(first);
    page.push(compared(visits, found));
    for (kind, title) in [
        (Kind::Effect, "Named effects, against the reference campaign"),
        (Kind::Measured, "Quantities read from the recordings"),
        (Kind::Fitted, "Quantities of a table fitted to each campaign"),
    ] {
        if found.of_kind(kind).next().is_some() {
            page.push(quantities(visits, found, kind, title));
        }
    }
    for visit in visits {
        page.origin(&visit.name, format!("{}, {} rows", day(visit.date), visit.campaign.samples()));
    }
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

fn compared(visits: &[Visit], found: &Timeline) -> Section {
    let mut section = Section::new("Each campaign against the reference").summarised();
    let mut table = Table::new(
        "Campaigns in the order of their dates",
        &["date", "campaign", "dated by", "what differs"],
    );
    for row in campaigns(visits, found) {
        table.row(row);
    }
    section.table(table);
    section
}

fn quantities(visits: &[Visit], found: &Timeline, kind: Kind, title: &str) -> Section {
    let mut section = Section::new(title);
    let mut table = Table::new(
        "Values, with 95 % intervals where recordings are repeated",
        &["quantity", "first campaign", "last campaign", "course"],
    );
    for (index, (series, change_points)) in found.of_kind(kind).enumerate() {
        let id = format!("{}-{index}", name(&series.what));
        section.figure(Figure::new(
            id,
            name(&series.what),
            meaning(&series.what),
            panel(visits, series, change_points),
        ));
        let shown = |p: Option<&Option<_>>| {
            p.and_then(Option::as_ref).map_or_else(|| "–".to_owned(), |p| point(p, &series.unit))
        };
        table.row([
            name(&series.what),
            shown(series.points.first()),
            shown(series.points.last()),
            judged(series, change_points),
        ]);
    }
    section.table(table);
    section
}

/// Values with intervals over the days, and the course that the changes make.
fn panel(visits: &[Visit], series: &Series, change_points: &ChangePoints) -> Panel {
    let (scale, unit) = usual_unit(&series.unit);
    let start = visits.first().map_or(0.0, |v| v.date);
    let spread = visits.iter().any(|v| v.date > start);
    let at = |i: usize| if spread { (visits[i].date - start) / DAY } else { i as f64 };
    let known: Vec<usize> = (0..series.points.len()).filter(|i| series.points[*i].is_some()).collect();
    let x: Vec<f64> = known.iter().map(|i| at(*i)).collect();
    let points: Vec<_> = known.iter().filter_map(|i| series.points[*i]).collect();
    let value: Vec<f64> = points.iter().map(|p| scale * p.value).collect();
    // A campaign without repeats has a value, and no interval.
    let repeated: Vec<usize> = (0..points.len()).filter(|i| points[*i].std.is_some()).collect();
    let end = |sign: f64| -> Vec<f64> {
        repeated
            .iter()
            .map(|i| value[*i] + sign * NORMAL_95 * scale * points[*i].std.unwrap_or(0.0))
            .collect()
    };
    let interval_x: Vec<f64> = repeated.iter().map(|i| x[*i]).collect();
    let axis =
        if spread { Axis::new("time since the first campaign", "d") } else { Axis::new("campaign", "") };
    let mut panel = Panel::new(axis, Axis::new(name(&series.what), unit));
    if !repeated.is_empty() {
        panel = panel.intervals("95 % by repeats", Colour::Series(0), &interval_x, &end(-1.0), &end(1.0));
    }
    panel = panel.points("value", Colour::Series(0), &x, &value);
    for c in &change_points.changes {
        panel = panel.region("change", at(c.from), at(c.to));
    }
    panel
}
