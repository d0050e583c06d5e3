//! Pictures of recordings at held length: force against pressure, one line per length.

use super::super::{Axis, Colour, Figure, Mark, Panel};
use super::loads::{PANELS, broken};
use super::models::{DRAWN, within_reach};
use super::view::{Banded, View};
use pam_data::statistics::extremes;
use pam_fit::{ChunkError, MidPoint};

/// Pressures along a curve of the table.
const STEPS: usize = 60;

fn pressure() -> Axis {
    Axis::new("pressure P", "kPa")
}

fn force() -> Axis {
    Axis::new("force F", "N")
}

/// Lengths that get a panel of their own: the first, the last, and evenly between.
fn shown(view: &View<'_>) -> Vec<usize> {
    let n = view.lengths.len();
    if n <= PANELS { (0..n).collect() } else { (0..PANELS).map(|i| i * (n - 1) / (PANELS - 1)).collect() }
}

/// The pressures tested at one length, evenly spaced, Pa.
fn pressures(view: &View<'_>, length: usize) -> Vec<f64> {
    let of = (0..view.points().len()).filter(|i| view.length_of(view.points()[*i].stroke) == length);
    let (low, high) = extremes(of.map(|i| view.points()[i].pressure));
    if !(low < high) {
        return Vec::new();
    }
    (0..STEPS).map(|i| low + (high - low) * i as f64 / (STEPS - 1) as f64).collect()
}

fn kpa(pascals: &[f64]) -> Vec<f64> {
    pascals.iter().map(|p| p / 1e3).collect()
}

/// Indices of the mid-line's points at one length, by rising pressure.
fn midline(view: &View<'_>, length: usize) -> Vec<usize> {
    let all = &view.fit.midline;
    let mut of: Vec<usize> = (0..all.len()).filter(|i| view.length_of(all[*i].stroke) == length).collect();
    of.sort_by(|a, b| all[*a].pressure.total_cmp(&all[*b].pressure));
    of
}

fn middle(view: &View<'_>, of: &[usize]) -> (Vec<f64>, Vec<f64>) {
    of.iter().map(|i| (view.fit.midline[*i].pressure / 1e3, view.fit.midline[*i].force)).unzip()
}

/// All lengths in one picture, with the table's line through each.
pub(super) fn load_lines(view: &View<'_>) -> Figure {
    let mut panel = Panel::new(pressure(), force().from_zero());
    for length in 0..view.lengths.len() {
        let (x, y) = broken(view.points().iter().map(|p| {
            (view.length_of(p.stroke) == length).then_some((p.pressure / 1e3, p.force, p.recording))
        }));
        panel = panel.points(view.length_name(length), view.length_colour(length), &x, &y);
    }
    for length in 0..view.lengths.len() {
        let at = pressures(view, length);
        let y: Vec<f64> = at.iter().map(|p| view.force(*p, view.lengths[length], 0.0)).collect();
        let name = if length == 0 { "table without friction" } else { "" };
        panel = panel.line(name, view.length_colour(length), &kpa(&at), &y);
    }
    let reading = "Dots are measured, lines are the table without friction. In a good fit, each line runs through the middle of its dots.";
    let lengths = if view.fitted_lengths() { " The lengths are the fitted ones." } else { "" };
    Figure::new(
        "load-lines",
        "Force against pressure, one line per length",
        format!("{reading}{lengths}"),
        panel,
    )
}

/// One panel per length: both directions of the table.
pub(super) fn branches(view: &View<'_>) -> Figure {
    let friction = view.fit.solution.problem.design.friction;
    let panels = shown(view).into_iter().map(|length| {
        let of = view.points().iter().filter(|p| view.length_of(p.stroke) == length);
        let (x, y): (Vec<f64>, Vec<f64>) = of.map(|p| (p.pressure / 1e3, p.force)).unzip();
        let at = pressures(view, length);
        let mut panel = Panel::new(pressure(), force()).titled(view.length_name(length)).points(
            "measured",
            Colour::Muted,
            &x,
            &y,
        );
        let branches: &[(f64, &str)] =
            if friction { &[(1.0, "table, filling"), (-1.0, "table, emptying")] } else { &[(0.0, "table")] };
        for (i, (direction, name)) in branches.iter().enumerate() {
            let line: Banded =
                at.iter().map(|p| view.banded_at(*p, view.lengths[length], *direction)).collect();
            let band = if i == 0 { "95 % confidence interval of the table" } else { "" };
            panel = panel.band(band, Colour::Series(i), &kpa(&at), &line.low, &line.high).line(
                *name,
                Colour::Series(i),
                &kpa(&at),
                &line.middle,
            );
        }
        panel
    });
    Figure::multiples(
        "loops",
        "Table against measurement, length by length",
        "In a good fit, each line runs through the middle of its branch's dots.",
        panels.collect(),
    )
}

