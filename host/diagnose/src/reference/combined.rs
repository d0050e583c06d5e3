//! Length and pressure that move together, as of a controller at work: taken apart into runs at nearly held lengths.
//!
//! The stroke of the reference is divided into equal parts, and each side into a few spans of time. The rows of one part and one span are
//! a run at the middle of that part: their force is taken there along ∂F/∂x, and the direction is that of the stroke.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};
use nalgebra::{DMatrix, DVector};
use pam_data::statistics::{extremes, quantile, range};

use super::answer::NotComparable;
use super::criteria::{
    BEYOND, COMBINED_BEYOND, COMBINED_FEWEST_ROWS, COMBINED_LENGTHS, COMBINED_PULLS, COMBINED_RIDGE,
    COMBINED_SMOOTH, COMBINED_SPANS, COMBINED_SWING, COMBINED_TURNED, COMBINED_TURNS, GRID, POINT_BINS,
    STROKES_ENDS, TABLE_SURFACE_STEP,
};
use super::runs::{Mounted, Run, Runs, mounted_anew};
use super::strokes::ends;
use super::surface::{Surface, bin};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::motion;
use pam_data::recording::{self, Campaign, Recording};
use pam_fit::table_file::TableFile;

/// Whether something beside the pressure moves the stroke: at one pressure it takes values further apart than a held length does,
/// smoothly and back and forth. A mounting that yields with the force, and a noisy sensor, do not.
pub(super) fn swings(r: &Recording) -> bool {
    let mut strokes = r.stroke.clone();
    let travel = quantile(&mut strokes, STROKES_ENDS.1) - quantile(&mut strokes, STROKES_ENDS.0);
    if !(travel > recording::HELD) {
        return false;
    }
    let n = r.stroke.len();
    let mean = r.stroke.iter().sum::<f64>() / n as f64;
    let variance = r.stroke.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
    let steps = r.stroke.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / n as f64;
    if !(steps < COMBINED_SMOOTH * variance) {
        return false;
    }
    let reversals =
        motion::way(&r.stroke, COMBINED_SWING * travel, 0.0).windows(2).filter(|w| w[0] != w[1]).count();
    let (low, high) = extremes(&r.pressure);
    let mut at = vec![Vec::new(); COMBINED_LENGTHS];
    for (p, x) in r.pressure.iter().zip(&r.stroke) {
        at[bin(*p, low, high, COMBINED_LENGTHS)].push(*x);
    }
    let spread = at.iter().map(range).fold(0.0, f64::max);
    reversals >= COMBINED_TURNS && spread > COMBINED_SWING * travel
}

/// ∂F/∂x, N/m, over pressure and stroke; `None` where the reference has no data.
type Slope<'a> = dyn Fn(f64, f64) -> Option<f64> + 'a;

/// A smooth force over pressure and stroke with another level for each direction; only its slopes are used. Over one part of the stroke
/// alone the pressure passes too rarely for a slope.
pub(super) struct Plane {
    pressures: (f64, f64),
    strokes: (f64, f64),
    coefficients: DVector<f64>,
}

/// Powers of pressure and stroke of the terms without direction.
const TERMS: [(i32, i32); 10] =
    [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (0, 3)];
/// The same of those with direction.
const GAP_TERMS: [(i32, i32); 3] = [(0, 0), (1, 0), (0, 1)];

