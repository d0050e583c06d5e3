//! Counts with the singular or plural of a noun.

use std::fmt::Display;

/// A count with its noun, given in the singular; the plural adds an s.
///
/// ```
/// use pam_data::pluralise::pluralise;
/// assert_eq!([pluralise(0, "row"), pluralise(1, "row"), pluralise(2, "row")], ["0 rows", "1 row", "2 rows"]);
/// assert_eq!(pluralise("17 880", "row"), "17 880 rows");
/// ```
#[must_use]
pub fn pluralise(number: impl Display, one: &str) -> String {
    let number = number.to_string();
    let plural = if number == "1" { "" } else { "s" };
    format!("{number} {one}{plural}")
}
