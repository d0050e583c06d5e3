//! Paired comparison of two sets of errors over the same independent units: runs, or mountings.

/// By how much the sum of one set of errors lies below that of another, and the standard error by the scatter between the units.
pub(crate) fn gain(with: &[f64], without: &[f64]) -> (f64, f64) {
    let gains: Vec<f64> = without.iter().zip(with).map(|(o, s)| o - s).collect();
    let (count, gain) = (gains.len() as f64, gains.iter().sum::<f64>());
    let variance = gains.iter().map(|g| (g - gain / count).powi(2)).sum::<f64>() / (count - 1.0);
    (gain, (count * variance).sqrt())
}

/// How many standard errors one set of errors lies below another.
pub(crate) fn errors_below(with: &[f64], without: &[f64]) -> f64 {
    let (gain, error) = gain(with, without);
    gain / error.max(f64::MIN_POSITIVE)
}
