//! Remarks on what can and cannot be concluded.

use pam_data::pluralise::pluralise;
use pam_diagnose::refit_comparison::RefitComparison;
use pam_diagnose::remark::{Dimension, Refusal, Remark, RestFriction, Scatter, Unjudgeable};

/// A remark as text without its full stop.
#[must_use]
pub fn remark(remark: &Remark) -> String {
    match remark {
        Remark::NotJudged(reason) => format!("not judged: {}", unjudgeable(reason)),
        Remark::StaticMisfit(rms) => static_misfit(*rms),
        Remark::FirstRuns { left_out, of, others_agree } => first_runs(*left_out, *of, *others_agree),
        Remark::BeginsWithinStroke(effect) => begins_within_stroke(effect),
        Remark::BeginsJustFilled(effect) => begins_just_filled(effect),
        Remark::BladderStiffens(effect) => bladder_stiffens(effect),
        Remark::MemoryInTable => {
            "the table that -o writes contains the memory as `bladder-creep` if this improves the prediction of the recordings. The length was \
             held throughout, so under motion the memory is a prediction. To measure its recovery, vent the muscle for an hour, then repeat a \
             run at the same mounting"
                .to_owned()
        }
        Remark::HeldLength => {
            "the length was held throughout: speed, viscous friction, inertia and first strokes are not identifiable".to_owned()
        }
        Remark::OnePressure => {
            "one pressure only: effects that depend on pressure are not identifiable".to_owned()
        }
        Remark::NoTemperature => "no temperature column: warming is seen only as a slow change".to_owned(),
        Remark::OneDirection => "the muscle moves in one direction only: friction is not identifiable".to_owned(),
        Remark::NoVentedRows => {
            "no vented rows: an offset of the load cell is not identifiable".to_owned()
        }
        Remark::Wall => "near full contraction the force falls more steeply than four elastic orders can follow: jammed strands, or a \
             bladder that stiffens (then fit with `--order 6`)"
            .to_owned(),
        Remark::Slack(share) => format!("{:.0} % of the rows excluded: muscle slack", 100.0 * share),
        Remark::FrictionAtRest(law) => friction_at_rest(*law),
        Remark::FrictionTurns { over } => format!(
            "after a reversal of the pressure at held length, friction turns by 63 % over {:.1} kPa. The model turns it without delay, so \
             rows of a pressure ramp are excluded while it turns",
            over * 1e-3
        ),
        Remark::FilteredChannels { over } => format!(
            "the recordings are filtered: force and displacement pass through a reversal of the motion over {over:.2} s, and the force begins \
             before the displacement turns. These rows are excluded, so that friction that turns slowly is not identifiable. Record without \
             the filter, or with a higher cut-off frequency"
        ),
        Remark::SensorEnd { rows, force } => format!(
            "{} of exactly {force:.2} N excluded: end of the force sensor's range",
            pluralise(*rows, "reading")
        ),
        Remark::Screening(text) => text.clone(),
        Remark::NoAdvice(error) => format!("no next experiment proposed: {error}"),
        Remark::Ringing { excluded, total } => format!(
            "{excluded} of {total} readings excluded: within a third of a second after a pulse of the valve, pressure and force oscillate \
             faster than any effect of the library"
        ),
        Remark::Spikes { excluded, total } => {
            format!("{excluded} of {total} force readings excluded: isolated outliers")
        }
        Remark::InverseFriction { constant, slope } => inverse_friction(*constant, *slope),
        Remark::StraightElasticity(change) => straight_elasticity(*change),
        Remark::CoarseStroke { step, force } => format!(
            "the displacement is read in steps of {:.2} mm, an error of up to {force:.2} N rms in the model's force: smaller errors of the \
             model are hardly visible. Use a displacement sensor of finer resolution",
            step * 1e3
        ),
        Remark::NoRepeats => {
            "no stroke is repeated under the same conditions: the noise is estimated from the residual of the most flexible model".to_owned()
        }
        Remark::Concealed { rms, share, candidates } => concealed(*rms, *share, candidates),
        Remark::NotRepeatable(s) => format!(
            "{}. This is more than sensor noise, and no effect is confirmed as its cause. Check the air supply, the stroke sensor and \
             all fixings, then repeat two strokes under the same conditions",
            scatter(s)
        ),
        Remark::CheckDescription(effect) => format!(
            "{effect} is larger than any published value. Check the muscle's description (diameter, braid angle, rest length, wall) and \
             the units first: an error there has the same effect"
        ),
        Remark::Dimensions(all) => dimensions(all),
        Remark::Refused { effect, why } => refused(effect, why),
        Remark::Measured { check, value } => format!("measured with {check}: {value}"),
        Remark::Table { file, comparison: c } => format!("{file}: {}", refit_comparison(c)),
    }
}

