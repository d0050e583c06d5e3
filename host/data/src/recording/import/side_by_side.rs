//! Recordings side by side: the same columns again and again.

use serde::Deserialize;

use super::{ColumnRef, Import};
use crate::error::{DataCode, Error, Result};

/// Recordings side by side, at most: each is read on its own.
const MOST_BESIDE: usize = 1000;

/// Recordings beside each other in one table, with the same columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SideBySide {
    /// How many there are.
    pub recordings: usize,
    /// Columns from one to the next.
    pub columns: usize,
}

impl Import {
    pub(super) fn check_side_by_side(&self) -> Result<()> {
        let Some(SideBySide { recordings, columns }) = self.side_by_side else { return Ok(()) };
        let invalid = |cause: &str| Err(Error::new(DataCode::ImportInvalid, cause).column("side_by_side"));
        if !(2..=MOST_BESIDE).contains(&recordings) || columns == 0 {
            return invalid("recordings must be from 2 to 1000, and columns 1 or more");
        }
        let all = || self.columns.values().flat_map(|c| std::iter::once(&c.column).chain(c.further()));
        if all().any(|c| matches!(c, ColumnRef::Name(_))) || !self.split_by.is_empty() {
            return invalid("recordings side by side need all columns by their numbers, and no split_by");
        }
        Ok(())
    }

    /// The description of the n-th of recordings side by side, counted from 0.
    pub(in crate::recording) fn beside(&self, n: usize) -> Self {
        let step = self.side_by_side.map_or(0, |s| s.columns);
        let mut own = Self { side_by_side: None, ..self.clone() };
        for column in own.columns.values_mut() {
            let further = column.date.iter_mut().chain(column.fraction.iter_mut().map(|f| &mut f.column));
            for reference in std::iter::once(&mut column.column).chain(further) {
                if let ColumnRef::Number(number) = reference {
                    *number += n * step;
                }
            }
        }
        own
    }
}
