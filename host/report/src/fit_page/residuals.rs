//! Residuals: against every coordinate, over time, and their autocorrelation.

use super::super::{Axis, Colour, Figure, Mark, Panel, Section, Table, fixed, residual_table};
use super::view::View;
use pam_data::statistics::NORMAL_95;
use pam_data::statistics::extremes;

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Residuals");
    section.text(
        "Residuals are measured minus computed force, with friction in the direction of motion. A random part is noise; a \
         systematic part is physics that the model lacks, which `host diagnose` identifies.",
    );
    residual_table::add(&mut section, "Residuals by recording (F − F_model)", &view.fit.summary.recordings);
    section.figure(coordinates(view));
    section.figure(time(view));
    section.figure(memory(view));
    outliers(view, &mut section);
    section
}

fn axis() -> Axis {
    Axis::new("residual", "N")
}

/// Mean of the residual in bins along a coordinate, with at least a few points each.
fn trend(x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (low, high) = extremes(x);
    if !(low < high) {
        return (Vec::new(), Vec::new());
    }
    const BINS: usize = 40;
    let mut sums = [(0.0, 0.0, 0.0); BINS];
    for (a, b) in x.iter().zip(y) {
        let bin = (((a - low) / (high - low) * BINS as f64) as usize).min(BINS - 1);
        let sum = &mut sums[bin];
        *sum = (sum.0 + a, sum.1 + b, sum.2 + 1.0);
    }
    // A handful of points at the edge of a level is not a trend.
    let least = (0.003 * x.len() as f64).max(5.0);
    sums.iter().filter(|s| s.2 >= least).map(|s| (s.0 / s.2, s.1 / s.2)).unzip()
}

/// Mean of the residual at each tested pressure: bins of a range would cut levels in two.
fn by_level(view: &View<'_>, rows: &[usize], residual: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut sums = vec![(0.0, 0.0); view.levels.len()];
    for (i, r) in rows.iter().zip(residual) {
        let sum = &mut sums[view.group(*i)];
        *sum = (sum.0 + r, sum.1 + 1.0);
    }
    let known = sums.iter().zip(view.levels).filter(|(s, _)| s.1 > 0.0);
    known.map(|((sum, count), p)| (p / 1e3, sum / count)).unzip()
}

fn coordinates(view: &View<'_>) -> Figure {
    let rows: Vec<usize> = (0..view.points().len()).filter(|i| view.fitted(*i)).collect();
    let points = view.points();
    let residual: Vec<f64> = rows.iter().map(|i| view.residual[*i]).collect();
    let speed = speeds(view);
    let of = |take: &dyn Fn(usize) -> f64| -> Vec<f64> { rows.iter().map(|i| take(*i)).collect() };
    let mut coordinates = vec![
        ("contraction ΔL/L_{0}", "%", of(&|i| view.contraction(points[i].stroke))),
        ("pressure P", "kPa", of(&|i| points[i].pressure / 1e3)),
        ("force F", "N", of(&|i| points[i].force)),
    ];
    if !view.held_length() {
        coordinates.push(("speed of shortening", "mm/s", of(&|i| 1e3 * speed[i])));
    }
    // A temperature of each point is that of its first row.
    let warm = |i: usize| {
        let p = &points[i];
        let column = view.campaign.recordings.get(p.recording as usize)?.temperature.as_ref()?;
        column.get(p.first_row as usize).map(|k| k - 273.15)
    };
    if rows.iter().all(|i| warm(*i).is_some()) && !rows.is_empty() {
        coordinates.push(("temperature", "°C", of(&|i| warm(i).unwrap_or(f64::NAN))));
    }
    let held = view.fit.solution.problem.pressures.held;
    let panels = coordinates.into_iter().map(|(label, unit, x)| {
        let (at, mean) =
            if held && unit == "kPa" { by_level(view, &rows, &residual) } else { trend(&x, &residual) };
        Panel::new(Axis::new(label, unit), axis())
            .titled(format!("against {}", label.split(' ').next().unwrap_or(label)))
            .points("each point", Colour::Muted, &x, &residual)
            .line("mean", Colour::Series(1), &at, &mean)
    });
    Figure::multiples(
        "residuals",
        "Residuals against each coordinate",
        "In a good fit, the mean stays at zero. Where it does not, the force depends on that coordinate in a way that the model lacks.",
        panels.collect(),
    )
    .shared(false, true)
}

