//! The errors on held-out data as a JSON document.

use pam_data::output::json_of;
use pam_evaluate::cross_validation::{CrossValidation, Score, Spot};
use pam_evaluate::length_transfer::LengthTransfer;
use pam_evaluate::stock_transfer::StockTransfer;

use super::{Case, percent};
use crate::documents::evaluate as document;

/// One muscle of the document.
pub(super) fn to_document(
    case: &Case,
    length: Option<&LengthTransfer>,
    stock: Option<&StockTransfer>,
) -> document::Muscle {
    let any = case.runs.as_ref().or(case.contractions.as_ref());
    let (blocked, largest) = any.map_or((f64::NAN, f64::NAN), |h| (h.blocked, h.largest));
    let score = |s: &Score| {
        let (mean_pct, rms_pct) = percent(s, largest);
        let (mean, rms) = (s.mean(), s.rms());
        document::Score { rows: s.rows, mean_N: mean, rms_N: rms, mean_pct, rms_pct, bias_N: s.bias() }
    };
    let spots = |spots: &[Spot]| -> Vec<document::Spot> {
        spots
            .iter()
            .map(|s| document::Spot {
                left_out: s.left_out.clone(),
                contraction: s.contraction as f64 * 1e-3,
                direction: s.direction,
                bias_N: s.score.bias(),
                rms_N: s.score.rms(),
                rows: s.score.rows,
            })
            .collect()
    };
    let held = |h: &Option<CrossValidation>| {
        h.as_ref().map(|h| document::HeldOut {
            table: score(&h.table),
            between: h.between.as_ref().map(score),
            ends: h.ends.as_ref().map(score),
            published: h.published.as_ref().map(score),
            r#where: spots(&h.spots),
            recordings: json_of(&h.recordings),
            adjusted: json_of(&h.whole.summary.adjusted),
        })
    };
    document::Muscle {
        muscle: case.muscle.name.clone(),
        blocked_force_N: blocked,
        largest_force_N: largest,
        unseen_runs: held(&case.runs),
        unseen_contractions: held(&case.contractions),
        unseen_length: length.map(|l| document::OtherLength {
            end_effect_mm: l.end_effect * 1e3,
            table: score(&l.score),
            r#where: spots(&l.spots),
        }),
        with_stock: stock.map(|s| document::WithStock {
            ends_mm: s.ends * 1e3,
            unseen_length: score(&s.length),
            length_expected_pct: 100.0 * s.length_expected / largest,
            length_where: spots(&s.length_spots),
            unseen_contractions: (s.contractions.rows > 0.0).then(|| score(&s.contractions)),
            contractions_expected_pct: 100.0 * s.contractions_expected / largest,
            contractions_where: spots(&s.contraction_spots),
        }),
    }
}
