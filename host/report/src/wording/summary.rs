//! The answer for a user at a terminal who does not know the effect.

use std::fmt::Write;

use pam_data::statistics::NORMAL_95;
use pam_diagnose::history::is_from_history;
use pam_diagnose::verdict::{Diagnosis, Missing, ParameterValue, Pattern, Verdict};
use pam_diagnose::why::Why;

use super::{
    HiddenEffect, hidden, one_bladder_misfits, only_first_runs_differ, pattern, proposal, region, remark,
    sentence, split, unconfirmed, why, with_interval,
};
use crate::effect_page::place;

/// The diagnosis as text for a terminal.
#[must_use]
pub fn summary(d: &Diagnosis) -> String {
    let mut s = String::new();
    header(&mut s, d);
    if !d.r#where.is_empty() {
        let _ = writeln!(s, "\nWhere the model is wrong");
        for r in d.r#where.iter().take(4) {
            let _ = writeln!(s, "  {} (p = {:.3})", region(r), r.p);
        }
    }
    for m in &d.missing {
        effect(&mut s, m);
    }
    let h = &d.held_out;
    if !d.missing.is_empty() {
        let _ = writeln!(
            s,
            "\nError on held-out rows ({}), rms\n  {:.3} N without the effects, {:.3} N with them; noise {:.3} N\n  including the rows \
             about each reversal: {:.3} N without, {:.3} N with",
            split(h.split),
            h.rms_before_N,
            h.rms_after_N,
            h.noise_N,
            h.with_turns_before_N,
            h.with_turns_after_N
        );
    }
    if d.missing.is_empty() && d.judged() && h.rms_before_N > 0.0 {
        let _ = writeln!(
            s,
            "\nError of the plain model on held-out rows ({}): {:.3} N rms; noise {:.3} N",
            split(h.split),
            h.rms_before_N,
            h.noise_N
        );
    }
    if d.verdict() != Verdict::Consistent {
        let pattern = match &d.unexplained.pattern {
            Pattern::None => "no pattern".to_owned(),
            other => pattern(other),
        };
        let _ = writeln!(
            s,
            "\nUnexplained: {:.0} % {}; {pattern}",
            100.0 * d.unexplained.share,
            unexplained_base(d)
        );
        if let Some(unconfirmed) = unconfirmed(d) {
            let _ = writeln!(s, "  {unconfirmed}");
        }
    }
    if let Some(n) = &d.next_experiment {
        let _ = write!(s, "\nNext experiment: {}", proposal(&n.proposal));
        // What no motion separates has no difference to expect.
        if n.proposal.motion_separates {
            let _ = write!(s, " (expected difference {:.2} N)", n.expected_difference_N);
        }
        s.push('\n');
    }
    if d.noise_N > 0.0 {
        could_be_hidden(&mut s, d);
    }
    if !d.remarks.is_empty() {
        let _ = writeln!(s, "\nRemarks");
        for r in &d.remarks {
            let _ = writeln!(s, "  {}", sentence(&remark(r)));
        }
    }
    s
}

/// What the unexplained share is a share of.
#[must_use]
pub(crate) fn unexplained_base(d: &Diagnosis) -> &'static str {
    if d.missing.iter().any(is_from_history) {
        "of the squared error of unseen runs at the same mounting"
    } else {
        "of the excess error"
    }
}

fn header(s: &mut String, d: &Diagnosis) {
    let judged = d.judged();
    let _ = if judged {
        writeln!(s, "{}: {} rows, blocked force {:.1} N", d.muscle, d.samples, d.blocked_force_N)
    } else {
        writeln!(s, "{}: {} rows", d.muscle, d.samples)
    };
    let explained = match d.explained_beside_small_rest() {
        None => "EXPLAINED: the effects below explain the model's error above the noise.".to_owned(),
        Some(share) => format!(
            "EXPLAINED: the effects below explain {:.0} % of the model's error above the noise; the rest is within the model's \
             stated inexactness.",
            100.0 * share
        ),
    };
    let given = format!("GIVEN EFFECTS FITTED: {}", super::outcome::given(d));
    let _ = writeln!(
        s,
        "\n{}",
        match d.verdict() {
            Verdict::Consistent if !judged =>
                "NOT JUDGED: these recordings do not allow a judgement of the model; see the remarks.",
            Verdict::Consistent if one_bladder_misfits(d) =>
                "CONSISTENT AT EACH PRESSURE: no error exceeds the noise there, but one bladder does not describe all pressures.",
            Verdict::Consistent =>
                "CONSISTENT: no error exceeds the noise and the model's stated inexactness.",
            Verdict::Explained if d.missing.iter().any(|m| !m.supported) => &given,
            Verdict::Explained => &explained,
            Verdict::PartlyExplained =>
                "PARTLY EXPLAINED: the effects below explain a part of the model's error above the noise.",
            Verdict::Unexplained if only_first_runs_differ(d) =>
                "UNEXPLAINED: the model agrees with all runs but the first of each mounting, and no effect of the library explains these.",
            Verdict::Unexplained if !d.unconfirmed().is_empty() =>
                "UNEXPLAINED: effects of the library fit the model's error above the noise, but no better than chance or slow noise could.",
            Verdict::Unexplained if matches!(d.unexplained.pattern, Pattern::NotRepeatable(_)) =>
                "NOISE WITH MEMORY: the error does not repeat under the same conditions, and no effect of the library fits it.",
            Verdict::Unexplained if !d.missing.is_empty() =>
                "UNEXPLAINED: no effect of the library explains the model's error above the noise. What checks of the bench measured is below.",
            Verdict::Unexplained =>
                "UNEXPLAINED: the model has an error above the noise that no effect of the library explains well enough to be named.",
        }
    );
    if judged {
        let _ = writeln!(
            s,
            "\n  error of the plain model {:.3} N rms ({:.2} % of blocked force)\n  noise                    {:.3} N rms (excess \
             error: the squared error above it)",
            d.misfit_rms_N,
            100.0 * d.misfit_rms_N / d.blocked_force_N.max(1e-12),
            d.noise_N
        );
    }
}

