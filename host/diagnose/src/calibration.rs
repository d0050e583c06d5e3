//! From model weight to probability: how often names of the same weight were right on the development set.
//!
//! The weights of its competitors give the model weight of a selected effect (`selection_step`). How often such an effect is right is learned
//! from trials with known truth, by a command that prints the constants:
//!
//! ```text
//! cargo run --release -p pam-diagnose --example calibrate_diagnosis -- SET…
//! logit p = A + B logit(model_weight) + C logit(explained)
//! ```

use super::criteria::uncertainty::{CALIBRATION, CERTAINTY};

fn logit(x: f64) -> f64 {
    let x = x.clamp(CERTAINTY, 1.0 - CERTAINTY);
    (x / (1.0 - x)).ln()
}

/// The probability of a name with this model weight among its competitors, where all names together explain this share of the misfit above noise.
pub(crate) fn probability(model_weight: f64, explained: f64) -> f64 {
    let [a, b, c] = CALIBRATION;
    1.0 / (1.0 + (-(a + b * logit(model_weight) + c * logit(explained))).exp())
}
