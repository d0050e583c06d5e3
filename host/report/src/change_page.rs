//! The report of a diagnosis against a reference: what has changed, in pictures.

use super::{Axis, Colour, Figure, Page, Panel, Section, Table, Tone, fixed, significant};
use pam_data::recording::Campaign;
use pam_diagnose::reference::answer::Curve;
use pam_diagnose::reference::{ChangeReport, Verdict};

use super::wording::{change as wording, separate};

/// Panels in one picture, at most.
const MOST_PANELS: usize = 6;

/// Causes in the picture of probabilities, at most, and the least probability of one that is shown on its own.
const MOST_BARS: usize = 8;
const LEAST_BAR: f64 = 0.01;

/// The page of a comparison; `after` gives the recordings' names.
#[must_use]
pub fn page(r: &ChangeReport, after: &Campaign) -> Page {
    let whom = r.muscle.clone().unwrap_or_else(|| "this actuator".into());
    let mut page = Page::new(
        format!("What changed in {whom}"),
        format!(
            "{} rows after, {} before, largest force {} N",
            fixed(r.samples as f64, 0),
            fixed(r.reference.samples as f64, 0),
            significant(r.largest_force_N, 3)
        ),
    );
    header(&mut page, r);
    page.push(changes(r));
    page.push(probabilities(r));
    page.push(forces(r));
    page.push(differences(r));
    page.push(located(r));
    page.push(unseen_sizes(r));
    page.push(limits(r));
    page.recordings(after);
    for file in &r.reference.files {
        page.origin("reference", file);
    }
    if let Some(table) = &r.reference.table {
        page.origin("reference", table);
    }
    page.origin("made by", format!("host {}", env!("CARGO_PKG_VERSION")));
    page
}

fn header(page: &mut Page, r: &ChangeReport) {
    let tone = match r.verdict {
        Verdict::Consistent => Tone::Good,
        Verdict::Explained | Verdict::PartlyExplained => Tone::Caution,
        Verdict::Unexplained => Tone::Bad,
    };
    page.verdict(tone, wording::headline(r));
    let share = 100.0 * r.misfit_rms_N / r.largest_force_N.max(f64::MIN_POSITIVE);
    page.fact(
        "difference",
        format!("{} N", significant(r.misfit_rms_N, 2)),
        format!("{} % of the largest force, rms", significant(share, 2)),
        tone,
    );
    page.fact(
        "untouched recordings differ by",
        format!("{} N", significant(r.noise_N, 2)),
        "one cell, standard deviation",
        Tone::Plain,
    );
    if r.shows_in_force() {
        let h = &r.held_out;
        page.fact(
            "on held-out recordings",
            format!("{} → {} N", significant(h.rms_before_N, 2), significant(h.rms_after_N, 2)),
            "difference without and with the named changes",
            if h.rms_after_N < h.rms_before_N { Tone::Good } else { Tone::Bad },
        );
    }
}

fn changes(r: &ChangeReport) -> Section {
    let mut section = Section::new("What changed, and what to do").summarised();
    for m in &r.missing {
        section.text(format!(
            "*{}* ({}): {}. Probability {}, of its class {}. Law: {}. Since when: {}. It is {}.",
            m.effect,
            wording::sizes(&m.parameters),
            wording::remedy(m.change),
            fixed(m.probability, 2),
            fixed(m.class_probability, 2),
            m.change.about().changed.law,
            wording::since(&m.since),
            wording::owner(m.owner)
        ));
        if !m.confusable_with.is_empty() {
            section.text(format!(
                "These recordings cannot distinguish it from {}.",
                m.confusable_with.join(", ")
            ));
        }
        let apart = separate::of_change(m);
        if !apart.is_empty() {
            section.text(format!("To separate them: {}.", apart.join("; ")));
        }
    }
    if r.missing.is_empty() {
        section.text(wording::headline(r));
    }
    if let Some((names, apart)) = separate::of_unnamed(r) {
        section.text(format!("It is one of {}. To separate them: {}.", names.join(", "), apart.join("; ")));
    }
    section.list(r.remarks.iter().map(wording::remark));
    section
}

