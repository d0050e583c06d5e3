//! The force that a controller with this table produces, and its error.

use super::super::{Axis, Colour, Figure, Panel, Section, fixed, significant};
use super::view::{Banded, View};
use pam_data::statistics::NORMAL_95;

/// Contractions at which the force is evaluated, shares of the tested range.
const PLACES: [f64; 3] = [0.0, 1.0 / 3.0, 2.0 / 3.0];
/// Pressures along each curve.
const STEPS: usize = 60;

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("Force under control");
    let places: Vec<Place> = PLACES.iter().map(|share| Place::new(view, *share)).collect();
    let blocked = view.fit.summary.blocked_force_N;
    let worst = places.iter().flat_map(Place::halves).fold(0.0, f64::max);
    section.text(format!(
        "For a force setpoint the controller takes the pressure at which the table gives that force. The 95 % confidence interval of \
         the table adds an error of at most ± {} N ({} % of the blocked force). Single readings scatter by ± {} N (95 %) about the \
         model. The valve's error is not included.",
        significant(worst, 2),
        significant(100.0 * worst / blocked.max(f64::MIN_POSITIVE), 2),
        significant(NORMAL_95 * view.fit.summary.rms_N, 2)
    ));
    section.figure(pressure_for_force(view, &places));
    section.figure(error_of_force(view, &places));
    section
}

/// Curves over pressure at one contraction.
struct Place {
    title: String,
    /// Per direction: its name, pressures (kPa), forces with their interval, half the interval of readings.
    branches: Vec<(&'static str, Vec<f64>, Banded, Vec<f64>)>,
}

impl Place {
    fn new(view: &View<'_>, share: f64) -> Self {
        let solution = &view.fit.solution;
        let (stroke, pressure) = (solution.problem.points.stroke, solution.problem.points.pressure);
        let x = (stroke.low + share * stroke.span()).max(0.0);
        let ways: &[(f64, &'static str)] = if solution.problem.design.friction {
            &[(1.0, "shortening"), (-1.0, "lengthening")]
        } else {
            &[(0.0, "mid-line")]
        };
        let low = pressure.low.max(solution.deadband());
        let at: Vec<f64> =
            (0..STEPS).map(|i| low + (pressure.high - low) * i as f64 / (STEPS - 1) as f64).collect();
        let branches = ways.iter().map(|(direction, name)| {
            // A pressure at which the muscle does not pull produces no force.
            let pulls: Vec<f64> =
                at.iter().copied().filter(|p| view.force(*p, x, *direction) > 0.0).collect();
            let force: Banded = pulls.iter().map(|p| view.banded_at(*p, x, *direction)).collect();
            let readings = pulls.iter().map(|p| view.half_of_readings(*p, x, *direction)).collect();
            (*name, pulls.iter().map(|p| p / 1e3).collect(), force, readings)
        });
        let title = format!("contraction {} %", fixed(view.contraction(x), 1));
        Self { title, branches: branches.collect() }
    }

    fn halves(&self) -> impl Iterator<Item = f64> {
        self.branches.iter().flat_map(|(_, _, f, _)| f.middle.iter().zip(&f.low).map(|(m, l)| m - l))
    }
}

fn pressure_for_force(view: &View<'_>, places: &[Place]) -> Figure {
    let panels = places.iter().map(|place| {
        let mut panel = Panel::new(Axis::new("pressure P", "kPa"), Axis::new("force F", "N").from_zero())
            .titled(place.title.clone());
        for (i, (name, kpa, force, _)) in place.branches.iter().enumerate() {
            let band = if i == 0 { "95 % confidence interval" } else { "" };
            panel = panel.band(band, Colour::Series(i), kpa, &force.low, &force.high).line(
                *name,
                Colour::Series(i),
                kpa,
                &force.middle,
            );
        }
        panel
    });
    let note = if view.fit.solution.problem.design.friction {
        "Friction gives two pressures for one force: one while shortening, one while lengthening."
    } else {
        "No friction was found: each force has one pressure."
    };
    Figure::multiples(
        "controller",
        "Force against pressure at three contractions",
        format!("The controller reads the pressure for a force from these curves. {note}"),
        panels.collect(),
    )
    .shared(true, true)
}

fn error_of_force(view: &View<'_>, places: &[Place]) -> Figure {
    let panels = places.iter().map(|place| {
        let mut panel =
            Panel::new(Axis::new("force setpoint", "N").from_zero(), Axis::new("force error", "N"))
                .titled(place.title.clone());
        if let Some((_, _, force, readings)) = place.branches.first() {
            let low: Vec<f64> = readings.iter().map(|h| -h).collect();
            panel = panel.band("95 % of single readings", Colour::Muted, &force.middle, &low, readings);
        }
        for (i, (name, _, force, _)) in place.branches.iter().enumerate() {
            let off =
                |edge: &[f64]| -> Vec<f64> { edge.iter().zip(&force.middle).map(|(e, m)| e - m).collect() };
            let name = format!("table, {name}");
            panel = panel.band(name, Colour::Series(i), &force.middle, &off(&force.low), &off(&force.high));
        }
        panel
    });
    let spread = match view.fit.summary.left_out_pressure_mean_error_pct {
        Some(unseen) => format!(
            " At held-out pressures the mean error was {} % of the blocked force.",
            significant(unseen, 2)
        ),
        None => String::new(),
    };
    Figure::multiples(
        "controller-error",
        "Expected error of the force",
        format!(
            "Inner band: 95 % confidence interval of the table. Outer band: 95 % of single readings.{spread}"
        ),
        panels.collect(),
    )
    .shared(true, true)
}