/// Speed of each point, m/s, from its neighbours in the same recording.
fn speeds(view: &View<'_>) -> Vec<f64> {
    let points = view.points();
    (0..points.len())
        .map(|i| {
            let near = |k: Option<usize>| {
                k.and_then(|k| points.get(k)).filter(|p| p.block == points[i].block).unwrap_or(&points[i])
            };
            let (a, b) = (near(i.checked_sub(1)), near(Some(i + 1)));
            let dt = b.time - a.time;
            if dt > 0.0 { (b.stroke - a.stroke) / dt } else { 0.0 }
        })
        .collect()
}

fn time(view: &View<'_>) -> Figure {
    // Recordings that all start at zero are set one after another.
    let mut shift = vec![0.0; view.campaign.recordings.len()];
    let separate = view.campaign.clock == pam_data::recording::Clock::Separate;
    let mut starts = Vec::new();
    let mut end = 0.0;
    for (i, recording) in view.campaign.recordings.iter().enumerate() {
        let first = recording.time.first().copied().unwrap_or(0.0);
        if separate {
            shift[i] = end - first;
        }
        starts.push(first + shift[i]);
        end = recording.time.last().copied().unwrap_or(0.0) + shift[i];
    }
    let rows = || (0..view.points().len()).filter(|i| view.fitted(*i));
    let x: Vec<f64> =
        rows().map(|i| view.points()[i].time + shift[view.points()[i].recording as usize]).collect();
    let y: Vec<f64> = rows().map(|i| view.residual[i]).collect();
    let label = if separate { "time, recordings one after another" } else { "time" };
    let mut panel = Panel::new(Axis::new(label, "s"), axis()).points("each point", Colour::Muted, &x, &y);
    let (at, mean) = trend(&x, &y);
    panel = panel.line("mean", Colour::Series(1), &at, &mean);
    if starts.len() <= 30 {
        for (i, start) in starts.iter().enumerate().skip(1) {
            let name = if i == 1 { "next recording" } else { "" };
            panel = panel.with(name, Colour::Muted, Mark::Moment(*start));
        }
    }
    Figure::new(
        "residuals-time",
        "Residuals over time",
        "A slow slope is drift, warming or run-in. A step is a slip. A pattern that repeats with every stroke depends on the \
         motion, not on time.",
        panel,
    )
}

/// Autocorrelation of the residuals of points that follow each other within a half-stroke.
fn memory(view: &View<'_>) -> Figure {
    let points = view.points();
    let used: Vec<usize> = (0..points.len()).filter(|i| view.fitted(*i)).collect();
    let values = &view.fit.uncertain.autocorrelation;
    let lags: Vec<f64> = (0..values.len()).map(|l| l as f64).collect();
    let bound = NORMAL_95 / (used.len().max(1) as f64).sqrt();
    let correlation = view.fit.uncertain.correlation;
    let panel =
        Panel::new(Axis::new("lag in points", ""), Axis::new("autocorrelation", "").range(-1.0, 1.05))
            .bars("residuals", Colour::Series(0), &lags, values)
            .with("95 % limit for independent residuals", Colour::Alarm, Mark::Level(bound))
            .with("", Colour::Alarm, Mark::Level(-bound));
    Figure::new(
        "autocorrelation",
        "Autocorrelation of the residuals",
        format!(
            "High bars mean that neighbouring points have correlated errors: {} points are worth about {} independent ones. All \
             intervals of this report include this.",
            fixed(used.len() as f64, 0),
            fixed(used.len() as f64 / correlation.max(1.0), 0)
        ),
        panel,
    )
}

fn outliers(view: &View<'_>, section: &mut Section) {
    let all = &view.fit.summary.outliers;
    if all.is_empty() {
        return;
    }
    let mut table = Table::new(
        "Outliers, excluded from the fit",
        &["recording", "row", "time (s)", "force (N)", "residual (N)"],
    );
    const MOST: usize = 25;
    for o in all.iter().take(MOST) {
        table.row([
            o.recording.clone(),
            o.row.to_string(),
            fixed(o.time_s, 3),
            fixed(o.force_N, 2),
            fixed(o.off_N, 2),
        ]);
    }
    section.table(table);
    if all.len() > MOST {
        section.text(format!("{} more are listed in the JSON of the fit.", all.len() - MOST));
    }
}
