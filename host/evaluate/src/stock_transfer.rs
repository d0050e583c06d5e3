//! A muscle, or a contraction of it, predicted with all muscles of its stock.
//!
//! The joint fit ([`pam_fit::stock`]) is made without the predicted recordings. A muscle that is left out as a whole has the force of the
//! stock at its length, with ends that do not pull. One that is left out at one contraction keeps its own scale and rest length. What the
//! left-out mounting has of its own, length and zero, is at its mean.

use pam_data::error::{Error, Result};
use pam_data::recording::motion::Motion;
use pam_fit::error::FitCode;
use pam_fit::stock::MEAN_SIZE;
use pam_fit::stock::{Law, Member, Place, StockCells, StockFit, fit, stock_cells};
use rayon::prelude::*;

use crate::cross_validation::{Score, Spot, Tally};

/// What the stock predicts of a muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct StockTransfer {
    /// The errors where the whole muscle was left out.
    pub length: Score,
    /// Mean size of the error that unknown lengths, zeros and scale alone would give, N.
    pub length_expected: f64,
    /// By place.
    pub length_spots: Vec<Spot>,
    /// Total length `λ` of the ends by the other muscles, m.
    pub ends: f64,
    /// The errors where each contraction was left out in turn; empty for a muscle that moves.
    pub contractions: Score,
    /// Mean size of the error that the unknown length and zero of each mounting alone would give, N.
    pub contractions_expected: f64,
    /// By place.
    pub contraction_spots: Vec<Spot>,
}

/// The laws between muscles with which is predicted.
const LAWS: [Law; 1] = [Law::Ends];

/// Predicts every muscle of a stock. Rows with a force of at most `clips` (N, by muscle) do not count.
///
/// # Errors
/// Recordings without a force, or muscles that cannot be fitted together.
pub fn predict_with_stock(members: &[Member<'_>], clips: &[Option<f64>]) -> Result<Vec<StockTransfer>> {
    let cells = stock_cells(members)?;
    let unusable = || {
        Error::new(FitCode::FitUnderdetermined, "these muscles cannot be fitted together")
            .help("their pressures and contractions must overlap; check units and rest lengths")
    };
    let whole = fit(&cells, &LAWS, None).ok_or_else(unusable)?;
    let one = |m: usize| -> Result<StockTransfer> {
        let clip = clips.get(m).copied().flatten();
        let without = fit(&cells.only(|c| c.member != m), &LAWS, Some(&whole)).ok_or_else(unusable)?;
        let mut length = Predicted::default();
        add(&mut length, members, &cells, m, None, &without, clip)?;
        let mut contractions = Predicted::default();
        for mounting in cells.held_mountings(m) {
            let others = cells.only(|c| c.member != m || c.mounting != mounting);
            let without = fit(&others, &LAWS, Some(&whole)).ok_or_else(unusable)?;
            add(&mut contractions, members, &cells, m, Some(mounting), &without, clip)?;
        }
        Ok(StockTransfer {
            length: length.tally.score,
            length_expected: length.expected(),
            length_spots: length.tally.spots(),
            ends: without.shared[0].value,
            contractions: contractions.tally.score,
            contractions_expected: contractions.expected(),
            contraction_spots: contractions.tally.spots(),
        })
    };
    (0..members.len()).into_par_iter().map(one).collect()
}

/// Errors of a prediction, and the sum of their expected sizes.
#[derive(Debug, Clone, Default)]
struct Predicted {
    tally: Tally,
    expected: f64,
}

impl Predicted {
    fn expected(&self) -> f64 {
        self.expected / self.tally.score.rows.max(1.0)
    }
}

/// Adds the errors of a muscle's rows: of one mounting, with what is known of the muscle, or of all with nothing known.
fn add(
    into: &mut Predicted,
    members: &[Member<'_>],
    cells: &StockCells,
    m: usize,
    mounting: Option<usize>,
    fit: &StockFit,
    clip: Option<f64>,
) -> Result<()> {
    let Member { muscle, campaign } = members[m];
    let wanted = mounting.and_then(|k| cells.mountings[m][k].stroke);
    for (recording, motion) in campaign.recordings.iter().zip(Motion::of_campaign(campaign)) {
        let label = recording.mounting();
        let inside = mounting
            .is_none_or(|k| recording.held_stroke() == wanted && label == cells.mountings[m][k].label);
        if !inside {
            continue;
        }
        for (i, force) in recording.require_force()?.iter().enumerate() {
            if clip.is_some_and(|c| *force <= c) {
                continue;
            }
            let place = Place {
                pressure: recording.pressure[i],
                stroke: recording.stroke[i],
                rest_length: muscle.rest_length(),
                direction: f64::from(motion.direction[i]),
                member: mounting.map(|_| m),
                mounting: None,
            };
            let contraction = recording.stroke[i] / muscle.rest_length();
            let left_out = match mounting {
                Some(_) => format!("{:.1} mm", recording.stroke[i] * 1e3),
                None => muscle.name.clone(),
            };
            into.expected += MEAN_SIZE * fit.unknown_deviation(&place);
            into.tally.add(&left_out, contraction, motion.direction[i], force - fit.force(&place));
        }
    }
    Ok(())
}