fn effect(s: &mut String, m: &Missing) {
    let name = if m.given {
        format!("Given: {}", m.effect)
    } else {
        format!("Missing: {} (probability {:.0} %)", m.effect, 100.0 * m.probability)
    };
    let _ = writeln!(s, "\n{name}, acts on {}", place(m.place));
    let _ = writeln!(s, "  {}", m.summary);
    let _ = writeln!(s, "  evidence: {}; largest contribution {:.2} N", why(&m.why), m.peak_N);
    // Of alternative laws those that were not chosen are zero.
    for p in m.parameters.iter().filter(|p| p.value != 0.0) {
        let odd = if p.outside_known_range { "   outside the published range" } else { "" };
        let _ = writeln!(s, "  {} = {}{odd}", p.name, with_interval(p.value, p.std, &p.unit));
    }
    if let Some(traded) = traded_off(m) {
        let _ = writeln!(s, "  {traded}");
    }
    if !m.confusable_with.is_empty() {
        let _ =
            writeln!(s, "  these recordings do not distinguish it from: {}", m.confusable_with.join(", "));
    }
    if m.correction {
        let remedy = if m.checked && m.share_explained == 0.0 {
            "the recordings cannot be corrected for it, so repair the bench"
        } else {
            "it corrects the data and is not sent to the controller"
        };
        let _ = writeln!(s, "  an error of the bench, not of the muscle: {remedy}");
    }
}

/// What to say where the intervals of single parameters include zero although the size of the whole effect is determined.
#[must_use]
pub(crate) fn traded_off(m: &Missing) -> Option<&'static str> {
    let includes_zero =
        |p: &ParameterValue| p.value != 0.0 && p.std.is_some_and(|s| NORMAL_95 * s >= p.value.abs());
    let by_slack = matches!(m.why, Why::SlackReading { .. });
    let tested = !m.given && !m.checked && !by_slack && !is_from_history(m);
    (tested && m.parameters.iter().any(includes_zero)).then_some(
        "the force of this effect is determined (the 95 % interval of its size excludes zero), its single parameters are not: \
         one compensates another",
    )
}

/// What may be there unseen, by what would show it; and what checks of the bench have excluded.
fn could_be_hidden(s: &mut String, d: &Diagnosis) {
    let named = |effects: &[HiddenEffect<'_>]| {
        effects.iter().map(|e| format!("{} {}", e.effect, e.size)).collect::<Vec<_>>().join(", ")
    };
    let hidden = hidden(d);
    if !hidden.by_measure.is_empty() {
        let _ = writeln!(s, "\nEffects that these recordings could hide, and how to find out");
    }
    for (measure, effects) in &hidden.by_measure {
        let _ = writeln!(s, "  {}: {measure}", named(effects));
    }
    if !hidden.moving.is_empty() {
        let _ = writeln!(
            s,
            "\nEffects that only a moving muscle shows; they do not matter where its length is held\n  {}",
            named(&hidden.moving)
        );
    }
    let checked = d.considered.iter().filter(|c| c.checked);
    let cleared: Vec<String> = checked
        .map(|c| match c.hidden_up_to_N {
            Some(h) => format!("{} (at most {h:.2} N)", c.effect),
            None => c.effect.clone(),
        })
        .collect();
    if !cleared.is_empty() {
        let _ = writeln!(s, "\nExcluded by checks of the bench: {}", cleared.join(", "));
    }
}
