//! The thesis's models and the table side by side: errors, load lines, error against contraction.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, Table, significant};
use super::held_length;
use super::loads::{PANELS, contraction_axis};
use super::view::View;

/// The models of the thesis and the table, side by side.
pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Comparison of models").summarised();
    let s = &view.fit.summary;
    let mut table = Table::new(
        "Error of the mid-line in percent of blocked force",
        &["model", "mean", "largest", "fitted parameters"],
    );
    for model in &s.models {
        let cells = [model.mean_error_pct, model.max_error_pct].map(error);
        table.row([
            format!("`{}`", model.name),
            cells[0].clone(),
            cells[1].clone(),
            what(&model.name).into(),
        ]);
    }
    section.table(table);
    if view.held_length() {
        section.figure(held_length::each_model(view));
        section.figure(held_length::models(view));
        section.figure(held_length::errors(view));
    } else {
        section.figure(each(view));
        section.figure(against_midline(view));
        section.figure(error_lines(view));
    }
    section
}

/// An error in percent; beyond ten times the blocked force its digits carry nothing.
fn error(percent: f64) -> String {
    if percent <= 1e3 { significant(percent, 2) } else { "> 1000".to_owned() }
}

/// A model's forces with gaps where they are far beyond what was measured: one model that fails must not set the scale of all.
pub(super) fn within_reach(view: &View<'_>, force: &[f64]) -> Vec<f64> {
    /// How far above and below the measured forces a model is drawn, as a share of their range.
    const FAR: f64 = 0.5;
    let fold = |m: (f64, f64), p: &pam_fit::MidPoint| (m.0.min(p.force), m.1.max(p.force));
    let (low, high) = view.fit.midline.iter().fold((0.0, 0.0), fold);
    let room = FAR * (high - low);
    let drawn = |f: &f64| if *f >= low - room && *f <= high + room { *f } else { f64::NAN };
    force.iter().map(drawn).collect()
}

fn what(model: &str) -> &'static str {
    match model {
        "gaylord" => "none: pressure and braid only",
        "gaylord-corrected" => "the deadband",
        "linear" => "deadband; E of the material is given",
        "m1-linear-part" | "m2-linear-part" => "E_{k} per pressure, on the straight part of the load line",
        "m2" | "m3" | "m4" => "E_{k} per pressure, on the whole load line",
        "m4-tip" => "the same with rounded ends, L′",
        "m4-friction" => "E_{k} and k_{F} per pressure; error of both branches",
        "yeoh" => "one hyperelastic wall for all pressures: P_{0} and three constants",
        "material" => "deadband; the wall from the material's modulus",
        "table" => "all, as curves over pressure: used by the controller",
        _ => "",
    }
}

/// Each model separately, on the mid-lines of some pressures.
fn each(view: &View<'_>) -> Figure {
    let groups = view.some(PANELS);
    let mid = &view.fit.midline;
    let contraction: Vec<f64> = mid.iter().map(|m| 100.0 * m.contraction).collect();
    let shown: Vec<usize> = (0..mid.len()).filter(|i| groups.contains(&(mid[*i].group as usize))).collect();
    let at = |of: &[usize], column: &[f64]| -> Vec<f64> { of.iter().map(|i| column[*i]).collect() };
    let average: Vec<f64> = mid.iter().map(|m| m.force).collect();
    let panels = view.fit.models.iter().map(|model| {
        let force = within_reach(view, &model.force);
        let panel = Panel::new(contraction_axis(), Axis::new("force F", "N")).titled(model.name).points(
            "F_{AVG}",
            Colour::Muted,
            &at(&shown, &contraction),
            &at(&shown, &average),
        );
        groups.iter().fold(panel, |panel, group| {
            let of: Vec<usize> = shown.iter().copied().filter(|i| mid[*i].group as usize == *group).collect();
            let (x, y) = (at(&of, &contraction), at(&of, &force));
            if view.fit.solution.problem.pressures.held {
                panel.line(view.name(*group), view.colour(*group), &x, &y)
            } else {
                panel.points(view.name(*group), view.colour(*group), &x, &y)
            }
        })
    });
    Figure::multiples(
        "each-model",
        "Each model alone",
        "Dots are measured mid-lines, lines are one model. A model that is wrong in the same way at every pressure lacks physics; one \
         that is wrong at some pressures lacks a constant that depends on pressure.",
        panels.collect(),
    )
    .shared(true, true)
}

/// Models that are drawn together, with their colours.
pub(super) const DRAWN: [(&str, usize); 5] =
    [("gaylord", 6), ("linear", 1), ("m2", 2), ("m4", 3), ("yeoh", 4)];

fn against_midline(view: &View<'_>) -> Figure {
    let panels = view.some(PANELS).into_iter().filter_map(|group| {
        let of: Vec<usize> =
            (0..view.fit.midline.len()).filter(|i| view.fit.midline[*i].group as usize == group).collect();
        // A pressure without loops, such as that of a vented tare, has no mid-line.
        if of.is_empty() {
            return None;
        }
        let x: Vec<f64> = of.iter().map(|i| 100.0 * view.fit.midline[*i].contraction).collect();
        let average: Vec<f64> = of.iter().map(|i| view.fit.midline[*i].force).collect();
        let mut panel = Panel::new(contraction_axis(), Axis::new("force F", "N"))
            .titled(view.name(group))
            .points("F_{AVG}", Colour::Muted, &x, &average);
        for (name, colour) in DRAWN {
            if let Some(model) = view.fit.models.iter().find(|m| m.name == name) {
                let force = within_reach(view, &model.force);
                let y: Vec<f64> = of.iter().map(|i| force[*i]).collect();
                panel = panel.dashes(name, Colour::Series(colour), &x, &y);
            }
        }
        let strokes: Vec<f64> = of.iter().map(|i| view.fit.midline[*i].stroke).collect();
        let pressure = view.levels[group];
        let line = view.banded(pressure, &strokes, 0.0);
        panel =
            panel.band("95 % confidence interval of the table", Colour::Series(0), &x, &line.low, &line.high);
        Some(panel.line("table", Colour::Series(0), &x, &line.middle))
    });
    Figure::multiples(
        "models",
        "Models against measurement, pressure by pressure",
        "Dots are measured mid-lines, lines are models. The fewer constants a model has, the more its distance from the dots says about \
         the physics.",
        panels.collect(),
    )
}

fn error_lines(view: &View<'_>) -> Figure {
    let mut panel = Panel::new(contraction_axis(), Axis::log("error |F_{model} − F_{AVG}|/F_{B}", "%"));
    for group in 0..view.levels.len() {
        let mut of: Vec<(f64, f64)> = view
            .fit
            .chunks
            .iter()
            .filter(|c| c.group as usize == group)
            .map(|c| (100.0 * c.contraction, c.percent.abs().max(2e-3)))
            .collect();
        of.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (x, y): (Vec<f64>, Vec<f64>) = of.into_iter().unzip();
        panel = if view.fit.solution.problem.pressures.held {
            panel.hair(view.name(group), view.colour(group), &x, &y)
        } else {
            panel.points(view.name(group), view.colour(group), &x, &y)
        };
    }
    let panel = panel.with("1 % of blocked force", Colour::Ink, Mark::Level(1.0));
    Figure::new(
        "errors",
        "Error of the table against contraction",
        "Error in percent of the blocked force. A line dips where model and measurement cross. Where the lines of all pressures rise at \
         the same contraction, the model lacks something.",
        panel,
    )
}
