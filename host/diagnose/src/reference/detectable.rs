//! The size from which on a change would be named.
//!
//! ```text
//! d = σ (z + z_β),   z = √(2 ln(p_none/p_name) + 2 ln B + price)
//! ```
//! A change of size `z σ` raises the log evidence by `z²/2`. Twice that must outweigh the prior odds against the name, the lead `ln B`
//! of a decision, and the price of the size that is fitted. `z_β` more, and the change is named with the power `β`.

use super::criteria::{DETECTABLE_LEAD, DETECTABLE_POWER};

/// Standard deviations by which a change must differ from zero to be named. `odds`: prior odds of no change against this name; `price`:
/// twice the log evidence that the free size costs.
pub(super) fn required(odds: f64, price: f64) -> f64 {
    (2.0 * odds.ln() + 2.0 * DETECTABLE_LEAD + price).max(0.0).sqrt()
}

/// Prior odds of no change against a name, one of `names`.
pub(super) fn odds(none: f64, names: usize) -> f64 {
    none / ((1.0 - none) / names.max(1) as f64).max(1e-6)
}

/// The size from which on a change with this standard deviation is named, where `required` deviations name it.
pub(super) fn size(std: f64, required: f64) -> f64 {
    std * (required + DETECTABLE_POWER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_just_meets_the_odds() {
        let z = required(odds(0.8, 20), 1.5);
        let gain = 0.5 * z * z;
        assert!((gain - (0.8_f64 / 0.01).ln() - DETECTABLE_LEAD - 0.75).abs() < 1e-12);
        assert_eq!(required(1e-9, 0.0), 0.0);
        assert!(size(2.0, z) > 2.0 * z);
    }
}