impl Plane {
    /// By least squares over means of small bins, so that a hold does not outvote a motion.
    fn of(campaign: &Campaign) -> Result<Self> {
        let columns = |of: fn(&Recording) -> &Vec<f64>| {
            let all = campaign.recordings.iter().flat_map(|r| of(r).iter().copied());
            extremes(all)
        };
        let (pressures, strokes) = (columns(|r| &r.pressure), columns(|r| &r.stroke));
        let mut bins = vec![[0.0; 4]; 2 * POINT_BINS * POINT_BINS];
        for r in &campaign.recordings {
            let force = r.require_force()?;
            for (i, d) in motion::way(&r.stroke, motion::reversal_threshold(range(&r.stroke)), 0.0)
                .into_iter()
                .enumerate()
            {
                let at = bin(r.pressure[i], pressures.0, pressures.1, POINT_BINS) * POINT_BINS
                    + bin(r.stroke[i], strokes.0, strokes.1, POINT_BINS);
                let sum = &mut bins[2 * at + usize::from(d < 0.0)];
                let row = [r.pressure[i], r.stroke[i], force[i], 1.0];
                sum.iter_mut().zip(row).for_each(|(s, v)| *s += v);
            }
        }
        let plane = Self { pressures, strokes, coefficients: DVector::zeros(0) };
        let mut rows = Vec::new();
        let mut forces = Vec::new();
        for (place, [p, x, f, n]) in bins.into_iter().enumerate().filter(|(_, b)| b[3] > 0.0) {
            rows.push(plane.terms(p / n, x / n, if place % 2 == 0 { 1.0 } else { -1.0 }).transpose());
            forces.push(f / n);
        }
        let unusable = || {
            Error::new(DataCode::RecordingTooShort, "the reference has too few rows in motion")
                .help("record a minute of ordinary motion")
        };
        if rows.len() < 2 * (TERMS.len() + GAP_TERMS.len()) {
            return Err(unusable());
        }
        let design = DMatrix::from_rows(&rows);
        let mut inner = design.tr_mul(&design);
        let ridge = COMBINED_RIDGE * rows.len() as f64;
        for i in 0..inner.nrows() {
            inner[(i, i)] += ridge;
        }
        let solved = inner.cholesky().map(|f| f.solve(&design.tr_mul(&DVector::from_vec(forces))));
        Ok(Self { coefficients: solved.ok_or_else(unusable)?, ..plane })
    }

    /// Pressure and stroke, −1 to 1 over the range.
    fn scaled(&self, pressure: f64, stroke: f64) -> (f64, f64) {
        let one =
            |v: f64, (low, high): (f64, f64)| 2.0 * (v - low) / (high - low).max(f64::MIN_POSITIVE) - 1.0;
        (
            one(pressure, self.pressures).clamp(-COMBINED_BEYOND, COMBINED_BEYOND),
            one(stroke, self.strokes).clamp(-COMBINED_BEYOND, COMBINED_BEYOND),
        )
    }

    fn terms(&self, pressure: f64, stroke: f64, direction: f64) -> DVector<f64> {
        let (p, x) = self.scaled(pressure, stroke);
        let term = |(a, b): &(i32, i32)| p.powi(*a) * x.powi(*b);
        let gap = GAP_TERMS.iter().map(|t| direction * term(t));
        DVector::from_iterator(TERMS.len() + GAP_TERMS.len(), TERMS.iter().map(term).chain(gap))
    }

    /// ∂F/∂x, N/m.
    fn slope(&self, pressure: f64, stroke: f64) -> f64 {
        let (p, x) = self.scaled(pressure, stroke);
        let term = |((a, b), c): (&(i32, i32), &f64)| {
            if *b > 0 { c * f64::from(*b) * p.powi(*a) * x.powi(b - 1) } else { 0.0 }
        };
        let sum: f64 = TERMS.iter().zip(self.coefficients.iter()).map(term).sum();
        2.0 * sum / (self.strokes.1 - self.strokes.0).max(f64::MIN_POSITIVE)
    }

    /// ∂F/∂P, N/Pa.
    fn by_pressure(&self, pressure: f64, stroke: f64) -> f64 {
        let (p, x) = self.scaled(pressure, stroke);
        let term = |((a, b), c): (&(i32, i32), &f64)| {
            if *a > 0 { c * f64::from(*a) * p.powi(a - 1) * x.powi(*b) } else { 0.0 }
        };
        let sum: f64 = TERMS.iter().zip(self.coefficients.iter()).map(term).sum();
        2.0 * sum / (self.pressures.1 - self.pressures.0).max(f64::MIN_POSITIVE)
    }

