//! Delays between the channels, by rows in motion.

use super::cells::Cell;
use super::contrast::{log_mean, student};
use super::criteria::{
    CELLS, LAG_AFTER_TURN, LAG_CLIP, LAG_CORRELATION, LAG_FLOOR, LAG_GAP, LAG_RUNS, LAG_SIZES, LAG_SPREADS,
    LAG_WEIGHED_BY, LAGS, MEDIAN_VARIANCE,
};
use super::runs::{Run, Runs};
use super::surface::{Surface, bin};
use pam_data::statistics::{deviation_from_median, median, midpoint_median};

/// The lag of a run that explains its force best, s: positive where the force is late, negative where the pressure reading is.
#[derive(Debug, Clone, Copy, Default)]
struct Score {
    pub lag: f64,
    /// How much a lag would show: a slack mounting does not show it.
    pub weight: f64,
    /// Variance by the run's own noise, s²: large where two lags explain the force about as well.
    pub variance: f64,
}

/// What AFTER's lags differ by.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shift {
    /// Lag of AFTER less that of BEFORE, s; positive where the force became later.
    pub lag: f64,
    /// Variance, s².
    pub variance: f64,
    /// Log density if nothing changed.
    pub unchanged: f64,
    /// Log density under a change.
    pub changed: f64,
}

/// A signal a time `lag` earlier at every row; before the first row it holds its value.
pub(super) fn delayed(time: &[f64], values: &[f64], lag: f64) -> Vec<f64> {
    let mut at = 0;
    time.iter()
        .map(|t| {
            let t = t - lag;
            while at + 1 < time.len() && time[at + 1] <= t {
                at += 1;
            }
            if t <= time[0] || at + 1 >= time.len() {
                return values[at];
            }
            values[at] + (values[at + 1] - values[at]) * (t - time[at]) / (time[at + 1] - time[at])
        })
        .collect()
}

/// A first-order lag, exact where the signal is linear between rows.
pub(super) fn low_pass(time: &[f64], values: &[f64], lag: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(values.len());
    let mut state = values.first().copied().unwrap_or(0.0);
    out.push(state);
    for i in 1..values.len() {
        let h = time[i] - time[i - 1];
        let slope = (values[i] - values[i - 1]) / h;
        state = values[i] - slope * lag + (state - (values[i - 1] - slope * lag)) * (-h / lag).exp();
        out.push(state);
    }
    out
}

struct Scorer<'a> {
    run: &'a Run,
    surface: &'a Surface,
    /// Rows that count, with their cell.
    rows: Vec<(usize, usize)>,
}

/// Which rows show lags beside a change of friction: at a reversal its force jumps, and a jump at another row than the one
/// that is taken for the reversal looks like a lag. `longest`: of the lags that are tried, s.
fn clear_of_reversals(run: &Run, longest: f64) -> Vec<bool> {
    let reversed = (1..run.time.len()).filter(|i| run.direction[*i] != run.direction[i - 1]);
    let reversals: Vec<f64> = reversed.map(|i| run.time[i]).collect();
    let clear = |t: &f64| reversals.iter().all(|r| t - r < -longest || t - r > LAG_AFTER_TURN * longest);
    run.time.iter().map(clear).collect()
}

impl<'a> Scorer<'a> {
    fn new(run: &'a Run, surface: &'a Surface, clear: &[bool]) -> Self {
        let mut steps: Vec<f64> = run.time.windows(2).map(|w| w[1] - w[0]).collect();
        let usual = median(&mut steps);
        let rows = (1..run.time.len())
            .filter(|i| run.time[*i] - run.time[i - 1] < LAG_GAP * usual && clear[*i])
            .map(|i| {
                let place = bin(run.pressure[i], surface.low, surface.high, CELLS);
                (i, place + if run.direction[i] > 0.0 { CELLS } else { 0 })
            })
            .collect();
        Self { run, surface, rows }
    }

    fn forces(&self, pressure: &[f64]) -> Vec<f64> {
        let of = |(p, d): (&f64, &f64)| self.surface.force(self.run.mounting, *p, *d);
        pressure.iter().zip(&self.run.direction).map(of).collect()
    }

    /// Sum of squares after the mean of each cell, clipped.
    fn cost(&self, force: &[f64], expected: &[f64]) -> f64 {
        self.residuals(force, expected).iter().map(|e| e * e).sum()
    }

    /// Residuals after the mean of each cell, clipped.
    fn residuals(&self, force: &[f64], expected: &[f64]) -> Vec<f64> {
        let mut sums = [(0.0_f64, 0.0_f64); 2 * CELLS];
        for (i, cell) in &self.rows {
            sums[*cell] = (sums[*cell].0 + force[*i] - expected[*i], sums[*cell].1 + 1.0);
        }
        let limit = LAG_CLIP * self.surface.largest;
        let of = |(i, cell): &(usize, usize)| {
            let e = force[*i] - expected[*i] - sums[*cell].0 / sums[*cell].1.max(1.0);
            e.clamp(-limit, limit)
        };
        self.rows.iter().map(of).collect()
    }

