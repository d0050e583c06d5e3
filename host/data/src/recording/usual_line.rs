//! The usual line of a text file, read without looking at it twice: numbers between delimiters. Any other line is left to
//! [`cells`](super::cells).

use super::cells::{Dialect, Want, Wanted};
use super::decimal;

/// The columns of a usual line.
pub(super) struct UsualLine<'a> {
    delimiter: u8,
    point: u8,
    comment: Option<u8>,
    /// Per column of the file, which of the requested ones it is.
    columns: Vec<Option<(usize, f64, f64)>>,
    wanted: &'a [Wanted],
}

impl<'a> UsualLine<'a> {
    /// `None` where a usual line of these columns does not exist.
    pub(super) fn new(dialect: Dialect, wanted: &'a [Wanted], width: usize) -> Option<Self> {
        let mut columns = vec![None; width];
        for (n, wanted) in wanted.iter().enumerate() {
            let column = columns.get_mut(wanted.index)?;
            match (wanted.want, &column) {
                (Want::Number { scale, offset }, None) => *column = Some((n, scale, offset)),
                _ => return None,
            }
        }
        let (delimiter, point) = (dialect.delimiter, dialect.point());
        let usual = dialect.thousands.is_none()
            && delimiter != b' '
            && delimiter != point
            && !delimiter.is_ascii_digit();
        usual.then_some(Self { delimiter, point, comment: dialect.comment, columns, wanted })
    }

    /// The number at a place, and where it ends.
    #[inline]
    fn number(&self, text: &[u8], at: usize) -> Option<(f64, usize)> {
        decimal::plain(text, at, self.point).or_else(|| {
            let (value, used) = decimal::prefix(text.get(at..)?, self.point)?;
            value.is_finite().then_some((value, at + used))
        })
    }

    /// Reads a line into `values` and gives its length with its end, or `None` if it is not quite usual.
    #[inline]
    pub(super) fn row(&self, text: &[u8], values: &mut [f64]) -> Option<usize> {
        debug_assert_eq!(values.len(), self.wanted.len());
        if text.first() == self.comment.as_ref() {
            return None;
        }
        let mut at = 0;
        let last = self.columns.len() - 1;
        for (i, column) in self.columns.iter().enumerate() {
            match column {
                Some((n, scale, offset)) => {
                    let (value, end) = self.number(text, at)?;
                    *values.get_mut(*n)? = value * scale + offset;
                    at = end;
                }
                None => loop {
                    match *text.get(at)? {
                        b if b == self.delimiter => break,
                        b'\n' | b'\r' if i == last => break,
                        b'\n' | b'\r' | b'"' => return None,
                        _ => at += 1,
                    }
                },
            }
            let end = *text.get(at)?;
            at += 1;
            if i < last {
                if end != self.delimiter {
                    return None;
                }
            } else if end != b'\n' {
                if end != b'\r' || *text.get(at)? != b'\n' {
                    return None;
                }
                at += 1;
            }
        }
        Some(at)
    }
}
