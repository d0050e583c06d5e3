//! The force before, tabulated: mean, gap between the directions, slopes and variance over pressure, for every mounting.

use super::criteria::{GRID, MONOTONE_END, POINT_BINS, USUAL_SLOPE_QUANTILE, USUAL_SLOPE_SHARE};
use super::interpolate;
use super::runs::{Run, Runs};
use super::spline::{Point, Spline};
use pam_data::error::{DataCode, Error, Result};
use pam_data::statistics::midpoint_median;

/// One mounting's curves on the common pressures.
#[derive(Debug, Clone, Default)]
pub(super) struct Curves {
    /// Mean of the directions, N.
    pub force: Vec<f64>,
    /// Half the gap between the directions, N.
    pub gap: Vec<f64>,
    /// ∂F/∂P, N/Pa.
    pub by_pressure: Vec<f64>,
    /// ∂F/∂x, N/m; zeros where there is one length.
    pub by_stroke: Vec<f64>,
    /// The same as AFTER shows it, beside a table; empty elsewhere.
    pub own_by_stroke: Vec<f64>,
    /// Variance of filling and of emptying, N².
    pub variance: [Vec<f64>; 2],
}

/// Curves of all mountings.
#[derive(Debug, Clone, Default)]
pub(super) struct Surface {
    pub low: f64,
    pub high: f64,
    pub curves: Vec<Curves>,
    /// The usual ∂F/∂P where the actuator is not slack, N/Pa.
    pub usual_slope: f64,
    /// Largest force before, N.
    pub largest: f64,
}

/// The bin of a value.
pub(super) fn bin(value: f64, low: f64, high: f64, bins: usize) -> usize {
    let share = (value - low) / (high - low) * bins as f64;
    if share > 0.0 { (share as usize).min(bins - 1) } else { 0 }
}

/// Means of a run's settled rows by direction and pressure bin.
fn points(run: &Run, index: usize, low: f64, high: f64) -> Vec<Point> {
    let mut sums = [[(0.0, 0.0, 0.0); POINT_BINS]; 2];
    for i in (0..run.time.len()).filter(|i| run.settled[*i]) {
        let side = usize::from(run.direction[i] < 0.0);
        let sum = &mut sums[side][bin(run.pressure[i], low, high, POINT_BINS)];
        *sum = (sum.0 + run.pressure[i], sum.1 + run.force[i], sum.2 + 1.0);
    }
    let mut points = Vec::new();
    for (side, direction) in [(0, 1.0), (1, -1.0)] {
        for (p, f, n) in sums[side].iter().filter(|s| s.2 > 0.0) {
            points.push(Point { direction, pressure: p / n, force: f / n, run: index });
        }
    }
    points
}

