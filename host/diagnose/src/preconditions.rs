//! Preconditions of a diagnosis, and the answer where they are not met.

use super::candidates::library;
use super::criteria::judgement::{
    CONSTANT_FORCE, DEAD_GAUGE, FEWEST_BLOCKS, FEWEST_ROWS, FORCE_SCALE, ONE_WAY_ROWS,
};
use super::options::Options;
use super::remark::{Remark, Unjudgeable};
use super::rows::Rows;
use super::verdict::{Considered, Diagnosis, HeldOut, Outcome, Pattern, Split, Trace, Unexplained, WhyNot};
use pam_data::statistics::extremes;
use pam_fit::beginning::Beginning;

/// The scale of forces: what the highest pressure would give at rest length, or the largest force seen.
pub(super) fn blocked_force(rows: &Rows) -> f64 {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let by_pressure = rows.contexts().iter().map(|c| c.pressure * c.area).fold(0.0, f64::max);
    // An outlier must not set the scale.
    if by_pressure > 0.0 { strongest.min(FORCE_SCALE * by_pressure) } else { strongest }
}

pub(super) fn unmet_precondition(rows: &Rows, blocked: f64) -> Option<Unjudgeable> {
    let effective = rows.effective();
    if effective < FEWEST_ROWS {
        return Some(Unjudgeable::FewRows { usable: effective, least: FEWEST_ROWS });
    }
    if rows.blocks < FEWEST_BLOCKS {
        return Some(Unjudgeable::FewStrokes { found: rows.blocks, least: FEWEST_BLOCKS });
    }
    let judged = || rows.root_weight().iter().zip(rows.contexts()).filter(|(w, _)| **w > 0.0);
    let highest = judged().map(|(_, c)| c.pressure).fold(f64::NEG_INFINITY, f64::max);
    if highest <= DEAD_GAUGE {
        return Some(Unjudgeable::NoPressure { highest });
    }
    let (lo, hi) =
        extremes(rows.force.iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0).map(|(f, _)| *f));
    if !(hi - lo > CONSTANT_FORCE * blocked.abs().max(1e-9)) || !(blocked > 0.0) {
        return Some(Unjudgeable::NoForce);
    }
    None
}

pub(super) fn limitations(rows: &Rows) -> Vec<Remark> {
    let mut remarks = Vec::new();
    if rows.isometric {
        remarks.push(Remark::HeldLength);
    }
    if rows.levels.len() < 2 {
        remarks.push(Remark::OnePressure);
    }
    if !rows.has_temperature {
        remarks.push(Remark::NoTemperature);
    }
    let moving = rows.sign.iter().filter(|s| **s > 0.0).count();
    let back = rows.sign.iter().filter(|s| **s < 0.0).count();
    if moving + back > 0 && moving.min(back) * ONE_WAY_ROWS < rows.len() {
        remarks.push(Remark::OneDirection);
    }
    if !rows.vented.iter().any(|v| *v) {
        remarks.push(Remark::NoVentedRows);
    }
    remarks
}

pub(super) fn not_judged(
    rows: &Rows,
    options: &Options,
    mut remarks: Vec<Remark>,
    reason: Unjudgeable,
    blocked: f64,
) -> Diagnosis {
    remarks.insert(0, Remark::NotJudged(reason.clone()));
    let considered = library(rows, &options.added())
        .iter()
        .map(|c| Considered {
            effect: c.name().into(),
            gain: 0.0,
            why_not: WhyNot::NotJudged,
            hidden_up_to_N: None,
            checked: false,
            visible: 0.0,
        })
        .collect();
    Diagnosis {
        muscle: options.muscle.clone(),
        samples: rows.samples,
        outcome: Outcome::NotJudged(reason),
        noise_N: 0.0,
        misfit_rms_N: 0.0,
        r#where: Vec::new(),
        missing: Vec::new(),
        unexplained: Unexplained { share: 0.0, pattern: Pattern::None, unconfirmed: Vec::new() },
        held_out: HeldOut {
            split: Split::NothingFitted,
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
        beginning: Beginning::default(),
        history: None,
    }
}
