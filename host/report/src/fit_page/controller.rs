//! What a controller with this table will produce, and how far that may be from what was wanted.

use super::super::{Axis, Colour, Figure, Panel, Section, figures, fixed};
use super::view::{Banded, View};

/// Contractions at which the force is looked at, shares of the tested range.
const PLACES: [f64; 3] = [0.0, 1.0 / 3.0, 2.0 / 3.0];
/// Pressures along each curve.
const STEPS: usize = 60;

pub(super) fn section(view: &View<'_>) -> Section {
    let mut section = Section::new("What a controller will produce");
    let places: Vec<Place> = PLACES.iter().map(|share| Place::new(view, *share)).collect();
    let blocked = view.fit.summary.blocked_force_N;
    let worst = places.iter().flat_map(Place::halves).fold(0.0, f64::max);
    section.text(format!(
        "The controller has the table only: for a wanted force it takes the pressure at which the table gives that force. What the \
         muscle then pulls differs by what the table's numbers leave open, at most ± {} N here ({} % of the blocked force, \
         95 %), and by what the model does not describe, ± {} N for a single moment. The valve's own error comes on top.",
        figures(worst, 2),
        figures(100.0 * worst / blocked.max(f64::MIN_POSITIVE), 2),
        figures(pam_fit::confidence_band::HALF_95 * view.fit.summary.rms_N, 2)
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
            // A pressure at which the muscle does not pull is the answer to no wanted force.
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
            let band = if i == 0 { "95 % interval" } else { "" };
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
        "For one force there are two pressures, as the muscle shortens or lengthens: friction lies between them."
    } else {
        "Friction was not found, so there is one pressure for each force."
    };
    Figure::multiples(
        "controller",
        "Which force a pressure gives",
        format!("Read from the force to the pressure, this is what the controller does. {note}"),
        panels.collect(),
    )
    .shared(true, true)
}

fn error_of_force(view: &View<'_>, places: &[Place]) -> Figure {
    let panels = places.iter().map(|place| {
        let mut panel =
            Panel::new(Axis::new("wanted force", "N").from_zero(), Axis::new("produced − wanted", "N"))
                .titled(place.title.clone());
        if let Some((_, _, force, readings)) = place.branches.first() {
            let low: Vec<f64> = readings.iter().map(|h| -h).collect();
            panel = panel.band("95 % of single moments", Colour::Muted, &force.middle, &low, readings);
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
            " At pressures between the tested ones the table was off by {} % of the blocked force on average when they were left \
             out in turn.",
            figures(unseen, 2)
        ),
        None => String::new(),
    };
    Figure::multiples(
        "controller-error",
        "How far the produced force may be from the wanted one",
        format!("Inside: what the table's numbers leave open. Outside: with what the model does not describe.{spread}"),
        panels.collect(),
    )
    .shared(true, true)
}
