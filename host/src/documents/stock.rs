//! `host diagnose` with several muscles, `pam-diagnose-stock/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_data::statistics::NORMAL_95;
use pam_diagnose::stock::{
    CauseError, Considered, Interval, MountedLengths, MuscleMountings, MuscleOwn, SharedPlace, StockDiagnosis,
};
use pam_fit::stock::{Law, MountingCause};
use pam_report::stock_mountings::lengths_refusal;
use pam_report::stock_text::law_refusal;
use serde::Serialize;

/// What muscles of one stock share, and what each has of its own.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields, title = "pam-diagnose-stock/1"))]
pub(crate) struct StockDocument {
    pub schema: &'static str,
    /// `explained`: an effect that differs with length, or errors of the mounted lengths, are named. `consistent`: the muscles and mountings
    /// differ by chance only.
    pub verdict: &'static str,
    /// The effects that are named.
    pub missing: Vec<StockEffect>,
    pub shared: Shared,
    pub muscles: Vec<Muscle>,
    /// Standard deviations of what muscles and mountings have of their own.
    pub deviations: Deviations,
    /// All laws between muscles that were tried.
    pub considered: Vec<Tried>,
    /// Held mountings, each predicted without its own recordings; null where none can be.
    pub unseen_mountings: Option<UnseenMountings>,
    /// Root mean square of the residuals of the joint fit, N.
    pub rms_N: f64,
}

/// An estimate with its standard error and its 95 % interval.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Estimate {
    pub value: f64,
    pub std: f64,
    pub low: f64,
    pub high: f64,
    pub unit: &'static str,
}

/// An effect of the stock.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct StockEffect {
    pub effect: &'static str,
    pub law: &'static str,
    pub parameter: Estimate,
    /// The parameter over its standard error; unit of uncertainty: muscle. Of the mounted lengths: the mean gain in error of left-out mountings
    /// over its standard error; unit of uncertainty: mounting.
    pub t: f64,
    pub confusable_with: Vec<String>,
    /// Whether it is the bench's, and no property of the muscles.
    pub correction: bool,
}

/// What the muscles share.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Shared {
    /// The highest pressure at which all muscles were recorded.
    pub pressure_kPa: f64,
    /// Area on which the pressure pulls at rest length, without ends.
    pub pulling_area_mm2: f64,
    /// The same by the described braid.
    pub described_area_mm2: f64,
    /// Force, gap between the directions, and onset of the pull over contraction.
    pub places: Vec<Place>,
    /// How much less the first filling of a mounting pulls than the second, over the muscles that show it.
    pub first_run_low: Option<Estimate>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Place {
    pub contraction: f64,
    pub force_N: f64,
    pub emptying_less_filling_N: Option<f64>,
    /// Pressure that the bladder takes before the muscle pulls.
    pub onset_kPa: Option<f64>,
}

/// What a muscle has of its own.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Muscle {
    pub muscle: String,
    pub rest_length_mm: f64,
    pub blocked_force_N: f64,
    /// Blocked force of a muscle of this length that has nothing of its own.
    pub expected_blocked_force_N: f64,
    /// Its force over that of a muscle of the stock with its length.
    pub scale: Estimate,
    pub mountings: Vec<Mounting>,
    /// How much less the first filling of a mounting pulls than the second.
    pub first_run_low: Option<Estimate>,
    /// Its held mountings, each predicted without its own recordings; null where none can be.
    pub unseen_mountings: Option<OwnMountings>,
}

/// Errors on the mountings of a muscle that were left out, rms.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct OwnMountings {
    /// Predicted from all others.
    pub error_N: f64,
    /// With one length for each mounting, fitted to the other direction.
    pub with_length_N: f64,
}

