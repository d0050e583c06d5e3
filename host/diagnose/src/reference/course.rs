//! How a change develops through AFTER: there from the beginning, suddenly from a moment on, or growing from a moment on.

use nalgebra::DVector;

use super::cells::Cell;
use super::contrast::{Contrast, evidence, log_mean, log_sum};
use super::criteria::{COURSE_LEAD, COURSE_PART, COURSE_STARTS};
use super::slip::rms_after;

/// How a change continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// As it is, through all of AFTER.
    Whole,
    /// Suddenly.
    Step,
    /// Gradually, to the end.
    Ramp,
}

/// When a change begins, on AFTER's clock, with the 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    pub at: f64,
    pub low: f64,
    pub high: f64,
}

/// The course that explains the difference best.
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub kind: Kind,
    /// Whether it leads the other courses.
    pub sure: bool,
    pub start: Start,
    /// The shape with this course.
    pub shape: DVector<f64>,
}

/// A course from one start.
struct Tried {
    start: f64,
    log: f64,
}

fn factor(kind: Kind, start: f64, clock: f64) -> f64 {
    match kind {
        Kind::Whole => 1.0,
        Kind::Step => f64::from(u8::from(clock >= start)),
        Kind::Ramp => ((clock - start) / (1.0 - start)).max(0.0),
    }
}

fn with_course(cells: &[Cell], shape: &DVector<f64>, kind: Kind, start: f64) -> DVector<f64> {
    let of = |(c, s): (&Cell, &f64)| s * factor(kind, start, c.means.clock);
    DVector::from_iterator(cells.len(), cells.iter().zip(shape.iter()).map(of))
}

/// Moments between the cells of AFTER at which a change may have begun.
fn starts(cells: &[Cell]) -> Vec<f64> {
    let mut clocks: Vec<f64> = cells.iter().filter(|c| c.after).map(|c| c.means.clock).collect();
    clocks.sort_by(f64::total_cmp);
    clocks.dedup();
    let between = clocks.windows(2).map(|w| 0.5 * (w[0] + w[1]));
    between.filter(|t| *t > COURSE_PART.0 && *t < COURSE_PART.1).collect()
}

/// Every `n`-th.
fn thinned(all: &[f64], n: usize) -> Vec<f64> {
    all.iter().step_by(n.max(1)).copied().collect()
}

/// How a change whose shape is known develops. `kinds`: those that its name allows.
pub(super) fn of(
    cells: &[Cell],
    contrast: &Contrast,
    shape: &DVector<f64>,
    kinds: &[Kind],
    sizes: &[f64],
) -> Option<Course> {
    let scale = contrast.without_shapes(std::slice::from_ref(shape)).scale();
    let weigh = |kind: Kind, start: f64| {
        let shape = with_course(cells, shape, kind, start);
        let rms = rms_after(cells, &shape);
        if !(rms > 0.0) {
            return Tried { start, log: f64::NEG_INFINITY };
        }
        let (a, b) = contrast.products(&(shape / rms));
        Tried { start, log: evidence(a, b, scale, sizes) }
    };
    let all = starts(cells);
    let stride = all.len().div_ceil(COURSE_STARTS);
    let mut courses: Vec<(Kind, f64, Vec<Tried>)> = Vec::new();
    for kind in kinds {
        let mut tried: Vec<Tried> = match kind {
            Kind::Whole => vec![weigh(Kind::Whole, 0.0)],
            Kind::Step => thinned(&all, stride).into_iter().map(|t| weigh(Kind::Step, t)).collect(),
            Kind::Ramp => {
                let later = thinned(&all, 2 * stride).into_iter();
                std::iter::once(0.0).chain(later).map(|t| weigh(Kind::Ramp, t)).collect()
            }
        };
        let logs: Vec<f64> = tried.iter().map(|t| t.log).collect();
        let log = log_mean(&logs);
        // All moments beside the best one, for the time.
        if *kind == Kind::Step
            && stride > 1
            && let Some(best) = tried.iter().max_by(|a, b| a.log.total_cmp(&b.log)).map(|t| t.start)
        {
            let at = all.partition_point(|t| *t < best);
            let near = all[at.saturating_sub(stride)..(at + stride).min(all.len())].iter();
            tried = near.map(|t| weigh(Kind::Step, *t)).collect();
        }
        if log.is_finite() {
            courses.push((*kind, log, tried));
        }
    }
    courses.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let second = courses.get(1).map_or(f64::NEG_INFINITY, |c| c.1);
    let (kind, log, tried) = courses.into_iter().next()?;
    let start = start(&tried)?;
    Some(Course {
        kind,
        sure: log > second + COURSE_LEAD,
        start,
        shape: with_course(cells, shape, kind, start.at),
    })
}

/// The likeliest start and the shortest stretch of starts that holds 95 %.
fn start(tried: &[Tried]) -> Option<Start> {
    let logs: Vec<f64> = tried.iter().map(|t| t.log).collect();
    let total = log_sum(&logs);
    let mut order: Vec<usize> = (0..tried.len()).filter(|i| logs[*i].is_finite()).collect();
    order.sort_by(|a, b| logs[*b].total_cmp(&logs[*a]));
    let best = *order.first()?;
    let (mut sum, mut low, mut high) = (0.0, best, best);
    for i in order {
        if sum >= 0.95 {
            break;
        }
        sum += (logs[i] - total).exp();
        (low, high) = (low.min(i), high.max(i));
    }
    // A change between two moments that were tried can be anywhere between their neighbours.
    let ends = (low.saturating_sub(1), (high + 1).min(tried.len() - 1));
    let (at, low, high) = (tried[best].start, tried[ends.0].start, tried[ends.1].start);
    // What may have grown from the beginning is taken to have done so.
    Some(Start { at: if low > 0.0 { at } else { 0.0 }, low, high })
}