fn unjudgeable(reason: &Unjudgeable) -> String {
    match reason {
        Unjudgeable::FewRows { usable, least } => {
            let usable = if *usable == 0 {
                "no row".to_owned()
            } else {
                format!("only {}", pluralise(*usable, "row"))
            };
            format!("{usable} usable (direction known, muscle not slack); {least} are needed")
        }
        Unjudgeable::FewStrokes { found, least } => format!(
            "only {} (from one reversal to the next; where the length is held, of the pressure); {least} are needed to distinguish an effect \
             from chance",
            pluralise(*found, "half-stroke")
        ),
        Unjudgeable::NoPressure { highest } => format!(
            "the pressure never rises above {:.1} kPa, where no muscle pulls. Check the gauge and its unit",
            highest * 1e-3
        ),
        Unjudgeable::NoForce => "the force is constant or the muscle never pulls".to_owned(),
        Unjudgeable::WrongModel { misfit, measured } => format!(
            "the model's error ({misfit:.3} N rms) is larger than the measured force ({measured:.3} N rms). Check the muscle's \
             description and the units"
        ),
        Unjudgeable::Implausible(why) => why.clone(),
    }
}

fn dimensions(all: &[Dimension]) -> String {
    let value =
        |d: &Dimension| format!("{} {:.2} {} instead of {:.2}", d.name, d.fitted, d.unit, d.described);
    format!(
        "wrong dimensions in the muscle's description leave the same error: with {} the model agrees with these recordings, and no effect is \
         needed. Measure them before you rely on a name",
        super::list(&all.iter().map(value).collect::<Vec<_>>())
    )
}

fn friction_at_rest(law: RestFriction) -> String {
    match law {
        RestFriction::Fades(time) => format!(
            "while the length is held the hysteresis gap closes within about {time:.1} s (pressure ripple releases friction). The model \
             keeps it open, so rows at rest are compared with a friction that decays"
        ),
        RestFriction::Follows { carries, over } => format!(
            "while the length is held friction follows the drifting pressure (changes beyond ± {:.1} kPa, over about {:.1} kPa). The \
             model keeps it constant, so rows at rest are compared with a friction that follows",
            carries * 1e-3,
            over * 1e-3
        ),
    }
}

fn inverse_friction(constant: f64, slope: f64) -> String {
    format!(
        "k_F(P) follows {constant:.3} + {:.1} kPa/P: this friction is not proportional to force (dry, seal, or viscous at \
         one speed)",
        slope * 1e-3
    )
}

fn straight_elasticity(change: f64) -> String {
    format!(
        "E_1 {} linearly with pressure, by {:.0} % over the range. One bladder cannot do this; possible causes: ends that are \
         not cylindrical, a stretching braid, a gain error, or a slow change in the order of the tests",
        if change > 0.0 { "rises" } else { "falls" },
        100.0 * change.abs()
    )
}

fn concealed(rms: f64, share: f64, candidates: &[String]) -> String {
    let which = if candidates.is_empty() {
        "No effect of the library leaves such a difference".to_owned()
    } else {
        format!(
            "Effects that leave such a difference: {}. None is distinct enough to be named",
            candidates.join(", ")
        )
    };
    format!(
        "one bladder does not fit all pressures: coefficients fitted at each pressure absorb {rms:.2} N rms ({:.2} % of blocked force) that \
         one set of coefficients does not. {which}. The table is accurate at tested pressures, less so between and beyond them",
        100.0 * share
    )
}

/// How strokes under the same conditions differ.
pub(super) fn scatter(s: &Scatter) -> String {
    format!(
        "not repeatable: under the same conditions the force differs by {:.2} N ({:.1} % of blocked force) for about {:.1} s at a time",
        s.sigma,
        100.0 * s.share,
        s.memory
    )
}

