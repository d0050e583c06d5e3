//! Load lines, loops, blocked force and free contraction, the deadband line.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, fixed};
use super::held_length;
use super::view::{Banded, View};
use pam_data::pluralise::pluralise;
use pam_data::statistics::NORMAL_95;
use pam_fit::columns;

/// At most this many small panels: more cannot be compared by eye.
pub(super) const PANELS: usize = 9;

pub(super) fn contraction_axis() -> Axis {
    Axis::new("contraction ΔL/L_{0}", "%")
}

/// The picture that stands first.
pub(super) fn overview(view: &View<'_>) -> Section {
    let mut section = Section::new("Measured and fitted force");
    section.figure(if view.held_length() { held_length::load_lines(view) } else { load_lines(view) });
    section
}

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Force of the muscle");
    section.figure(if view.held_length() { held_length::branches(view) } else { loops(view) });
    section.figure(ends(view));
    section.figure(deadband(view));
    section
}

fn load_lines(view: &View<'_>) -> Figure {
    let points = view.points();
    let mut panel = Panel::new(contraction_axis(), Axis::new("force F", "N").from_zero());
    for group in 0..view.levels.len() {
        let (x, y): (Vec<f64>, Vec<f64>) = broken(points.iter().enumerate().map(|(i, p)| {
            (view.group(i) == group).then(|| (view.contraction(p.stroke), p.force, p.recording))
        }));
        panel = if view.fit.solution.problem.pressures.held {
            panel.hair(view.name(group), view.colour(group), &x, &y)
        } else {
            panel.points(view.name(group), view.colour(group), &x, &y)
        };
    }
    for group in (0..view.levels.len()).filter(|_| view.fit.solution.problem.pressures.held) {
        let mid = view.fit.midline.iter().filter(|m| m.group as usize == group);
        let (x, y): (Vec<f64>, Vec<f64>) = mid.map(|m| (100.0 * m.contraction, m.force)).unzip();
        panel = panel.dashes(if group == 0 { "mid-line F_{AVG}" } else { "" }, Colour::Ink, &x, &y);
    }
    Figure::new(
        "load-lines",
        "Force against contraction, one loop per pressure",
        "Measured force. The upper branch of a loop is lengthening, the lower one shortening; half their distance is friction. The \
         elastic model is fitted to the dashed mid-line.",
        panel,
    )
}

/// Points with a break where the path leaves the selected ones, or another recording begins.
pub(super) fn broken(points: impl Iterator<Item = Option<(f64, f64, u32)>>) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    let mut last = None;
    for point in points {
        match point {
            Some((a, b, recording)) => {
                if last.is_some_and(|l| l != Some(recording)) && !x.is_empty() {
                    x.push(f64::NAN);
                    y.push(f64::NAN);
                }
                x.push(a);
                y.push(b);
                last = Some(Some(recording));
            }
            None => last = Some(None),
        }
    }
    (x, y)
}

fn loops(view: &View<'_>) -> Figure {
    let friction = view.fit.solution.problem.design.friction;
    let panels = view.some(PANELS).into_iter().map(|group| {
        let mut of: Vec<usize> = (0..view.points().len()).filter(|i| view.group(*i) == group).collect();
        // Few enough to stay dots, so that one sees them on both sides of the line.
        let every = of.len().div_ceil(160).max(1);
        of = of.into_iter().step_by(every).collect();
        let xs: Vec<f64> = of.iter().map(|i| view.contraction(view.points()[*i].stroke)).collect();
        let ys: Vec<f64> = of.iter().map(|i| view.points()[*i].force).collect();
        let strokes = view.strokes(group, 80);
        let at: Vec<f64> = strokes.iter().map(|x| view.contraction(*x)).collect();
        let pressure = view.levels[group];
        let mut panel = Panel::new(contraction_axis(), Axis::new("force F", "N"))
            .titled(view.name(group))
            .points("measured", Colour::Muted, &xs, &ys);
        let branches: &[(f64, &str)] = if friction {
            &[(1.0, "table, shortening"), (-1.0, "table, lengthening")]
        } else {
            &[(0.0, "table")]
        };
        for (i, (direction, name)) in branches.iter().enumerate() {
            let line = view.banded(pressure, &strokes, *direction);
            let band = if i == 0 { "95 % confidence interval of the table" } else { "" };
            panel = panel.band(band, Colour::Series(i), &at, &line.low, &line.high).line(
                *name,
                Colour::Series(i),
                &at,
                &line.middle,
            );
        }
        panel
    });
    let more = view.levels.len().saturating_sub(PANELS);
    let left = match more {
        0 => String::new(),
        n => format!(" Not shown: {} between them.", pluralise(n, "pressure")),
    };
    Figure::multiples(
        "loops",
        "Table against measurement, pressure by pressure",
        format!(
            "In a good fit, each line runs through the middle of its branch's dots. The band is the 95 % confidence interval of the table.{left}"
        ),
        panels.collect(),
    )
}