    /// Variance that one independent residual has, times two: residuals that follow each other are not independent, and by a correlation
    /// `r` from row to row only a share `(1 − r)/(1 + r)` of them counts.
    fn temperature(&self) -> f64 {
        let e = self.residuals(&self.run.force, &self.forces(&self.run.pressure));
        let square: f64 = e.iter().map(|v| v * v).sum();
        let next: f64 = e.windows(2).map(|w| w[0] * w[1]).sum();
        let correlation = if square > 0.0 { (next / square).clamp(0.0, LAG_CORRELATION) } else { 0.0 };
        2.0 * square / e.len().max(1) as f64 * (1.0 + correlation) / (1.0 - correlation)
    }
}

/// Mean square distance from `lag` of all lags that were tried, each with the probability that its cost leaves it.
fn spread(tried: &[(f64, f64)], lag: f64, temperature: f64) -> f64 {
    let least = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
    let (mut sum, mut all) = (0.0, f64::MIN_POSITIVE);
    for i in 0..tried.len() {
        // Lags are not tried at equal distances: each has the weight of half the way to its neighbours.
        let width = tried[(i + 1).min(tried.len() - 1)].0 - tried[i.saturating_sub(1)].0;
        let p = width * (-(tried[i].1 - least) / temperature.max(f64::MIN_POSITIVE)).exp();
        sum += p * (tried[i].0 - lag).powi(2);
        all += p;
    }
    sum / all
}

/// Where a parabola through three points is lowest; the middle one where it opens downwards.
fn lowest(x: [f64; 3], y: [f64; 3]) -> f64 {
    let (a, b) = ((y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1]));
    let curvature = (b - a) / (x[2] - x[0]);
    if !(curvature > 0.0) {
        return x[1];
    }
    ((x[0] + x[1]) / 2.0 - a / (2.0 * curvature)).clamp(x[0], x[2])
}

/// The lag score of a run. The `first` of the lags are tried, and all of them where the longest of these is the best.
fn score(run: &Run, surface: &Surface, first: usize, rubs: bool) -> Score {
    let usual = &LAGS[..first.clamp(1, LAGS.len())];
    let longest = usual[usual.len() - 1];
    let clear = if rubs { clear_of_reversals(run, longest) } else { vec![true; run.time.len()] };
    let scorer = Scorer::new(run, surface, &clear);
    let expected = scorer.forces(&run.pressure);
    let later = |lag: f64| scorer.forces(&delayed(&run.time, &run.pressure, lag));
    let cost = |lag: f64| {
        let cost = if lag < 0.0 {
            scorer.cost(&low_pass(&run.time, &run.force, -lag), &expected)
        } else if lag > 0.0 {
            scorer.cost(&run.force, &later(lag))
        } else {
            scorer.cost(&run.force, &expected)
        };
        (lag, cost)
    };
    let both = |lags: &[f64]| -> Vec<(f64, f64)> {
        lags.iter().rev().map(|l| -l).chain([0.0]).chain(lags.iter().copied()).map(cost).collect()
    };
    let least = |tried: &[(f64, f64)]| {
        (0..tried.len()).min_by(|a, b| tried[*a].1.total_cmp(&tried[*b].1)).unwrap_or(0)
    };
    let mut tried = both(usual);
    let mut best = least(&tried);
    if (best == 0 || best + 1 == tried.len()) && usual.len() < LAGS.len() {
        tried = both(&LAGS);
        best = least(&tried);
    }
    let lag = if best > 0 && best + 1 < tried.len() {
        let near = &tried[best - 1..=best + 1];
        lowest([near[0].0, near[1].0, near[2].0], [near[0].1, near[1].1, near[2].1])
    } else {
        tried[best].0
    };
    let moved = later(LAG_WEIGHED_BY);
    let weight = 1e-9 + scorer.rows.iter().map(|(i, _)| (moved[*i] - expected[*i]).powi(2)).sum::<f64>();
    Score { lag, weight, variance: spread(&tried, lag, scorer.temperature()) }
}

/// The value below which half of the weight lies.
fn weighted_median(values: &[(f64, f64)]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * sorted.iter().map(|v| v.1).sum::<f64>();
    let mut sum = 0.0;
    for (value, weight) in &sorted {
        sum += weight;
        if sum >= half {
            return *value;
        }
    }
    sorted.last().map_or(0.0, |v| v.0)
}

