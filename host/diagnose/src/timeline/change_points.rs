//! Change points: whether a series stays, steps between two campaigns, or changes gradually.
//!
//! With `y` the values, `s` their standard errors and one unknown factor `κ` on all of them, because campaigns differ by more than their
//! repeats show:
//!
//! ```text
//! y = level + Σ δ_k x_k + κ s ε     1/κ² ~ χ²_ν0/ν0     δ_k ~ N(0, κ² σ²)     x: a step before campaign k, or a slope over the date
//! ln B = −½ ln(1 + σ²a) − (ν0 + n)/2 · ln[ (ν0 + q − b²/(a + σ⁻²)) / (ν0 + q) ]
//! ```
//! with `a = x'x`, `b = x'r`, `q = r'r` of the weighted residuals `r` beside the level and earlier changes, `n` their degrees of freedom
//! (the marginal likelihood of the conjugate model, see A. O'Hagan and J. Forster, Bayesian Inference, 2004, ch. 11). After a change
//! is accepted the next is looked for beside it.

use super::series::{Kind, Series};
use crate::criteria::timeline::{
    AT_ONCE, COURSE_CHANGED, COURSE_EFFECT_PRIOR, COURSE_MOST_CHANGES, COURSE_PRIOR_NONE, COURSE_SCALE_PRIOR,
    COURSE_SIZES, FEWEST_POINTS, SMALLEST_ERROR,
};
use crate::reference::{log_mean, log_sum};

/// How a change came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// Between two neighbouring campaigns.
    AtOnce,
    /// Over the whole time.
    Gradual,
    /// The campaigns do not say which of both.
    NotDetermined,
}

/// One change of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// How it came.
    pub how: How,
    /// Index of the last campaign before it; of a gradual one the first campaign.
    pub from: usize,
    /// Index of the first campaign after it; of a gradual one the last campaign.
    pub to: usize,
    /// Size, SI.
    pub size: f64,
    /// Standard error with the scatter between campaigns.
    pub std: f64,
    /// Probability that something changed.
    pub probability: f64,
}

/// What became of a series.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChangePoints {
    /// Its changes, in the order of time.
    pub changes: Vec<Change>,
    /// Probability that nothing (more) changed.
    pub none: f64,
    /// Scatter of the campaigns over what their own repeats show; `None` with too few points to decide.
    pub scatter: Option<f64>,
    /// Whether there are too few campaigns for a judgement.
    pub too_few: bool,
}

/// The known points of a series: campaign, date, value, standard error.
struct Known {
    /// Observations that the standard errors are worth.
    worth: f64,
    campaign: Vec<usize>,
    date: Vec<f64>,
    value: Vec<f64>,
    error: Vec<f64>,
}

impl Known {
    fn of(dates: &[f64], series: &Series) -> Self {
        let worth = if series.kind == Kind::Effect { COURSE_EFFECT_PRIOR } else { COURSE_SCALE_PRIOR };
        let mut all =
            Self { worth, campaign: Vec::new(), date: Vec::new(), value: Vec::new(), error: Vec::new() };
        for (i, (date, point)) in dates.iter().zip(&series.points).enumerate() {
            if let Some(p) = point {
                all.campaign.push(i);
                all.date.push(*date);
                all.value.push(p.value);
                all.error.push(p.std.unwrap_or(f64::NAN));
            }
        }
        // Where nothing repeats, the differences between neighbours estimate the error.
        let differences: f64 = all.value.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        let neighbours = (differences / 2.0 / all.value.len().saturating_sub(1).max(1) as f64).sqrt();
        let known: Vec<f64> = all.error.iter().copied().filter(|e| *e > 0.0).collect();
        let usual =
            if known.is_empty() { neighbours } else { known.iter().sum::<f64>() / known.len() as f64 };
        // An error of nought would decide everything alone: the reference's own effects have none.
        all.error.iter_mut().for_each(|e| *e = if *e > SMALLEST_ERROR * usual { *e } else { usual });
        all
    }

