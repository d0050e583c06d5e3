//! From model weight to probability: how often names of the same weight were right in trials with known truth.
//!
//! The weights of its competitors give the model weight of a selected effect (`selection_step`): where four effects explain the same, it is a
//! quarter, however much they explain. How likely the truth is among them at all depends on how much is explained. Both are learned from
//! trials with known truth, by a command that prints the constants:
//!
//! ```text
//! cargo run --release -p pam-diagnose --example calibrate_diagnosis -- SET…
//! p = w^B q,   logit q = A + C logit(explained)
//! ```

use super::criteria::uncertainty::{CALIBRATION, CERTAINTY};

fn within(x: f64) -> f64 {
    x.clamp(CERTAINTY, 1.0 - CERTAINTY)
}

/// The probability of a name with this model weight w among its competitors, where all names together explain this share of the misfit above
/// noise.
pub(crate) fn probability(model_weight: f64, explained: f64) -> f64 {
    let [a, b, c] = CALIBRATION;
    let e = within(explained);
    let among = 1.0 / (1.0 + (-(a + c * (e / (1.0 - e)).ln())).exp());
    within(model_weight).powf(b) * among
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever they explain: of several effects that explain the same, the sum of their probabilities is about one or less.
    #[test]
    fn equal_effects_share_the_probability() {
        let [_, b, _] = CALIBRATION;
        for n in 1..=6 {
            let each = probability(1.0 / f64::from(n), 1.0);
            let sum = f64::from(n) * each;
            // An exponent below one allows for weights that are not exactly equal.
            assert!(sum <= f64::from(n).powf(1.0 - b) + 1e-12 && each < 1.0, "{n}: {each}");
        }
        assert!(probability(0.25, 1.0) < probability(0.5, 1.0));
        assert!(probability(0.9, 0.5) < probability(0.9, 0.9));
    }
}
