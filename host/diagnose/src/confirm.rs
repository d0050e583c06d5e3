//! What the search finds has to hold on rows that it has not seen.

use super::candidates::Candidate;
use super::criteria::selection::MOST_REFUSED;
use super::criteria::uncertainty::HELD_OUT_LEAVES;
use super::held_out::Unseen;
use super::remark::{Refusal, Remark};
use super::rows::Rows;
use super::search::search;
use super::select::Found;
use super::verdict::HeldOut;

/// What the search finds and unseen rows confirm, with the error on these rows.
pub(super) fn confirmed(rows: &Rows, library: &[Candidate], blocked: f64, step: f64) -> (Found, HeldOut) {
    let mut refused = Vec::new();
    let mut remarks = Vec::new();
    let mut rows = rows.clone();
    loop {
        let selected = search(&rows, library, blocked, step, &refused);
        let first = selected.taken.first().map(|t| t.trial.candidate);
        let (mut found, held) = keep_what_helps(selected, library);
        remarks.append(&mut found.remarks);
        match first {
            Some(candidate) if found.taken.is_empty() && refused.len() < MOST_REFUSED => {
                refused.push(candidate);
                // The next search begins from the model that this one ended with.
                rows = found.rows;
            }
            _ => return (Found { remarks, ..found }, held),
        }
    }
}

/// Drops effects, the last taken first, that do not improve rows which the fit had not seen; gives the error on these rows.
fn keep_what_helps(mut found: Found, library: &[Candidate]) -> (Found, HeldOut) {
    let sigma = found.noise.sigma;
    loop {
        let unseen = Unseen::new(&found.rows, found.full.kind, &found.traces);
        let with = unseen.held_out(&found.traces, sigma);
        let Some(fewer) = found.traces.len().checked_sub(1) else { return (found, with) };
        let before = if fewer == 0 { with.rms_before_N } else { unseen.error(&found.traces[..fewer]) };
        // An effect that takes a third of what is above the noise lowers the whole by more than this.
        if with.rms_after_N < HELD_OUT_LEAVES * before {
            return (found, with);
        }
        let name = found.taken.last().map_or("", |t| library[t.trial.candidate].name());
        found.remarks.push(Remark::Refused {
            effect: name.to_owned(),
            why: Refusal::NotConfirmed { without: before, with: with.rms_after_N },
        });
        found = found.without_last(library);
    }
}
