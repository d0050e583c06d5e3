//! The page of a fleet: distributions, outlying muscles, effects by share, groups that differ, failures.

use pam_data::pluralise::pluralise;
use pam_data::statistics::extremes;
use pam_report::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed, significant};

use crate::fleet::{Fleet, Member, Quantity};
use crate::groups::{self, Difference, Finding};
use crate::overview::{Distribution, Outlying, Overview};
use crate::partition::folder_name;
use crate::robust::{FALSE_ALARMS, SMALLEST};

/// Rows of a table of muscles; the Parquet tables hold all.
const MOST_ROWS: usize = 200;
/// Bins of a histogram.
const BINS: usize = 24;
/// Values further from the median than this, in robust standard deviations, are counted in the last bin.
const WIDEST: f64 = 8.0;
/// Points in the picture over time.
const MOST_POINTS: usize = 5000;

/// Builds the page. `results` is the address of the results, relative to the page.
#[must_use]
pub fn page(fleet: &Fleet, overview: &Overview, results: &str) -> Page {
    let mut page = Page::new("Fleet", pluralise(fleet.members.len(), "muscle"));
    header(&mut page, fleet, overview);
    page.push(differences(fleet, overview));
    page.push(outlying(fleet, overview, results));
    page.push(effects(fleet, overview, results));
    page.push(distributions(fleet, overview));
    page.push(dates(fleet));
    page.push(failures(fleet, results));
    page.push(members(fleet, overview, results));
    page.origin("results", results);
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

fn header(page: &mut Page, fleet: &Fleet, overview: &Overview) {
    let (failed, outlying) = (fleet.failed(), overview.outlying_muscles());
    let tone = if failed + outlying + overview.differences.len() > 0 { Tone::Caution } else { Tone::Good };
    let mut parts = vec![format!("{} fitted", fixed(fleet.fitted() as f64, 0))];
    parts.push(format!("{outlying} outlying"));
    parts.push(match overview.differences.len() {
        0 => "no difference between groups".to_owned(),
        n => pluralise(n, "difference") + " between groups",
    });
    parts.push(format!("{failed} failed"));
    page.verdict(tone, format!("{}: {}.", pluralise(fleet.members.len(), "muscle"), parts.join(", ")));
    let count = |n: usize| fixed(n as f64, 0);
    page.fact("fitted", count(fleet.fitted()), "muscles with a table", Tone::Plain);
    page.fact("diagnosed", count(overview.diagnosed), "muscles with a verdict", Tone::Plain);
    let bad = |n: usize| if n > 0 { Tone::Caution } else { Tone::Good };
    page.fact("outlying", count(outlying), format!("|z| > {}", fixed(overview.limit, 1)), bad(outlying));
    page.fact("failed", count(failed), "see Failures", bad(failed));
    for d in overview.distributions.iter().filter(|d| fleet.quantities[d.quantity].name == "deadband_kPa") {
        let note = format!(
            "5 to 95 %: {} to {} kPa",
            significant(d.quantiles[0], 3),
            significant(d.quantiles[4], 3)
        );
        page.fact("median P_{0}", format!("{} kPa", significant(d.quantiles[2], 3)), note, Tone::Plain);
    }
}

fn address(results: &str, member: &Member) -> String {
    match member.reports.first() {
        // The folder's name has percent signs, which an address would decode.
        Some(report) => format!("{results}/{}/{report}", folder_name(&member.muscle).replace('%', "%25")),
        None => String::new(),
    }
}

fn name_of(q: &Quantity, fleet: &Fleet) -> String {
    let at = fleet.pressure_kPa.filter(|_| q.name.starts_with("E_") || q.name == "k_F");
    at.map_or_else(|| q.label.clone(), |p| format!("{} at {} kPa", q.label, fixed(p, 0)))
}

fn with_unit(value: f64, q: &Quantity) -> String {
    format!("{} {}", significant(value, 3), q.unit).trim_end().to_owned()
}

fn tags(member: &Member) -> String {
    member.tags.iter().map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>().join(", ")
}

fn outlying(fleet: &Fleet, overview: &Overview, results: &str) -> Section {
    let mut section = Section::new("Outlying muscles").summarised();
    if overview.distributions.iter().all(|d| d.centre.is_none()) {
        section.text(format!(
            "Outlying muscles are determined in fleets of at least {SMALLEST} fitted muscles with different values."
        ));
        return section;
    }
    section.text(format!(
        "A muscle is outlying if its robust z score, the distance from the median in units of 1.4826 times the median absolute deviation, \
         exceeds {} in size. In a fleet of normally distributed values, the probability that any muscle is listed is {} %.",
        fixed(overview.limit, 2),
        fixed(100.0 * FALSE_ALARMS, 0)
    ));
    if overview.outlying.is_empty() {
        section.notice(Tone::Good, "No muscle is outlying.");
        return section;
    }
    let mut table = Table::new("Outlying muscles", &["muscle", "largest z", "outlying in", "tags"]);
    let rows = by_muscle(overview);
    for (member, all) in rows.iter().take(MOST_ROWS) {
        let m = &fleet.members[*member];
        let one = |o: &&Outlying| {
            let q = &fleet.quantities[o.quantity];
            format!("{} = {} (z = {})", name_of(q, fleet), with_unit(o.value, q), fixed(o.z, 1))
        };
        let list = all.iter().map(one).collect::<Vec<_>>().join(", ");
        let largest = all.first().map_or_else(String::new, |o| fixed(o.z, 1));
        table.linked_row(address(results, m), [m.muscle.clone(), largest, list, tags(m)]);
    }
    section.table(table);
    more(&mut section, rows.len());
    section
}

/// Outlying muscles with all their outlying quantities, the largest z first.
fn by_muscle(overview: &Overview) -> Vec<(usize, Vec<&Outlying>)> {
    let mut rows: Vec<(usize, Vec<&Outlying>)> = Vec::new();
    for o in &overview.outlying {
        match rows.iter_mut().find(|(member, _)| *member == o.member) {
            Some((_, all)) => all.push(o),
            None => rows.push((o.member, vec![o])),
        }
    }
    rows
}

fn more(section: &mut Section, rows: usize) {
    if rows > MOST_ROWS {
        section.text(format!("{} more rows are not shown.", fixed((rows - MOST_ROWS) as f64, 0)));
    }
}

fn distributions(fleet: &Fleet, overview: &Overview) -> Section {
    let mut section = Section::new("Distributions");
    let mut table = Table::new(
        "Quantiles over the fleet",
        &["quantity", "muscles", "5 %", "25 %", "median", "75 %", "95 %", "robust std"],
    );
    let mut all = overview.distributions.iter().filter(|d| d.muscles > 0).peekable();
    if all.peek().is_none() {
        return section;
    }
    for d in all {
        let q = &fleet.quantities[d.quantity];
        let title = format!("Distribution of {}", name_of(q, fleet));
        let reading = "Each bar counts muscles. Dashed lines: beyond them a muscle is outlying. Values far outside are counted in the last bar.";
        section.figure(Figure::new(
            format!("distribution-{}", d.quantity),
            &title,
            reading,
            histogram(fleet, overview, d),
        ));
        let scale = d.centre.map_or_else(String::new, |c| significant(c.deviation, 2));
        let mut cells =
            vec![format!("{} ({})", name_of(q, fleet), if q.unit.is_empty() { "–" } else { q.unit })];
        cells.push(fixed(d.muscles as f64, 0));
        cells.extend(d.quantiles.map(|v| significant(v, 3)));
        cells.push(scale);
        table.row(cells);
    }
    section.table(table);
    section
}

fn histogram(fleet: &Fleet, overview: &Overview, d: &Distribution) -> Panel {
    let q = &fleet.quantities[d.quantity];
    let values: Vec<f64> = fleet.members.iter().filter_map(|m| m.values[d.quantity]).collect();
    let (mut low, mut high) = extremes(&values);
    if let Some(c) = d.centre {
        low = low.max(c.median - WIDEST * c.deviation);
        high = high.min(c.median + WIDEST * c.deviation);
    }
    let width = ((high - low) / BINS as f64).max(1e-9 * high.abs().max(1e-9));
    let mut counts = vec![0.0; BINS];
    for value in &values {
        let bin = ((value - low) / width).floor().clamp(0.0, (BINS - 1) as f64);
        counts[bin as usize] += 1.0;
    }
    let middles: Vec<f64> = (0..BINS).map(|i| low + (i as f64 + 0.5) * width).collect();
    let mut panel = Panel::new(Axis::new(name_of(q, fleet), q.unit), Axis::new("muscles", "").from_zero())
        .bars("muscles", Colour::Series(0), &middles, &counts);
    if let Some(c) = d.centre {
        for side in [-1.0, 1.0] {
            let at = c.median + side * overview.limit * c.deviation;
            if at > low && at < high {
                panel = panel.with("limit of outlying values", Colour::Alarm, pam_report::Mark::Moment(at));
            }
        }
    }
    panel
}

fn effects(fleet: &Fleet, overview: &Overview, results: &str) -> Section {
    let mut section = Section::new("Effects").summarised();
    if overview.diagnosed == 0 {
        return section;
    }
    let verdicts: Vec<String> = overview.verdicts.iter().map(|(v, n)| format!("{n} {v}")).collect();
    section.text(format!("Verdicts: {}.", verdicts.join(", ")));
    if overview.effects.is_empty() {
        section.text("No effect was named for any muscle.");
        return section;
    }
    let places: Vec<f64> = (0..overview.effects.len()).map(|i| i as f64).collect();
    let shares: Vec<f64> = overview.effects.iter().map(|e| 100.0 * e.share).collect();
    let names = overview.effects.iter().map(|e| e.effect.clone()).collect();
    let panel = Panel::new(
        Axis::new("share of the diagnosed muscles", "%").range(0.0, 100.0),
        Axis::names("effect", names),
    )
    .bars("", Colour::Series(0), &shares, &places);
    section.figure(Figure::new(
        "effects",
        "Effects by share of the fleet",
        "Effects that the diagnosis named.",
        panel,
    ));
    let mut table = Table::new("Effects by muscle", &["muscle", "effect", "probability", "acts on", "tags"]);
    let mut rows = 0;
    for member in &fleet.members {
        for effect in &member.effects {
            rows += 1;
            if rows <= MOST_ROWS {
                let whose = if effect.bench { "bench" } else { "muscle" };
                table.linked_row(
                    address(results, member),
                    [
                        member.muscle.clone(),
                        effect.effect.clone(),
                        fixed(effect.probability, 2),
                        whose.into(),
                        tags(member),
                    ],
                );
            }
        }
    }
    section.table(table);
    more(&mut section, rows);
    section
}

/// A finding as a sentence without its full stop.
#[must_use]
pub fn sentence(finding: &Finding, fleet: &Fleet) -> String {
    let group = format!("{} = {}", finding.key, finding.value);
    let quantity = |i: &usize| &fleet.quantities[*i];
    match &finding.difference {
        Difference::Effect { effect, inside, outside } => format!(
            "{group}: {effect} in {} % of the muscles, {} % of the others",
            fixed(100.0 * inside, 0),
            fixed(100.0 * outside, 0)
        ),
        Difference::Quantity { quantity: i, inside, outside } => {
            let q = quantity(i);
            format!(
                "{group}: {} is {}, {} in the others",
                name_of(q, fleet),
                with_unit(*inside, q),
                with_unit(*outside, q)
            )
        }
        Difference::Trend { quantity: i, correlation } => {
            let way = if *correlation > 0.0 { "rises" } else { "falls" };
            format!(
                "{} {way} with the date (rank correlation {})",
                name_of(quantity(i), fleet),
                fixed(*correlation, 2)
            )
        }
    }
}

fn differences(fleet: &Fleet, overview: &Overview) -> Section {
    let mut section = Section::new("Groups").summarised();
    if overview.tests == 0 {
        let tagged = fleet.members.iter().any(|m| !m.tags.is_empty());
        section.text(if tagged {
            "No tag of the manifest makes two groups of enough muscles to compare."
        } else {
            "Tags in the manifest, such as batch, rig, and date, make groups comparable here."
        });
        return section;
    }
    section.text(format!(
        "{} compared the muscles of each tag with the others. A difference is listed if the probability of any by chance, over all tests, is \
         below {} %.",
        pluralise(overview.tests, "test"),
        fixed(100.0 * groups::SIGNIFICANT, 0)
    ));
    if overview.differences.is_empty() {
        section.notice(Tone::Good, "No group differs from the others.");
        return section;
    }
    let mut table = Table::new("Differences between groups", &["tag", "difference", "muscles", "p"]);
    for finding in overview.differences.iter().take(MOST_ROWS) {
        let tag = if finding.value.is_empty() {
            finding.key.clone()
        } else {
            format!("{} = {}", finding.key, finding.value)
        };
        let text = sentence(finding, fleet);
        let text = text.split_once(": ").map_or(text.as_str(), |(_, t)| t).to_owned();
        table.row([
            tag,
            text,
            finding.muscles.to_string(),
            if finding.p < 1e-6 { "< 10^{−6}".into() } else { significant(finding.p, 1) },
        ]);
    }
    section.table(table);
    more(&mut section, overview.differences.len());
    section
}

/// Quantities over the date of the recordings.
fn dates(fleet: &Fleet) -> Section {
    let mut section = Section::new("Over time");
    let days: Vec<Option<f64>> =
        fleet.members.iter().map(|m| m.tags.get("date").and_then(|d| groups::day(d))).collect();
    let Some(first) = days.iter().copied().flatten().reduce(f64::min) else { return section };
    if !days.iter().flatten().any(|d| *d > first) {
        return section;
    }
    for (i, q) in fleet
        .quantities
        .iter()
        .enumerate()
        .filter(|(_, q)| ["deadband_kPa", "k_F", "E_1_MPa"].contains(&q.name.as_str()))
    {
        let dated = fleet.members.iter().zip(&days).filter_map(|(m, d)| Some(((*d)? - first, m.values[i]?)));
        let (x, y): (Vec<f64>, Vec<f64>) = dated.take(MOST_POINTS).unzip();
        if x.len() < 2 {
            continue;
        }
        let panel =
            Panel::new(Axis::new("days since the first date", "d"), Axis::new(name_of(q, fleet), q.unit))
                .points("muscles", Colour::Series(0), &x, &y);
        section.figure(Figure::new(
            format!("date-{i}"),
            format!("{} over the date", name_of(q, fleet)),
            "One point per muscle, by the tag `date`.",
            panel,
        ));
    }
    section
}

fn failures(fleet: &Fleet, results: &str) -> Section {
    let mut section = Section::new("Failures");
    let mut table = Table::new("Failures", &["muscle", "code", "cause", "place", "remedy"]);
    let mut rows = 0;
    for member in &fleet.members {
        for f in &member.failures {
            rows += 1;
            if rows <= MOST_ROWS {
                table.linked_row(
                    address(results, member),
                    [&member.muscle, &f.code, &f.cause, &f.place, &f.remedy].map(String::clone),
                );
            }
        }
    }
    section.table(table);
    more(&mut section, rows);
    section
}

fn members(fleet: &Fleet, overview: &Overview, results: &str) -> Section {
    let mut section = Section::new("Muscles");
    let mut header = vec!["muscle".to_owned()];
    header.extend(fleet.quantities.iter().map(|q| match q.unit {
        "" => q.label.clone(),
        unit => format!("{} ({unit})", q.label),
    }));
    header.extend(["verdict".to_owned(), "effects".to_owned(), "tags".to_owned()]);
    let mut table = Table { caption: "Muscles by name".into(), header, ..Table::default() };
    for member in fleet.members.iter().take(MOST_ROWS) {
        let mut cells = vec![member.muscle.clone()];
        cells.extend(member.values.iter().map(|v| v.map_or_else(String::new, |v| significant(v, 3))));
        cells.push(member.verdict.clone().unwrap_or_default());
        cells.push(member.effects.iter().map(|e| e.effect.as_str()).collect::<Vec<_>>().join(", "));
        cells.push(tags(member));
        table.linked_row(address(results, member), cells);
    }
    section.table(table);
    more(&mut section, fleet.members.len());
    if fleet.members.iter().all(|m| m.reports.is_empty()) && !overview.distributions.is_empty() {
        section.text("`host batch --reports` writes a report for each muscle; their names are links then.");
    }
    section
}
