//! Values that are constant over a file.

use crate::error::{DataCode, Error, Result};
use crate::recording::decimal;
use crate::recording::import::{self, pattern as pattern_of};

/// Values that are constant over a file, from its name or the lines above its table.
#[derive(Default)]
pub(super) struct Constants {
    pub quantities: Vec<(String, f64)>,
    pub labels: Vec<(String, String)>,
}

impl Constants {
    /// Takes what the named groups of `pattern` catch in `text`.
    pub(super) fn catch(&mut self, what: &str, key: &str, pattern: Option<&str>, text: &str) -> Result<()> {
        let Some(pattern) = pattern_of(key, pattern)? else { return Ok(()) };
        let Some(captures) = pattern.captures(text) else {
            return Err(Error::new(
                DataCode::ImportInvalid,
                format!("{what} not of the form in the import description"),
            )
            .value(text)
            .help(format!("{key} must match {}", pattern.as_str())));
        };
        for group in pattern.capture_names().flatten() {
            let Some(caught) = captures.name(group).map(|m| m.as_str()) else { continue };
            if import::constant(group).is_err() {
                self.labels.push((group.to_owned(), caught.to_owned()));
                continue;
            }
            let value = decimal::caught(caught).ok_or_else(|| {
                Error::new(DataCode::ImportInvalid, format!("{key} matches no number for {group}"))
                    .value(caught)
            })?;
            self.quantities.push((group.to_owned(), value));
        }
        Ok(())
    }
}