/// Mountings that were left out, and what one number for each would explain.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct UnseenMountings {
    pub mountings: usize,
    /// Root mean square error, predicted from all others.
    pub error_N: f64,
    /// The same with one number for each mounting, fitted to the other direction.
    pub causes: Vec<Cause>,
    /// Empty where `displacement-offset` is named.
    pub why_not: String,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Cause {
    pub effect: &'static str,
    pub error_N: f64,
    /// Root mean square of the numbers.
    pub size: f64,
    /// Whether instruments may have numbers of this size.
    pub plausible: bool,
    pub unit: &'static str,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Mounting {
    pub label: String,
    /// The held stroke; null where the muscle moved.
    pub stroke_mm: Option<f64>,
    /// By how much the muscle is shorter than the file says.
    pub length_error: Estimate,
    pub load_cell_zero: Estimate,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Deviations {
    /// Of the force between muscles of one length, percent.
    pub scale_pct: f64,
    pub rest_length_mm: f64,
    pub mounted_length_mm: f64,
    pub load_cell_zero_N: f64,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Tried {
    /// Null: muscles differ by chance only.
    pub effect: Option<&'static str>,
    pub law: &'static str,
    pub parameter: Option<Estimate>,
    /// Standard error of the parameter by the jackknife over muscles, for comparison.
    pub jackknife_std: Option<f64>,
    /// Error on muscles that were left out, rms in percent of the largest force of each.
    pub left_out_error_pct: f64,
    /// Empty for the effect that is named.
    pub why_not: String,
}

fn estimate(of: &Interval, scale: f64, unit: &'static str) -> Estimate {
    let Interval { value, std, low, high } = *of;
    Estimate { value: scale * value, std: scale * std, low: scale * low, high: scale * high, unit }
}

/// The law as text, the factor and the unit of its parameter.
fn law(of: Option<Law>) -> (&'static str, f64, &'static str) {
    match of {
        None => ("chance differences only", 1.0, ""),
        Some(Law::Ends) => ("F ∝ 1 − λ/L0", 1e3, "mm"),
        Some(Law::Taper) => ("F ∝ 1 − κ·ε/L0", 1e3, "mm"),
        Some(Law::Compliance) => ("x = x_read + F/K", 1e3, "mm/N"),
    }
}

fn mountings(of: &MountedLengths) -> UnseenMountings {
    let cause = |c: &CauseError| {
        let (scale, unit) = match c.cause {
            MountingCause::Length => (1e3, "mm"),
            MountingCause::ForceZero => (1.0, "N"),
            MountingCause::GaugeZero => (1e-3, "kPa"),
            MountingCause::ForceScale => (1.0, ""),
        };
        Cause {
            effect: c.cause.effect().info().name,
            error_N: c.error,
            size: scale * c.size,
            plausible: c.plausible,
            unit,
        }
    };
    UnseenMountings {
        mountings: of.mountings,
        error_N: of.before,
        causes: of.causes.iter().map(cause).collect(),
        why_not: of.why_not.map_or_else(String::new, |why| lengths_refusal(of.mountings, why)),
    }
}

/// The entry of the mounted lengths, where they are named.
fn lengths(of: &MountedLengths) -> Option<StockEffect> {
    of.named().then(|| StockEffect {
        effect: MountingCause::Length.effect().info().name,
        law: "x = x_read + d, each mounting its own d; rms of d",
        parameter: estimate(&of.size, 1e3, "mm"),
        t: of.t,
        confusable_with: of.confusable_with.iter().map(|&e| e.to_owned()).collect(),
        correction: true,
    })
}

fn muscle(of: &MuscleOwn, mountings: Option<MuscleMountings>) -> Muscle {
    let history = |e: &pam_diagnose::history::answer::Estimate| Estimate {
        value: e.value,
        std: e.half().unwrap_or(0.0) / NORMAL_95,
        low: e.low.unwrap_or(e.value),
        high: e.high.unwrap_or(e.value),
        unit: "N",
    };
    Muscle {
        muscle: of.name.clone(),
        rest_length_mm: of.rest_length * 1e3,
        blocked_force_N: of.blocked,
        expected_blocked_force_N: of.expected,
        scale: estimate(&of.scale, 1.0, ""),
        mountings: of
            .mountings
            .iter()
            .map(|m| Mounting {
                label: m.label.clone(),
                stroke_mm: m.stroke.map(|s| s * 1e3),
                length_error: estimate(&m.length, 1e3, "mm"),
                load_cell_zero: estimate(&m.zero, 1.0, "N"),
            })
            .collect(),
        first_run_low: of.run_in.as_ref().map(history),
        unseen_mountings: mountings.map(|m| OwnMountings { error_N: m.before, with_length_N: m.with_length }),
    }
}

fn tried(of: &Considered) -> Tried {
    let (description, scale, unit) = law(of.law);
    Tried {
        effect: of.law.map(Law::effect),
        law: description,
        parameter: of.parameter.as_ref().map(|p| estimate(p, scale, unit)),
        jackknife_std: of.jackknife.map(|j| j * scale),
        left_out_error_pct: 100.0 * of.error,
        why_not: of.why_not.map_or_else(String::new, law_refusal),
    }
}

fn place(of: &SharedPlace) -> Place {
    Place {
        contraction: of.contraction,
        force_N: of.force,
        emptying_less_filling_N: of.gap,
        onset_kPa: of.onset.map(|p| p * 1e-3),
    }
}

/// The document of a diagnosis.
pub(crate) fn of(answer: &StockDiagnosis) -> StockDocument {
    let deviations = &answer.fitted.fit.deviations;
    let named = answer.named.as_ref().map(|(of, interval, t)| {
        let (description, scale, unit) = law(Some(*of));
        StockEffect {
            effect: of.effect(),
            law: description,
            parameter: estimate(interval, scale, unit),
            t: *t,
            confusable_with: answer.confusable_with.clone(),
            correction: *of == Law::Compliance,
        }
    });
    let held = answer.mounted_lengths.as_ref();
    let missing: Vec<StockEffect> = named.into_iter().chain(held.and_then(lengths)).collect();
    let own = |m: usize| held.and_then(|h| h.muscles.get(m).copied().flatten());
    StockDocument {
        schema: "pam-diagnose-stock/1",
        verdict: if missing.is_empty() { "consistent" } else { "explained" },
        missing,
        shared: Shared {
            pressure_kPa: answer.pressure * 1e-3,
            pulling_area_mm2: answer.area * 1e6,
            described_area_mm2: answer.described_area * 1e6,
            places: answer.shared.iter().map(place).collect(),
            first_run_low: answer.run_in.as_ref().map(|(i, _)| estimate(i, 1.0, "N")),
        },
        muscles: answer.muscles.iter().enumerate().map(|(m, of)| muscle(of, own(m))).collect(),
        deviations: Deviations {
            scale_pct: 100.0 * deviations.scale,
            rest_length_mm: 1e3 * deviations.length,
            mounted_length_mm: 1e3 * deviations.mounted,
            load_cell_zero_N: deviations.zero,
        },
        considered: answer.considered.iter().map(tried).collect(),
        unseen_mountings: held.map(mountings),
        rms_N: answer.fitted.fit.rms,
    }
}
