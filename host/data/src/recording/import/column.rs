//! Which column of a file a quantity is, and how its cells are read.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;

use super::super::quantity::Quantity;
use crate::date::DateOrder;

/// A column by name or by number, counted from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum ColumnRef {
    /// Counted from 1.
    Number(usize),
    /// As the header has it.
    Name(String),
}

impl fmt::Display for ColumnRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "{name}"),
        }
    }
}

/// Which way a displacement counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Positive {
    /// Readings grow as the muscle gets longer.
    Extension,
    /// Readings grow as the muscle shortens.
    Contraction,
}

/// Where a displacement of arbitrary zero has stroke 0, that is, where the muscle has its rest length.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Zero {
    /// At a reading, in the column's unit after scale and offset, before the sign.
    At(f64),
    /// At a place that the data show.
    Found(FoundZero),
}

/// A zero that the data show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FoundZero {
    /// Where the file begins.
    First,
    /// Where the muscle is longest, as on a machine that never stretches it beyond rest.
    Longest,
    /// Where the force is largest: the blocked force, at rest length.
    LargestForce,
}

/// What one quantity is made from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// The column of the file or of the lookup table.
    pub column: ColumnRef,
    /// The unit after scale and offset; by default that of the column's name, or SI. `timestamp` for a time that is written as a date
    /// with a time of day.
    pub unit: Option<String>,
    /// Value in `unit` = cell · scale + offset.
    #[serde(default = "one")]
    pub scale: f64,
    /// See `scale`.
    #[serde(default)]
    pub offset: f64,
    /// For displacements: which way is positive; contraction by default.
    pub positive: Option<Positive>,
    /// For displacements: where stroke 0 is; where the reading is 0 by default.
    pub zero: Option<Zero>,
    /// Text to number, for columns of words.
    pub values: Option<BTreeMap<String, f64>>,
    /// For times of day: the column of the dates.
    pub date: Option<ColumnRef>,
    /// For times: the column of the parts of a second that the time lacks.
    pub fraction: Option<Fraction>,
}

/// Parts of a second in a column of their own, such as milliseconds beside a time of day.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fraction {
    /// The column of the file.
    pub column: ColumnRef,
    /// What it counts: `s`, `ms`, `us`, or `ns`.
    pub unit: String,
}

/// The units of parts of a second, s.
pub(in crate::recording) const FRACTIONS: [(&str, f64); 4] =
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

impl Fraction {
    /// Its unit, s; `None` where that is not known.
    pub(in crate::recording) fn scale(&self) -> Option<f64> {
        FRACTIONS.iter().find(|(unit, _)| self.unit == *unit).map(|(_, scale)| *scale)
    }
}

/// The units of a time that is written as a date with a time of day, or as a time of day alone, and how dates with slashes are read.
const TIME_STAMPS: [(&str, DateOrder); 3] = [
    ("timestamp", DateOrder::YearFirst),
    ("timestamp-month-first", DateOrder::MonthFirst),
    ("timestamp-day-first", DateOrder::DayFirst),
];

/// The unit of time stamps with dates of this order.
pub(in crate::recording) fn time_stamp_unit(order: DateOrder) -> &'static str {
    TIME_STAMPS.iter().find(|(_, o)| *o == order).map_or(TIME_STAMPS[0].0, |(unit, _)| unit)
}

impl Column {
    /// The columns beside its own that it is read from.
    pub(in crate::recording) fn further(&self) -> impl Iterator<Item = &ColumnRef> {
        self.date.iter().chain(self.fraction.iter().map(|f| &f.column))
    }

    /// How its cells are read, where they are time stamps.
    pub(in crate::recording) fn stamp(&self, quantity: Quantity) -> Option<DateOrder> {
        let found = TIME_STAMPS.iter().find(|(unit, _)| self.unit.as_deref() == Some(unit));
        found.filter(|_| quantity == Quantity::Time).map(|(_, order)| *order)
    }
}

fn one() -> f64 {
    1.0
}
