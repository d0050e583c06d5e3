//! A run that differs from what the memory explains: a slip that lasts, or a single bad run.
//!
//! The offset of a run is the shift of pressure that brings it onto the curve of the other runs of its mounting, with the memory held:
//! `o = Σ S′(y − ŷ)/Σ S′²`, kPa. A change of length by slipping shows as such a shift. The first run of a mounting is never called bad: what
//! the memory leaves of it is run-in.

use super::campaign::Points;
use super::criteria::{
    BAD_RUN_ERRORS, BAD_RUN_LEAST, BAD_RUN_NEXT, BAD_RUN_RUNS, RUN_OFFSET_FLAT, RUN_OFFSET_LEAST,
    SLIP_ERRORS, SLIP_GAIN, SLIP_LEAST, SLIP_RUNS, SUPPORT,
};
use super::law::{Law, Layer};
use super::shift_fit;
use super::spline::Banded;
use super::unseen::shifted_curves;
use pam_data::statistics::{deviation_from_median, median, midpoint_median};
use pam_fit::numerics::bspline::CubicSplines;
use pam_fit::numerics::jackknife;
use pam_fit::numerics::student::half_width_95;

/// What happened to a run, or from a run on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Event {
    pub mounting: usize,
    /// Number of the run within its mounting, from 1.
    pub run: usize,
    /// Whether it lasts until the end of the mounting.
    pub lasts: bool,
    /// Shift of pressure, kPa.
    pub shift: f64,
    /// Its standard error: by jackknife over runs, or the deviation of all runs.
    pub error: f64,
    /// Whether every rule holds; of a slip that is only likely the interval excludes none.
    pub sure: bool,
}

/// Offset of each run from the others of its mounting, kPa; not a number where it is not identifiable.
pub(super) fn offsets(layer: &Layer<'_>, law: &Law) -> Vec<f64> {
    let points = layer.points;
    let shifted: Vec<f64> = (0..points.len())
        .map(|i| {
            let shifts = law.columns.iter().zip(&law.fit.theta).map(|(q, t)| q[i] * t);
            points.pressure[i] + shifts.sum::<f64>()
        })
        .collect();
    (0..points.runs.len()).map(|r| offset(points, &layer.spline, &shifted, r).unwrap_or(f64::NAN)).collect()
}

fn offset(points: &Points, spline: &CubicSplines, shifted: &[f64], run: usize) -> Option<f64> {
    let mounting = points.runs[run].mounting;
    let mut band = Banded::penalty(spline.len(), super::criteria::SMOOTHNESS, super::criteria::RIDGE);
    let mut weights = vec![0.0; spline.len()];
    let mut reached = f64::NEG_INFINITY;
    for i in (0..points.len()).filter(|i| points.mounting[*i] == mounting && points.run[*i] != run) {
        let local = spline.at(shifted[i]);
        band.add(&local, 1.0);
        (0..4).for_each(|k| weights[local.first + k] += local.value[k] * points.force[i]);
        reached = reached.max(shifted[i]);
    }
    if !reached.is_finite() {
        return None;
    }
    band.factor().solve(&mut weights);
    let (from, to) = points.runs[run].points;
    let own: Vec<(f64, f64)> = (from..to)
        .filter(|i| shifted[*i] <= reached + SUPPORT)
        .map(|i| {
            let local = spline.at(shifted[i]);
            (local.slope(&weights), points.force[i] - local.value(&weights))
        })
        .collect();
    let steepest = own.iter().map(|o| o.0).fold(0.0, f64::max);
    let counts = own.iter().filter(|o| o.0 > RUN_OFFSET_FLAT * steepest);
    let (n, along, square) = counts.fold((0, 0.0, 0.0), |(n, a, q), (s, e)| (n + 1, a + s * e, q + s * s));
    (n >= RUN_OFFSET_LEAST && square > 0.0).then(|| along / square)
}

/// Robust deviation of all offsets about the median of their mounting, kPa.
pub(super) fn deviation(points: &Points, offsets: &[f64]) -> f64 {
    let mut away = Vec::new();
    for mounting in &points.mountings {
        let mut own: Vec<f64> = mounting.runs.iter().map(|r| offsets[*r]).filter(|o| o.is_finite()).collect();
        let middle = midpoint_median(&mut own);
        away.extend(own.iter().map(|o| (o - middle).abs()));
    }
    deviation_from_median(median(&mut away))
}