/// One loop: how far its mid-line lies from the table's at rest length and where the force ends.
struct Repeat {
    group: usize,
    /// Counted within its pressure.
    number: usize,
    blocked: Option<f64>,
    free: Option<f64>,
}

/// Pairs of successive half-strokes in opposite directions, at one pressure.
fn repeats(view: &View<'_>) -> Vec<Repeat> {
    let points = view.points();
    let mut blocks: Vec<(usize, usize)> = Vec::new();
    let mut start = 0;
    for i in 1..=points.len() {
        if i == points.len() || points[i].block != points[start].block || view.group(i) != view.group(start) {
            blocks.push((start, i));
            start = i;
        }
    }
    blocks.retain(|(from, to)| (*from..*to).any(|i| view.fitted(i)));
    let mut out: Vec<Repeat> = Vec::new();
    // Looked up once: there may be as many repeats as some thousandth of the points.
    let longest = |group: usize| view.strokes(group, 2).last().copied().unwrap_or(0.0) / view.l0;
    let reach: Vec<f64> = (0..view.levels.len()).map(longest).collect();
    let mut i = 0;
    while i + 1 < blocks.len() {
        let (a, b) = (blocks[i], blocks[i + 1]);
        let (p, q) = (&points[a.0], &points[b.0]);
        let group = view.group(a.0);
        if p.recording != q.recording || group != view.group(b.0) || p.direction == q.direction {
            i += 1;
            continue;
        }
        let number = 1 + out.iter().filter(|r| r.group == group).count();
        out.push(repeat(view, group, reach[group], number, [a, b]));
        i += 2;
    }
    out
}

fn repeat(view: &View<'_>, group: usize, reach: f64, number: usize, branches: [(usize, usize); 2]) -> Repeat {
    let at = &view.fit.summary.pressures[group];
    let pressure = view.levels[group];
    // The mid-line's distance from the table's, N, over points that `take` accepts: both branches have the same weight.
    let off = |take: &dyn Fn(f64) -> bool| -> Option<f64> {
        let mut sum = 0.0;
        for (from, to) in branches {
            let near: Vec<f64> = (from..to)
                .filter(|i| view.fitted(*i) && take(view.points()[*i].stroke / view.l0))
                .map(|i| view.residual[i])
                .collect();
            if near.is_empty() {
                return None;
            }
            sum += 0.5 * near.iter().sum::<f64>() / near.len() as f64;
        }
        Some(sum)
    };
    let blocked = off(&|c| c < 0.1 * reach.max(0.01)).map(|d| at.blocked_force_N + d);
    let free = at.free_contraction.and_then(|free| {
        let shift = off(&|c| (c - free).abs() < 0.12 * free.max(0.01))?;
        let slope = view.slope(pressure, free);
        (slope < 0.0).then(|| free - shift / slope)
    });
    Repeat { group, number, blocked, free }
}

