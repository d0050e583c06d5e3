//! The report of a diagnosis, for an engineer who has never heard of the effect.

mod history;
mod located;

use model_core::braid::Geometry;
use model_core::units::Length;

use super::effect_page::place;
use super::effect_trace::Demonstration;
use super::letters::letters;
use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, figures, fixed};
use pam_data::recording::Campaign;
use pam_diagnose::history::is_from_history;
use pam_diagnose::verdict::{Diagnosis, Missing, Verdict};
use pam_fit::bench::Candidate;

/// The page of a diagnosis. `geometry` is that of the muscle at rest, to say what a force means in pressure; `campaign` gives the
/// recordings' names.
#[must_use]
pub fn page(d: &Diagnosis, geometry: &Geometry, campaign: &Campaign) -> Page {
    let mut page = Page::new(
        format!("Diagnosis of {}", d.muscle),
        if d.judged {
            format!("{} rows, blocked force {} N", fixed(d.samples as f64, 0), figures(d.blocked_force_N, 3))
        } else {
            format!("{} rows", fixed(d.samples as f64, 0))
        },
    );
    head(&mut page, d);
    page.push(wrong(d));
    page.push(history::section(d.history.as_ref()));
    page.push(located::section(d));
    for missing in &d.missing {
        page.push(what_it_is(d, missing));
    }
    page.push(alternatives(d));
    page.push(controller(d, geometry));
    page.push(unseen(d));
    page.push(remains(d));
    page.push(next(d));
    page.push(looked_at(d));
    page.recordings(campaign);
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

fn names(d: &Diagnosis) -> String {
    let names: Vec<String> = d.missing.iter().map(|m| format!("`{}`", m.effect)).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

/// Which of the names stand for several effects that the recordings cannot tell apart.
fn in_doubt(d: &Diagnosis) -> String {
    let open: Vec<String> = d
        .missing
        .iter()
        .filter(|m| !m.confusable_with.is_empty() && !m.given)
        .map(|m| format!("`{}` (right with {} %)", m.effect, fixed(100.0 * m.probability, 0)))
        .collect();
    if open.is_empty() {
        return String::new();
    }
    format!(
        " Instead of {} it could be others, which these recordings cannot tell apart.",
        open.join(" and ")
    )
}

fn percent(part: f64, whole: f64) -> String {
    if whole > 0.0 { figures(100.0 * part / whole, 2) } else { "–".into() }
}

fn head(page: &mut Page, d: &Diagnosis) {
    let (tone, words) = match d.verdict {
        Verdict::Consistent if !d.judged => {
            (Tone::Caution, "These recordings say nothing about the model: nothing could be judged.".to_owned())
        }
        Verdict::Consistent => (
            Tone::Good,
            "Model and recordings agree: nothing stands above the noise and the model's own inexactness.".to_owned(),
        ),
        Verdict::Explained => (Tone::Caution, format!("The model lacks {}, which explains what it misses.", names(d))),
        Verdict::PartlyExplained => {
            (Tone::Caution, format!("The model lacks {}, which explains a part of what it misses.", names(d)))
        }
        Verdict::Unexplained => (
            Tone::Bad,
            "The model leaves something out that none of the known effects describes well enough to be named.".to_owned(),
        ),
    };
    page.verdict(tone, words + &in_doubt(d));
    if !d.judged {
        return;
    }
    page.fact(
        "misfit of the plain model",
        format!("{} N", figures(d.misfit_rms_N, 2)),
        format!("{} % of blocked force", percent(d.misfit_rms_N, d.blocked_force_N)),
        if d.verdict == Verdict::Consistent { Tone::Good } else { Tone::Caution },
    );
    page.fact("noise", format!("{} N", figures(d.noise_N, 2)), "no model can do better", Tone::Plain);
    if !d.missing.is_empty() {
        let h = &d.held_out;
        let better = h.rms_after_N < h.rms_before_N;
        page.fact(
            "on unseen rows",
            format!("{} → {} N", figures(h.rms_before_N, 2), figures(h.rms_after_N, 2)),
            "error before and after",
            if better { Tone::Good } else { Tone::Bad },
        );
    }
    if d.verdict != Verdict::Consistent {
        page.fact(
            "left unexplained",
            format!("{} %", fixed(100.0 * d.unexplained.share, 0)),
            "of the misfit above noise",
            if d.unexplained.share < 0.2 { Tone::Good } else { Tone::Caution },
        );
    }
}

fn wrong(d: &Diagnosis) -> Section {
    let mut section = Section::new(if d.judged { "What is wrong" } else { "Why" }).summarised();
    if !d.judged {
        section.list(d.remarks.iter().cloned());
        return section;
    }
    let relation = if d.noise_N > 0.0 { d.misfit_rms_N / d.noise_N } else { 0.0 };
    section.text(format!(
        "The plain model, with its tables free over pressure, misses the measured force by {} N (root mean square); the \
         recordings themselves repeat to {} N{}.",
        figures(d.misfit_rms_N, 2),
        figures(d.noise_N, 2),
        if relation > 1.3 {
            format!(", so the misfit is {} times what chance gives", figures(relation, 2))
        } else {
            String::new()
        }
    ));
    section.list(d.remarks.iter().cloned());
    section
}

fn what_it_is(d: &Diagnosis, m: &Missing) -> Section {
    let mut section = Section::new(format!("What it is: {}", m.effect)).summarised();
    section.text(m.summary.clone());
    // The history's law is told in its own chapter: the catalogue's equation of that name is another.
    let candidate = Candidate::from_name(&m.effect).filter(|_| !is_from_history(m));
    let whose = if m.correction { "It is the bench's, not the muscle's." } else { "It is the muscle's." };
    let place = candidate.map_or(m.place.as_str(), |c| place(c.info().link));
    section.text(format!(
        "It acts on {place}. {whose} In these recordings it makes up to {} N, {} % of the blocked force.",
        figures(m.peak_N, 2),
        percent(m.peak_N, d.blocked_force_N)
    ));
    if let Some(candidate) = candidate {
        section.listing(candidate.info().equation);
        section.table(letters(candidate.info()));
    }
    let mut table = Table::new(
        "Its parameters, in SI units",
        &["letter", "parameter", "value", "± (95 %)", "unit", "remark"],
    );
    for p in &m.parameters {
        let std = p.std.map_or("not determined".into(), |s| figures(1.96 * s, 2));
        let unit = if p.unit.is_empty() { "–".to_owned() } else { p.unit.clone() };
        let remark = if p.outside_known_range { "outside the range known from the literature" } else { "" };
        let letter = candidate
            .and_then(|c| c.info().parameters.iter().find(|i| i.name == p.name))
            .map_or("–", |i| i.letter);
        table.row([letter.to_owned(), p.name.clone(), figures(p.value, 3), std, unit, remark.into()]);
    }
    section.table(table);
    section.text(if m.given {
        format!("*What the recordings say of it:* {}.", m.why)
    } else {
        format!(
            "*Why we think so:* {}. The name is right with a probability of {} %.",
            m.why,
            fixed(100.0 * m.probability, 0)
        )
    });
    if let Some(candidate) = candidate
        && let Ok(demonstration) = Demonstration::new()
    {
        let trace = demonstration.run(candidate);
        if trace.force.iter().any(|f| *f != 0.0) {
            let mut figure = demonstration.figure(&trace);
            figure.title = format!("What {} looks like on another muscle, by itself", m.effect);
            section.figure(figure);
        }
    }
    section.text(format!("Source: {}", m.source));
    section
}

fn alternatives(d: &Diagnosis) -> Section {
    let mut section = Section::new("What else it could be").summarised();
    for m in &d.missing {
        if m.confusable_with.is_empty() {
            section.text(format!("Nothing else in the catalogue leaves the same trace as `{}`.", m.effect));
        } else {
            let others: Vec<String> = m.confusable_with.iter().map(|c| format!("`{c}`")).collect();
            section.text(format!("Instead of `{}` it could be {}.", m.effect, others.join(", ")));
        }
        let mut odds: Vec<(String, f64)> = vec![(m.effect.clone(), m.probability)];
        let others = m.confusable_with.iter().filter_map(|c| d.considered.iter().find(|k| k.effect == *c));
        odds.extend(others.map(|c| (c.effect.clone(), c.gain)));
        if odds.len() > 1 {
            let mut table = Table::new(
                "How much of the misfit each would take by itself",
                &["effect", "share of the misfit above noise (%)"],
            );
            for (i, (name, gain)) in odds.iter().enumerate() {
                let share = if i == 0 { m.share_explained } else { *gain };
                table.row([format!("`{name}`"), fixed(100.0 * share, 0)]);
            }
            section.table(table);
        }
    }
    if d.missing.is_empty() && d.verdict == Verdict::Unexplained {
        section.text(
            "No effect of the catalogue takes enough of the misfit to be named. A wrong name would be worse than none: it \
             would put wrong physics into the controller.",
        );
    }
    section
}

fn controller(d: &Diagnosis, geometry: &Geometry) -> Section {
    let mut section = Section::new("What it changes in the controller").summarised();
    let area = geometry.build().ok().map(|b| b.posture(Length::ZERO).area).filter(|a| *a > 0.0);
    for m in &d.missing {
        if is_from_history(m) {
            section.text(format!(
                "`{}`: nothing yet. In these recordings it makes up to {} N ({} % of blocked force); it was found at held length, and no table \
                 carries this law.",
                m.effect,
                figures(m.peak_N, 2),
                percent(m.peak_N, d.blocked_force_N)
            ));
            continue;
        }
        if m.correction {
            section.text(format!(
                "`{}`: nothing. It is an error of the bench; it is taken out of the recordings before the table is fitted, and the \
                 controller is sent the muscle only.",
                m.effect
            ));
            continue;
        }
        let mut text = format!(
            "`{}`: the feed-forward force changes by up to {} N ({} % of blocked force)",
            m.effect,
            figures(m.peak_N, 2),
            percent(m.peak_N, d.blocked_force_N)
        );
        if let Some(area) = area {
            text += &format!(
                ", so at rest length the commanded pressure changes by up to {} kPa",
                figures(m.peak_N / area / 1e3, 2)
            );
        }
        text.push('.');
        if let Some(info) = Candidate::from_name(&m.effect).map(Candidate::info) {
            if info.persistent {
                text += " It remembers: the controller keeps its memory over a power cycle.";
            }
            if info.depends_on_pressure {
                text +=
                    " Its force depends on the pressure, so the controller solves for the pressure with it.";
            }
        }
        section.text(text);
    }
    if d.missing.is_empty() && d.verdict != Verdict::Consistent {
        section.text("Nothing: without a name nothing is added to the table.");
    }
    section
}

fn unseen(d: &Diagnosis) -> Section {
    let mut section = Section::new("Before and after, on rows the fit had not seen").summarised();
    if d.missing.is_empty() {
        return section;
    }
    let h = &d.held_out;
    section.text(format!("Held out: {}.", h.split));
    let names = ["before", "after", "before, turns included", "after, turns included", "noise"];
    let values = [h.rms_before_N, h.rms_after_N, h.with_turns_before_N, h.with_turns_after_N, h.noise_N];
    let places: Vec<f64> = (0..names.len()).map(|i| i as f64).collect();
    let panel = Panel::new(
        Axis::new("error on unseen rows, root mean square", "N").from_zero(),
        Axis::names("", names.map(String::from).to_vec()),
    )
    .bars("", Colour::Series(0), &values, &places);
    section.figure(Figure::new(
        "unseen",
        "Error on unseen rows",
        "After should come close to the noise; no model can go below it.",
        panel,
    ));
    if !(h.rms_after_N < h.rms_before_N) {
        section.notice(
            Tone::Bad,
            "The effect does not help on unseen rows: do not use the table that carries it.",
        );
    }
    section
}

fn remains(d: &Diagnosis) -> Section {
    let mut section = Section::new("What remains").summarised();
    if d.verdict != Verdict::Consistent {
        section.text(format!(
            "{} % of the misfit above noise stays without a name{}.",
            fixed(100.0 * d.unexplained.share, 0),
            if d.unexplained.pattern == "none" {
                ", without a pattern".to_owned()
            } else {
                format!("; its pattern: {}", d.unexplained.pattern)
            }
        ));
    }
    if !d.judged {
        return section;
    }
    let hidden: Vec<String> = d
        .considered
        .iter()
        .filter_map(|c| match c.hidden_up_to_N {
            Some(h) if h <= 0.02 * d.blocked_force_N => None,
            Some(h) => Some(format!("`{}` up to {} N", c.effect, figures(h, 2))),
            None => Some(format!("`{}` of any size", c.effect)),
        })
        .collect();
    if !hidden.is_empty() {
        section.text(format!(
            "These recordings could hide, because the tables imitate it or nothing excites it: {}.",
            hidden.join(", ")
        ));
    }
    section
}

fn next(d: &Diagnosis) -> Section {
    let mut section = Section::new("What to record next").summarised();
    if let Some(n) = &d.next_experiment {
        let separates: Vec<String> = n.separates.iter().map(|s| format!("`{s}`")).collect();
        section.text(format!(
            "{}. It would tell {} apart, by up to {} N.",
            sentence(&n.words),
            separates.join(" and "),
            figures(n.expected_difference_N, 2)
        ));
        if !n.protocol.is_empty() {
            section.listing(n.protocol.clone());
        }
    } else if d.judged && d.verdict == Verdict::Consistent {
        section.text("Nothing more is needed for what these recordings cover.");
    }
    section
}

/// Words as the beginning of a sentence, without its end.
fn sentence(words: &str) -> String {
    let mut letters = words.trim_end_matches('.').chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn looked_at(d: &Diagnosis) -> Section {
    let mut section = Section::new("All that was looked at");
    if !d.judged {
        return section;
    }
    if !d.path.is_empty() {
        let mut table = Table::new(
            "Step by step: what was taken, and what came next",
            &["taken", "misfit after it (N)", "chance (p)", "runners-up"],
        );
        for step in &d.path {
            let rivals: Vec<String> =
                step.runners_up.iter().take(3).map(|(name, _)| format!("`{name}`")).collect();
            table.row([
                format!("`{}`", step.effect),
                figures(step.rms_N, 3),
                figures(step.p, 2),
                rivals.join(", "),
            ]);
        }
        section.table(table);
    }
    let mut considered: Vec<_> = d.considered.iter().collect();
    considered.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut table = Table::new("Effects that are not named, and why", &["effect", "gain (%)", "why not"]);
    for c in considered {
        table.row([format!("`{}`", c.effect), fixed(100.0 * c.gain, 1), c.why_not.clone()]);
    }
    section.table(table);
    section
}
