//! A time that a logger writes into several columns: the date, the time of day, and the parts of the second.

use super::names::{Family, Name};
use super::sample::{Sample, SampleColumn};
use crate::recording::Quantity;
use crate::recording::import::FRACTIONS;
use crate::recording::time_of_day::DAY;

/// The columns of a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Joined {
    /// The time of day, or the whole seconds.
    pub clock: usize,
    /// Its date.
    pub date: Option<usize>,
    /// Its parts of a second, with their unit.
    pub fraction: Option<(usize, &'static str)>,
}

/// Looks for such columns, and joins their numbers in the column of the clock.
pub(super) fn join(sample: &mut Sample) {
    let (clock, fraction) = match fraction(sample) {
        Some((clock, n, unit)) => (clock, Some((n, unit))),
        None => match stamped(sample) {
            Some(clock) => (clock, None),
            None => return,
        },
    };
    if let Some((n, unit)) = fraction {
        let numbers = with_fraction(&sample.columns[clock].numbers, &sample.columns[n].numbers, unit);
        sample.columns[clock].numbers = numbers;
    }
    let date = date(sample, clock);
    if let Some((_, numbers)) = &date {
        sample.columns[clock].numbers.clone_from(numbers);
        sample.columns[clock].midnight = None;
    }
    let date = date.map(|(n, _)| n);
    if date.is_some() || fraction.is_some() {
        sample.joined = Some(Joined { clock, date, fraction });
    }
}

/// The column of time stamps that is the time: that named for it, or the first.
pub(super) fn stamped(sample: &Sample) -> Option<usize> {
    let all = || (0..sample.columns.len()).filter(|n| sample.columns[*n].is_stamped());
    all().find(|n| sample.columns[*n].quantity_by_name() == Some(Quantity::Time)).or_else(|| all().next())
}

/// The clock that shows whole seconds, and the column of the parts of a second that it lacks.
fn fraction(sample: &Sample) -> Option<(usize, usize, &'static str)> {
    let whole = |c: &SampleColumn| {
        let seconds = c.name.unit.is_none_or(|u| u.unit == "s" && u.scale == 1.0);
        let clock =
            c.is_stamped() || c.is_numeric() && seconds && c.quantity_by_name() == Some(Quantity::Time);
        clock && c.values().all(|v| v.fract() == 0.0)
    };
    let clocks: Vec<usize> = (0..sample.columns.len()).filter(|n| whole(&sample.columns[*n])).collect();
    let parts = sample.columns.iter().enumerate().filter_map(|(n, c)| Some((n, part(c)?)));
    parts.into_iter().find_map(|(n, unit)| {
        let completes = |clock: &&usize| {
            let alone = &sample.columns[**clock].numbers;
            let joined = with_fraction(alone, &sample.columns[n].numbers, unit);
            let back = backwards(&joined);
            **clock != n && back < backwards(alone) && 20 * back <= joined.len()
        };
        clocks.iter().find(completes).map(|clock| (*clock, n, unit))
    })
}

/// The unit of a column whose numbers are parts of a second.
fn part(column: &SampleColumn) -> Option<&'static str> {
    let spelled = column.name.unit.filter(|u| u.family == Family::Time && u.unit == "ms")?;
    let (unit, scale) =
        *FRACTIONS.iter().find(|(_, scale)| (scale / (1e-3 * spelled.scale) - 1.0).abs() < 1e-6)?;
    let within = column.is_numeric() && column.values().all(|v| v >= 0.0 && v * scale < 1.0);
    (within && backwards(&column.numbers) > 0).then_some(unit)
}

fn with_fraction(clock: &[f64], parts: &[f64], unit: &str) -> Vec<f64> {
    let scale = FRACTIONS.iter().find(|(u, _)| *u == unit).map_or(1.0, |(_, scale)| *scale);
    clock.iter().zip(parts).map(|(clock, part)| clock + scale * part).collect()
}

/// Rows at which a time does not increase.
fn backwards(time: &[f64]) -> usize {
    time.windows(2).filter(|w| !(w[1] > w[0])).count()
}

/// The column of the dates of times of day, and both together; `None` where they do not change with them.
fn date(sample: &Sample, clock: usize) -> Option<(usize, Vec<f64>)> {
    let times = &sample.columns[clock];
    // A clock that passes midnight counts on behind it.
    let of_day = times.is_stamped() && times.values().all(|t| (0.0..2.0 * DAY).contains(&t));
    let is_date = |name: &Name| {
        name.words.iter().any(|w| ["date", "datum", "day", "tag", "fecha"].contains(&w.as_str()))
    };
    let dated = || sample.columns.iter().enumerate().filter(|(_, c)| c.is_dated());
    let (n, dates) = dated().find(|(_, c)| is_date(&c.name)).or_else(|| dated().next()).filter(|_| of_day)?;
    let join = |(time, date): (&f64, &f64)| time % DAY + date;
    let joined: Vec<f64> = times.numbers.iter().zip(&dates.numbers).map(join).collect();
    (backwards(&joined) <= backwards(&times.numbers)).then_some((n, joined))
}