fn ends(view: &View<'_>) -> Figure {
    let all = if view.held_length() { Vec::new() } else { repeats(view) };
    let most = all.iter().map(|r| r.number).max().unwrap_or(0).min(8);
    let kpa: Vec<f64> = view.levels.iter().map(|p| p / 1e3).collect();
    let s = &view.fit.summary.pressures;
    let blocked: Banded = view.levels.iter().map(|p| view.banded_at(*p, 0.0, 0.0)).collect();
    // The force's interval, carried over to the contraction by the slope of the load line.
    let free: Banded = view
        .levels
        .iter()
        .zip(s)
        .map(|(pressure, p)| {
            let Some(at) = p.free_contraction else { return [f64::NAN; 3] };
            let [force, low, _] = view.banded_at(*pressure, at * view.l0, 0.0);
            let half = ((force - low) / view.slope(*pressure, at)).abs();
            [100.0 * at, 100.0 * (at - half), 100.0 * (at + half)]
        })
        .collect();
    let pressure = || Axis::new("pressure P", "kPa");
    let panel = |title: &str, y: Axis, line: &Banded| {
        Panel::new(pressure(), y.from_zero())
            .titled(title)
            .band("95 % confidence interval of the table", Colour::Muted, &kpa, &line.low, &line.high)
            .line("table", Colour::Muted, &kpa, &line.middle)
    };
    let mut panels = [
        panel("Blocked force", Axis::new("blocked force F_{B}", "N"), &blocked),
        panel("Free contraction", Axis::new("free contraction", "%"), &free),
    ];
    for number in 1..=most {
        let name =
            if most == 8 && number == 8 { "loop 8 and later".into() } else { format!("loop {number}") };
        let of = |value: &dyn Fn(&Repeat) -> Option<f64>| -> (Vec<f64>, Vec<f64>) {
            all.iter()
                .filter(|r| r.number.min(8) == number)
                .filter_map(|r| Some((view.levels[r.group] / 1e3, value(r)?)))
                .unzip()
        };
        let colour = Colour::ordered(number - 1, most);
        let (x, y) = of(&|r| r.blocked);
        let [first, second] = panels;
        let first = first.rings(name.clone(), colour, &x, &y);
        let (x, y) = of(&|r| r.free.map(|c| 100.0 * c));
        panels = [first, second.rings(name, colour, &x, &y)];
    }
    Figure::multiples(
        "blocked-free",
        "Blocked force and free contraction against pressure",
        if most == 0 {
            "Computed by the table. A gap means that the force does not reach zero within the tested contractions."
        } else {
            "Rings are single loops; those of one pressure should coincide. A trend from loop to loop is run-in (Mullins softening); \
             scatter is poor repeatability."
        },
        panels.to_vec(),
    )
}

fn deadband(view: &View<'_>) -> Figure {
    let s = &view.fit.summary;
    let area = columns(&view.fit.solution.problem.braid, 0.0).area;
    let (p0, half) = (s.deadband_kPa, NORMAL_95 * s.deadband_std_kPa);
    let top = view.levels.last().map_or(1.0, |p| p / 1e3);
    let (x, y): (Vec<f64>, Vec<f64>) = if view.held_length() {
        held_length::at_rest_length(view)
    } else {
        repeats(view).iter().filter_map(|r| Some((view.levels[r.group] / 1e3, r.blocked?))).unzip()
    };
    let line: Vec<f64> = [p0, top].iter().map(|p| 1e3 * (p - p0) * area).collect();
    // The band begins where its upper edge leaves zero, and its lower edge later.
    let ends = [p0 - half, (p0 + half).min(top), top];
    let low: Vec<f64> = ends.iter().map(|p| (1e3 * (p - p0 - half) * area).max(0.0)).collect();
    let high: Vec<f64> = ends.iter().map(|p| (1e3 * (p - p0 + half) * area).max(0.0)).collect();
    let panel = Panel::new(
        Axis::new("pressure P", "kPa").from_zero(),
        Axis::new("blocked force without friction", "N").from_zero(),
    )
    .band("95 % confidence interval", Colour::Series(0), &ends, &low, &high)
    .line("(P − P_{0}) g(L_{0})", Colour::Series(0), &[p0, top], &line)
    .with(format!("P_{{0}} = {} kPa", fixed(p0, 1)), Colour::Ink, Mark::Moment(p0));
    let panel = if x.is_empty() { panel } else { panel.points("measured", Colour::Muted, &x, &y) };
    Figure::new(
        "deadband",
        "Deadband: blocked force against pressure",
        "At rest length all elastic terms vanish, so the blocked force is a straight line that begins at the deadband P_{0}. Dots \
         off the line mean a wrong geometry, or a wrong zero of force or pressure.",
        panel,
    )
}