    /// A step before the point `k`.
    fn step(&self, k: usize) -> Vec<f64> {
        self.excursion(k, self.value.len())
    }

    /// A step before the point `k`, and back before the point `l`.
    fn excursion(&self, k: usize, l: usize) -> Vec<f64> {
        (0..self.value.len()).map(|i| f64::from(u8::from(i >= k && i < l))).collect()
    }

    /// From nought to one over the dates; over the order where all dates are one.
    fn slope(&self) -> Vec<f64> {
        let n = self.date.len();
        let (first, last) = (self.date[0], self.date[n - 1]);
        let over_dates = last > first;
        let at = |i: usize| {
            if over_dates { (self.date[i] - first) / (last - first) } else { i as f64 / (n - 1) as f64 }
        };
        (0..n).map(at).collect()
    }

    fn weighted(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.error).map(|(x, e)| x / e).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// An orthonormal basis that grows.
#[derive(Default)]
struct Basis(Vec<Vec<f64>>);

impl Basis {
    /// What of `x` the basis does not hold.
    fn rest(&self, x: &[f64]) -> Vec<f64> {
        let mut rest = x.to_vec();
        // Twice, because once leaves rounding errors where x lies nearly in the basis.
        for _ in 0..2 {
            for b in &self.0 {
                let share = dot(b, &rest);
                rest.iter_mut().zip(b).for_each(|(r, b)| *r -= share * b);
            }
        }
        rest
    }

