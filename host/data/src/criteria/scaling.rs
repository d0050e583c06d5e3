//! A criterion scaled at compile time, for a study of how much an answer depends on it.

/// The name of the criterion that is scaled in this build; none in a release.
const NAME: Option<&str> = option_env!("PAM_CRITERION");
/// The factor, a plain decimal number.
const FACTOR: Option<&str> = option_env!("PAM_CRITERION_FACTOR");

const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

/// A decimal number such as `0.5`; building fails for anything else.
const fn decimal(text: &str) -> f64 {
    let text = text.as_bytes();
    let (mut value, mut place, mut i) = (0.0, 0.0, 0);
    while i < text.len() {
        match text[i] {
            b'.' if place == 0.0 => place = 1.0,
            digit @ b'0'..=b'9' => {
                value = 10.0 * value + (digit - b'0') as f64;
                place *= 10.0;
            }
            _ => panic!("PAM_CRITERION_FACTOR is not a decimal number"),
        }
        i += 1;
    }
    if place == 0.0 { value } else { value / place }
}

const fn factor(name: &str) -> f64 {
    match (NAME, FACTOR) {
        (Some(scaled), Some(by)) if same(scaled, name) => decimal(by),
        _ => 1.0,
    }
}

/// A criterion, scaled where this build scales it.
#[must_use]
pub const fn number(name: &str, value: f64) -> f64 {
    value * factor(name)
}

/// A criterion that counts, at least one.
#[must_use]
pub const fn count(name: &str, value: usize) -> usize {
    let scaled = (value as f64 * factor(name)) as usize;
    if scaled == 0 && value > 0 { 1 } else { scaled }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_factor_is_read_and_only_its_criterion_scaled() {
        for (text, value) in [("2", 2.0), ("0.5", 0.5), ("1.25", 1.25)] {
            assert_eq!(decimal(text), value);
        }
        assert!(same("LIMIT", "LIMIT") && !same("LIMIT", "LIMITS") && !same("LIMIT", "LIMIX"));
        // A build that scales nothing leaves every value as it is written.
        if NAME.is_none() {
            assert_eq!((number("LIMIT", 0.3), count("LIMIT", 7)), (0.3, 7));
        }
    }
}
