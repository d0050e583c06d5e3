//! Decimal numbers from bytes, correctly rounded, without going through text.

/// Powers of ten that a double holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Reads a number at the start of `bytes` and says how many bytes it took; `None` when there is none.
///
/// Up to 2⁵³ and 10^±22 one multiplication or division of two exact doubles is correctly rounded (Clinger 1990); any other
/// number goes through the standard library, which is correctly rounded too.
#[inline]
pub(super) fn prefix(bytes: &[u8]) -> Option<(f64, usize)> {
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
    if bytes.get(at) == Some(&b'.') {
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
    let value = std::str::from_utf8(&bytes[..at]).ok()?.parse().ok()?;
    Some((value, at))
}

#[inline]
fn digit(bytes: &[u8], at: usize) -> Option<u64> {
    let digit = bytes.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::prefix;

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
            assert_eq!(prefix(text.as_bytes()), expected, "{text}");
        }
    }

    proptest! {
        #[test]
        fn every_double_survives_a_round_trip(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            for text in [format!("{value}"), format!("{value:e}")] {
                let (read, used) = prefix(text.as_bytes()).unwrap();
                prop_assert_eq!(read.to_bits(), value.to_bits(), "{}", &text);
                prop_assert_eq!(used, text.len());
            }
        }

        #[test]
        fn agrees_with_the_standard_library(text in "[+-]?[0-9]{1,22}(\\.[0-9]{0,22})?([eE][+-]?[0-9]{1,3})?") {
            let (read, used) = prefix(text.as_bytes()).unwrap();
            let reference: f64 = text.parse().unwrap();
            prop_assert_eq!(read.to_bits(), reference.to_bits());
            prop_assert_eq!(used, text.len());
        }

        #[test]
        fn never_panics_and_never_reads_past_the_end(bytes: Vec<u8>) {
            if let Some((_, used)) = prefix(&bytes) {
                prop_assert!(used <= bytes.len() && used > 0);
            }
        }
    }
}
