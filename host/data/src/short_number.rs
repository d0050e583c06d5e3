//! Numbers in messages: as many digits as a reader needs.

/// A number in at most four digits. Numbers that would begin or end in many zeros are written with an exponent.
///
/// ```
/// use pam_data::short_number::short;
/// assert_eq!([short(0.1 + 0.2), short(123_456.0), short(0.0), short(-7.0)], ["0.3", "123500", "0", "-7"]);
/// assert_eq!([short(1.192_092_9e-7), short(6.02e23), short(f64::NAN)], ["1.192e-7", "6.02e23", "NaN"]);
/// ```
#[must_use]
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&digits) {
        let text = format!("{value:.3e}");
        // No zeros between the last digit and the exponent.
        return match text.split_once('e') {
            Some((number, exponent)) => {
                format!("{}e{exponent}", number.trim_end_matches('0').trim_end_matches('.'))
            }
            None => text,
        };
    }
    let scale = 10f64.powf(3.0 - digits);
    format!("{}", (value * scale).round() / scale)
}
