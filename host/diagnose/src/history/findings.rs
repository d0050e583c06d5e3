//! What is documented of such muscles, measured without any model: contrasts between visits to the same pressure and length.
//!
//! Units of uncertainty are mountings or runs, never rows: rows of one run are not independent measurements.

use super::campaign::Points;
use super::criteria::{
    NEIGHBOURS, PLATEAU_FREE, PLATEAU_FROM, PLATEAU_ROWS, PLATEAU_WITHIN, PULLS, SHORTENED,
};
use super::shift_fit::knot_step;
use pam_fit::numerics::student::half_width_95;

/// A mean over independent units with the half-width of its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contrast {
    pub mean: f64,
    /// Absent of fewer than two units.
    pub half: Option<f64>,
    pub units: usize,
    /// Sum of squares about the mean, for pooling over muscles.
    pub squares: f64,
}

impl Contrast {
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let n = finite.len();
        let mean = mean(&finite)?;
        let squares = finite.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let freedom = n.saturating_sub(1);
        let half =
            (freedom > 0).then(|| half_width_95(freedom) * (squares / freedom as f64 / n as f64).sqrt());
        Some(Self { mean, half, units: n, squares })
    }

    /// As [`chance`], of the mean.
    pub(super) fn chance(&self) -> f64 {
        chance(self.mean, self.half.map(|half| half / half_width_95(self.units - 1)))
    }

    /// Whether the interval lies above zero.
    pub(super) fn is_positive(&self) -> bool {
        self.half.is_some_and(|h| self.mean > h)
    }
}

/// Probability that chance alone gives a value this many standard errors from zero, by Chebyshev's inequality: no law of errors is assumed.
pub(super) fn chance(value: f64, error: Option<f64>) -> f64 {
    error.map_or(1.0, |error| (error / value.abs().max(f64::MIN_POSITIVE)).powi(2).min(1.0))
}

fn mean(values: &[f64]) -> Option<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
}

/// Forces of each run at common pressures, filling and emptying; not a number where the run has none that pulls on both sides.
pub(super) struct Visits {
    /// By run, then filling (0) or emptying (1), then pressure.
    forces: Vec<[Vec<f64>; 2]>,
}

impl Visits {
    pub(super) fn new(points: &Points) -> Self {
        let step = knot_step(points.highest());
        let grid: Vec<f64> =
            (6..).map(|k| 0.5 * step * f64::from(k)).take_while(|p| *p <= points.highest()).collect();
        let least = PULLS * points.largest_force();
        let forces = points
            .runs
            .iter()
            .map(|run| {
                [1, -1].map(|direction| {
                    let own = (run.points.0..run.points.1).filter(|i| points.direction[*i] == direction);
                    let mut own: Vec<(f64, f64)> =
                        own.map(|i| (points.pressure[i], points.force[i])).collect();
                    own.sort_by(|a, b| a.0.total_cmp(&b.0));
                    grid.iter().map(|p| between(&own, *p, NEIGHBOURS * step, least)).collect()
                })
            })
            .collect();
        Self { forces }
    }

    /// Mean over pressures of one run's force during filling less another's, N.
    pub(super) fn filled(&self, run: usize, other: usize) -> f64 {
        self.difference((run, 0), (other, 0))
    }

    /// Mean over pressures of one run's force less another's.
    fn difference(&self, (run, way): (usize, usize), (other, other_way): (usize, usize)) -> f64 {
        let pairs = self.forces[run][way].iter().zip(&self.forces[other][other_way]);
        mean(&pairs.map(|(a, b)| a - b).collect::<Vec<_>>()).unwrap_or(f64::NAN)
    }
}

fn between(sorted: &[(f64, f64)], pressure: f64, widest: f64, least: f64) -> f64 {
    let at = sorted.partition_point(|p| p.0 < pressure);
    if at == 0 || at == sorted.len() {
        return f64::NAN;
    }
    let ((p0, f0), (p1, f1)) = (sorted[at - 1], sorted[at]);
    if !(p1 - p0 <= widest && f0 >= least) {
        return f64::NAN;
    }
    f0 + (f1 - f0) * (pressure - p0) / (p1 - p0).max(f64::MIN_POSITIVE)
}