    /// Gives a surface these slopes.
    pub(super) fn into_slopes(self, surface: &mut Surface, strokes: &[f64]) {
        let step = (surface.high - surface.low) / (GRID - 1) as f64;
        let grid: Vec<f64> = (0..GRID).map(|i| surface.low + step * i as f64).collect();
        for (curve, x) in surface.curves.iter_mut().zip(strokes) {
            curve.by_pressure = grid.iter().map(|p| self.by_pressure(*p, *x)).collect();
            curve.by_stroke = grid.iter().map(|p| self.slope(*p, *x)).collect();
        }
        surface.find_usual_slope();
    }
}

/// Runs of AFTER and of earlier recordings, and the slopes of these.
///
/// # Errors
/// A recording without force, or a reference of too few rows.
pub(super) fn of(before: &Campaign, after: &Campaign, said: Mounted) -> Result<(Runs, Plane)> {
    let plane = Plane::of(before)?;
    let slope = |p: f64, x: f64| Some(plane.slope(p, x));
    let mut runs = Runs {
        strokes: middles(before),
        remounted: mounted_anew(before, after, said),
        moving: true,
        ..Runs::default()
    };
    add(&mut runs, before, false, &slope)?;
    add(&mut runs, after, true, &slope)?;
    Ok((runs, plane))
}

