//! A muscle of a length that was not recorded, predicted from others of its stock.
//!
//! By the model, muscles of one stock have the same force at equal pressure and contraction, whatever their length. Measured muscles
//! deviate: near the fittings the braid acts less, so short muscles have less force (the published formula for Festo muscles has the same
//! trend: [`super::published`]). With an end effect `δ` that all lengths share
//!
//! ```text
//! ln F_B = a − δ / L0                    F(P, ε; L0) = mean_i F_i(P, ε) · exp(−δ (1/L0 − 1/L0_i))
//! ```
//! `δ` in metres is a least-squares estimate over the blocked forces of the recorded muscles with a prior: end effects extend over about
//! the diameter of the bladder, `δ ~ N(0, (2 D0)²)`, and two muscles of one length differ by about 5 % in force. With few or similar
//! lengths the prior keeps `δ` near zero, and the prediction is the mean of the others.

use model_core::units::Length;

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_data::recording::motion::Motion;
use pam_fit::predict::predict;
use pam_fit::table_file::{About, TableFile};

use pam_fit::Fit;

use crate::cross_validation::{Score, Spot, Tally};

/// Scatter of the blocked force among muscles of one stock and length: standard deviation of its logarithm.
const SCATTER: f64 = 0.05;
/// Prior standard deviation of the end effect `δ`, in bladder diameters.
const REACH: f64 = 2.0;

/// Errors of a prediction from other lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct LengthTransfer {
    /// The errors of all rows.
    pub score: Score,
    /// The errors by place.
    pub spots: Vec<Spot>,
    /// The end effect `δ`, m.
    pub end_effect: f64,
}

/// The end effect `δ` in m of muscles given as rest length (m), blocked force (N) at one pressure, and bladder diameter (m).
///
/// ```
/// use pam_evaluate::length_transfer::end_effect;
///
/// // Blocked forces that fall by the law with δ = 25 mm, of muscles 10 mm thick.
/// let law = |length: f64| (length, 480.0 * (-25e-3 / length).exp(), 10e-3);
/// let found = end_effect(&[law(0.08), law(0.13), law(0.18), law(0.25), law(0.4)]);
/// // The prior pulls it slightly towards zero.
/// assert!((found - 22.6e-3).abs() < 1e-3, "{found}");
/// // With a single length it is not identifiable, and the prior makes it zero.
/// assert_eq!(end_effect(&[law(0.25), law(0.25)]), 0.0);
/// ```
#[must_use]
pub fn end_effect(muscles: &[(f64, f64, f64)]) -> f64 {
    let usable: Vec<_> = muscles.iter().filter(|(_, force, _)| *force > 0.0).collect();
    let count = usable.len().max(1) as f64;
    let mean = |of: &dyn Fn(&(f64, f64, f64)) -> f64| usable.iter().map(|m| of(m)).sum::<f64>() / count;
    let (inverse, logarithm) = (mean(&|m| 1.0 / m.0), mean(&|m| m.1.ln()));
    let reach = REACH * mean(&|m| m.2);
    let (mut across, mut square) = (0.0, (SCATTER / reach.max(f64::MIN_POSITIVE)).powi(2));
    for (length, force, _) in usable {
        let u = 1.0 / length - inverse;
        across -= u * (force.ln() - logarithm);
        square += u * u;
    }
    across / square
}

/// Scores the prediction of a muscle from the fits of others of its stock. Rows with a force of at most `clip` (N) do not count.
///
/// # Errors
/// A table that cannot be used at this length, or a recording without force.
pub fn predict_unseen_length(
    others: &[&Fit],
    campaign: &Campaign,
    muscle: &MuscleDescription,
    clip: Option<f64>,
) -> Result<LengthTransfer> {
    let pressure =
        others.iter().map(|f| f.solution.problem.points.pressure.high).fold(f64::INFINITY, f64::min);
    let of = |f: &&Fit| {
        let geometry = &f.solution.problem.geometry;
        (geometry.rest_length.metres(), f.solution.blocked(pressure), geometry.outer_diameter.metres())
    };
    let end_effect = end_effect(&others.iter().map(of).collect::<Vec<_>>());
    let predictions = others
        .iter()
        .map(|other| {
            let mut geometry = other.solution.problem.geometry;
            let share = 1.0 / muscle.rest_length() - 1.0 / geometry.rest_length.metres();
            // At equal strains every force of the model scales with the square of the diameter if the wall scales with the diameter.
            let thicker = (-0.5 * end_effect * share).exp();
            geometry.rest_length = Length::from_metres(muscle.rest_length());
            geometry.outer_diameter = geometry.outer_diameter * thicker;
            geometry.wall = geometry.wall * thicker;
            let mut table = other.table.clone();
            table.geometry = geometry.cast();
            predict(&TableFile { table, about: About::default() }, campaign)
        })
        .collect::<Result<Vec<_>>>()?;
    let mut tally = Tally::default();
    for (r, (recording, motion)) in campaign.recordings.iter().zip(Motion::of_campaign(campaign)).enumerate()
    {
        for (i, force) in recording.require_force()?.iter().enumerate() {
            if clip.is_some_and(|c| *force <= c) {
                continue;
            }
            let model = predictions.iter().map(|p| p.recordings[r].force[i]).sum::<f64>()
                / predictions.len().max(1) as f64;
            let contraction = recording.stroke[i] / muscle.rest_length();
            tally.add(&muscle.name, contraction, motion.direction[i], force - model);
        }
    }
    Ok(LengthTransfer { score: tally.score, spots: tally.spots(), end_effect })
}
