//! The state of a muscle at the beginning of a recording.
//!
//! A law with a memory is carried on from recording to recording. Where the muscle was vented and filled in between, this is wrong in two ways.
//! Its strands have slipped, so that friction opposes the first stroke from its beginning and nothing builds up there, as it does after each
//! reversal later on. And its bladder begins to creep or to relax under the whole pressure, not under the change from the last one. How well laws
//! fit decides what holds: taken the wrong way, the beginnings of recordings contradict the rest of them.

use model_core::effects::{Context, Info, Link, Start};
use rayon::prelude::*;

use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::candidates::VENTED_BEFORE_FILLING;
use super::criteria::selection::LEAST_SCORE;
use super::remark::Remark;
use super::rows::Rows;

/// What is known of the muscle before the first row of a recording. By default it is as the recording before left it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Beginning {
    /// The first stroke had begun long before, for laws that remember the last reversal.
    pub within_stroke: bool,
    /// The muscle had been vented for long and was just filled, for memories of the bladder.
    pub just_filled: bool,
}

impl Beginning {
    /// Whether a law begins otherwise than the recording before ended.
    pub(crate) fn concerns(self, law: &Info) -> bool {
        self.within_stroke && remembers_reversal(law) || self.just_filled && remembers_load(law)
    }
}

fn remembers_reversal(law: &Info) -> bool {
    law.start == Start::Branch
}

fn remembers_load(law: &Info) -> bool {
    law.link == Link::Memory && law.start == Start::Settled
}

/// The rows with the beginnings under which laws with a memory are more likely, by as much as evidence requires.
pub(crate) fn settle(rows: &Rows, library: &[Candidate], scorer: &Scorer<'_>) -> Rows {
    let carried = Beginning::default();
    let more_likely = |begins: Beginning, concerned: fn(&Info) -> bool| {
        let best =
            |beginning: Beginning| best_score(&rows.with_beginning(beginning), library, concerned, scorer);
        best(begins) - best(carried) >= LEAST_SCORE
    };
    rows.with_beginning(Beginning {
        within_stroke: more_likely(Beginning { within_stroke: true, ..carried }, remembers_reversal),
        just_filled: more_likely(Beginning { just_filled: true, ..carried }, remembers_load),
    })
}

/// What is remarkable about the beginnings, for the first effect that they concern.
pub(crate) fn remarks(rows: &Rows, effects: &[&Info]) -> Vec<Remark> {
    let Beginning { within_stroke, just_filled } = rows.beginning();
    let first =
        |concerned: fn(&Info) -> bool| effects.iter().find(|e| concerned(e)).map(|e| e.name.to_owned());
    let reversal = first(remembers_reversal).filter(|_| within_stroke).map(Remark::BeginsWithinStroke);
    let load = first(remembers_load).filter(|_| just_filled).map(Remark::BeginsJustFilled);
    reversal.into_iter().chain(load).collect()
}

/// The score of the most likely of some laws.
fn best_score(rows: &Rows, library: &[Candidate], some: fn(&Info) -> bool, scorer: &Scorer<'_>) -> f64 {
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
        let before = if !begins {
            None
        } else if remembers_load(law) {
            Some(vented(context))
        } else {
            before_first_stroke(rows, i)
        };
        contexts.extend(before);
        is_row.resize(contexts.len(), false);
        contexts.push(if before.is_some() { Context { dt: 0.0, ..*context } } else { *context });
        is_row.push(true);
    }
    (contexts, is_row)
}

/// The same muscle, vented for longer than any memory lasts.
fn vented(filled: &Context<f64>) -> Context<f64> {
    Context {
        dt: VENTED_BEFORE_FILLING,
        pressure: 0.0,
        corrected_pressure: 0.0,
        gaylord: 0.0,
        quasi: filled.elastic,
        ..*filled
    }
}

/// A place from which the first stroke of the recording that begins with row `from` comes, farther away than any memory reaches.
fn before_first_stroke(rows: &Rows, from: usize) -> Option<Context<f64>> {
    let own = (from..rows.len()).take_while(|i| rows.recording[*i] == rows.recording[from]);
    let first = own.map(|i| rows.contexts()[i]).find(|c| c.speed != 0.0 && c.direction != 0.0)?;
    let begin = rows.contexts()[from];
    let stroke = begin.stroke - first.direction * begin.rest_length;
    Some(Context { stroke, direction: first.direction, speed: first.speed, ..begin })
}