/// The first names of a list, and how many follow.
fn first_of(names: &[String]) -> String {
    const LISTED: usize = 5;
    match names.len().checked_sub(LISTED + 1) {
        None => names.join(", "),
        Some(more) => format!("{}, and {} more", names[..LISTED].join(", "), more + 1),
    }
}

fn static_misfit(rms: f64) -> String {
    format!(
        "the static model of all mountings, without the memory, leaves {rms:.2} N rms. Geometry, end effects and mounted lengths (±1 mm by \
         tape measure) are not identifiable from one muscle; diagnose three or more muscles of one type together to identify them"
    )
}

fn first_runs(left_out: usize, of: usize, others_agree: bool) -> String {
    let others = if others_agree { " The model agrees with the other runs." } else { "" };
    format!(
        "run 1 of each mounting differs from the runs that follow, and no effect of the library explains it: the muscle may run in.{others} The \
         search for effects, what could be hidden, the error on held-out rows, and the table that -o writes are without these runs ({left_out} \
         of {of}). Before a recording, fill the muscle several times at the new length"
    )
}

fn begins_within_stroke(effect: &str) -> String {
    format!(
        "friction opposes the first stroke of each recording from its beginning, as in a muscle that was just filled: {effect} begins with \
         the first reversal"
    )
}

fn begins_just_filled(effect: &str) -> String {
    format!(
        "each recording begins as if the muscle had been vented for long and was just filled: {effect} begins there"
    )
}

fn bladder_stiffens(effect: &str) -> String {
    format!(
        "a bladder whose stiffness changes with the pressure explains as much as {effect} would, and tables contain that: effects were \
         looked for beside it"
    )
}

fn refused(effect: &str, why: &Refusal) -> String {
    match why {
        Refusal::NotConfirmed { without, with } => format!(
            "{effect} not named: it fits these recordings but does not improve held-out rows by more than chance ({without:.3} N \
             without it, {with:.3} N with it)"
        ),
        // A number of many thousand percent says no more.
        Refusal::UncertainSize(half) if half.is_finite() && *half > 10.0 => format!(
            "{effect} not named: the 95 % interval of its size is more than ten times as wide as the size itself"
        ),
        Refusal::UncertainSize(half) if half.is_finite() => format!(
            "{effect} not named: the 95 % interval of its size includes zero (± {:.0} % of the size, by parts of the recordings)",
            100.0 * half
        ),
        Refusal::UncertainSize(_) => {
            format!(
                "{effect} not named: its size is not identifiable, because other effects or the model make the same force"
            )
        }
        Refusal::Impossible { parameter, value, most } => format!(
            "{effect} not named: the fit gives {parameter} = {value:.3}, and no more than {most:.3} is possible"
        ),
        Refusal::UnknownMemory(memory) => format!(
            "{effect} not named: it would act in the first strokes of recordings only, where the state of {memory} is unknown"
        ),
        Refusal::Competitors { share, others } => format!(
            "{effect} not named: it would explain {:.0} % of the excess error, but these explain it nearly as well: {}",
            100.0 * share,
            first_of(others)
        ),
        Refusal::SlowDrift => format!(
            "{effect} not named: it would explain much of the excess error, but so would a slowly drifting sensor"
        ),
        Refusal::ImpossibleInRefit => format!(
            "{effect} not named: it would explain much of the excess error, but the joint fit gives parameters that are impossible"
        ),
        Refusal::LostInRefit => format!(
            "{effect} not named: it would explain much of the excess error, but little remains of it in the joint fit"
        ),
    }
}

/// What happened to the effects when the table was refitted.
#[must_use]
fn refit_comparison(r: &RefitComparison) -> String {
    let left_out = r.left_out.map_or(String::new(), |(plain, with)| {
        format!("; a pressure left out of the fit: {with:.2} % of blocked force against {plain:.2} %")
    });
    format!(
        "the effects do not improve the table's prediction of these recordings ({:.3} N with them, {:.3} N without{left_out}). {}",
        r.with,
        r.without,
        if r.kept {
            "They were written nevertheless, because they were given"
        } else {
            "The table was written without them"
        }
    )
}
