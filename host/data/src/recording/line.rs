//! One line of text, cell by cell.

use std::borrow::Cow;

use super::cells::Dialect;
use super::decimal;
use super::thousands;

pub(super) fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// Whether a line begins with the sign of remarks, behind blanks.
pub(super) fn is_remark(line: &[u8], comment: Option<u8>) -> bool {
    comment.is_some() && line.trim_ascii_start().first() == comment.as_ref()
}

/// A line without its carriage return.
pub(super) fn trim_end(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Bytes as text: UTF-8, and Latin-1 where they are none, as older programs of Windows write `µ`, `°`, and letters with accents.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().copied().map(char::from).collect(), Cow::Borrowed)
}

/// A place in a line, cell by cell; `at` is `None` behind the last cell.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    /// The line.
    pub line: &'a [u8],
    /// Where the next cell begins.
    pub at: Option<usize>,
    /// How it is cut.
    pub dialect: Dialect,
}

impl<'a> Cells<'a> {
    /// Before the first cell.
    pub(super) fn of(line: &'a [u8], dialect: Dialect) -> Self {
        Self { line, at: Some(0), dialect }
    }

    /// All cells of a line as text; used for headers.
    pub(super) fn split(line: &'a [u8], dialect: Dialect) -> Result<Vec<String>, ()> {
        let mut cells = Self::of(trim_end(line), dialect);
        let mut all = Vec::new();
        while cells.at.is_some() {
            all.push(cells.text()?.trim().to_owned());
        }
        Ok(all)
    }

    #[inline]
    fn blanks(&self, mut at: usize) -> usize {
        while let Some(b) = self.line.get(at)
            && is_blank(*b)
            && (*b != self.dialect.delimiter || self.dialect.delimiter == b' ')
        {
            at += 1;
        }
        at
    }

    /// The start of the cell after one that ends at `at`, or `None` if no separator follows.
    #[inline]
    fn after(&self, at: usize) -> Option<Option<usize>> {
        match self.line.get(at) {
            None => Some(None),
            Some(b) if *b == self.dialect.delimiter => Some(Some(at + 1)),
            Some(_) => {
                let end = self.blanks(at);
                match self.line.get(end) {
                    None => Some(None),
                    Some(b) if *b == self.dialect.delimiter => Some(Some(end + 1)),
                    Some(_) if self.dialect.delimiter == b' ' && end > at => Some(Some(end)),
                    Some(_) => None,
                }
            }
        }
    }

    /// The next cell as a number; `None` where it is none.
    #[inline]
    pub(super) fn number(&mut self) -> Option<f64> {
        let start = self.blanks(self.at?);
        let Dialect { decimal_comma, thousands, .. } = self.dialect;
        if decimal_comma || thousands.is_some() || self.line.get(start) == Some(&b'"') {
            let text = self.text().ok()?;
            let text = match thousands {
                Some(separator) => thousands::without(text.trim(), separator, decimal_comma)?,
                None => Cow::Borrowed(text.trim()),
            };
            // A point beside a decimal comma would separate thousands, whose meaning we do not guess.
            let (value, used) = decimal::prefix(text.as_bytes(), self.dialect.point())?;
            return (used == text.len() && value.is_finite()).then_some(value);
        }
        let (value, used) = decimal::prefix(&self.line[start..], b'.')?;
        self.at = self.end_of_blank_run(self.after(start + used)?);
        value.is_finite().then_some(value)
    }

    /// With blanks as delimiter, blanks at the end of a line do not open another cell.
    #[inline]
    fn end_of_blank_run(&self, at: Option<usize>) -> Option<usize> {
        if self.dialect.delimiter != b' ' {
            return at;
        }
        at.map(|a| self.blanks(a)).filter(|a| *a < self.line.len())
    }

    /// The next cell as text; an error where a quote does not end.
    pub(super) fn text(&mut self) -> Result<Cow<'a, str>, ()> {
        let Some(at) = self.at else { return Ok("".into()) };
        let start = self.blanks(at);
        if self.line.get(start) == Some(&b'"') {
            return self.quoted(start + 1);
        }
        let rest = &self.line[start.min(self.line.len())..];
        let end = if self.dialect.delimiter == b' ' {
            rest.iter().position(|b| is_blank(*b))
        } else {
            memchr::memchr(self.dialect.delimiter, rest)
        };
        let cell = &rest[..end.unwrap_or(rest.len())];
        self.at = self.end_of_blank_run(end.map(|e| start + e + 1));
        Ok(decode(cell))
    }

    fn quoted(&mut self, start: usize) -> Result<Cow<'a, str>, ()> {
        let mut text = Vec::new();
        let mut at = start;
        loop {
            let end = at + memchr::memchr(b'"', &self.line[at..]).ok_or(())?;
            text.extend_from_slice(&self.line[at..end]);
            if self.line.get(end + 1) == Some(&b'"') {
                text.push(b'"');
                at = end + 2;
                continue;
            }
            self.at = self.end_of_blank_run(self.after(end + 1).ok_or(())?);
            return Ok(decode(&text).into_owned().into());
        }
    }

    /// Passes over the next cell.
    #[inline]
    pub(super) fn skip(&mut self) -> Result<(), ()> {
        let Some(at) = self.at else { return Ok(()) };
        if self.dialect.delimiter == b' ' || self.line.get(self.blanks(at)) == Some(&b'"') {
            return self.text().map(|_| ());
        }
        self.at = memchr::memchr(self.dialect.delimiter, &self.line[at..]).map(|n| at + n + 1);
        Ok(())
    }
}