/// The runs of a mounting whose offset is known, with it.
fn known_offsets(points: &Points, mounting: usize, offsets: &[f64]) -> Vec<(usize, f64)> {
    let runs = points.mountings[mounting].runs.iter();
    runs.map(|r| (points.runs[*r].number, offsets[*r])).filter(|o| o.1.is_finite()).collect()
}

/// A single run that is off, and no other.
fn bad_run(points: &Points, mounting: usize, offsets: &[f64], deviation: f64) -> Option<Event> {
    let own = known_offsets(points, mounting, offsets);
    if (own.len() as f64) < BAD_RUN_RUNS {
        return None;
    }
    let middle = midpoint_median(&mut own.iter().map(|o| o.1).collect::<Vec<_>>());
    let mut away: Vec<(usize, f64)> = own.iter().map(|(k, o)| (*k, o - middle)).collect();
    away.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let ((run, shift), next) = (away[0], away[1].1.abs());
    let large = shift.abs() > (BAD_RUN_ERRORS * deviation).max(BAD_RUN_LEAST);
    let alone = shift.abs() > BAD_RUN_NEXT * next;
    (run > 1 && large && alone).then_some(Event {
        mounting,
        run,
        lasts: false,
        shift,
        error: deviation,
        sure: true,
    })
}

/// The place at which the offsets of a mounting most likely step, if they do: the refit decides.
fn candidate(points: &Points, mounting: usize, offsets: &[f64]) -> Option<usize> {
    let own = known_offsets(points, mounting, offsets);
    if (own.len() as f64) < SLIP_RUNS {
        return None;
    }
    let scatter = |part: &[(usize, f64)]| {
        let mean = part.iter().map(|o| o.1).sum::<f64>() / part.len().max(1) as f64;
        part.iter().map(|o| (o.1 - mean).powi(2)).sum::<f64>()
    };
    let splits = (2..own.len() - 1).map(|s| (s, scatter(&own[..s]) + scatter(&own[s..])));
    let (split, _) = splits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(own[split].0)
}

/// The column of a step that lasts from a run of a mounting on.
pub(super) fn step_column(points: &Points, mounting: usize, from_run: usize) -> Vec<f64> {
    let after = |i: usize| points.mounting[i] == mounting && points.runs[points.run[i]].number >= from_run;
    (0..points.len()).map(|i| f64::from(u8::from(after(i)))).collect()
}

/// A slip that unseen runs support, in one mounting; `P_b` and the unrecorded times are held.
fn slip(layer: &Layer<'_>, law: &Law, mounting: usize, offsets: &[f64]) -> Option<Event> {
    let points = layer.points;
    let run = candidate(points, mounting, offsets)?;
    let without = law.columns.clone();
    let mut with = without.clone();
    with.push(step_column(points, mounting, run));
    let everything = vec![true; points.len()];
    let start = with_room(law).theta;
    let full = shift_fit::fit(points, &layer.spline, &everything, &with, &start, 6);
    let shift = *full.theta.last()?;
    if !(shift.abs() >= SLIP_LEAST) {
        return None;
    }
    let (stepped, thetas) = shifted_curves(layer, &with, &full.theta);
    let (plain, _) = shifted_curves(layer, &without, &law.fit.theta);
    let steps: Vec<f64> = thetas.iter().filter_map(|t| t.last().copied()).collect();
    let error = jackknife::deviation(&steps);
    let here = |i: usize| points.mounting[i] == mounting;
    let (before, after) = (plain.sizes(points, here).rms, stepped.sizes(points, here).rms);
    let likely = shift.abs() > half_width_95(steps.len().saturating_sub(1)) * error
        && after <= (1.0 - SLIP_GAIN) * before;
    let sure = shift.abs() > SLIP_ERRORS * error;
    likely.then_some(Event { mounting, run, lasts: true, shift, error, sure })
}

/// A fit with one more coefficient, zero.
pub(super) fn with_room(law: &Law) -> shift_fit::ShiftFit {
    let mut fit = law.fit.clone();
    fit.theta.push(0.0);
    fit
}

/// All slips and bad runs, mounting by mounting.
pub(super) fn events(layer: &Layer<'_>, law: &Law, offsets: &[f64]) -> Vec<Event> {
    let deviation = deviation(layer.points, offsets);
    (0..layer.points.mountings.len())
        .filter_map(|m| bad_run(layer.points, m, offsets, deviation).or_else(|| slip(layer, law, m, offsets)))
        .collect()
}
