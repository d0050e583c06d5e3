//! What is wrong with a file for every reader: words among numbers, rows without numbers, clocks that go back.

use super::others::Others;
use super::runs;
use super::sample::{Sample, SampleColumn};
use super::{Guess, GuessedColumn, Note, Source, roles};
use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;
use crate::recording::Quantity;

/// Columns that are named for a quantity and hold cells that are not numbers.
pub(super) fn texts(sample: &Sample, guess: &mut Guess) {
    for column in &sample.columns {
        let Some(quantity) = column.quantity_by_name() else { continue };
        let is_known = guess.unknown.iter().any(|note| note.is_on_column(&column.header));
        let coded = matches!(quantity, Quantity::Direction | Quantity::Cycle);
        if column.texts == 0 || coded || is_known || guess.has(quantity) {
            continue;
        }
        let cell = column.first_text.as_deref().unwrap_or_default();
        let advice = if has_thousands(cell) {
            "write numbers without separators of thousands"
        } else {
            "remove these cells, or write all decimals with the same sign"
        };
        let text = format!(
            "{} looks like {}, but {} of {} cells are not numbers, such as `{}`: {advice}",
            column.header,
            quantity.name().replace('_', " "),
            column.texts,
            sample.rows,
            cell.chars().take(40).flat_map(char::escape_debug).collect::<String>()
        );
        guess.unknown.push(Note::on_column(&column.header, Some(quantity), text));
    }
}

/// Whether a cell is a number with separators of thousands: `1,234.5`, `1.234,5`, `1 234`, `1'234`.
fn has_thousands(cell: &str) -> bool {
    let bare = cell.trim_start_matches(['-', '+']);
    [',', '.', ' ', '\'', '\u{a0}', '\u{202f}', '\u{2019}'].iter().any(|separator| {
        let mut groups = bare.split(*separator);
        let first = groups.next().unwrap_or_default();
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let rest: Vec<&str> = groups.collect();
        let group = |(n, text): (usize, &&str)| {
            let last = n + 1 == rest.len();
            let whole = if last { text.split([',', '.']).next().unwrap_or_default() } else { text };
            whole.len() == 3 && digits(whole)
        };
        digits(first) && first.len() <= 3 && !rest.is_empty() && rest.iter().enumerate().all(group)
    })
}

/// Rows without a number in a column that is used.
pub(super) fn incomplete_rows(sample: &Sample, guess: &mut Guess) {
    let column = |column: &GuessedColumn| {
        let n = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source)?;
        (column.quantity != Quantity::Direction).then_some(&sample.columns[n])
    };
    let used: Vec<&SampleColumn> = guess.columns.iter().filter_map(column).collect();
    let lacking: Vec<&&SampleColumn> = used.iter().filter(|c| c.missing > 0).collect();
    if lacking.is_empty() {
        return;
    }
    let whole = |row: &usize| used.iter().all(|c| c.numbers.get(*row).is_some_and(|v| v.is_finite()));
    let complete = (0..sample.rows).filter(whole).count();
    let names: Vec<&str> = lacking.iter().map(|c| c.header.as_str()).collect();
    let most = lacking.iter().map(|c| c.missing).max().unwrap_or_default();
    let without = format!(
        "{} {} up to {most} of {} cells without a number",
        names.join(", "),
        if names.len() == 1 { "has" } else { "have" },
        sample.rows
    );
    if 2 * complete < sample.rows {
        guess.unknown.push(format!(
            "{without}, and {} a number in every column: where the channels were recorded at different times, interpolate them to \
             the times of one of them",
            match complete {
                0 => "no row has".to_owned(),
                1 => "only one row has".to_owned(),
                n => format!("only {} have", pluralise(n, "row")),
            }
        ).into());
    } else {
        guess.checks.push(
            format!(
                "{without}: write missing = \"skip\" to leave {} out",
                pluralise(sample.rows - complete, "row")
            )
            .into(),
        );
    }
}

/// The row behind which a counter of a microcontroller began again, counted from 1, and its bits; none where the time ever goes back
/// elsewhere.
pub(super) fn wraps(time: &SampleColumn) -> Option<(usize, u32)> {
    /// Of its size, how near to it the last reading before is, and how near to zero the first one after.
    const NEAR: f64 = 0.01;
    let back = || time.numbers.windows(2).enumerate().filter(|(_, w)| !(w[1] > w[0]));
    let (first, _) = back().next()?;
    let of = |bits: &u32| {
        let size = (1_u64 << bits) as f64;
        back().all(|(_, w)| w[0] > (1.0 - NEAR) * size && w[0] < size && w[1] < NEAR * size)
    };
    [16, 32].into_iter().find(of).map(|bits| (first + 1, bits))
}

/// A time that does not increase at some rows of the same run.
pub(super) fn clock(time: &SampleColumn, at: usize, guess: &mut Guess) {
    let rows = time.numbers.len();
    let problem = if runs::runs_backwards(time) {
        "time runs backwards: sort the rows by time".to_owned()
    } else if 4 * at > rows {
        "the clock is coarser than the rows: log more digits, or replace the time by sample_interval_s where rows are equally spaced"
            .to_owned()
    } else if let Some((row, bits)) = wraps(time) {
        let size = 1_u64 << bits;
        format!("a counter of {bits} bits overflowed after row {row}: add {size} to the times that follow")
    } else {
        "no column says which run a row belongs to: make one file of each run, or remove the rows that are given twice".to_owned()
    };
    let text = format!("time does not increase at {}; {problem}", pluralise(at, "row"));
    guess.unknown.push(Note::on_column(&time.header, Some(Quantity::Time), text));
}

/// Refuses files whose columns have other places or other units in a row of their own, where the description counts columns: nothing else
/// would notice.
pub(super) fn other_columns(sample: &Sample, others: &Others<'_>, guess: &Guess) -> Result<()> {
    /// Files that are named.
    const NAMED: usize = 5;
    let by_number = |c: &GuessedColumn| match c.source {
        Source::Number(n) => Some(n - 1),
        Source::Named(_) | Source::Listed(_) => None,
    };
    let columns: Vec<usize> = guess.columns.iter().filter_map(by_number).collect();
    if columns.is_empty() {
        return Ok(());
    }
    let differing = others.with_other_columns(sample, &columns);
    if differing.is_empty() {
        return Ok(());
    }
    let more = differing.len().saturating_sub(NAMED);
    let mut names = differing.into_iter().take(NAMED).collect::<Vec<_>>().join(", ");
    if more > 0 {
        names += &format!(", and {more} more");
    }
    let cause = format!("the columns have other names, units, or places than in {}: {names}", guess.file);
    Err(Error::new(DataCode::CallInvalid, cause)
        .help("describe files of each form by themselves, in calls of their own"))
}
