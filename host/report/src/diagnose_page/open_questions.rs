//! Open questions after a diagnosis: the unexplained error, effects that could be hidden, the next experiment, and all effects considered.

use pam_diagnose::verdict::{Diagnosis, Pattern, Verdict};

use super::super::wording;
use super::super::{Section, Table, fixed, significant};

/// The error that no named effect explains, and the effects that could be hidden.
pub(super) fn remains(d: &Diagnosis) -> Section {
    let mut section = Section::new("Unexplained").summarised();
    if d.verdict() != Verdict::Consistent {
        section.text(format!(
            "{} % of the excess error is unexplained{}.",
            fixed(100.0 * d.unexplained.share, 0),
            match &d.unexplained.pattern {
                Pattern::None => ", without a pattern".to_owned(),
                pattern => format!(". Its pattern: {}", wording::pattern(pattern)),
            }
        ));
    }
    if let Some(unconfirmed) = wording::unconfirmed(d) {
        section.text(format!("{unconfirmed}."));
    }
    if !d.judged() {
        return section;
    }
    let hidden = wording::hidden(d);
    let named = |effects: &[wording::HiddenEffect<'_>]| {
        effects.iter().map(|e| format!("`{}` {}", e.effect, e.size)).collect::<Vec<_>>().join(", ")
    };
    if !hidden.by_measure.is_empty() {
        let mut table = Table::new(
            "Effects that these recordings could hide, because the tables imitate them or nothing excites them",
            &["what would show them", "effects"],
        );
        for (measure, effects) in &hidden.by_measure {
            table.row([wording::sentence(measure), named(effects)]);
        }
        section.table(table);
    }
    if !hidden.moving.is_empty() {
        section.text(format!(
            "Only a moving muscle shows these effects; they do not matter where its length is held: {}.",
            named(&hidden.moving)
        ));
    }
    section
}

/// The proposed recording.
pub(super) fn next(d: &Diagnosis) -> Section {
    let mut section = Section::new("Next experiment").summarised();
    if let Some(n) = &d.next_experiment {
        let separates: Vec<String> = n.separates.iter().map(|s| format!("`{s}`")).collect();
        let (proposal, separates) =
            (wording::sentence(&wording::proposal(&n.proposal)), separates.join(" and "));
        section.text(if n.proposal.motion_separates {
            format!(
                "{proposal} It separates {separates} by up to {} N.",
                significant(n.expected_difference_N, 2)
            )
        } else {
            format!("{proposal} This separates {separates}.")
        });
        if n.proposal.motion_separates && !n.protocol.is_empty() {
            section.listing(n.protocol.clone());
        }
    } else if d.judged() && d.verdict() == Verdict::Consistent {
        section.text("None needed for the range that these recordings cover.");
    }
    section
}

/// Forward selection, and every effect that is not named.
pub(super) fn considered(d: &Diagnosis) -> Section {
    let mut section = Section::new("All effects considered");
    if !d.judged() {
        return section;
    }
    if !d.path.is_empty() {
        let mut table = Table::new(
            "Forward selection",
            &["selected", "residual after it (N)", "held-out error after it (N)", "p (chance)", "next best"],
        );
        for step in &d.path {
            let competitors: Vec<String> =
                step.runners_up.iter().take(3).map(|(name, _)| format!("`{name}`")).collect();
            table.row([
                format!("`{}`", step.effect),
                significant(step.rms_N, 3),
                step.held_out_rms_N.map_or_else(|| "–".to_owned(), |e| significant(e, 3)),
                significant(step.p, 2),
                competitors.join(", "),
            ]);
        }
        section.table(table);
    }
    let named = |effect: &str| d.missing.iter().any(|m| m.effect == effect);
    let mut considered: Vec<_> = d.considered.iter().filter(|c| !named(&c.effect)).collect();
    considered.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut table = Table::new("Effects not named", &["effect", "share explained alone (%)", "reason"]);
    for c in considered {
        table.row([format!("`{}`", c.effect), fixed(100.0 * c.gain, 1), wording::why_not(c)]);
    }
    section.table(table);
    section
}
