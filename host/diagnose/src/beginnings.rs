//! The state of a muscle at the beginning of a recording, as the recordings show it.
//!
//! A law with a memory is carried on from recording to recording. Where the muscle was vented and filled in between, this is wrong in two ways
//! ([`Beginning`]). How well laws fit decides what holds: taken the wrong way, the beginnings of recordings contradict the rest of them.

use model_core::effects::{Context, Info};
use rayon::prelude::*;

use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::selection::LEAST_SCORE;
use super::remark::Remark;
use super::rows::Rows;
use pam_fit::beginning::{Beginning, is_stroke};

/// The rows with the beginnings under which laws with a memory are more likely, by as much as evidence requires.
pub(crate) fn settle(rows: &Rows, library: &[Candidate], scorer: &Scorer<'_>) -> Rows {
    let carried = Beginning::default();
    let more_likely = |begins: Beginning| {
        let best = |beginning: Beginning| {
            best_score(&rows.with_beginning(beginning), library, |law| begins.concerns(law), scorer)
        };
        best(begins) - best(carried) >= LEAST_SCORE
    };
    rows.with_beginning(Beginning {
        within_stroke: more_likely(Beginning { within_stroke: true, ..carried }),
        just_filled: more_likely(Beginning { just_filled: true, ..carried }),
    })
}

/// What is remarkable about the beginnings, for the first effect that they concern.
pub(crate) fn remarks(rows: &Rows, effects: &[&Info]) -> Vec<Remark> {
    let Beginning { within_stroke, just_filled } = rows.beginning();
    let first =
        |concerned: fn(&Info) -> bool| effects.iter().find(|e| concerned(e)).map(|e| e.name.to_owned());
    let reversal = first(Beginning::is_of_reversal).filter(|_| within_stroke).map(Remark::BeginsWithinStroke);
    let load = first(Beginning::is_of_load).filter(|_| just_filled).map(Remark::BeginsJustFilled);
    reversal.into_iter().chain(load).collect()
}

/// The score of the most likely of some laws.
fn best_score(rows: &Rows, library: &[Candidate], some: impl Fn(&Info) -> bool, scorer: &Scorer<'_>) -> f64 {
    let laws = library.iter().enumerate().filter(|(_, c)| some(c.info));
    let shapes: Vec<_> = laws.flat_map(|(i, c)| c.grid().into_iter().map(move |s| (i, c, s))).collect();
    let scores = shapes.par_iter().map(|(i, c, s)| scorer.fit(*i, c, s, rows, false).score);
    scores.reduce(|| 0.0, f64::max)
}

/// The contexts of rows for a law, each recording preceded by the state from which it begins; and which of them are rows.
pub(crate) fn preceded(rows: &Rows, law: &Info) -> (Vec<Context<f64>>, Vec<bool>) {
    let (mut contexts, mut is_row) = (Vec::with_capacity(rows.len() + rows.names.len()), Vec::new());
    for (i, context) in rows.contexts().iter().enumerate() {
        let begins = i == 0 || rows.recording[i] != rows.recording[i - 1];
        if begins {
            contexts.push(Beginning::before(context, &first_stroke(rows, i).unwrap_or(*context), law));
            is_row.push(false);
        }
        contexts.push(if begins { Beginning::first(context) } else { *context });
        is_row.push(true);
    }
    (contexts, is_row)
}

/// A row of the first stroke of the recording that begins with row `from`.
fn first_stroke(rows: &Rows, from: usize) -> Option<Context<f64>> {
    let own = (from..rows.len()).take_while(|i| rows.recording[*i] == rows.recording[from]);
    own.map(|i| rows.contexts()[i]).find(is_stroke)
}