/// AFTER's lags against BEFORE's: a robust contrast per mounting, joined by a weighted median.
fn shift(runs: &Runs, scores: &[Score]) -> Shift {
    let (mut contrasts, mut deviations) = (Vec::new(), Vec::new());
    let alone = runs.side(false).next().is_none();
    for mounting in 0..runs.strokes.len() {
        let side = |after: bool| -> Vec<(f64, f64)> {
            let both = runs.runs.iter().zip(scores);
            both.filter(|(r, _)| r.mounting == mounting && r.after == after)
                .map(|(_, s)| (s.lag, s.weight))
                .collect()
        };
        let (after, before) = (side(true), side(false));
        if after.is_empty() || (before.is_empty() && !alone) {
            continue;
        }
        // A table knows no lag.
        let (a, b) = (weighted_median(&after), weighted_median(&before));
        let total =
            |v: &[(f64, f64)]| if v.is_empty() { f64::INFINITY } else { v.iter().map(|s| s.1).sum::<f64>() };
        contrasts.push((a - b, 1.0 / (1.0 / total(&after) + 1.0 / total(&before))));
        deviations.extend(after.iter().map(|s| s.0 - a).chain(before.iter().map(|s| s.0 - b)));
    }
    let lag = weighted_median(&contrasts);
    let mut sizes: Vec<f64> = deviations.iter().map(|d: &f64| d.abs()).collect();
    let limit = LAG_SPREADS * deviation_from_median(midpoint_median(&mut sizes)).max(LAG_FLOOR);
    let freedom = deviations.len().saturating_sub(2 * contrasts.len()) as f64;
    let square: f64 = deviations.iter().map(|d| d.clamp(-limit, limit).powi(2)).sum();
    let spread = (LAG_RUNS * LAG_FLOOR * LAG_FLOOR + square) / (LAG_RUNS + freedom);
    let share =
        |after: bool| if alone && !after { 0.0 } else { 1.0 / (runs.side(after).count() as f64).max(1.0) };
    // Of a slack mounting nothing is known, and nothing is taken: weighted as the medians are.
    let own = |after: bool| {
        let side = || runs.runs.iter().zip(scores).filter(move |(r, _)| r.after == after).map(|(_, s)| s);
        let total: f64 = side().map(|s| s.weight).sum();
        side().map(|s| s.weight * s.variance).sum::<f64>() / total.max(f64::MIN_POSITIVE)
    };
    let each = |after: bool| (spread + own(after)) * share(after);
    let variance = MEDIAN_VARIANCE * (each(true) + each(false)) + LAG_FLOOR * LAG_FLOOR;
    let degrees = LAG_RUNS + freedom;
    let density = |v: f64| student(lag, v, degrees);
    let each: Vec<f64> = LAG_SIZES.iter().map(|s| density(variance + s * s)).collect();
    // The sign is known, hence twice the density.
    Shift { lag, variance, unchanged: density(variance), changed: log_mean(&each) + std::f64::consts::LN_2 }
}

/// AFTER's lags against BEFORE's. `first`: how many lags are tried first. `rubs`: whether friction changed, which leaves the rows at turns out.
pub(super) fn between(runs: &Runs, surface: &Surface, first: usize, rubs: bool) -> Shift {
    use rayon::prelude::*;
    let scores: Vec<Score> = runs.runs.par_iter().map(|r| score(r, surface, first, rubs)).collect();
    shift(runs, &scores)
}

/// What this lag does to the rows of a run, N.
pub(super) fn effect(run: &Run, surface: &Surface, lag: f64) -> Vec<f64> {
    if lag > 0.0 {
        let late = delayed(&run.time, &run.pressure, lag);
        let of = |i: usize| {
            let (p, d) = (run.pressure[i], run.direction[i]);
            surface.force(run.mounting, late[i], d) - surface.force(run.mounting, p, d)
        };
        (0..run.time.len()).map(of).collect()
    } else {
        let slow = low_pass(&run.time, &run.force, -lag);
        run.force.iter().zip(slow).map(|(f, s)| f - s).collect()
    }
}

/// The lag's trace in the cells.
pub(super) fn trace(cells: &[Cell]) -> nalgebra::DVector<f64> {
    nalgebra::DVector::from_iterator(cells.len(), cells.iter().map(|c| c.means.lag))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_shifts_and_a_low_pass_follows_a_ramp_late_by_its_time() {
        let time: Vec<f64> = (0..400).map(|i| 0.01 * f64::from(i)).collect();
        let ramp: Vec<f64> = time.iter().map(|t| 5.0 * t).collect();
        assert!((delayed(&time, &ramp, 0.125)[300] - 5.0 * (3.0 - 0.125)).abs() < 1e-9);
        assert!((delayed(&time, &ramp, 0.125)[3]).abs() < 1e-12);
        assert!((low_pass(&time, &ramp, 0.1)[399] - 5.0 * (3.99 - 0.1)).abs() < 1e-6);
    }

    #[test]
    fn a_parabola_is_lowest_where_it_is() {
        let of = |x: f64| (x - 0.3) * (x - 0.3);
        assert!((lowest([0.0, 0.2, 1.0], [of(0.0), of(0.2), of(1.0)]) - 0.3).abs() < 1e-12);
        assert_eq!(lowest([0.0, 0.2, 1.0], [0.0, 1.0, 0.0]), 0.2);
    }
}
