//! The time of a file that has no column of numbers with its name.

use super::roles::source;
use super::sample::{Sample, SampleColumn};
use super::{Guess, GuessedColumn, Note, values};
use crate::date::{DateOrder, time_stamp};
use crate::recording::Quantity;
use crate::recording::import::time_stamp_unit;

/// The time where no column of numbers is named for it: time stamps, or a column that increases from row to row.
pub(super) fn find(sample: &Sample, used: &mut [bool], guess: &mut Guess) {
    if guess.has(Quantity::Time) {
        return;
    }
    let is_time = |c: &SampleColumn| c.quantity_by_name() == Some(Quantity::Time);
    let stamped = |(n, c): &(usize, &SampleColumn)| !used[*n] && c.is_stamped();
    let all = || sample.columns.iter().enumerate();
    // A file may have a column of dates and one of times of day: that named for the time is looked for first.
    let found = all().filter(stamped).find(|(_, c)| is_time(c)).or_else(|| all().find(stamped));
    if let Some((n, column)) = found {
        used[n] = true;
        let plain = column.first_text.as_deref().is_some_and(|text| time_stamp(text).is_some());
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
                if suggested.scale == 1.0 { suggested.unit } else { "µs" }
            )
            .into(),
        );
        let range = Some(column.range());
        guess.columns.insert(0, time_column(sample, n, suggested.unit, suggested.scale, range));
    }
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
        range,
    }
}
