//! Forms of a file: signs of remarks, separators of thousands, dates with slashes.

use super::Note;
use super::layout::{Layout, cells, is_missing, number};
use super::sample::SampleColumn;
use crate::date::{DateOrder, date_in, time_stamp_in};
use crate::recording::line::is_remark;
use crate::recording::thousands::{self, SEPARATORS};
use crate::statistics::extremes;

/// Signs that remarks begin with, beside the number sign; none begins a number.
const REMARKS: &[u8] = b"%;!'/*";
/// Of the time that the dates of a file span in one order, how much less it is in the right one: a month against a day.
const TELLING: f64 = 10.0;

/// How cells are read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forms {
    pub decimal_comma: bool,
    pub thousands: Option<u8>,
    pub order: DateOrder,
}

impl Forms {
    pub(super) fn of(layout: &Layout) -> Self {
        Self { decimal_comma: layout.decimal_comma, thousands: None, order: DateOrder::YearFirst }
    }

    /// A cell as a number.
    pub(super) fn number(&self, cell: &str) -> Option<f64> {
        match self.thousands {
            Some(separator) => {
                number(&thousands::without(cell.trim(), separator, self.decimal_comma)?, self.decimal_comma)
            }
            None => number(cell, self.decimal_comma),
        }
    }
}

/// The sign of remarks: another one than the number sign, where lines among the rows begin with it and are not rows.
pub(super) fn sign_of_remarks(lines: &[&[u8]], layout: &Layout) -> u8 {
    let first = |line: &&[u8]| line.trim_ascii_start().first().copied();
    let body = || lines[layout.data_at..].iter();
    let found = body().filter_map(first).find(|b| REMARKS.contains(b) && *b != layout.delimiter);
    let Some(sign) = found.filter(|_| !body().any(|l| first(l) == Some(b'#'))) else { return b'#' };
    let is_row = |line: &&&[u8]| {
        let row = cells(line, layout.dialect()).unwrap_or_default();
        row.len() == layout.names.len() && row.iter().any(|c| number(c, layout.decimal_comma).is_some())
    };
    let rows = body().filter(|l| is_remark(l, Some(sign))).any(|l| is_row(&l));
    if rows { b'#' } else { sign }
}

/// What was found of the forms, with what the user has to check and what is not clear.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub checks: Vec<Note>,
    pub unknown: Vec<Note>,
}

/// Looks at the columns whose cells are not numbers; `cells` gives those of one column.
pub(super) fn find<'a>(
    columns: &[SampleColumn],
    cells: impl Fn(usize) -> Vec<&'a str>,
    forms: &mut Forms,
) -> Found {
    let mut found = Found::default();
    for (n, column) in
        columns.iter().enumerate().filter(|(_, c)| c.texts > 0 && !c.is_stamped() && !c.is_dated())
    {
        let first = column.first_text.as_deref().unwrap_or_default();
        if first.matches('/').count() == 2 {
            dates(column, first, &cells(n), forms, &mut found);
        } else if column.quantity_by_name().is_some() {
            separators(column, first, &cells(n), forms, &mut found);
        }
    }
    found
}

/// The separator of thousands of a column.
fn separators(column: &SampleColumn, first: &str, cells: &[&str], forms: &mut Forms, found: &mut Found) {
    let decimal = if forms.decimal_comma { b',' } else { b'.' };
    let present = || cells.iter().filter(|c| !is_missing(c));
    let fits = |separator: &u8| {
        let with = Forms { thousands: Some(*separator), ..*forms };
        *separator != decimal
            && present().any(|c| thousands::has(c, *separator))
            && present().all(|c| with.number(c).is_some())
    };
    let Some(separator) = SEPARATORS.into_iter().find(fits) else { return };
    if forms.thousands == Some(separator)
        || present().any(|c| thousands::is_certain(c, separator, forms.decimal_comma))
    {
        forms.thousands.get_or_insert(separator);
        return;
    }
    let sign = char::from(separator);
    let text = format!(
        "{} holds numbers such as `{first}`, whose `{sign}` may separate thousands or be a decimal sign: write numbers without separators of \
         thousands, or describe the column and write thousands = \"{sign}\"",
        column.header
    );
    found.unknown.push(Note::on_column(&column.header, column.quantity_by_name(), text));
}

/// The order of the dates of a column.
fn dates(column: &SampleColumn, first: &str, cells: &[&str], forms: &mut Forms, found: &mut Found) {
    let span = |order: DateOrder| {
        let present = cells.iter().filter(|c| !is_missing(c));
        let seconds: Option<Vec<f64>> =
            present.map(|c| time_stamp_in(c, order).or_else(|| date_in(c, order))).collect();
        let range = extremes(&seconds?);
        Some(range.1 - range.0)
    };
    let (order, reason) = match (span(DateOrder::MonthFirst), span(DateOrder::DayFirst)) {
        (Some(_), None) => (DateOrder::MonthFirst, "no other order gives dates"),
        (None, Some(_)) => (DateOrder::DayFirst, "no other order gives dates"),
        (Some(month), Some(day)) if month * TELLING < day => {
            (DateOrder::MonthFirst, "otherwise months would pass between the rows")
        }
        (Some(month), Some(day)) if day * TELLING < month => {
            (DateOrder::DayFirst, "otherwise months would pass between the rows")
        }
        (Some(_), Some(_)) => {
            let alone = date_in(first, DateOrder::DayFirst).is_some();
            let which = if alone { format!("date = \"{}\" and ", column.header) } else { String::new() };
            let text = format!(
                "{} holds dates such as `{first}`, whose month may be the first or the second number: describe it under [columns.time] with \
                 {which}unit = \"timestamp-month-first\" or \"timestamp-day-first\"",
                column.header
            );
            found.unknown.push(Note::on_column(&column.header, column.quantity_by_name(), text));
            return;
        }
        (None, None) => return,
    };
    forms.order = order;
    let which = if order == DateOrder::MonthFirst { "month" } else { "day" };
    let text = format!(
        "{} has dates such as `{first}`: the {which} is taken to be first, since {reason}",
        column.header
    );
    found.checks.push(text.into());
}