    fn add(&mut self, x: &[f64]) {
        let rest = self.rest(x);
        let size = dot(&rest, &rest).sqrt();
        if size > 1e-9 {
            self.0.push(rest.into_iter().map(|v| v / size).collect());
        }
    }
}

/// ln Bayes factor of a further change of shape `x`.
fn evidence(x: &[f64], residual: &[f64], freedom: f64, worth: f64) -> f64 {
    let (a, b, q) = (dot(x, x), dot(x, residual), dot(residual, residual));
    if !(a > 1e-9) {
        return f64::NEG_INFINITY;
    }
    let each: Vec<f64> = COURSE_SIZES
        .iter()
        .map(|size| {
            let s2 = size * size;
            let left = (q - b * b / (a + 1.0 / s2)).max(0.0);
            -0.5 * (s2 * a).ln_1p() - 0.5 * (worth + freedom) * ((worth + left) / (worth + q)).ln()
        })
        .collect();
    log_mean(&each)
}

/// Looks for the changes of a series.
#[must_use]
pub(crate) fn find(dates: &[f64], series: &Series) -> ChangePoints {
    let known = Known::of(dates, series);
    let n = known.value.len();
    if n < FEWEST_POINTS {
        return ChangePoints { none: COURSE_PRIOR_NONE, too_few: true, ..ChangePoints::default() };
    }
    // Equal values have no error and no change.
    if !known.error.iter().all(|e| *e > 0.0) {
        return ChangePoints { none: 1.0, ..ChangePoints::default() };
    }
    let y = known.weighted(&known.value);
    let mut basis = Basis::default();
    basis.add(&known.weighted(&vec![1.0; n]));
    let mut change_points = ChangePoints { none: 1.0, ..ChangePoints::default() };
    let mut shapes: Vec<(Vec<f64>, Change)> = Vec::new();
    while shapes.len() < COURSE_MOST_CHANGES && n > shapes.len() + 2 {
        let residual = basis.rest(&y);
        let freedom = (n - 1 - shapes.len()) as f64;
        let Some(next) = Candidate::best(&known, &basis, &residual, freedom) else { break };
        change_points.none = next.none;
        if !(1.0 - next.none >= COURSE_CHANGED) {
            break;
        }
        for (shape, change) in next.changes(&known) {
            let x = known.weighted(&shape);
            basis.add(&x);
            shapes.push((x, change));
        }
    }
    let left = basis.rest(&y);
    let freedom = n as f64 - basis.0.len() as f64;
    let scale = (known.worth + dot(&left, &left)) / (known.worth + freedom);
    change_points.scatter = (freedom >= 1.0).then(|| (dot(&left, &left) / freedom).sqrt());
    for i in 0..shapes.len() {
        let mut others = Basis::default();
        others.add(&known.weighted(&vec![1.0; n]));
        shapes.iter().enumerate().filter(|(j, _)| *j != i).for_each(|(_, (x, _))| others.add(x));
        let own = others.rest(&shapes[i].0);
        let a = dot(&own, &own);
        let change = &mut shapes[i].1;
        (change.size, change.std) = (dot(&own, &y) / a, (scale / a).sqrt());
    }
    change_points.changes = shapes.into_iter().map(|s| s.1).collect();
    change_points.changes.sort_by_key(|c| (c.from, c.to));
    change_points
}

/// What can happen next.
#[derive(Clone, Copy)]
enum Shape {
    /// A step before a point.
    Step(usize),
    /// A step before one point and back before another.
    Excursion(usize, usize),
    /// A line over the dates.
    Slope,
}

/// The most probable next change.
struct Candidate {
    none: f64,
    shape: Shape,
    how: How,
}

impl Candidate {
    fn best(known: &Known, basis: &Basis, residual: &[f64], freedom: f64) -> Option<Self> {
        let n = known.value.len();
        let log =
            |shape: &[f64]| evidence(&basis.rest(&known.weighted(shape)), residual, freedom, known.worth);
        let steps: Vec<(Shape, f64)> = (1..n).map(|k| (Shape::Step(k), log(&known.step(k)))).collect();
        let excursions: Vec<(Shape, f64)> = (1..n)
            .flat_map(|k| (k + 1..n).map(move |l| (k, l)))
            .map(|(k, l)| (Shape::Excursion(k, l), log(&known.excursion(k, l))))
            .collect();
        let slopes = vec![(Shape::Slope, log(&known.slope()))];
        // The prior probability of a change is shared by the kinds, then by the places.
        let kinds = [steps, excursions, slopes];
        let prior = |kind: &[(Shape, f64)]| ((1.0 - COURSE_PRIOR_NONE) / 3.0 / kind.len().max(1) as f64).ln();
        let all: Vec<(Shape, f64)> =
            kinds.iter().flat_map(|kind| kind.iter().map(|(s, l)| (*s, l + prior(kind)))).collect();
        let logs: Vec<f64> = all.iter().map(|(_, l)| *l).chain([COURSE_PRIOR_NONE.ln()]).collect();
        let total = log_sum(&logs);
        let none = (COURSE_PRIOR_NONE.ln() - total).exp();
        let (shape, _) = *all.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let gradual = all.last().map_or(0.0, |(_, l)| (l - total).exp());
        let at_once = 1.0 - gradual / (1.0 - none).max(f64::MIN_POSITIVE);
        let how = match at_once {
            s if s >= AT_ONCE => How::AtOnce,
            s if s <= 1.0 - AT_ONCE => How::Gradual,
            _ => How::NotDetermined,
        };
        total.is_finite().then_some(Self { none, shape, how })
    }

    /// Its parts: a change and its reverse are two changes, each with its own size.
    fn changes(&self, known: &Known) -> Vec<(Vec<f64>, Change)> {
        let change = |from: usize, to: usize| Change {
            how: self.how,
            from: known.campaign[from],
            to: known.campaign[to],
            size: 0.0,
            std: 0.0,
            probability: 1.0 - self.none,
        };
        let step = |k: usize| (known.step(k), change(k - 1, k));
        match self.shape {
            Shape::Step(k) => vec![step(k)],
            Shape::Excursion(k, l) => vec![step(k), step(l)],
            Shape::Slope => vec![(known.slope(), change(0, known.campaign.len() - 1))],
        }
    }
}
