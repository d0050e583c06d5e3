//! What an effect must show before it is named: a size, a possible value, and a lower error on held-out rows.
//!
//! | requirement | criterion |
//! | --- | --- |
//! | the 95 % interval of its size excludes zero | [`SIZE_ERRORS`] |
//! | no parameter has a value that cannot be | [`RANGE_ERRORS`] |
//! | it lowers the error on held-out rows, by more than the standard error of the difference unless a test by whole blocks supports it already | [`HELD_OUT_LEAVES`](super::criteria::uncertainty::HELD_OUT_LEAVES), [`HELD_OUT_ERRORS`](super::criteria::uncertainty::HELD_OUT_ERRORS) |

use model_core::effects::Parameter;

use super::candidates::Candidate;
use super::criteria::selection::{FAMILY_ALPHA, MOST_REFUSED};
use super::criteria::uncertainty::{RANGE_ERRORS, SIZE_ERRORS};
use super::cross_validation::HeldOutRows;
use super::forward_selection::forward_selection;
use super::intervals::{deviations, size_deviations};
use super::remark::{Refusal, Remark};
use super::rows::Rows;
use super::selection_step::Selection;
use super::verdict::HeldOut;

/// The effects that forward selection finds and their sizes and held-out rows confirm, with the error on these rows.
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
        let mut selection = forward_selection(&rows, library, blocked, step, &refused);
        let mut failed = None;
        while let Some((place, why)) = unfounded(&selection, library) {
            failed = failed.or(Some(selection.selected[place].fit.candidate));
            selection = refuse(selection, place, why, library);
            // Another effect may have been kept out by this one: the search is repeated without it.
            if refused.len() < MOST_REFUSED {
                break;
            }
        }
        let (mut selection, again, held) = match failed {
            Some(_) if refused.len() < MOST_REFUSED => (selection, failed, None),
            _ => drop_what_does_not_help(selection, library),
        };
        remarks.append(&mut selection.remarks);
        match (again, held) {
            (Some(candidate), _) if refused.len() < MOST_REFUSED => {
                refused.push(candidate);
                // The next search begins from the model that this one ended with.
                rows = selection.rows;
            }
            (_, held) => {
                let held = held.unwrap_or_else(|| error(&selection));
                return (Selection { remarks, ..selection }, held);
            }
        }
    }
}

/// The error on held-out rows with the effects as they are.
fn error(selection: &Selection) -> HeldOut {
    HeldOutRows::new(&selection.rows, selection.joint.kind, &selection.traces)
        .held_out(&selection.traces, selection.noise.sigma)
}

/// The last selected effect whose size the recordings do not determine, or that has a value that cannot be; and why it is not named.
fn unfounded(selection: &Selection, library: &[Candidate]) -> Option<(usize, Refusal)> {
    let sizes = size_deviations(selection, &selection.rows);
    let without_size = sizes.iter().enumerate().rev().find_map(|(place, deviation)| {
        let half = SIZE_ERRORS * deviation.unwrap_or(f64::INFINITY);
        (!(half < 1.0)).then_some((place, Refusal::UncertainSize(half)))
    });
    without_size.or_else(|| impossible(selection, library))
}

/// The last selected effect with a parameter whose whole interval lies beyond what is possible.
fn impossible(selection: &Selection, library: &[Candidate]) -> Option<(usize, Refusal)> {
    let beyond = |place: usize| {
        let fit = &selection.selected[place].fit;
        let parameters = library[fit.candidate].info.parameters.iter().zip(&fit.amplitudes).enumerate();
        // A share of the whole has a limit by its meaning; a time has a usual range only.
        let limited = |p: &Parameter| p.bounded && p.unit.is_empty();
        let mut beyond = parameters.filter(|(_, (p, a))| limited(p) && a.abs() > p.largest());
        beyond.next().map(|(k, (p, a))| (k, p.name, *a, p.largest()))
    };
    let suspects: Vec<usize> = (0..selection.selected.len()).filter(|i| beyond(*i).is_some()).collect();
    if suspects.is_empty() {
        return None;
    }
    let deviations = deviations(selection, library, &selection.rows);
    suspects.into_iter().rev().find_map(|place| {
        let (k, name, value, most) = beyond(place)?;
        let deviation = deviations[place][k]?;
        (value.abs() - RANGE_ERRORS * deviation > most)
            .then(|| (place, Refusal::Impossible { parameter: name.to_owned(), value, most }))
    })
}

/// The selection without an effect, and a remark on it.
fn refuse(mut selection: Selection, place: usize, why: Refusal, library: &[Candidate]) -> Selection {
    let effect = library[selection.selected[place].fit.candidate].name().to_owned();
    selection.remarks.push(Remark::Refused { effect, why });
    selection.without(place, library)
}

/// Drops effects, the last selected first, that do not reduce the error on held-out rows, and others without which it is lower. Gives that
/// error, and the candidate that may have kept others out: the search is then to be repeated without it.
fn drop_what_does_not_help(
    mut selection: Selection,
    library: &[Candidate],
) -> (Selection, Option<usize>, Option<HeldOut>) {
    let first = selection.selected.first().map(|t| t.fit.candidate);
    let mut harmful = None;
    loop {
        let unseen = HeldOutRows::new(&selection.rows, selection.joint.kind, &selection.traces);
        let held = unseen.held_out(&selection.traces, selection.noise.sigma);
        let Some(last) = selection.traces.len().checked_sub(1) else {
            return (selection, harmful.or(first), Some(held));
        };
        // An effect that takes a third of what is above the noise lowers the whole by more than this.
        let tested = selection.selected[last].p <= FAMILY_ALPHA;
        let (without, with, helps) = unseen.last_helps(&selection.traces, tested);
        let failed = if helps {
            let harmful = unseen.harmful(&selection.traces, held.rms_after_N);
            harmful.map(|(place, without)| (place, without, held.rms_after_N))
        } else {
            Some((last, without, with))
        };
        let Some((place, without, with)) = failed else { return (selection, harmful, Some(held)) };
        if place != last {
            harmful = harmful.or(Some(selection.selected[place].fit.candidate));
        }
        selection = refuse(selection, place, Refusal::NotConfirmed { without, with }, library);
    }
}
