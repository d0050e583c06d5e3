//! Separators of thousands: `1,234.5`, `1.234,5`, `1 234.5`, `1'234.5`.

use std::borrow::Cow;

/// A separator as an import description names it; a blank includes those that do not break, an apostrophe the typographic one.
pub(super) const SEPARATORS: [u8; 4] = *b",. '";

/// Whether a character is this separator.
fn is(separator: u8, c: char) -> bool {
    match separator {
        b' ' => [' ', '\u{a0}', '\u{202f}'].contains(&c),
        b'\'' => ['\'', '\u{2019}'].contains(&c),
        _ => char::from(separator) == c,
    }
}

/// Whether a text contains this separator.
pub(super) fn has(text: &str, separator: u8) -> bool {
    text.contains(|c| is(separator, c))
}

/// A number without its separators; `None` where these do not set groups of three digits apart, left of the decimal sign.
pub(super) fn without(text: &str, separator: u8, decimal_comma: bool) -> Option<Cow<'_, str>> {
    if !has(text, separator) {
        return Some(Cow::Borrowed(text));
    }
    let sign = if decimal_comma { ',' } else { '.' };
    let (whole, fraction) = text.find(sign).map_or((text, ""), |at| text.split_at(at));
    let digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let bare = whole.trim_start_matches(['-', '+']);
    let mut groups = bare.split(|c| is(separator, c));
    let first = groups.next().unwrap_or_default();
    let proper = (1..=3).contains(&first.len())
        && digits(first)
        && groups.all(|group| group.len() == 3 && digits(group))
        && !has(fraction, separator);
    proper.then(|| Cow::Owned(text.chars().filter(|c| !is(separator, *c)).collect()))
}

/// Whether the separator cannot be a decimal sign: a decimal sign follows it, or it occurs twice, or it is none.
pub(super) fn is_certain(text: &str, separator: u8, decimal_comma: bool) -> bool {
    let never_decimal = separator == b' ' || separator == b'\'';
    let count = text.chars().filter(|c| is(separator, *c)).count();
    count > 1 || count == 1 && (never_decimal || text.contains(if decimal_comma { ',' } else { '.' }))
}

#[cfg(test)]
mod tests {
    use super::without;

    #[test]
    fn only_groups_of_three_digits_are_thousands() {
        let of = |text, separator, comma| without(text, separator, comma).map(|t| t.into_owned());
        assert_eq!(of("1,234.5", b',', false).as_deref(), Some("1234.5"));
        assert_eq!(of("-1.234.567,25", b'.', true).as_deref(), Some("-1234567,25"));
        assert_eq!(of("1\u{202f}234", b' ', false).as_deref(), Some("1234"));
        assert_eq!(of("12345.5", b',', false).as_deref(), Some("12345.5"));
        for text in ["12,34", "1234,567", ",123", "1,234,56", "1.234,567", "1,2e4", "1,,234"] {
            assert_eq!(of(text, b',', false), None, "{text}");
        }
    }
}
