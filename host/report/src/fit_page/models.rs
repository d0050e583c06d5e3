//! The thesis's models and the table side by side: errors, load lines, error against contraction.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, Table, figures};
use super::loads::{PANELS, contraction_axis};
use super::view::View;

/// The models of the thesis and the table, side by side.
pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Models side by side").summarised();
    let s = &view.fit.summary;
    let mut table = Table::new(
        "Error of the mid-line, percent of blocked force (thesis, eq. 24)",
        &["model", "mean", "largest", "what is fitted"],
    );
    for model in &s.models {
        let cells = [model.mean_error_pct, model.max_error_pct].map(|v| figures(v, 2));
        table.row([
            format!("`{}`", model.name),
            cells[0].clone(),
            cells[1].clone(),
            what(&model.name).into(),
        ]);
    }
    section.table(table);
    section.figure(each(view));
    section.figure(against_midline(view));
    section.figure(error_lines(view));
    section
}

fn what(model: &str) -> &'static str {
    match model {
        "gaylord" => "nothing: pressure and braid alone",
        "gaylord-corrected" => "the deadband",
        "linear" => "the deadband; E of the material",
        "m1-linear-part" | "m2-linear-part" => "E_{k} per pressure, on the straight part of the load line",
        "m2" | "m3" | "m4" => "E_{k} per pressure, on the whole load line",
        "m4-tip" => "the same with rounded tips, L′",
        "m4-friction" => "E_{k} and k_{F} per pressure, judged on both branches",
        "yeoh" => "one hyperelastic wall for all pressures: P_{0} and three constants",
        "material" => "the deadband; the wall from the material's modulus alone",
        "table" => "everything at once, curves over pressure: this goes to the controller",
        _ => "",
    }
}

/// Every model by itself, on the mid-lines of some pressures.
fn each(view: &View<'_>) -> Figure {
    let groups = view.some(PANELS);
    let mid = &view.fit.midline;
    let contraction: Vec<f64> = mid.iter().map(|m| 100.0 * m.contraction).collect();
    let shown: Vec<usize> = (0..mid.len()).filter(|i| groups.contains(&(mid[*i].group as usize))).collect();
    let at = |of: &[usize], column: &[f64]| -> Vec<f64> { of.iter().map(|i| column[*i]).collect() };
    let average: Vec<f64> = mid.iter().map(|m| m.force).collect();
    let panels = view.fit.models.iter().map(|model| {
        let panel = Panel::new(contraction_axis(), Axis::new("force F", "N")).titled(model.name).points(
            "F_{AVG}",
            Colour::Muted,
            &at(&shown, &contraction),
            &at(&shown, &average),
        );
        groups.iter().fold(panel, |panel, group| {
            let of: Vec<usize> = shown.iter().copied().filter(|i| mid[*i].group as usize == *group).collect();
            let (x, y) = (at(&of, &contraction), at(&of, &model.force));
            if view.fit.solution.problem.pressures.held {
                panel.line(view.name(*group), view.colour(*group), &x, &y)
            } else {
                panel.points(view.name(*group), view.colour(*group), &x, &y)
            }
        })
    });
    Figure::multiples(
        "each-model",
        "Each model by itself",
        "Dots are the measured mid-lines, lines what one model makes of them: lines that miss in the same way at every pressure \
         lack physics, lines that miss at some lack a constant that follows the pressure.",
        panels.collect(),
    )
    .shared(true, true)
}

/// Models that are drawn together, with their colours.
const DRAWN: [(&str, usize); 5] = [("gaylord", 6), ("linear", 1), ("m2", 2), ("m4", 3), ("yeoh", 4)];

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
                let y: Vec<f64> = of.iter().map(|i| model.force[*i]).collect();
                panel = panel.dashes(name, Colour::Series(colour), &x, &y);
            }
        }
        let strokes: Vec<f64> = of.iter().map(|i| view.fit.midline[*i].stroke).collect();
        let pressure = view.levels[group];
        let line = view.banded(pressure, &strokes, 0.0);
        panel = panel.band("95 % interval of the table", Colour::Series(0), &x, &line.low, &line.high);
        Some(panel.line("table", Colour::Series(0), &x, &line.middle))
    });
    Figure::multiples(
        "models",
        "Models against the mid-line, pressure by pressure",
        "Dots are measured, lines are models. The fewer constants a model has, the more its distance from the dots tells about \
         the physics; that a flexible one lies on them proves little.",
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
        "Each line dives where model and measurement cross; what counts is how high its arches are, and whether all of \
         them rise at the same contraction: there the model lacks something.",
        panel,
    )
}
