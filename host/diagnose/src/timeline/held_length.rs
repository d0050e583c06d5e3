//! Quantities of pressure sweeps at held lengths, read from the recordings without any model.

use pam_data::error::Result;

use super::mean::{Repeats, pooled};
use super::series::{Kind, Point, Quantity, Series};
use super::{Visit, of_campaign};
use crate::criteria::timeline::{PRESSURE_BINS, THRESHOLD_SHARE, TURN_MARGIN};
use crate::reference::sweeps::{Sweep, sweeps};

/// Force of a run at the middles of bins of pressure, by direction; `NaN` where there are no rows.
struct Profile {
    stroke: usize,
    force: [Vec<f64>; 2],
}

/// Pressures that all runs of all campaigns reach, Pa.
fn common_range(all: &[Vec<Sweep>]) -> (f64, f64) {
    all.iter().flatten().fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), s| {
        let (a, b) = s.pressures();
        (low.max(a), high.min(b))
    })
}

fn profile(sweep: &Sweep, low: f64, high: f64) -> Profile {
    let mut sums = [vec![(0.0, 0.0, 0usize); PRESSURE_BINS], vec![(0.0, 0.0, 0usize); PRESSURE_BINS]];
    for (p, force, direction) in sweep.settled() {
        if p >= low && p <= high {
            let bin = (((p - low) / (high - low) * PRESSURE_BINS as f64) as usize).min(PRESSURE_BINS - 1);
            let sum = &mut sums[usize::from(direction < 0.0)][bin];
            *sum = (sum.0 + p, sum.1 + force, sum.2 + 1);
        }
    }
    let width = (high - low) / PRESSURE_BINS as f64;
    let at_middles = |sums: &[(f64, f64, usize)]| {
        // Rows do not lie evenly in a bin: the force is taken at its middle, not at the rows' mean.
        let means: Vec<(f64, f64)> =
            sums.iter().filter(|s| s.2 > 0).map(|(p, f, n)| (p / *n as f64, f / *n as f64)).collect();
        let one = |(bin, sum): (usize, &(f64, f64, usize))| {
            let middle = low + width * (bin as f64 + 0.5);
            if sum.2 > 0 { interpolated(&means, middle) } else { f64::NAN }
        };
        sums.iter().enumerate().map(one).collect()
    };
    Profile { stroke: sweep.stroke, force: [at_middles(&sums[0]), at_middles(&sums[1])] }
}

/// A line through the two neighbouring points, or the two outermost.
fn interpolated(points: &[(f64, f64)], at: f64) -> f64 {
    if points.len() < 2 {
        return points.first().map_or(f64::NAN, |p| p.1);
    }
    let above = points.partition_point(|p| p.0 < at).clamp(1, points.len() - 1);
    let (a, b) = (points[above - 1], points[above]);
    a.1 + (b.1 - a.1) * (at - a.0) / (b.0 - a.0)
}

impl Profile {
    /// Mean of both directions where both are there, of the one otherwise.
    fn middle(&self, bin: usize) -> f64 {
        let (a, b) = (self.force[0][bin], self.force[1][bin]);
        if a.is_finite() && b.is_finite() {
            (a + b) / 2.0
        } else if a.is_finite() {
            a
        } else {
            b
        }
    }

    fn hysteresis(&self) -> f64 {
        let gaps =
            self.force[0].iter().zip(&self.force[1]).map(|(a, b)| (b - a) / 2.0).filter(|g| g.is_finite());
        let (sum, n) = gaps.fold((0.0, 0), |(s, n), g| (s + g, n + 1));
        if n > 0 { sum / f64::from(n) } else { f64::NAN }
    }

    /// Pressure at which the mean force rises through `force`, Pa.
    fn crossing(&self, force: f64, low: f64, high: f64) -> f64 {
        let width = (high - low) / PRESSURE_BINS as f64;
        let at = |bin: usize| low + width * (bin as f64 + 0.5);
        let known: Vec<(f64, f64)> =
            (0..PRESSURE_BINS).map(|b| (at(b), self.middle(b))).filter(|(_, f)| f.is_finite()).collect();
        let through = known.windows(2).find(|w| w[0].1 < force && w[1].1 >= force);
        through.map_or(f64::NAN, |w| w[0].0 + (w[1].0 - w[0].0) * (force - w[0].1) / (w[1].1 - w[0].1))
    }
}

/// All quantities.
///
/// # Errors
/// A recording without force.
pub(super) fn series(visits: &[Visit], reference: usize) -> Result<Vec<Series>> {
    let sides = visits
        .iter()
        .map(|v| sweeps(&visits[reference].campaign, &v.campaign).map_err(|e| of_campaign(v, e)))
        .collect::<Result<Vec<_>>>()?;
    let (low, high) = common_range(&sides);
    // About a turn the direction is that of the hold before it, not the pressure's.
    let (low, high) = (low + TURN_MARGIN * (high - low), high - TURN_MARGIN * (high - low));
    if !(high > low) {
        return Ok(Vec::new());
    }
    let profiles: Vec<Vec<Profile>> =
        sides.iter().map(|s| s.iter().map(|sweep| profile(sweep, low, high)).collect()).collect();
    // The length at which the force is largest, of those that every campaign has.
    let shared = |stroke: &usize| profiles.iter().all(|p| p.iter().any(|r| r.stroke == *stroke));
    let mut strokes: Vec<usize> = profiles[reference].iter().map(|p| p.stroke).collect();
    strokes.sort_unstable();
    let Some(first) = strokes.into_iter().find(shared) else { return Ok(Vec::new()) };
    let gather = |of: &dyn Fn(&Profile) -> f64, only_first: bool| -> Vec<Option<Point>> {
        let one = |runs: &Vec<Profile>| {
            let mut repeats = Repeats::default();
            for p in runs.iter().filter(|p| !only_first || p.stroke == first) {
                repeats.push(p.stroke, of(p));
            }
            repeats
        };
        pooled(profiles.iter().map(one).collect())
            .into_iter()
            .map(|m| m.map(|(v, s)| Point::new(v, s)))
            .collect()
    };
    let top = gather(&|p| p.middle(PRESSURE_BINS - 1), true);
    let largest = top[reference].map_or(0.0, |p| p.value);
    let measured = |quantity, unit, points| Series::of(quantity, Kind::Measured, unit, points);
    Ok(vec![
        measured(Quantity::LargestForce, "N", top),
        measured(Quantity::Hysteresis, "N", gather(&Profile::hysteresis, false)),
        measured(
            Quantity::Threshold,
            "Pa",
            gather(&|p| p.crossing(THRESHOLD_SHARE * largest, low, high), true),
        ),
    ])
}
