//! Selected effects must reduce the error on held-out rows.

use super::candidates::Candidate;
use super::criteria::selection::MOST_REFUSED;
use super::criteria::uncertainty::HELD_OUT_LEAVES;
use super::cross_validation::HeldOutRows;
use super::forward_selection::forward_selection;
use super::remark::{Refusal, Remark};
use super::rows::Rows;
use super::selection_step::Selection;
use super::verdict::HeldOut;

/// The effects that forward selection finds and held-out rows confirm, with the error on these rows.
pub(super) fn select_and_confirm(
    rows: &Rows,
    library: &[Candidate],
    blocked: f64,
    step: f64,
) -> (Selection, HeldOut) {
    let mut refused = Vec::new();
    let mut remarks = Vec::new();
    let mut rows = rows.clone();
    loop {
        let selected = forward_selection(&rows, library, blocked, step, &refused);
        let first = selected.selected.first().map(|t| t.fit.candidate);
        let (mut selection, held) = drop_what_does_not_help(selected, library);
        remarks.append(&mut selection.remarks);
        match first {
            Some(candidate) if selection.selected.is_empty() && refused.len() < MOST_REFUSED => {
                refused.push(candidate);
                // The next search begins from the model that this one ended with.
                rows = selection.rows;
            }
            _ => return (Selection { remarks, ..selection }, held),
        }
    }
}

/// Drops effects, the last selected first, that do not reduce the error on held-out rows; gives that error.
fn drop_what_does_not_help(mut selection: Selection, library: &[Candidate]) -> (Selection, HeldOut) {
    let sigma = selection.noise.sigma;
    loop {
        let unseen = HeldOutRows::new(&selection.rows, selection.joint.kind, &selection.traces);
        let with = unseen.held_out(&selection.traces, sigma);
        let Some(fewer) = selection.traces.len().checked_sub(1) else { return (selection, with) };
        let before = if fewer == 0 { with.rms_before_N } else { unseen.error(&selection.traces[..fewer]) };
        // An effect that takes a third of what is above the noise lowers the whole by more than this.
        if with.rms_after_N < HELD_OUT_LEAVES * before {
            return (selection, with);
        }
        let name = selection.selected.last().map_or("", |t| library[t.fit.candidate].name());
        selection.remarks.push(Remark::Refused {
            effect: name.to_owned(),
            why: Refusal::NotConfirmed { without: before, with: with.rms_after_N },
        });
        selection = selection.without_last(library);
    }
}
