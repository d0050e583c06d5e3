//! The continuation of a campaign: the engine reads what the log holds.

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;

use super::{Done, read};
use crate::engine::Engine;
use crate::journal::{Chosen, Event, Journal};

/// A recording has at least this many rows.
const FEWEST_ROWS: u64 = 20;

/// Gives an engine what the log of an earlier program holds; gives the steps and the bench time so far.
pub(super) fn resume(
    engine: &mut Engine,
    journal: &Journal,
    muscle: &MuscleDescription,
) -> Result<(Vec<Done>, f64)> {
    let mut chosen: Option<Chosen> = None;
    let mut steps: Vec<Done> = Vec::new();
    let mut spoiled = Vec::new();
    let mut spent = 0.0;
    for event in journal.events() {
        match event {
            Event::Chosen(c) => (chosen, spoiled) = (Some(c.clone()), Vec::new()),
            Event::Spoiled { reason, file, .. } => {
                spoiled.push(*reason);
                if let (Some(chosen), Ok(recording)) = (&chosen, read(&journal.folder().join(file), muscle)) {
                    let longest = recording.stroke.iter().copied().fold(0.0, f64::max);
                    engine.spoiled(&chosen.step, *reason, longest);
                }
            }
            Event::Cut { file, rows, .. } => {
                if *rows >= FEWEST_ROWS {
                    engine.add_rows(read(&journal.folder().join(file), muscle)?);
                }
            }
            Event::Recorded { file, rows, begin_s, end_s, .. } => {
                let Some(chosen) = chosen.take() else { continue };
                engine.add(chosen.step, Some(read(&journal.folder().join(file), muscle)?));
                spent += end_s - begin_s;
                steps.push(Done {
                    chosen,
                    file: file.clone(),
                    rows: *rows,
                    clock_s: (*begin_s, *end_s),
                    spoiled: std::mem::take(&mut spoiled),
                    finding: String::new(),
                });
            }
            Event::Checked { check, file, end_s, .. } => {
                let Some(chosen) = chosen.take() else { continue };
                engine.add_check(*check, journal.folder().join(file));
                spent += chosen.expected_s;
                let clock_s = (end_s - chosen.expected_s, *end_s);
                let spoiled = Vec::new();
                steps.push(Done {
                    chosen,
                    file: file.clone(),
                    rows: 0,
                    clock_s,
                    spoiled,
                    finding: String::new(),
                });
            }
            Event::Finding { text, .. } => {
                if let Some(last) = steps.last_mut() {
                    last.finding.clone_from(text);
                }
            }
            Event::Begin { .. } | Event::Ended { .. } => {}
        }
    }
    if !steps.is_empty() {
        engine.fit();
    }
    Ok((steps, spent))
}
