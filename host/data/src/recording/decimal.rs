//! Decimal numbers from bytes, correctly rounded, without going through text.

/// Powers of ten that a double holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Parses a number at the start of `bytes` whose decimal sign is `point`; returns it with its length in bytes, or `None`.
///
/// Up to 2⁵³ and 10^±22 one multiplication or division of two exact doubles is correctly rounded (Clinger 1990); any other
/// number goes through the standard library, which is correctly rounded too.
#[inline]
pub(super) fn prefix(bytes: &[u8], point: u8) -> Option<(f64, usize)> {
    let mut at = 0;
    let negative = match bytes.first() {
        Some(b'-') => {
            at = 1;
            true
        }
        Some(b'+') => {
            at = 1;
            false
        }
        _ => false,
    };
    let mut mantissa = 0u64;
    let start = at;
    while let Some(digit) = digit(bytes, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    let mut digits = at - start;
    let mut exponent = 0i32;
    if bytes.get(at) == Some(&point) {
        at += 1;
        let fraction = at;
        while let Some(digit) = digit(bytes, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        digits += at - fraction;
        exponent = -((at - fraction).min(1 << 20) as i32);
    }
    if digits == 0 {
        return None;
    }
    if let Some(b'e' | b'E') = bytes.get(at) {
        let mut end = at + 1;
        let down = match bytes.get(end) {
            Some(b'-') => {
                end += 1;
                true
            }
            Some(b'+') => {
                end += 1;
                false
            }
            _ => false,
        };
        let first = end;
        let mut power = 0i32;
        while let Some(digit) = digit(bytes, end) {
            power = power.saturating_mul(10).saturating_add(digit as i32);
            end += 1;
        }
        if end > first {
            at = end;
            exponent = exponent.saturating_add(if down { power.saturating_neg() } else { power });
        }
    }
    // 19 digits always fit into 64 bits.
    if digits <= 19 && mantissa <= 1 << 53 && (-22..=22).contains(&exponent) {
        let power = POWERS[exponent.unsigned_abs() as usize];
        let magnitude = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
        return Some((if negative { -magnitude } else { magnitude }, at));
    }
    let text = std::str::from_utf8(&bytes[..at]).ok()?;
    let value = if point == b'.' { text.parse() } else { text.replace(char::from(point), ".").parse() };
    Some((value.ok()?, at))
}

#[inline]
fn digit(bytes: &[u8], at: usize) -> Option<u64> {
    let digit = bytes.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

/// As [`prefix`], for the plain numbers that recordings are full of, eight digits at a time; `None` says nothing: the number
/// may be longer, have an exponent, or be at the end of `bytes`.
#[inline]
pub(super) fn plain(bytes: &[u8], at: usize, point: u8) -> Option<(f64, usize)> {
    let negative = *bytes.get(at)? == b'-';
    let at = at + usize::from(negative);
    let (whole, count) = run(bytes, at)?;
    if count == 8 {
        return None;
    }
    let mut end = at + count;
    let (mut mantissa, mut digits, mut decimals) = (whole, count, 0);
    if *bytes.get(end)? == point {
        end += 1;
        loop {
            let (fraction, count) = run(bytes, end)?;
            mantissa = mantissa.wrapping_mul(TENS[count]).wrapping_add(fraction);
            digits += count;
            decimals += count;
            end += count;
            if count < 8 {
                break;
            }
            if decimals > 16 {
                return None;
            }
        }
    }
    // The same bounds as in `prefix`, so that the one operation below is correctly rounded.
    if digits == 0 || digits > 19 || mantissa > 1 << 53 || matches!(bytes.get(end)?, b'e' | b'E') {
        return None;
    }
    let value = mantissa as f64 / POWERS[decimals.min(22)];
    Some((if negative { -value } else { value }, end))
}

const TENS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];

/// The digits at the start of the next eight bytes, as a number, and how many there are.
#[inline]
fn run(bytes: &[u8], at: usize) -> Option<(u64, usize)> {
    let eight = bytes.get(at..at + 8)?.try_into().ok()?;
    let digits = u64::from_le_bytes(eight) ^ 0x3030_3030_3030_3030;
    // A byte that was a digit is now 0 to 9, and stays below 0x80 when 0x76 is added. Carries of other bytes only reach bytes
    // behind them.
    let others = (digits.wrapping_add(0x7676_7676_7676_7676) | digits) & 0x8080_8080_8080_8080;
    let count = (others.trailing_zeros() / 8) as usize;
    if count == 0 {
        return Some((0, 0));
    }
    // Shifted so that the digits end the word and zeros begin it; then pairs, fours, eights are joined.
    let word = digits << (8 * (8 - count));
    let pairs = (word.wrapping_mul(10).wrapping_add(word >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (pairs.wrapping_mul(100).wrapping_add(pairs >> 16)) & 0x0000_ffff_0000_ffff;
    let eights = fours.wrapping_mul(10_000).wrapping_add(fours >> 32) & 0xffff_ffff;
    Some((eights, count))
}

/// A number that a pattern catches from a file's name or from a line above the table. Its decimal sign may be a comma, or, between digits,
/// one that names of files may contain: `2p05`, `2_05`, `2-05`. A comma that may separate thousands, as in `1,000`, is none.
pub(super) fn caught(text: &str) -> Option<f64> {
    let sign = text.char_indices().find(|(_, c)| ",p_-".contains(*c));
    let (Some((at, sign)), true) = (sign, text.starts_with(|c: char| c.is_ascii_digit())) else {
        return text.parse().ok().filter(|v: &f64| v.is_finite());
    };
    let (whole, fraction) = (&text[..at], &text[at + 1..]);
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let thousands = sign == ',' && fraction.len() == 3 && whole.len() <= 3 && whole != "0";
    (digits(whole) && digits(fraction) && !thousands).then(|| format!("{whole}.{fraction}").parse().ok())?
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{plain, prefix};

    #[test]
    fn stops_where_the_number_stops() {
        let cases: [(&str, Option<(f64, usize)>); 12] = [
            ("12.5,3", Some((12.5, 4))),
            ("-0.001\t", Some((-0.001, 6))),
            ("+7", Some((7.0, 2))),
            (".5", Some((0.5, 2))),
            ("5.", Some((5.0, 2))),
            ("1e3", Some((1e3, 3))),
            ("1e", Some((1.0, 1))),
            ("1e-400", Some((0.0, 6))),
            ("", None),
            ("-", None),
            (".", None),
            ("abc", None),
        ];
        for (text, expected) in cases {
            assert_eq!(prefix(text.as_bytes(), b'.'), expected, "{text}");
        }
    }

    proptest! {
        #[test]
        fn every_double_survives_a_round_trip(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            for text in [format!("{value}"), format!("{value:e}")] {
                let (read, used) = prefix(text.as_bytes(), b'.').unwrap();
                prop_assert_eq!(read.to_bits(), value.to_bits(), "{}", &text);
                prop_assert_eq!(used, text.len());
            }
        }

        #[test]
        fn agrees_with_the_standard_library(text in "[+-]?[0-9]{1,22}(\\.[0-9]{0,22})?([eE][+-]?[0-9]{1,3})?") {
            let (read, used) = prefix(text.as_bytes(), b'.').unwrap();
            let reference: f64 = text.parse().unwrap();
            prop_assert_eq!(read.to_bits(), reference.to_bits());
            prop_assert_eq!(used, text.len());
        }

        #[test]
        fn a_comma_for_the_point_changes_nothing_else(text in "[+-]?[0-9]{1,22}(\\.[0-9]{0,22})?([eE][+-]?[0-9]{1,3})?;1234567") {
            let comma = text.replace('.', ",");
            prop_assert_eq!(prefix(comma.as_bytes(), b','), prefix(text.as_bytes(), b'.'));
            prop_assert_eq!(plain(comma.as_bytes(), 0, b','), plain(text.as_bytes(), 0, b'.'));
        }

        #[test]
        fn the_quick_way_gives_the_same(text in "-?[0-9]{0,9}(\\.[0-9]{0,18})?[,\n;e][0-9,]{0,20}") {
            let quick = plain(text.as_bytes(), 0, b'.');
            if let Some((value, end)) = quick {
                let (reference, used) = prefix(text.as_bytes(), b'.').unwrap();
                prop_assert_eq!((value.to_bits(), end), (reference.to_bits(), used), "{}", text);
            }
        }

        #[test]
        fn the_quick_way_takes_the_usual(whole in 0..9_999_999u32, decimals in 0..9usize, fraction: u32) {
            let text = format!("-{whole}.{:0>1$},1234567", fraction % 10u32.pow(decimals as u32), decimals);
            prop_assert!(plain(text.as_bytes(), 0, b'.').is_some());
        }

        #[test]
        fn never_panics_and_never_reads_past_the_end(bytes: Vec<u8>) {
            let _ = plain(&bytes, 0, b'.');
            if let Some((_, used)) = prefix(&bytes, b'.') {
                prop_assert!(used <= bytes.len() && used > 0);
            }
        }
    }
}
