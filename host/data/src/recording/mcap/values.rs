//! The numbers in the messages of one topic, as columns.

use std::collections::HashMap;

use crate::bounds::Budget;
use crate::error::Result;

/// More columns than this are a picture or a map, no sensor; as for a matrix.
const WIDEST: usize = 1000;
/// Elements of an array that become columns: joints, channels of an amplifier. Longer arrays are scans and pictures.
pub(super) const LONGEST_ARRAY: usize = 64;

/// One field that is a number.
#[derive(Debug)]
pub(super) struct Field {
    /// Its path within the message, such as `wrench.force.x`.
    pub path: String,
    /// The first message that has it.
    first: usize,
    /// One value for each message from there on; NaN where a message does not have the field.
    values: Vec<f64>,
    /// Whether it moves in steps: all its values are integers or switches, by their type.
    pub steps: bool,
}

impl Field {
    /// The value of a message; NaN where it does not have the field.
    pub(super) fn at(&self, row: usize) -> f64 {
        row.checked_sub(self.first).and_then(|i| self.values.get(i)).copied().unwrap_or(f64::NAN)
    }

    fn truncate(&mut self, rows: usize) {
        self.values.truncate(rows.saturating_sub(self.first));
    }
}

/// The fields of one topic. A decoder calls [`Values::put`] for each number of a message.
#[derive(Debug, Default)]
pub(super) struct Values {
    pub fields: Vec<Field>,
    index: HashMap<String, usize>,
    /// Messages that are complete.
    pub rows: usize,
    /// Where the next field is expected: messages have their fields in the same order.
    next: usize,
    /// Seconds and nanoseconds of the stamp in the header of the current message.
    stamp: (f64, f64),
    /// A field does not fit into the limits.
    pub too_wide: bool,
}

impl Values {
    /// Adds a number of the current message. `exact` is an integer or a switch.
    pub(super) fn put(&mut self, path: &str, value: f64, exact: bool) {
        if let Some(part) = path.strip_prefix("header.").or_else(|| path.strip_prefix("timestamp.")) {
            match part {
                "stamp.sec" | "stamp.secs" | "sec" | "seconds" => self.stamp.0 = value,
                "stamp.nanosec" | "stamp.nsec" | "stamp.nsecs" | "nsec" | "nanos" => self.stamp.1 = value,
                _ => {}
            }
            return;
        }
        let at = match self.fields.get(self.next) {
            Some(field) if field.path == path => self.next,
            _ => match self.index.get(path) {
                Some(at) => *at,
                None => {
                    if self.fields.len() >= WIDEST {
                        self.too_wide = true;
                        return;
                    }
                    self.index.insert(path.to_owned(), self.fields.len());
                    self.fields.push(Field {
                        path: path.to_owned(),
                        first: self.rows,
                        values: Vec::new(),
                        steps: true,
                    });
                    self.fields.len() - 1
                }
            },
        };
        self.next = at + 1;
        let field = &mut self.fields[at];
        field.steps &= exact;
        // A name that is there twice in a message counts once.
        if field.first + field.values.len() == self.rows {
            field.values.push(value);
        }
    }

    /// Forgets what was put of a message that cannot be read to its end.
    pub(super) fn abandon(&mut self) {
        for field in &mut self.fields {
            field.truncate(self.rows);
        }
        (self.next, self.stamp) = (0, (0.0, 0.0));
    }

    /// Ends a message, and gives the stamp of its header, ns since 1970.
    pub(super) fn end(&mut self, budget: &mut Budget) -> Result<Option<u64>> {
        // A message takes memory for every column, whatever little it says, and for its two times.
        budget.take(self.fields.len() + 2)?;
        self.rows += 1;
        for field in &mut self.fields {
            field.values.resize(self.rows - field.first, f64::NAN);
        }
        let (seconds, nanoseconds) = std::mem::take(&mut self.stamp);
        self.next = 0;
        let valid = (0.0..1e10).contains(&seconds) && (0.0..1e9).contains(&nanoseconds);
        let stamp = (seconds as u64).saturating_mul(1_000_000_000).saturating_add(nanoseconds as u64);
        Ok((valid && stamp > 0).then_some(stamp))
    }
}
