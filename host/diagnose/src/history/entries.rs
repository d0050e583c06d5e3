//! Entries of an answer that the history layer makes.

use model_core::effects::{EffectName, Role};
use pam_data::statistics::NORMAL_95;
use pam_fit::bench::{BenchName, Candidate};

use super::History;
use super::additional_effect::AdditionalEffect;
use super::answer::Estimate;
use super::criteria::{ENTER_REFUTES, ENTER_SURE, ENTER_UNSURE, LEAST_GAIN};
use super::findings::{Contrast, chance};
use super::slack_reading::SlackReading;
use crate::verdict::{Missing, ParameterValue, Why};
use crate::why::{Chance, Evidence};

/// The memory's parameter in an answer; the catalogue's `log-creep` is driven by another load and has other parameters.
const RELAXED_SHARE: &str = "relaxed_share";
/// The same for `P_b`.
const BALANCE_PRESSURE: &str = "balance_pressure";
/// Names of the memory: the same to these recordings.
pub(super) const NAMES: [&str; 2] =
    [EffectName::LogCreep.info().name, EffectName::StressRelaxation.info().name];

/// Whether an entry was found by the history layer: its parameters are not those of the catalogue's effect of that name.
#[must_use]
pub fn is_from_history(missing: &Missing) -> bool {
    missing.parameters.iter().any(|p| p.name == RELAXED_SHARE)
}

/// The memory as an entry of what is missing.
pub(super) fn memory(history: &History, peak: f64) -> Missing {
    let spectrum = history.law.one_time_constant_ratio >= ENTER_REFUTES;
    let probability = if spectrum { ENTER_SURE } else { ENTER_UNSURE };
    let error = |e: &Estimate| e.half().map(|h| h / NORMAL_95);
    let mut parameters = vec![
        ParameterValue {
            name: RELAXED_SHARE.into(),
            value: history.law.relaxed_share.value,
            std: error(&history.law.relaxed_share),
            unit: String::new(),
            outside_known_range: false,
        },
        ParameterValue {
            name: BALANCE_PRESSURE.into(),
            value: 1e3 * history.law.balance_pressure.value,
            std: history.law.balance_pressure.half().map(|h| 1e3 * h / NORMAL_95),
            unit: "Pa".into(),
            outside_known_range: false,
        },
    ];
    parameters.extend(history.law.time_constants_s.iter().enumerate().map(|(k, t)| ParameterValue {
        name: format!("time_constant_{}", k + 1),
        value: *t,
        // The spectrum's places are given.
        std: Some(0.0),
        unit: "s".into(),
        outside_known_range: false,
    }));
    let why = Why::Memory {
        without_pct: history.unseen.supported_without.rms_pct,
        with_pct: history.unseen.supported_with.rms_pct,
        gain: history.unseen.gain,
        least_gain: LEAST_GAIN,
        one_time_constant_ratio: history.law.one_time_constant_ratio,
    };
    Missing {
        share_explained: history.unseen.gain.clamp(0.0, 1.0),
        parameters,
        confusable_with: vec![NAMES[1].into()],
        summary: "The bladder carries a part of the pressure. That part relaxes at constant length in proportion to the logarithm of time, \
                  and recovers as slowly after venting: each run starts from the state that the runs before it left."
            .into(),
        source: "P_eff = P + c·z̄, dz_k/dt = (u − z_k)/τ_k, u = p_el·clip((P − 60 kPa)/max(|p_el|, 60 kPa), 0, 1), p_el = P_th(L) − P_b; \
                 linear relaxation with a flat spectrum over decades: W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear \
                 Viscoelastic Materials, 1976"
            .into(),
        peak_N: peak,
        p: chance(history.law.relaxed_share.value, error(&history.law.relaxed_share)),
        ..Missing::of(EffectName::LogCreep.info(), probability, why)
    }
}

/// An effect beside the memory as an entry of what is missing. `left` is the share of the squared error that the memory leaves.
pub(super) fn beside_memory(needed: &AdditionalEffect, left: f64) -> Missing {
    let info = needed.effect.info();
    let probability = if needed.confusable.is_empty() { ENTER_SURE } else { ENTER_UNSURE };
    let share = (left * needed.gain).clamp(0.0, 1.0);
    let parameters = info.parameters.iter().enumerate().map(|(k, parameter)| {
        let value = match parameter.role {
            Role::Shape => needed.shape.unwrap_or(0.0),
            Role::Amplitude if k == needed.amplitude => needed.value,
            Role::Amplitude => 0.0,
        };
        ParameterValue::of(parameter, value, (k == needed.amplitude).then_some(needed.error))
    });
    let chance = Chance::Tested { effects: needed.tried, p: needed.chance };
    Missing {
        share_explained: share,
        parameters: parameters.collect(),
        confusable_with: needed.confusable.iter().map(|e| e.info().name.to_owned()).collect(),
        correction: matches!(needed.effect, Candidate::Bench(_)),
        peak_N: needed.peak,
        p: needed.chance,
        ..Missing::of(info, probability, Why::Found(Evidence { share, chance, change_point: None }))
    }
}

/// An error of the load cell that a slack muscle shows, as an entry of what is missing. It moves no curve against another, so that it
/// explains no share of their error.
pub(super) fn slack_reading(reading: &SlackReading) -> Missing {
    let info = reading.effect.info();
    let Contrast { half, units, .. } = reading.mean;
    let follows_pressure = reading.effect == BenchName::CrossTalk;
    // The least of several slopes has no interval of its own.
    let std = half.filter(|_| !follows_pressure).map(|h| h / NORMAL_95);
    let parameters = info.parameters.iter().take(1);
    Missing {
        parameters: parameters.map(|p| ParameterValue::of(p, reading.amplitude, std)).collect(),
        confusable_with: reading.confusable.iter().map(|b| b.info().name.to_owned()).collect(),
        correction: true,
        peak_N: reading.force.abs(),
        p: reading.mean.chance(),
        ..Missing::of(
            info,
            ENTER_UNSURE,
            Why::SlackReading { reading: reading.force, mountings: units, follows_pressure },
        )
    }
}
