//! Preconditions of a diagnosis, and the answer where they are not met.

use super::candidates::library;
use super::criteria::judgement::{
    CONSTANT_FORCE, DEAD_GAUGE, FEWEST_BLOCKS, FEWEST_ROWS, FORCE_SCALE, ONE_WAY_ROWS,
};
use super::options::Options;
use super::rows::Rows;
use super::verdict::{Considered, Diagnosis, HeldOut, Trace, Unexplained, Verdict};
use pam_data::counted::counted;

/// The scale of forces: what the highest pressure would give at rest length, or the largest force seen.
pub(super) fn blocked_force(rows: &Rows) -> f64 {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let by_pressure = rows.contexts().iter().map(|c| c.pressure * c.area).fold(0.0, f64::max);
    // An outlier must not set the scale.
    if by_pressure > 0.0 { strongest.min(FORCE_SCALE * by_pressure) } else { strongest }
}

pub(super) fn unmet_precondition(rows: &Rows, blocked: f64) -> Option<String> {
    let effective = rows.effective();
    if effective < FEWEST_ROWS {
        let usable =
            if effective == 0 { "no row".to_owned() } else { format!("only {}", counted(effective, "row")) };
        return Some(format!(
            "{usable} can be used (direction known, muscle not slack); {FEWEST_ROWS} is the least"
        ));
    }
    if rows.blocks < FEWEST_BLOCKS {
        return Some(format!(
            "only {}: with fewer than {FEWEST_BLOCKS} chance and physics cannot be told apart",
            counted(rows.blocks, "half-stroke")
        ));
    }
    let judged = || rows.root_weight().iter().zip(rows.contexts()).filter(|(w, _)| **w > 0.0);
    let highest = judged().map(|(_, c)| c.pressure).fold(f64::NEG_INFINITY, f64::max);
    if highest <= DEAD_GAUGE {
        return Some(format!(
            "the pressure never rises above {:.1} kPa, where no muscle pulls: look at the gauge and at the unit",
            highest * 1e-3
        ));
    }
    let (lo, hi) = rows
        .force
        .iter()
        .zip(rows.root_weight())
        .filter(|(_, w)| **w > 0.0)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (f, _)| (l.min(*f), h.max(*f)));
    if !(hi - lo > CONSTANT_FORCE * blocked.abs().max(1e-9)) || !(blocked > 0.0) {
        return Some("the force is constant or never pulls: there is nothing to explain".to_owned());
    }
    None
}

pub(super) fn limitations(rows: &Rows) -> Vec<String> {
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
    if moving + back > 0 && moving.min(back) * ONE_WAY_ROWS < rows.len() {
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

pub(super) fn not_judged(
    rows: &Rows,
    options: &Options,
    mut remarks: Vec<String>,
    reason: String,
    blocked: f64,
) -> Diagnosis {
    remarks.insert(0, format!("nothing can be judged: {reason}"));
    let considered = library(rows, &options.added())
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