fn probabilities(r: &ChangeReport) -> Section {
    let mut section = Section::new("How probable each cause is");
    // The labels of all causes of the catalogue cannot be read beside each other.
    let kept = r.probabilities.iter().take(MOST_BARS).filter(|p| p.probability >= LEAST_BAR).count();
    let mut names: Vec<String> = r.probabilities[..kept].iter().map(|p| p.cause.clone()).collect();
    let mut y: Vec<f64> = r.probabilities[..kept].iter().map(|p| p.probability).collect();
    let others = &r.probabilities[kept..];
    if !others.is_empty() {
        names.push(format!("{} others", others.len()));
        y.push(others.iter().map(|p| p.probability).sum());
    }
    let x: Vec<f64> = (0..names.len()).map(|i| i as f64).collect();
    let panel = Panel::new(Axis::names("cause", names), Axis::new("probability", "").range(0.0, 1.0)).bars(
        "",
        Colour::Series(0),
        &x,
        &y,
    );
    section.figure(Figure::new(
        "probabilities",
        "Probability of each cause",
        "Before any other change is taken out. Above one half a class of causes is named.",
        panel,
    ));
    section
}

fn shown(r: &ChangeReport) -> &[Curve] {
    &r.curves[..r.curves.len().min(MOST_PANELS)]
}

/// The ways of motion, in the order of the curves.
fn ways(r: &ChangeReport) -> [&'static str; 2] {
    if r.abscissa.1 == "kPa" {
        ["filling", "emptying"]
    } else {
        ["growing displacement", "shrinking displacement"]
    }
}

fn forces(r: &ChangeReport) -> Section {
    let mut section = Section::new("Force before and after");
    let panels: Vec<Panel> = shown(r)
        .iter()
        .map(|c| {
            let mut panel =
                Panel::new(Axis::new(r.abscissa.0, r.abscissa.1), Axis::new("force F", "N")).titled(&c.title);
            for (side, way) in ways(r).into_iter().enumerate() {
                let colour = Colour::Series(side);
                panel = panel.line(format!("before, {way}"), colour, &c.at, &c.before[side]).points(
                    format!("after, {way}"),
                    colour,
                    &c.at,
                    &c.after[side],
                );
            }
            panel
        })
        .collect();
    if !panels.is_empty() {
        section.figure(Figure::multiples(
            "forces",
            "Force before (lines) and after (points)",
            "Where the points leave the lines something differs; the next picture shows by how much.",
            panels,
        ));
    }
    section
}

fn differences(r: &ChangeReport) -> Section {
    let mut section = Section::new("The difference and its explanation");
    let panels: Vec<Panel> = shown(r)
        .iter()
        .map(|c| {
            let mut panel = Panel::new(Axis::new(r.abscissa.0, r.abscissa.1), Axis::new("difference", "N"))
                .titled(&c.title);
            for (side, way) in ways(r).into_iter().enumerate() {
                let colour = Colour::Series(side);
                panel = panel.points(way, colour, &c.at, &c.difference[side]);
                if !r.missing.is_empty() {
                    panel = panel.line(format!("explained, {way}"), colour, &c.at, &c.explained[side]);
                }
            }
            panel
        })
        .collect();
    if !panels.is_empty() {
        section.figure(Figure::multiples(
            "differences",
            "After minus what was to be expected",
            "Points: the difference beyond the trend of the recordings before. Lines: what the named changes add.",
            panels,
        ));
    }
    section
}

fn located(r: &ChangeReport) -> Section {
    let mut section = Section::new("Where it is");
    if r.r#where.is_empty() {
        section.text("No part of the data holds more of the difference than its share.");
    }
    section.list(r.r#where.iter().map(wording::place));
    section
}

fn unseen_sizes(r: &ChangeReport) -> Section {
    let mut section = Section::new("What else could be hidden");
    let mut table = Table::new(
        "Changes that are not named",
        &["change", "probability", "would have been seen from", "why not"],
    );
    for c in &r.considered {
        table.row([
            c.effect.clone(),
            fixed(c.gain, 2),
            c.detectable.map_or_else(|| "–".into(), |d| wording::in_usual_unit(d, &c.unit)),
            wording::why_not(c.why_not).into(),
        ]);
    }
    section.table(table);
    section
}

fn limits(r: &ChangeReport) -> Section {
    let mut section = Section::new("What could not be compared");
    if r.reference.not_comparable.is_empty() {
        section.text("Everything that was recorded after was compared.");
    }
    section.list(r.reference.not_comparable.iter().map(wording::not_comparable));
    section
}
