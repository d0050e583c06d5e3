//! The time of a file: in a column of numbers with another name, in time stamps, in several columns.

use super::joined_time::stamped;
use super::names::Score;
use super::roles::source;
use super::sample::{Sample, SampleColumn};
use super::{Guess, GuessedColumn, Note, values};
use crate::date::{DateOrder, date_in, time_stamp};
use crate::recording::Quantity;
use crate::recording::import::time_stamp_unit;
use crate::statistics::{extremes, median};

/// The time where no column of numbers is named for it: time stamps, or a column that increases from row to row.
pub(super) fn find(sample: &Sample, used: &mut [bool], guess: &mut Guess) {
    if guess.has(Quantity::Time) {
        return;
    }
    let is_time = |c: &SampleColumn| c.quantity_by_name() == Some(Quantity::Time);
    if let Some(n) = stamped(sample).filter(|n| !used[*n]) {
        let column = &sample.columns[n];
        used[n] = true;
        let date = sample.joined.and_then(|j| j.date).map(|date| &sample.columns[date]);
        let plain = |text: &str| date_in(text, DateOrder::YearFirst).or_else(|| time_stamp(text)).is_some();
        let plain = date.unwrap_or(column).first_text.as_deref().is_some_and(plain);
        let order = if plain { DateOrder::YearFirst } else { sample.order };
        guess.columns.insert(0, time_column(sample, n, time_stamp_unit(order), 1.0, None));
        if let Some(row) = column.midnight {
            guess.checks.push(
                format!("{} passes midnight at row {row}: a day is added from there", column.header).into(),
            );
        }
        return;
    }
    // Dates have two separators, times of day colons.
    let dated = |c: &SampleColumn| {
        let text = c.first_text.as_deref().unwrap_or_default();
        text.contains(':') || text.matches(['-', '/', '.']).count() > 1
    };
    if let Some(column) = sample.columns.iter().find(|c| !c.is_numeric() && is_time(c) && dated(c)) {
        if guess.unknown.iter().any(|note| note.is_on_column(&column.header)) {
            return;
        }
        let text = format!(
            "{} holds dates or times of day that are not read: write them as 2026-11-21T13:30:00.25, write seconds from some beginning, or \
             give sample_interval_s",
            column.header
        );
        guess.unknown.push(Note::on_column(&column.header, Some(Quantity::Time), text));
        return;
    }
    let unnamed = |(n, c): &(usize, &SampleColumn)| {
        !used[*n]
            && c.quantity_by_name().is_none()
            && c.name.unit.is_none()
            && values::increases(c)
            && !values::counts_rows(c)
    };
    if let Some((n, column)) = sample.columns.iter().enumerate().find(unnamed)
        && let Some(suggested) = values::suggested(Quantity::Time, column, &[])
    {
        if sample.columns.iter().any(|c| is_time(c) && !c.is_numeric()) {
            return;
        }
        used[n] = true;
        guess.checks.push(
            format!(
                "column {} is taken as the time in {}, since it increases from row to row",
                column.header,
                suggested.spelled()
            )
            .into(),
        );
        let range = Some(column.range());
        guess.columns.insert(0, time_column(sample, n, suggested.unit, suggested.scale, range));
    }
}