/// Runs of AFTER alone, for a reference that is a table.
///
/// # Errors
/// A recording without force, or a table that cannot be evaluated.
pub(super) fn alone(table: &TableFile, after: &Campaign, said: Mounted) -> Result<Runs> {
    let muscle =
        Muscle::<f64>::build(&table.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let force =
        |p: f64, x: f64| muscle.force(Pressure::from_pascals(p), Length::from_metres(x), 0.0).newtons();
    let high = f64::from(table.table.tested.pressure_high.pascals());
    let least = COMBINED_PULLS * force(high, 0.0).max(0.0);
    // A table is fitted where the muscle pulls: it does not hold for a slack one.
    let slope = |p: f64, x: f64| {
        (force(p, x) > least).then(|| {
            (force(p, x + TABLE_SURFACE_STEP) - force(p, x - TABLE_SURFACE_STEP)) / (2.0 * TABLE_SURFACE_STEP)
        })
    };
    let remounted = said != Mounted::Same;
    let mut runs = Runs { strokes: middles(after), remounted, moving: true, ..Runs::default() };
    add(&mut runs, after, true, &slope)?;
    Ok(runs)
}

/// Middles of equal parts of the stroke, m; as many as have rows enough.
fn middles(campaign: &Campaign) -> Vec<f64> {
    let (low, high) = ends(campaign);
    let rows = |parts: usize| {
        let mut counts = vec![0; parts];
        for x in campaign.recordings.iter().flat_map(|r| &r.stroke) {
            counts[bin(*x, low, high, parts)] += 1;
        }
        counts.into_iter().min().unwrap_or(0)
    };
    let enough = |parts: &usize| rows(*parts) >= COMBINED_SPANS * COMBINED_FEWEST_ROWS;
    let parts = (1..=COMBINED_LENGTHS).rev().find(enough).unwrap_or(1);
    (0..parts).map(|i| low + (high - low) * (i as f64 + 0.5) / parts as f64).collect()
}

/// The direction of every row by the stroke, and whether the row is far enough from the last reversal for friction to have turned, too.
fn directions(stroke: &[f64]) -> (Vec<f64>, Vec<bool>) {
    let travel = range(stroke);
    let direction = motion::way(stroke, motion::reversal_threshold(travel), 0.0);
    let mut start = stroke.first().copied().unwrap_or(0.0);
    let mut reversed = vec![false; stroke.len()];
    for i in 1..stroke.len() {
        if direction[i] != direction[i - 1] {
            start = stroke[i];
        }
        reversed[i] = (stroke[i] - start) * direction[i] > COMBINED_TURNED * travel;
    }
    (direction, reversed)
}

/// Adds the runs of one side, and says which part of AFTER lies beyond the lengths.
fn add(runs: &mut Runs, campaign: &Campaign, after: bool, slope: &Slope<'_>) -> Result<()> {
    let parts = runs.strokes.len();
    let half = match runs.strokes.as_slice() {
        [first, second, ..] => (second - first) / 2.0,
        _ => range(campaign.recordings.iter().flat_map(|r| &r.stroke)) / 2.0,
    };
    let (low, high) = (runs.strokes[0] - half, runs.strokes[parts - 1] + half);
    let beyond = BEYOND * (high - low);
    let lasts = |r: &Recording| r.time.last().zip(r.time.first()).map_or(0.0, |(l, f)| l - f);
    let total: f64 = campaign.recordings.iter().map(lasts).sum::<f64>().max(f64::MIN_POSITIVE);
    let (mut elapsed, mut number) = (0.0, 0);
    for r in &campaign.recordings {
        let force = r.require_force()?;
        let (direction, reversed) = directions(&r.stroke);
        let duration = lasts(r);
        let spans = ((COMBINED_SPANS as f64 * duration / total).round() as usize).max(1);
        let mut members = vec![Vec::new(); spans * parts];
        let mut out = 0;
        for i in 0..r.time.len() {
            let x = r.stroke[i];
            let known = x >= low - beyond && x <= high + beyond;
            let Some(slope) = slope(r.pressure[i], x).filter(|_| known) else {
                out += 1;
                continue;
            };
            if reversed[i] {
                let span = bin(r.time[i] - r.time[0], 0.0, duration, spans);
                members[span * parts + bin(x, low, high, parts)].push((i, slope));
            }
        }
        if after && out > 0 {
            let share = out as f64 / r.time.len() as f64;
            runs.not_comparable.push(NotComparable::Lengths { recording: r.name.clone(), share });
        }
        for (place, rows) in members.into_iter().enumerate().filter(|(_, m)| m.len() >= COMBINED_FEWEST_ROWS)
        {
            let (span, mounting) = (place / parts, place % parts);
            let begins = duration * span as f64 / spans as f64;
            let middle = runs.strokes[mounting];
            runs.runs.push(Run {
                name: r.name.clone(),
                after,
                mounting,
                number: number + span,
                shift: 0.0,
                time: rows.iter().map(|(i, _)| r.time[*i] - r.time[0] - begins).collect(),
                pressure: rows.iter().map(|(i, _)| r.pressure[*i]).collect(),
                force: rows.iter().map(|(i, slope)| force[*i] - slope * (r.stroke[*i] - middle)).collect(),
                settled: vec![true; rows.len()],
                direction: rows.iter().map(|(i, _)| direction[*i]).collect(),
                since_mounted: elapsed + begins,
                since_after: if after { elapsed + begins } else { 0.0 },
            });
        }
        number += spans;
        elapsed += duration;
    }
    if after {
        runs.duration = elapsed;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(stroke: impl Fn(f64) -> f64, pressure: impl Fn(f64) -> f64) -> Recording {
        let time: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.01).collect();
        let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        Recording { stroke: of(&stroke), pressure: of(&pressure), time, ..Recording::default() }
    }

    #[test]
    fn a_stroke_that_something_else_moves_swings_and_a_mounting_that_gives_does_not() {
        let pressure = |t: f64| 300e3 + 200e3 * (1.3 * t).sin();
        assert!(swings(&recording(|t| 5e-4 * (2.5 * t).sin(), pressure)));
        assert!(!swings(&recording(|t| 5e-4 * (1.3 * t).sin(), pressure)));
        assert!(!swings(&recording(|t| 5e-4 * (9_999.0 * t * t).sin(), pressure)));
        assert!(!swings(&recording(|_| 5e-3, pressure)));
    }

    #[test]
    fn the_slope_over_the_length_is_found_beside_the_pressure() {
        let mut r = recording(|t| 5e-3 * (2.5 * t).sin(), |t| 300e3 + 200e3 * (1.3 * t).sin());
        let force = |p: f64, x: f64| 3e-4 * p * (1.0 - 40.0 * x) - 500.0 * x;
        r.force = Some(r.pressure.iter().zip(&r.stroke).map(|(p, x)| force(*p, *x)).collect());
        let plane = Plane::of(&Campaign::new(vec![r])).expect("enough rows");
        let slope = plane.slope(350e3, 1e-3);
        assert!((slope / -4_700.0 - 1.0).abs() < 0.02, "{slope}");
    }
}