fn shortened(points: &Points) -> impl Iterator<Item = usize> + '_ {
    (0..points.mountings.len()).filter(|m| points.mountings[*m].contraction > SHORTENED)
}

/// How much the second filling of a shortened mounting pulls more than the first, N; unit: mounting.
pub(super) fn first_run_deficit(points: &Points, visits: &Visits) -> Option<Contrast> {
    Contrast::of(&first_differences(points, visits))
}

/// The same of later runs: what runs differ by without run-in, N.
pub(super) fn later_differences(points: &Points, visits: &Visits) -> Vec<f64> {
    shortened(points)
        .flat_map(|m| points.mountings[m].runs.windows(2).skip(1).map(|w| visits.filled(w[1], w[0])))
        .filter(|d| d.is_finite())
        .collect()
}

/// Emptying less filling of each mounting after its first run, N.
fn gaps(points: &Points, visits: &Visits) -> Vec<f64> {
    let of = |runs: &[usize]| {
        let later = runs.iter().skip(1).map(|r| visits.difference((*r, 1), (*r, 0)));
        mean(&later.collect::<Vec<_>>()).unwrap_or(f64::NAN)
    };
    points.mountings.iter().map(|m| of(&m.runs)).collect()
}

/// By how much the gap between emptying and filling is larger when shortened than at full length, N; units: mounting, and run.
pub(super) fn gap(points: &Points, visits: &Visits) -> (Option<Contrast>, Option<Contrast>) {
    let full = points.longest();
    let gaps = gaps(points, visits);
    let short: Vec<usize> = shortened(points).filter(|m| *m != full).collect();
    let by_mounting: Vec<f64> = short.iter().map(|m| gaps[*m] - gaps[full]).collect();
    let most = points.mountings.iter().map(|m| m.runs.len()).max().unwrap_or(0);
    let own = |m: usize, k: usize| {
        points.mountings[m].runs.get(k).map_or(f64::NAN, |r| visits.difference((*r, 1), (*r, 0)))
    };
    let by_run: Vec<f64> = (1..most)
        .map(|k| {
            mean(&short.iter().map(|m| own(*m, k)).collect::<Vec<_>>()).unwrap_or(f64::NAN) - own(full, k)
        })
        .collect();
    (Contrast::of(&by_mounting), Contrast::of(&by_run))
}

/// What unseen errors leave of the gap: mean error on emptying less that on filling over points that pull, shortened mountings; unit: run.
pub(super) fn gap_left(points: &Points, predicted: &[f64]) -> Option<Contrast> {
    let full = points.longest();
    let pulls = 2.0 * PULLS * points.largest_force();
    let most = points.mountings.iter().map(|m| m.runs.len()).max().unwrap_or(0);
    let of = |run: usize| {
        let (from, to) = points.runs[run].points;
        let side = |direction: i8| {
            let own = (from..to).filter(|i| points.direction[*i] == direction && predicted[*i] > pulls);
            let errors: Vec<f64> = own.map(|i| points.force[i] - predicted[i]).collect();
            if errors.len() > 2 { mean(&errors).unwrap_or(f64::NAN) } else { f64::NAN }
        };
        side(-1) - side(1)
    };
    let by_run: Vec<f64> = (0..most)
        .filter_map(|k| {
            let own = shortened(points).filter(|m| *m != full);
            mean(&own.filter_map(|m| points.mountings[m].runs.get(k)).map(|r| of(*r)).collect::<Vec<_>>())
        })
        .collect();
    Contrast::of(&by_run)
}

