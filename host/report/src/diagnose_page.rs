//! The report of a diagnosis, for an engineer who does not know the effect.

mod history;
mod located;
mod open_questions;

use model_core::braid::Geometry;
use model_core::units::Length;
use pam_data::statistics::NORMAL_95;

use super::effect_page::place;
use super::effect_trace::Demonstration;
use super::symbols::symbols;
use super::wording;
use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed, significant};
use pam_data::recording::Campaign;
use pam_diagnose::history::is_from_history;
use pam_diagnose::remark::Remark;
use pam_diagnose::verdict::{Diagnosis, Missing, Verdict};
use pam_fit::RecordingResidual;
use pam_fit::bench::Candidate;

/// The page of a diagnosis. `geometry` is that of the muscle at rest, to say what a force means in pressure; `campaign` gives the
/// recordings' names.
#[must_use]
pub fn page(d: &Diagnosis, geometry: &Geometry, campaign: &Campaign) -> Page {
    page_with_residuals(d, geometry, campaign, &[])
}

/// As [`page`], with the residuals by recording of the table without effects.
#[must_use]
pub fn page_with_residuals(
    d: &Diagnosis,
    geometry: &Geometry,
    campaign: &Campaign,
    residuals: &[RecordingResidual],
) -> Page {
    let mut page = Page::new(
        format!("Diagnosis of {}", d.muscle),
        if d.judged() {
            format!(
                "{} rows, blocked force {} N",
                fixed(d.samples as f64, 0),
                significant(d.blocked_force_N, 3)
            )
        } else {
            format!("{} rows", fixed(d.samples as f64, 0))
        },
    );
    header(&mut page, d);
    page.push(recommendation(d));
    page.push(history::section(d.history.as_ref()));
    page.push(located::section(d, residuals));
    for missing in &d.missing {
        page.push(what_it_is(d, missing));
    }
    page.push(alternatives(d));
    page.push(controller(d, geometry));
    page.push(unseen(d));
    page.push(open_questions::remains(d));
    page.push(open_questions::next(d));
    page.push(open_questions::considered(d));
    page.recordings(campaign);
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

/// Which of the names represent several effects that the recordings cannot distinguish.
fn in_doubt(d: &Diagnosis) -> String {
    let open: Vec<String> = d
        .missing
        .iter()
        .filter(|m| !m.confusable_with.is_empty() && !m.given)
        .map(|m| format!("`{}` (probability {} %)", m.effect, fixed(100.0 * m.probability, 0)))
        .collect();
    if open.is_empty() {
        return String::new();
    }
    format!(" These recordings do not distinguish {} from other effects, listed below.", open.join(" and "))
}

fn percent(part: f64, whole: f64) -> String {
    if whole > 0.0 { significant(100.0 * part / whole, 2) } else { "–".into() }
}

fn header(page: &mut Page, d: &Diagnosis) {
    let tone = match d.verdict() {
        Verdict::Consistent if d.judged() && !wording::one_bladder_misfits(d) => Tone::Good,
        Verdict::Unexplained => Tone::Bad,
        Verdict::Consistent | Verdict::Explained | Verdict::PartlyExplained => Tone::Caution,
    };
    page.verdict(tone, wording::verdict(d) + &in_doubt(d));
    if !d.judged() {
        return;
    }
    page.fact(
        "error of the plain model",
        format!("{} N", significant(d.misfit_rms_N, 2)),
        format!(
            "rms, {} % of blocked force; the noise is {} N",
            percent(d.misfit_rms_N, d.blocked_force_N),
            significant(d.noise_N, 2)
        ),
        if d.verdict() == Verdict::Consistent && !wording::one_bladder_misfits(d) {
            Tone::Good
        } else {
            Tone::Caution
        },
    );
    if !d.missing.is_empty() {
        let h = &d.held_out;
        let tone = match d.verdict() {
            _ if h.rms_after_N >= h.rms_before_N => Tone::Bad,
            Verdict::Explained => Tone::Good,
            _ => Tone::Caution,
        };
        page.fact(
            "error on held-out rows",
            format!("{} → {} N", significant(h.rms_before_N, 2), significant(h.rms_after_N, 2)),
            "rms, without and with the effects",
            tone,
        );
    }
    if d.verdict() != Verdict::Consistent {
        page.fact(
            "unexplained",
            format!("{} %", fixed(100.0 * d.unexplained.share, 0)),
            wording::unexplained_base(d),
            if d.unexplained.share < 0.2 && d.verdict() == Verdict::Explained {
                Tone::Good
            } else {
                Tone::Caution
            },
        );
    }
}

/// What to do now, and what limits the answer.
fn recommendation(d: &Diagnosis) -> Section {
    let mut section = Section::new("What to do").summarised();
    let (bench, muscle): (Vec<&Missing>, Vec<&Missing>) = d.missing.iter().partition(|m| m.correction);
    let names =
        |all: &[&Missing]| wording::list(&all.iter().map(|m| format!("`{}`", m.effect)).collect::<Vec<_>>());
    let mut steps = Vec::new();
    if !d.judged() {
        steps.push("Correct what the remarks name, and record again.".to_owned());
    } else if d.missing.is_empty() && d.verdict() == Verdict::Consistent && wording::one_bladder_misfits(d) {
        steps.push(
            "Use the table of `host fit` at the tested pressures only, with the error that it states: one bladder does not describe all \
             pressures. The remarks name what could be the cause."
                .to_owned(),
        );
    } else if d.missing.is_empty() && d.verdict() == Verdict::Consistent {
        steps.push(
            "Use the table of `host fit`: it describes these recordings within their noise.".to_owned(),
        );
    } else if wording::only_first_runs_differ(d) {
        steps.push(
            "Use the table that `host diagnose -o` writes: it is fitted to the runs that follow the first of each mounting. Before you use \
             the muscle at another length, fill it several times."
                .to_owned(),
        );
    } else if d.missing.is_empty() {
        steps.push(
            "Use the table of `host fit`, with the error above. See below where the model is wrong."
                .to_owned(),
        );
    }
    if d.remarks.iter().any(|r| matches!(r, Remark::Dimensions(_))) {
        steps.push(
            "Measure the dimensions of the muscle first: other ones would leave nothing to explain."
                .to_owned(),
        );
    }
    if let Some(n) = &d.next_experiment {
        let proposal = wording::sentence(&wording::proposal(&n.proposal));
        steps.push(match n.proposal.motion_separates {
            true => format!("Record the next experiment: {proposal}"),
            false => proposal,
        });
    }
    if !bench.is_empty() {
        steps.push(format!(
            "Correct the bench: {}. Until then `host diagnose … -o T2.pam` corrects the recordings.",
            names(&bench)
        ));
    }
    let memory: Vec<&Missing> = muscle.iter().copied().filter(|m| is_from_history(m)).collect();
    if !memory.is_empty() {
        steps.push(format!(
            "Vent the muscle for an hour, then repeat a run at the same mounting: it shows how {} recovers.",
            names(&memory)
        ));
    }
    if !muscle.is_empty() {
        steps.push(format!(
            "Take the table with {} that `host diagnose … -o T2.pam` writes, and check it on new recordings with `host predict`.",
            names(&muscle)
        ));
    }
    section.list(steps);
    let remarks: Vec<String> = d.remarks.iter().map(|r| wording::sentence(&wording::remark(r))).collect();
    if !remarks.is_empty() {
        section.text("Remarks on these recordings:");
        section.list(remarks);
    }
    section
}

fn what_it_is(d: &Diagnosis, m: &Missing) -> Section {
    let mut section = Section::new(format!("Effect: {}", m.effect)).summarised();
    section.text(m.summary.clone());
    // The law of the history has a section of its own: the catalogue's equation of that name is another.
    let candidate = Candidate::from_name(&m.effect).filter(|_| !is_from_history(m));
    let whose = if m.correction {
        "It is an error of the bench, not of the muscle."
    } else {
        "It belongs to the muscle."
    };
    let place = place(m.place);
    section.text(format!(
        "It acts on {place}. {whose} Its largest force in these recordings is {} N, {} % of the blocked force.",
        significant(m.peak_N, 2),
        percent(m.peak_N, d.blocked_force_N)
    ));
    if let Some(candidate) = candidate {
        section.listing(candidate.info().equation);
        section.table(symbols(candidate.info()));
    }
    let mut table = Table::new(
        "Parameters in SI units, with the half-width of the 95 % confidence interval",
        &["symbol", "parameter", "value", "± (95 %)", "unit", "remark"],
    );
    for p in &m.parameters {
        let std = p.std.map_or("not identifiable".into(), |s| significant(NORMAL_95 * s, 2));
        let unit = if p.unit.is_empty() { "–".to_owned() } else { p.unit.clone() };
        // Of alternative laws those that were not chosen are zero.
        let (std, remark) = match p {
            p if p.value == 0.0 => ("–".to_owned(), "not used"),
            p if p.std == Some(0.0) => ("–".to_owned(), "fixed"),
            p if p.outside_known_range => (std, "outside the published range"),
            _ => (std, ""),
        };
        let symbol = candidate
            .and_then(|c| c.info().parameters.iter().find(|i| i.name == p.name))
            .map_or("–", |i| i.symbol);
        table.row([symbol.to_owned(), p.name.clone(), significant(p.value, 3), std, unit, remark.into()]);
    }
    section.table(table);
    if let Some(traded) = wording::traded_off(m) {
        section.text(wording::sentence(traded));
    }
    section.text(if m.given {
        format!("*Evidence:* {}.", wording::why(&m.why))
    } else {
        format!(
            "*Evidence:* {}. Probability that the name is right: {} %.",
            wording::why(&m.why),
            fixed(100.0 * m.probability, 0)
        )
    });
    if let Some(candidate) = candidate
        && let Ok(demonstration) = Demonstration::new()
    {
        let trace = demonstration.run(candidate);
        if trace.force.iter().any(|f| *f != 0.0) {
            let mut figure = demonstration.figure(&trace);
            figure.title = format!("{} alone, on an example muscle", m.effect);
            section.figure(figure);
        }
    }
    section.text(format!("Source: {}", m.source));
    section
}

fn alternatives(d: &Diagnosis) -> Section {
    let mut section = Section::new("Alternatives").summarised();
    for m in &d.missing {
        if m.confusable_with.is_empty() {
            section.text(format!(
                "These recordings distinguish `{}` from all other effects of the library.",
                m.effect
            ));
        } else {
            let others: Vec<String> = m.confusable_with.iter().map(|c| format!("`{c}`")).collect();
            section.text(format!(
                "These recordings do not distinguish `{}` from {}.",
                m.effect,
                others.join(", ")
            ));
        }
        let mut odds: Vec<(String, f64)> = vec![(m.effect.clone(), m.probability)];
        let others = m.confusable_with.iter().filter_map(|c| d.considered.iter().find(|k| k.effect == *c));
        odds.extend(others.map(|c| (c.effect.clone(), c.gain)));
        // The share of a memory is one of unseen runs; those of the others are of the recordings without it.
        if odds.len() > 1 && !is_from_history(m) {
            let mut table = Table::new(
                "Share of the excess error that each explains alone",
                &["effect", "share of the excess error (%)"],
            );
            for (i, (name, gain)) in odds.iter().enumerate() {
                let share = if i == 0 { m.share_explained } else { *gain };
                table.row([format!("`{name}`"), fixed(100.0 * share, 0)]);
            }
            section.table(table);
        }
    }
    if d.missing.is_empty() && d.verdict() == Verdict::Unexplained {
        section.text(
            "No effect of the library explains enough of the excess error to be named. A wrong name would put wrong physics \
             into the controller, so none is given.",
        );
    }
    section
}

fn controller(d: &Diagnosis, geometry: &Geometry) -> Section {
    let mut section = Section::new("Changes in the controller").summarised();
    let area = geometry.build().ok().map(|b| b.posture(Length::ZERO).area).filter(|a| *a > 0.0);
    for m in &d.missing {
        if is_from_history(m) {
            section.text(format!(
                "`{}`: a table of these recordings carries it where they are then predicted better (`-o`). It makes up to {} N ({} % of blocked \
                 force) in them. It was found at held length; under motion it is a prediction.",
                m.effect,
                significant(m.peak_N, 2),
                percent(m.peak_N, d.blocked_force_N)
            ));
            continue;
        }
        if m.correction {
            section.text(format!(
                "`{}`: none. It is an error of the bench: the recordings are corrected for it before the table is fitted.",
                m.effect
            ));
            continue;
        }
        let mut text = format!(
            "`{}`: the feed-forward force changes by up to {} N ({} % of blocked force)",
            m.effect,
            significant(m.peak_N, 2),
            percent(m.peak_N, d.blocked_force_N)
        );
        if let Some(area) = area {
            text += &format!(
                ", so at rest length the commanded pressure changes by up to {} kPa",
                significant(m.peak_N / area / 1e3, 2)
            );
        }
        text.push('.');
        if let Some(info) = Candidate::from_name(&m.effect).map(Candidate::info) {
            if info.persistent {
                text += " It has a memory, which the controller keeps over a power cycle.";
            }
            if info.depends_on_pressure {
                text += " Its force depends on pressure, so the controller includes it when it solves for the pressure.";
            }
        }
        section.text(text);
    }
    if d.missing.is_empty() && d.verdict() != Verdict::Consistent {
        section.text("None: without a named effect nothing is added to the table.");
    }
    section
}

fn unseen(d: &Diagnosis) -> Section {
    let mut section = Section::new("Error on held-out rows").summarised();
    if d.missing.is_empty() {
        return section;
    }
    let h = &d.held_out;
    section.text(format!("Held out: {}.", wording::split(h.split)));
    let names = ["without", "with", "without, reversals included", "with, reversals included", "noise"];
    let values = [h.rms_before_N, h.rms_after_N, h.with_turns_before_N, h.with_turns_after_N, h.noise_N];
    let places: Vec<f64> = (0..names.len()).map(|i| i as f64).collect();
    let panel = Panel::new(
        Axis::new("error on held-out rows, rms", "N").from_zero(),
        Axis::names("", names.map(String::from).to_vec()),
    )
    .bars("", Colour::Series(0), &values, &places);
    section.figure(Figure::new(
        "unseen",
        "Error on held-out rows without and with the named effects",
        "In a good model, the error with the effects comes close to the noise, which is the least possible error.",
        panel,
    ));
    if !(h.rms_after_N < h.rms_before_N) {
        section.notice(
            Tone::Bad,
            "The effects do not reduce the error on held-out rows. Do not use a table with them.",
        );
    }
    section
}