impl Surface {
    /// From the runs before.
    ///
    /// # Errors
    /// A pressure or a force that does not change, or too few rows.
    pub fn of(all: &Runs) -> Result<Self> {
        let values = || all.side(false).flat_map(|r| r.pressure.iter().copied());
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let largest = all.side(false).flat_map(|r| r.force.iter().copied()).fold(f64::NEG_INFINITY, f64::max);
        if !(high > low) {
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                "the pressure of the reference does not change",
            )
            .help(
                "the length is held too, so nothing moves: give recordings in which the pressure is swept",
            ));
        }
        if !(largest > 0.0) {
            return Err(Error::new(DataCode::RecordingOutOfRange, "the force of the reference is never positive")
                .help("force counts positive as the actuator pulls (or pushes): turn its sign in an import description"));
        }
        let grid: Vec<f64> = (0..GRID).map(|i| low + (high - low) * i as f64 / (GRID - 1) as f64).collect();
        let mut curves = Vec::new();
        for mounting in 0..all.strokes.len() {
            if all.is_interpolated(mounting) {
                curves.push(Curves::default());
                continue;
            }
            let runs = all.side(false).filter(|r| r.mounting == mounting);
            let points: Vec<Point> = runs.enumerate().flat_map(|(i, r)| points(r, i, low, high)).collect();
            let spline = Spline::fit(&points, low, high).ok_or_else(|| {
                Error::new(
                    DataCode::RecordingTooShort,
                    "the reference has too few rows for a curve of force over pressure",
                )
            })?;
            let along = |of: &dyn Fn(f64) -> f64| grid.iter().map(|p| of(*p)).collect::<Vec<f64>>();
            curves.push(Curves {
                force: along(&|p| spline.mean(p)),
                gap: along(&|p| spline.gap(p)),
                by_pressure: along(&|p| spline.slope(p)),
                by_stroke: Vec::new(),
                own_by_stroke: Vec::new(),
                variance: [along(&|p| spline.variance(p, 1.0)), along(&|p| spline.variance(p, -1.0))],
            });
        }
        let mut surface = Self { low, high, curves, usual_slope: 0.0, largest };
        let recorded: Vec<usize> = (0..all.strokes.len()).filter(|m| !all.is_interpolated(*m)).collect();
        surface.slopes_along(&all.strokes, &recorded);
        for mounting in (0..all.strokes.len()).filter(|m| all.is_interpolated(*m)) {
            surface.curves[mounting] =
                interpolate::curves(&surface.curves, &all.strokes, &recorded, mounting);
        }
        surface.find_usual_slope();
        Ok(surface)
    }

    /// ∂F/∂x of every mounting by a monotone piecewise cubic over the lengths.
    fn slopes_along(&mut self, strokes: &[f64], recorded: &[usize]) {
        let own: Vec<f64> = recorded.iter().map(|m| strokes[*m]).collect();
        for g in 0..GRID {
            let forces: Vec<f64> = recorded.iter().map(|m| self.curves[*m].force[g]).collect();
            for (m, slope) in recorded.iter().zip(monotone_slopes(&own, &forces)) {
                self.curves[*m].by_stroke.push(slope);
            }
        }
    }

    pub fn find_usual_slope(&mut self) {
        let mut all: Vec<f64> = self.curves.iter().flat_map(|c| c.by_pressure.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        let Some(last) = all.len().checked_sub(1) else { return };
        let at = USUAL_SLOPE_QUANTILE * last as f64;
        let (i, share) = (at as usize, at.fract());
        let high = all[i] + share * (all[(i + 1).min(last)] - all[i]);
        let mut kept: Vec<f64> = all.into_iter().filter(|s| *s > USUAL_SLOPE_SHARE * high).collect();
        self.usual_slope =
            if kept.is_empty() { high.abs().max(f64::MIN_POSITIVE) } else { midpoint_median(&mut kept) };
    }

    /// A tabulated curve at a pressure.
    pub fn at(&self, curve: &[f64], pressure: f64) -> f64 {
        let z = ((pressure - self.low) / (self.high - self.low) * (GRID - 1) as f64)
            .clamp(0.0, (GRID - 1) as f64);
        let i = (z as usize).min(GRID - 2);
        let v = z - i as f64;
        curve.get(i).copied().unwrap_or(0.0) * (1.0 - v) + curve.get(i + 1).copied().unwrap_or(0.0) * v
    }

    /// The force before, N; beyond the highest pressure along the last slope.
    pub fn force(&self, mounting: usize, pressure: f64, direction: f64) -> f64 {
        let c = &self.curves[mounting];
        let beyond = (pressure - self.high).max(0.0) * c.by_pressure.last().copied().unwrap_or(0.0);
        self.at(&c.force, pressure) + direction * self.at(&c.gap, pressure) + beyond
    }
}

/// Slopes at the nodes of a monotone piecewise cubic: Fritsch and Butland's weighted harmonic mean inside, one-sided at the ends.
pub(super) fn monotone_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let secant: Vec<f64> = (1..n).map(|i| (y[i] - y[i - 1]) / (x[i] - x[i - 1])).collect();
    let h: Vec<f64> = (1..n).map(|i| x[i] - x[i - 1]).collect();
    match n {
        0 | 1 => return vec![0.0; n],
        2 => return vec![secant[0]; 2],
        _ => {}
    }
    let inside = |i: usize| {
        let (a, b) = (secant[i - 1], secant[i]);
        let (wa, wb) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
        if a * b > 0.0 { (wa + wb) / (wa / a + wb / b) } else { 0.0 }
    };
    let end = |a: f64, b: f64, ha: f64, hb: f64| {
        let slope = ((2.0 * ha + hb) * a - ha * b) / (ha + hb);
        if slope * a <= 0.0 {
            0.0
        } else if a * b <= 0.0 && slope.abs() > MONOTONE_END * a.abs() {
            MONOTONE_END * a
        } else {
            slope
        }
    };
    (0..n)
        .map(|i| match i {
            0 => end(secant[0], secant[1], h[0], h[1]),
            i if i == n - 1 => end(secant[n - 2], secant[n - 3], h[n - 2], h[n - 3]),
            i => inside(i),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_a_line_are_its_own_and_a_knee_does_not_overshoot() {
        let line = monotone_slopes(&[0.0, 1.0, 3.0, 4.0], &[0.0, 2.0, 6.0, 8.0]);
        assert!(line.iter().all(|s| (s - 2.0).abs() < 1e-12), "{line:?}");
        let knee = monotone_slopes(&[0.0, 1.0, 2.0], &[-5.0, 0.0, 0.0]);
        assert!(knee[1].abs() < 1e-12 && knee[2].abs() < 1e-12, "{knee:?}");
    }

    #[test]
    fn bins_keep_to_their_range() {
        assert_eq!([-1.0, 0.0, 0.999, 1.0, 9.0].map(|v| bin(v, 0.0, 1.0, 4)), [0, 0, 3, 3, 3]);
        assert_eq!(bin(f64::NAN, 0.0, 1.0, 4), 0);
    }
}