/// Force gained in tenfold time while the pressure stays at its top, N a decade: mean over runs of shortened mountings; unit: run.
pub(super) fn plateau_creep(points: &Points) -> Option<Contrast> {
    let top = PLATEAU_WITHIN * points.highest();
    let of = |run: usize| {
        let (from, to) = points.runs[run].points;
        let highest = points.pressure[from..to].iter().copied().fold(0.0, f64::max);
        let held: Vec<usize> =
            (from..to).filter(|i| points.direction[*i] == 1 && points.pressure[*i] > highest - top).collect();
        if held.len() < PLATEAU_ROWS {
            return f64::NAN;
        }
        let first = points.time[held[0]];
        let rows = held.iter().map(|i| {
            let decades = (points.time[*i] - first + PLATEAU_FROM).log10();
            (decades, points.pressure[*i] - highest, points.force[*i])
        });
        slope_beside(&rows.collect::<Vec<_>>())
    };
    let runs = shortened(points).flat_map(|m| points.mountings[m].runs.iter().copied());
    Contrast::of(&runs.map(of).collect::<Vec<_>>())
}

/// Least-squares slope of the last on the first of three columns, beside the second and a constant.
fn slope_beside(rows: &[(f64, f64, f64)]) -> f64 {
    let n = rows.len() as f64;
    let sums = rows.iter().fold((0.0, 0.0, 0.0), |s, r| (s.0 + r.0, s.1 + r.1, s.2 + r.2));
    let (mut xx, mut xp, mut pp, mut xy, mut py) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for r in rows {
        let (x, p, y) = (r.0 - sums.0 / n, r.1 - sums.1 / n, r.2 - sums.2 / n);
        (xx, xp, pp, xy, py) = (xx + x * x, xp + x * p, pp + p * p, xy + x * y, py + p * y);
    }
    let left = xx - xp * xp / pp.max(1e-12);
    if left > PLATEAU_FREE * xx && xx > 1e-6 { (xy - xp * py / pp.max(1e-12)) / left } else { f64::NAN }
}

/// Slope of the force over pressure at full length near the highest pressures, N/kPa: the muscle's effective area, for an end effect over a stock.
pub(super) fn full_length_slope(points: &Points) -> Option<f64> {
    use super::criteria::{THRESHOLD_FROM, THRESHOLD_TO};
    let full = points.longest();
    let spline = super::shift_fit::static_spline(points.highest());
    let curve = super::shift_fit::static_curve(
        points,
        &spline,
        (0..points.len()).filter(|i| points.mounting[*i] == full),
    )?;
    let at = |share: f64| spline.at(share * points.highest()).value(&curve);
    let run = (THRESHOLD_TO - THRESHOLD_FROM) * points.highest();
    Some((at(THRESHOLD_TO) - at(THRESHOLD_FROM)) / run).filter(|s| s.is_finite())
}

/// First differences by mounting, N; see [`first_run_deficit`].
pub(super) fn first_differences(points: &Points, visits: &Visits) -> Vec<f64> {
    let of = |m: usize| match points.mountings[m].runs[..] {
        [first, second, ..] => visits.filled(second, first),
        _ => f64::NAN,
    };
    shortened(points).map(of).filter(|d| d.is_finite()).collect()
}

/// In how many ways `few` of `few + many` can be chosen.
pub(super) fn ways(few: usize, many: usize) -> f64 {
    (1..=few).map(|k| (many + k) as f64 / k as f64).product()
}

/// Mean unseen error over the first fillings of shortened mountings where the muscle pulls, N.
pub(super) fn first_run_left(points: &Points, predicted: &[f64]) -> Option<f64> {
    let pulls = PULLS * points.largest_force();
    let of = |m: usize| {
        let (from, to) = points.runs[*points.mountings[m].runs.first()?].points;
        let own = (from..to).filter(|i| points.direction[*i] == 1 && predicted[*i] > pulls);
        mean(&own.map(|i| points.force[i] - predicted[i]).collect::<Vec<_>>())
    };
    mean(&shortened(points).filter_map(of).collect::<Vec<_>>())
}