/// Each model separately, all lengths in each panel.
pub(super) fn each_model(view: &View<'_>) -> Figure {
    let panels = view.fit.models.iter().map(|model| {
        let computed = within_reach(view, &model.force);
        let mut panel = Panel::new(pressure(), force()).titled(model.name);
        for length in shown(view) {
            let of = midline(view, length);
            let (x, measured) = middle(view, &of);
            let computed: Vec<f64> = of.iter().map(|i| computed[*i]).collect();
            let colour = view.length_colour(length);
            panel = panel.points(if length == 0 { "measured" } else { "" }, colour, &x, &measured).line(
                view.length_name(length),
                colour,
                &x,
                &computed,
            );
        }
        panel
    });
    Figure::multiples(
        "each-model",
        "Each model alone",
        "Dots are measured, lines are one model. A model that is wrong in the same way at every length lacks physics; one that is \
         wrong at some lengths lacks a constant that depends on length.",
        panels.collect(),
    )
    .shared(true, true)
}

/// All models in one panel per length.
pub(super) fn models(view: &View<'_>) -> Figure {
    let panels = shown(view).into_iter().map(|length| {
        let of = midline(view, length);
        let (x, measured) = middle(view, &of);
        let mut panel = Panel::new(pressure(), force()).titled(view.length_name(length)).points(
            "measured",
            Colour::Muted,
            &x,
            &measured,
        );
        for (name, colour) in DRAWN {
            if let Some(model) = view.fit.models.iter().find(|m| m.name == name) {
                let computed = within_reach(view, &model.force);
                let y: Vec<f64> = of.iter().map(|i| computed[*i]).collect();
                panel = panel.dashes(name, Colour::Series(colour), &x, &y);
            }
        }
        let at = pressures(view, length);
        let line: Banded = at.iter().map(|p| view.banded_at(*p, view.lengths[length], 0.0)).collect();
        panel
            .band(
                "95 % confidence interval of the table",
                Colour::Series(0),
                &kpa(&at),
                &line.low,
                &line.high,
            )
            .line("table", Colour::Series(0), &kpa(&at), &line.middle)
    });
    Figure::multiples(
        "models",
        "Models against measurement, length by length",
        "Dots are measured, lines are models. The fewer constants a model has, the more its distance from the dots says about the \
         physics.",
        panels.collect(),
    )
}

/// Errors of the table over pressure, one line per length.
pub(super) fn errors(view: &View<'_>) -> Figure {
    let mut panel = Panel::new(pressure(), Axis::log("error |F_{model} − F_{AVG}|/F_{B}", "%"));
    for length in 0..view.lengths.len() {
        let at = |group: usize| {
            let of = |c: &&ChunkError| {
                c.group as usize == group && view.length_of(c.contraction * view.l0) == length
            };
            let squares: Vec<f64> =
                view.fit.chunks.iter().filter(of).map(|c| c.percent * c.percent).collect();
            let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            (!squares.is_empty()).then(|| (view.levels[group] / 1e3, rms.max(2e-3)))
        };
        let (x, y): (Vec<f64>, Vec<f64>) = (0..view.levels.len()).filter_map(at).unzip();
        panel = panel.line(view.length_name(length), view.length_colour(length), &x, &y);
    }
    Figure::new(
        "errors",
        "Error of the table against pressure",
        "Error at each pressure (rms) in percent of the blocked force, one line per length. Where all lines rise, the model lacks something.",
        panel.with("1 % of blocked force", Colour::Ink, Mark::Level(1.0)),
    )
}

/// Measured blocked force without friction: the mid-line near rest length, where that was tested; kPa and N. The table's force carries it to
/// rest length: a fitted mounting may be half a per cent off, where elastic terms are some per cent of the force.
pub(super) fn at_rest_length(view: &View<'_>) -> (Vec<f64>, Vec<f64>) {
    /// A contraction below this counts as rest length.
    const REST: f64 = 0.005;
    let near = view.fit.midline.iter().filter(|m| m.contraction.abs() < REST);
    let carried = |m: &MidPoint| {
        m.force + view.force(m.pressure, 0.0, 0.0) - view.force(m.pressure, m.contraction * view.l0, 0.0)
    };
    near.map(|m| (m.pressure / 1e3, carried(m))).unzip()
}
