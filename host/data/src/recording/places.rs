//! Places in recordings, as text: which rows, at what time, and a list of the first few.

use std::ops::Range;

use super::Recording;
use crate::pluralise::pluralise;

/// Places that a list names; the others are counted.
pub(super) const LISTED: usize = 4;

/// Rows of a recording, counted from 1 as in its file, and their times.
pub(super) fn rows_and_times(r: &Recording, rows: &Range<usize>) -> String {
    let row = |i: usize| 1 + r.rows.as_ref().map_or(i, |rows| rows[i] as usize);
    let (first, last) = (rows.start, rows.end - 1);
    if first == last {
        format!("row {} ({:.2} s)", row(first), r.time[first])
    } else {
        format!("rows {} to {} ({:.2} to {:.2} s)", row(first), row(last), r.time[first], r.time[last])
    }
}

/// The first few places, and how many more there are.
pub(super) fn listed(places: impl ExactSizeIterator<Item = String>) -> String {
    let more = places.len().saturating_sub(LISTED);
    let mut list: Vec<String> = places.take(LISTED).collect();
    if more > 0 {
        list.push(format!("and {}", pluralise(more, "more place")));
    }
    list.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_list_ends_with_the_number_of_further_places() {
        let list = |n: usize| listed((0..n).map(|i| format!("row {}", i + 1)));
        assert_eq!(list(0), "");
        assert_eq!(list(4), "row 1; row 2; row 3; row 4");
        assert_eq!(list(5), "row 1; row 2; row 3; row 4; and 1 more place");
        assert_eq!(list(7), "row 1; row 2; row 3; row 4; and 3 more places");
    }
}
