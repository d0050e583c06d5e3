//! What can be judged at all, and what is said where nothing can.

use super::answer::Options;
use super::candidates::library;
use super::rows::Rows;
use super::verdict::{Considered, Diagnosis, HeldOut, Trace, Unexplained, Verdict};
use pam_data::pluralise::pluralise;

/// Fewest rows and half-strokes from which anything is judged.
const FEWEST_ROWS: usize = 60;

const FEWEST_BLOCKS: usize = 6;

/// A gauge that never reads more than this, Pa, is dead or was never connected: vented, a muscle does not pull.
const VENTED: f64 = 1e3;

/// The scale of forces: what the highest pressure would give at rest length, or the largest force seen.
pub(super) fn blocked_force(rows: &Rows) -> f64 {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let by_pressure = rows.contexts.iter().map(|c| c.pressure * c.area).fold(0.0, f64::max);
    // An outlier must not set the scale.
    if by_pressure > 0.0 { strongest.min(1.3 * by_pressure) } else { strongest }
}

pub(super) fn cannot_be_judged(rows: &Rows, blocked: f64) -> Option<String> {
    let effective = rows.effective();
    if effective < FEWEST_ROWS {
        let usable = if effective == 0 {
            "no row".to_owned()
        } else {
            format!("only {}", pluralise(effective, "row"))
        };
        return Some(format!(
            "{usable} can be used (direction known, muscle not slack); {FEWEST_ROWS} is the least"
        ));
    }
    if rows.blocks < FEWEST_BLOCKS {
        return Some(format!(
            "only {}: with fewer than {FEWEST_BLOCKS} chance and physics cannot be told apart",
            pluralise(rows.blocks, "half-stroke")
        ));
    }
    let judged = || rows.root_weight.iter().zip(&rows.contexts).filter(|(w, _)| **w > 0.0);
    let highest = judged().map(|(_, c)| c.pressure).fold(f64::NEG_INFINITY, f64::max);
    if highest <= VENTED {
        return Some(format!(
            "the pressure never rises above {:.1} kPa, where no muscle pulls: look at the gauge and at the unit",
            highest * 1e-3
        ));
    }
    let (lo, hi) = rows
        .force
        .iter()
        .zip(&rows.root_weight)
        .filter(|(_, w)| **w > 0.0)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (f, _)| (l.min(*f), h.max(*f)));
    if !(hi - lo > 1e-6 * blocked.abs().max(1e-9)) || !(blocked > 0.0) {
        return Some("the force is constant or never pulls: there is nothing to explain".to_owned());
    }
    None
}

pub(super) fn what_can_be_judged(rows: &Rows) -> Vec<String> {
    let mut remarks = Vec::new();
    if rows.isometric {
        remarks.push(
            "the length was held throughout: speed, viscous friction, inertia and first strokes cannot be judged".to_owned(),
        );
    }
    if rows.levels.len() < 2 {
        remarks.push(
            "one pressure only: what scales with pressure cannot be told from what does not".to_owned(),
        );
    }
    if !rows.has_temperature {
        remarks.push("no temperature was recorded: warming shows only as a slow change".to_owned());
    }
    let moving = rows.sign.iter().filter(|s| **s > 0.0).count();
    let back = rows.sign.iter().filter(|s| **s < 0.0).count();
    if moving + back > 0 && moving.min(back) * 50 < rows.len() {
        remarks.push("the muscle moves one way only: friction cannot be judged".to_owned());
    }
    if !rows.vented.iter().any(|v| *v) {
        remarks.push(
            "no vented stretch: an offset of the load cell cannot be told from the model's own surface"
                .to_owned(),
        );
    }
    remarks
}

pub(super) fn no_judgement(
    rows: &Rows,
    options: &Options,
    mut remarks: Vec<String>,
    reason: String,
    blocked: f64,
) -> Diagnosis {
    remarks.insert(0, format!("nothing can be judged: {reason}"));
    let considered = library(rows)
        .iter()
        .map(|c| Considered {
            effect: c.name().into(),
            gain: 0.0,
            why_not: "these recordings cannot show it".into(),
            hidden_up_to_N: None,
            checked: false,
            visible: 0.0,
        })
        .collect();
    Diagnosis {
        schema: "pam-diagnose/1".into(),
        muscle: options.muscle.clone(),
        samples: rows.samples,
        judged: false,
        verdict: Verdict::Consistent,
        noise_N: 0.0,
        misfit_rms_N: 0.0,
        r#where: Vec::new(),
        missing: Vec::new(),
        unexplained: Unexplained { share: 0.0, pattern: "none".into() },
        held_out: HeldOut {
            split: "none: nothing was fitted".into(),
            rms_before_N: 0.0,
            rms_after_N: 0.0,
            noise_N: 0.0,
            with_turns_before_N: 0.0,
            with_turns_after_N: 0.0,
        },
        next_experiment: None,
        considered,
        path: Vec::new(),
        blocked_force_N: if blocked.is_finite() { blocked } else { 0.0 },
        noise_memory_s: 0.0,
        remarks,
        profiles: Vec::new(),
        trace: Trace { time: Vec::new(), before: Vec::new(), after: Vec::new(), effects: Vec::new() },
    }
}
