//! What was fitted, over pressure and over strain.

use super::super::{Axis, Colour, Figure, Panel, Section, fixed, significant};
use super::view::{Banded, View};
use pam_data::statistics::NORMAL_95;
use pam_fit::table_root;

/// Places along the pressure axis.
const PLACES: usize = 90;

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Fitted curves");
    section.figure(over_pressure(view));
    section.figure(stress(view));
    section
}

fn over_pressure(view: &View<'_>) -> Figure {
    let solution = &view.fit.solution;
    let nodes = &solution.problem.pressures.nodes;
    let range = solution.problem.points.pressure;
    let (low, high) = (
        nodes.first().copied().unwrap_or(range.low).min(range.low).max(0.0),
        nodes.last().copied().unwrap_or(range.high).max(range.high),
    );
    let at: Vec<f64> = (0..PLACES).map(|i| low + (high - low) * i as f64 / (PLACES - 1) as f64).collect();
    let kpa: Vec<f64> = at.iter().map(|p| p / 1e3).collect();
    let node_kpa: Vec<f64> = nodes.iter().map(|p| p / 1e3).collect();
    let root = table_root(solution, &view.fit.uncertain.root, &at);
    let order = solution.problem.design.layout().order;
    let curves: Vec<(Vec<f64>, f64)> = at.iter().map(|p| solution.curves_at(*p)).collect();
    let at_nodes: Vec<(Vec<f64>, f64)> = nodes.iter().map(|p| solution.curves_at(*p)).collect();
    let axis = || Axis::new("pressure P", "kPa");
    type Take<'a> = &'a dyn Fn(&(Vec<f64>, f64)) -> f64;
    let curve = |y: Axis, k: usize, scale: f64, take: Take<'_>| {
        let values: Vec<f64> = curves.iter().map(|c| take(c) * scale).collect();
        let std: Vec<f64> = (0..PLACES).map(|i| root.std(1 + k * PLACES + i) * scale).collect();
        let edge = |sign: f64| -> Vec<f64> {
            values.iter().zip(&std).map(|(v, s)| v + sign * NORMAL_95 * s).collect()
        };
        let ring: Vec<f64> = at_nodes.iter().map(|c| take(c) * scale).collect();
        Panel::new(axis(), y)
            .band("95 % confidence interval", Colour::Series(0), &kpa, &edge(-1.0), &edge(1.0))
            .line("fitted curve", Colour::Series(0), &kpa, &values)
            .rings("nodes of the table", Colour::Series(0), &node_kpa, &ring)
    };
    let mut panels: Vec<Panel> = (0..order)
        .map(|k| {
            let label = format!("E_{{{}}}", k + 1);
            curve(Axis::new(label.clone(), "MPa"), k, 1e-6, &|c| c.0[k]).titled(label)
        })
        .collect();
    if solution.problem.design.friction {
        panels.push(
            curve(Axis::new("k_{F}", "").from_zero(), order, 1.0, &|c| c.1).titled("Friction factor k_{F}"),
        );
    }
    panels.push(density(view, low, high));
    Figure::multiples(
        "curves",
        "Elastic coefficients and friction against pressure",
        "The band is the 95 % confidence interval; it widens where data are few (last panel). The bladder is one material: \
         coefficients that change with pressure compensate for physics that the equations lack.",
        panels,
    )
    .shared(true, false)
}

fn density(view: &View<'_>, low: f64, high: f64) -> Panel {
    const BINS: usize = 40;
    let mut rows = [0.0; BINS];
    let width = (high - low).max(1.0) / BINS as f64;
    for (_, p) in view.points().iter().enumerate().filter(|(i, _)| view.fitted(*i)) {
        let bin = (((p.pressure - low) / width).max(0.0) as usize).min(BINS - 1);
        rows[bin] += f64::from(p.rows);
    }
    let middle: Vec<f64> = (0..BINS).map(|i| (low + (i as f64 + 0.5) * width) / 1e3).collect();
    Panel::new(Axis::new("pressure P", "kPa"), Axis::new("rows", "").from_zero())
        .titled("Where the data are")
        .bars("rows fitted", Colour::Muted, &middle, &rows)
}

fn stress(view: &View<'_>) -> Figure {
    let solution = &view.fit.solution;
    let mut axial =
        Panel::new(Axis::new("axial strain ε_{z}", "%"), Axis::new("stress Σ E_{k} ε_{z}^{k}", "MPa"))
            .titled("Along the muscle");
    let mut radial =
        Panel::new(Axis::new("radial strain ε_{x}", "%"), Axis::new("stress Σ E_{k} ε_{x}^{k}", "MPa"))
            .titled("Around the muscle");
    let mut falls = Vec::new();
    let order = solution.problem.design.layout().order;
    for group in 0..view.levels.len() {
        let (moduli, _) = solution.curves_at(view.levels[group]);
        let root = table_root(solution, &view.fit.uncertain.root, &view.levels[group..=group]);
        let half = |strain: f64| {
            let mut gradient = vec![0.0; root.rows];
            for (k, g) in gradient[1..=order].iter_mut().enumerate() {
                *g = strain.powi(k as i32 + 1);
            }
            NORMAL_95 * root.variance(&gradient).sqrt() * 1e-6
        };
        let stress = |strain: f64| moduli.iter().rev().fold(0.0, |sum, e| strain * (sum + e)) * 1e-6;
        let postures: Vec<_> = view
            .strokes(group, 60)
            .into_iter()
            .map(|x| solution.problem.braid.posture(model_core::units::Length::from_metres(x)))
            .collect();
        let line = |strain: &dyn Fn(&model_core::braid::Posture<f64>) -> f64| -> (Vec<f64>, Banded) {
            let at = postures.iter().map(strain);
            let banded = at.clone().map(|e| [stress(e), stress(e) - half(e), stress(e) + half(e)]);
            (at.map(|e| 100.0 * e).collect(), banded.collect())
        };
        let drawn = |panel: Panel, x: &[f64], y: &Banded| {
            let band = if group == 0 { "95 % confidence interval" } else { "" };
            panel.band(band, view.colour(group), x, &y.low, &y.high).line(
                view.name(group),
                view.colour(group),
                x,
                &y.middle,
            )
        };
        let (x, y) = line(&|p| p.axial_strain);
        axial = drawn(axial, &x, &y);
        let (x, y) = line(&|p| p.radial_strain);
        radial = drawn(radial, &x, &y);
        let y = y.middle;
        if y.windows(2).any(|w| w[1] < w[0] - 1e-3 * y.iter().fold(0.0_f64, |m, v| m.max(v.abs()))) {
            falls.push(view.name(group));
        }
    }
    let warning = if falls.is_empty() {
        "It rises everywhere here.".to_owned()
    } else {
        format!(
            "It falls in a part of the range at {}: the coefficients absorb another effect there, such as rounded ends.",
            falls.join(", ")
        )
    };
    Figure::multiples(
        "stress-strain",
        "Fitted stress against strain of the bladder",
        format!(
            "In a real bladder stress rises with strain and is the same curve at every pressure. {warning}"
        ),
        vec![axial, radial],
    )
}

/// A value with half the width of its 95 % interval; the interval has two figures, the value as many decimals.
pub(super) fn with_interval(value: f64, std: f64) -> String {
    let half = NORMAL_95 * std;
    if !(half > 0.0 && half.is_finite()) {
        return significant(value, 3);
    }
    let decimals = (1 - half.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{} ± {}", fixed(value, decimals), fixed(half, decimals))
}