/// Whether columns of times disagree, such as those of channels that were recorded each for itself: one of them would shift the others. Epochs
/// beside seconds from the beginning agree, and recordings side by side have their own times.
pub(super) fn is_unclear(sample: &Sample, found: &[(Score, usize)], guess: &mut Guess) -> bool {
    let Some((score, first)) = found.first() else { return false };
    let same: Vec<usize> = found.iter().filter(|(s, _)| s == score).map(|(_, n)| *n).collect();
    let forces = sample.columns.iter().filter(|c| c.quantity_by_name() == Some(Quantity::Force)).count();
    if same.len() < 2 || forces == same.len() {
        return false;
    }
    let seconds = |n: usize| {
        let unit = sample.columns[n].name.unit;
        let scale = unit.map_or(1.0, |u| u.scale * Quantity::Time.unit(u.unit).map_or(1.0, |u| u.scale));
        sample.columns[n].numbers.iter().map(move |t| t * scale)
    };
    let own: Vec<f64> = seconds(*first).collect();
    let steps = own.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect::<Vec<_>>();
    if steps.is_empty() {
        return false;
    }
    let near = 0.5 * median(&mut steps.clone());
    let (begin, end) = extremes(own.iter().copied().filter(|t| t.is_finite()));
    let disagrees = |n: &usize| {
        let differences = seconds(*n).zip(&own).map(|(a, b)| a - b).filter(|d| d.is_finite());
        let (low, high) = extremes(differences);
        let another_clock = high - low <= near && low.abs() > end - begin;
        !(low.abs() <= near && high.abs() <= near || another_clock)
    };
    if !same[1..].iter().any(disagrees) {
        return false;
    }
    let names: Vec<&str> = same.iter().map(|n| sample.columns[*n].header.as_str()).collect();
    let text = format!(
        "{} hold different times: where each channel has its own, interpolate the channels to one of them; otherwise describe the right one under \
         [columns.time]",
        names.join(", ")
    );
    guess.unknown.push(Note::on_quantity(Quantity::Time, text));
    true
}

/// The date and the parts of a second, where the time has them in columns of their own.
pub(super) fn describe_parts(sample: &Sample, used: &mut [bool], guess: &mut Guess) {
    let Some(joined) = sample.joined else { return };
    let clock = source(sample, joined.clock);
    let is_time = |c: &&mut GuessedColumn| c.quantity == Quantity::Time && c.source == clock;
    let Some(column) = guess.columns.iter_mut().find(is_time) else { return };
    let mut parts = Vec::new();
    if let Some(n) = joined.date {
        used[n] = true;
        column.date = Some(source(sample, n));
        parts.push(format!("the date in {}", sample.columns[n].header));
    }
    if let Some((n, unit)) = joined.fraction {
        used[n] = true;
        column.fraction = Some((source(sample, n), unit));
        parts.push(format!("the {unit} in {}", sample.columns[n].header));
    }
    guess.checks.push(format!("the time is {} with {}", column.header, parts.join(" and ")).into());
}

/// The interval of the rows, by the one line above the table that says how many there are in a second.
pub(super) fn interval(sample: &Sample, guess: &mut Guess) {
    if guess.has(Quantity::Time) || guess.unknown.iter().any(|note| note.is_on_quantity(Quantity::Time)) {
        return;
    }
    let mut rates = sample.preamble.iter().filter_map(|line| Some((line, rate(line)?)));
    let (Some((line, rate)), None) = (rates.next(), rates.next()) else { return };
    guess.sample_interval_s = Some(1.0 / rate);
    let text = format!(
        "no column is the time: the rows are taken to be equally spaced, by the line above the table `{}`",
        line.trim()
    );
    guess.checks.push(text.into());
}

/// The rate in Hz that a line such as `Sampling rate [Hz]: 30` says.
fn rate(line: &str) -> Option<f64> {
    let lower = line.to_lowercase();
    let named =
        ["sampl", "abtast", "scan rate", "data rate", "acquisition rate"].iter().any(|w| lower.contains(w));
    let scale = if lower.contains("khz") { 1e3 } else { 1.0 };
    let mut numbers = lower
        .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == ','))
        .filter_map(|n| n.trim_matches([',', '.']).replace(',', ".").parse::<f64>().ok());
    let (Some(number), None) = (numbers.next(), numbers.next()) else { return None };
    (named && lower.contains("hz") && number > 0.0).then_some(scale * number)
}

/// A column as the time.
fn time_column(
    sample: &Sample,
    n: usize,
    unit: &'static str,
    scale: f64,
    range: Option<(f64, f64)>,
) -> GuessedColumn {
    GuessedColumn {
        quantity: Quantity::Time,
        source: source(sample, n),
        header: sample.columns[n].header.clone(),
        unit,
        scale,
        offset: 0.0,
        extension: false,
        from_longest: false,
        values: Vec::new(),
        date: None,
        fraction: None,
        range,
    }
}
