//! A value with its interval.

use pam_data::statistics::NORMAL_95;

/// A value with its 95 % confidence interval to two digits: `0.924 ± 0.024 N (95 %)`, `(4.59 ± 0.28)·10^-4 m (95 %)`.
#[must_use]
pub(crate) fn with_interval(value: f64, std: Option<f64>, unit: &str) -> String {
    // Pressures are read in kPa throughout.
    if unit == "Pa" && value.abs() >= 1e3 {
        return with_interval(1e-3 * value, std.map(|s| 1e-3 * s), "kPa");
    }
    let exponent = if (1e-2..1e5).contains(&value.abs()) { 0 } else { value.abs().log10().floor() as i32 };
    let scale = 10.0_f64.powi(exponent);
    let known = std.filter(|s| *s > 0.0).map(|s| s * NORMAL_95);
    let body = match known {
        Some(half) => {
            let digits = (1.0 - (half / scale).log10().floor()).clamp(0.0, 5.0) as usize;
            format!("{:.digits$} ± {:.digits$}", value / scale, half / scale)
        }
        None => format!("{:.3}", value / scale),
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let level = match (std, known) {
        (None, _) => " (interval not identifiable)",
        (_, Some(_)) => " (95 %)",
        _ => " (fixed)",
    };
    match exponent {
        0 => format!("{body}{unit}{level}"),
        _ => format!("({body})·10^{exponent}{unit}{level}"),
    }
}

#[cfg(test)]
mod tests {
    use super::with_interval;

    #[test]
    fn a_value_has_as_many_places_as_its_interval() {
        assert_eq!(with_interval(0.92421, Some(0.01247), "N"), "0.924 ± 0.024 N (95 %)");
        assert_eq!(with_interval(4.5924e-4, Some(1.419e-5), "m"), "(4.59 ± 0.28)·10^-4 m (95 %)");
        assert_eq!(with_interval(-810.2, Some(31.0), ""), "-810 ± 61 (95 %)");
        assert_eq!(with_interval(79_939.0, Some(6757.0), "Pa"), "80 ± 13 kPa (95 %)");
        assert_eq!(with_interval(2.5, None, "s"), "2.500 s (interval not identifiable)");
        assert_eq!(with_interval(10.0, Some(0.0), "s"), "10.000 s (fixed)");
        assert_eq!(with_interval(1e300, Some(f64::MIN_POSITIVE), "s"), "(1.00000 ± 0.00000)·10^300 s (95 %)");
    }
}
