//! How a change develops through AFTER: there from the beginning, suddenly from a moment on, or growing from a moment on to the end.
//!
//! A cell with the shape `s` and the clock `c` counts with `s` (whole), with `s` from `c ≥ t` on (a step at `t`), or with `s·(c − t)/(1 − t)`
//! from there on (a ramp). In the order of the clocks the products of all steps and ramps follow from sums over the cells so far.

use nalgebra::DVector;

use super::cells::{Cell, rms_after};
use super::contrast::{Contrast, evidence, log_mean, log_sum};
use super::criteria::{COURSE_INTERVAL, COURSE_LEAD, COURSE_PART, COURSE_WHOLE};
use super::shapes::{Change, Course};

/// What a change does while it is there in full, per unit of size, and the time courses that it may take; zero on BEFORE.
pub(super) struct Candidate {
    pub shape: DVector<f64>,
    pub courses: &'static [Course],
}

/// When a change begins, on AFTER's clock, with the 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    pub at: f64,
    pub low: f64,
    pub high: f64,
}

/// The time course that explains the difference best.
#[derive(Debug, Clone)]
pub(super) struct TimeCourse {
    pub kind: Course,
    /// Whether it leads the other time courses.
    pub sure: bool,
    pub start: Start,
    /// The shape with this time course.
    pub shape: DVector<f64>,
    /// Log evidence over all time courses and their starts.
    pub log: f64,
}

impl TimeCourse {
    /// The part of the change that is there at a moment.
    pub fn at(&self, clock: f64) -> f64 {
        factor(self.kind, self.start.at, clock)
    }
}

/// A time course from one start.
struct Tried {
    start: f64,
    log: f64,
}

/// A change with the time courses that it may have: an offset of the stroke that comes suddenly is a slip, a zero that grows is a drift.
/// `None` for a change that settled cells do not show by a shape.
pub(super) fn candidate(cells: &[Cell], change: Change) -> Option<Candidate> {
    let on = |value: &dyn Fn(&Cell) -> Option<f64>| {
        let all: Option<Vec<f64>> =
            cells.iter().map(|c| if c.after { value(c) } else { Some(0.0) }).collect();
        all.map(DVector::from_vec)
    };
    let shape = on(&|c| change.in_full(&c.means, c.direction))?;
    Some(Candidate { shape, courses: change.about().changed.courses })
}

fn factor(kind: Course, start: f64, clock: f64) -> f64 {
    match kind {
        Course::Whole => 1.0,
        Course::Step => f64::from(u8::from(clock >= start)),
        Course::Ramp => ((clock - start) / (1.0 - start)).max(0.0),
    }
}

fn with_time_course(cells: &[Cell], shape: &DVector<f64>, kind: Course, start: f64) -> DVector<f64> {
    let of = |(c, s): (&Cell, &f64)| s * factor(kind, start, c.means.clock);
    DVector::from_iterator(cells.len(), cells.iter().zip(shape.iter()).map(of))
}

/// `s'Πs`, `s'Πy` and `s's` of a shape with a time course.
type Products = (f64, f64, f64);

/// Sums over the latest cells, by powers of the clock: over pairs of cells, over cells with the difference, and over squares of the shape.
#[derive(Default)]
struct Sums {
    pairs: [f64; 3],
    moments: [f64; 2],
    squares: [f64; 3],
}

impl Sums {
    fn step(&self) -> Products {
        (self.pairs[0], self.moments[0], self.squares[0])
    }

    /// A ramp from a start that no summed cell precedes.
    fn ramp(&self, start: f64) -> Products {
        let rise = 1.0 / (1.0 - start);
        let square = |m: &[f64; 3]| (m[2] - 2.0 * start * m[1] + start * start * m[0]) * rise * rise;
        (square(&self.pairs), (self.moments[1] - start * self.moments[0]) * rise, square(&self.squares))
    }
}

/// The products of a shape from the beginning, of its steps and of its ramps, each by falling start.
struct AllProducts {
    whole: Products,
    steps: Vec<(f64, Products)>,
    ramps: Vec<(f64, Products)>,
    /// Cells of AFTER.
    count: f64,
}

fn products(cells: &[Cell], contrast: &Contrast, shape: &DVector<f64>) -> AllProducts {
    let mut order: Vec<usize> = (0..cells.len()).filter(|i| cells[*i].after).collect();
    order.sort_by(|a, b| cells[*b].means.clock.total_cmp(&cells[*a].means.clock));
    let mut sums = Sums::default();
    let (mut steps, mut ramps) = (Vec::new(), Vec::new());
    for (k, &i) in order.iter().enumerate() {
        let (s, c) = (shape[i], cells[i].means.clock);
        let column = contrast.projector.column(i);
        for &j in &order[..k] {
            let pair = s * shape[j] * column[j];
            let other = cells[j].means.clock;
            sums.pairs[0] += 2.0 * pair;
            sums.pairs[1] += (c + other) * pair;
            sums.pairs[2] += 2.0 * c * other * pair;
        }
        let own = s * s * column[i];
        let moment = s * contrast.projected[i];
        for (power, clock) in [1.0, c, c * c].into_iter().enumerate() {
            sums.pairs[power] += own * clock;
            sums.squares[power] += s * s * clock;
        }
        sums.moments[0] += moment;
        sums.moments[1] += c * moment;
        let Some(next) = order.get(k + 1).map(|n| cells[*n].means.clock) else { continue };
        let start = 0.5 * (c + next);
        if next < c && start > COURSE_PART.0 && start < COURSE_PART.1 {
            steps.push((start, sums.step()));
            ramps.push((start, sums.ramp(start)));
        }
    }
    ramps.push((0.0, sums.ramp(0.0)));
    AllProducts { whole: sums.step(), steps, ramps, count: order.len().max(1) as f64 }
}

/// Log evidence of one kind over all its starts. A ramp grows from the beginning in half of the cases.
fn over_starts(kind: Course, tried: &[Tried]) -> f64 {
    let logs: Vec<f64> = tried.iter().map(|t| t.log).collect();
    match (kind, logs.split_last()) {
        (Course::Ramp, Some((first, later))) if !later.is_empty() => log_mean(&[*first, log_mean(later)]),
        _ => log_mean(&logs),
    }
}

/// How a change develops; `None` where the cells do not show it by any of its time courses.
pub(super) fn of(
    cells: &[Cell],
    contrast: &Contrast,
    candidate: &Candidate,
    scale: f64,
    sizes: &[f64],
) -> Option<TimeCourse> {
    let Candidate { shape, courses } = candidate;
    let all = products(cells, contrast, shape);
    let tried = |from: &[(f64, Products)]| -> Vec<Tried> {
        let log = |(a, b, square): Products| {
            let mean = square / all.count;
            if mean > 0.0 { evidence(a / mean, b / mean.sqrt(), scale, sizes) } else { f64::NEG_INFINITY }
        };
        from.iter().map(|(start, products)| Tried { start: *start, log: log(*products) }).collect()
    };
    let mut time_courses: Vec<(Course, f64, Vec<Tried>)> = Vec::new();
    for kind in *courses {
        let tried = match kind {
            Course::Whole => tried(&[(0.0, all.whole)]),
            Course::Step => tried(&all.steps),
            Course::Ramp => tried(&all.ramps),
        };
        // Most changes happen between two campaigns, and not within the later one.
        let prior = match kind {
            _ if courses.len() == 1 => 1.0,
            Course::Whole => COURSE_WHOLE,
            _ => (1.0 - COURSE_WHOLE) / (courses.len() as f64 - 1.0),
        };
        let log = prior.ln() + over_starts(*kind, &tried);
        if log.is_finite() {
            time_courses.push((*kind, log, tried));
        }
    }
    let log = log_sum(&time_courses.iter().map(|c| c.1).collect::<Vec<f64>>());
    time_courses.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let second = time_courses.get(1).map_or(f64::NEG_INFINITY, |c| c.1);
    let (kind, best, tried) = time_courses.into_iter().next()?;
    let start = start(&tried)?;
    let shape = with_time_course(cells, shape, kind, start.at);
    (rms_after(cells, &shape) > 0.0).then_some(TimeCourse {
        kind,
        sure: best > second + COURSE_LEAD,
        start,
        shape,
        log,
    })
}

/// The likeliest start and the stretch of likely starts that holds `COURSE_INTERVAL`; the starts that were tried fall.
fn start(tried: &[Tried]) -> Option<Start> {
    let logs: Vec<f64> = tried.iter().map(|t| t.log).collect();
    let total = log_sum(&logs);
    let mut order: Vec<usize> = (0..tried.len()).filter(|i| logs[*i].is_finite()).collect();
    order.sort_by(|a, b| logs[*b].total_cmp(&logs[*a]));
    let best = *order.first()?;
    let (mut sum, mut late, mut early) = (0.0, best, best);
    for i in order {
        if sum >= COURSE_INTERVAL {
            break;
        }
        sum += (logs[i] - total).exp();
        (late, early) = (late.min(i), early.max(i));
    }
    // A change between two moments that were tried can be anywhere between their neighbours.
    let high = tried[late.saturating_sub(1)].start;
    let low = tried[(early + 1).min(tried.len() - 1)].start;
    // What may have grown from the beginning is taken to have done so.
    Some(Start { at: if low > 0.0 { tried[best].start } else { 0.0 }, low, high })
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::super::cells::Means;
    use super::*;

    /// Two cells of BEFORE and eight of AFTER in no order of time, with correlations.
    fn example() -> (Vec<Cell>, Contrast, DVector<f64>) {
        let clocks = [0.55, 0.05, 0.95, 0.25, 0.75, 0.15, 0.45, 0.85];
        let before = [Cell::default(), Cell::default()];
        let after = clocks.map(|clock| Cell {
            after: true,
            means: Means { clock, ..Means::default() },
            ..Cell::default()
        });
        let cells: Vec<Cell> = before.into_iter().chain(after).collect();
        let k = DMatrix::from_fn(10, 10, |i, j| {
            (-0.2 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.3 } else { 0.0 }
        });
        let y = DVector::from_fn(10, |i, _| (1.7 * i as f64).sin());
        let shape = DVector::from_fn(10, |i, _| if i < 2 { 0.0 } else { 1.0 + 0.1 * i as f64 });
        (cells, Contrast::new(k, Some(&[0; 10]), y, 4.0).expect("definite"), shape)
    }

    #[test]
    fn products_from_sums_are_those_of_the_shapes() {
        let (cells, contrast, shape) = example();
        let all = products(&cells, &contrast, &shape);
        let mut each = vec![(Course::Whole, 0.0, all.whole)];
        each.extend(all.steps.iter().map(|(t, p)| (Course::Step, *t, *p)));
        each.extend(all.ramps.iter().map(|(t, p)| (Course::Ramp, *t, *p)));
        assert_eq!(each.len(), 1 + 7 + 8);
        for (kind, start, (a, b, square)) in each {
            let direct = with_time_course(&cells, &shape, kind, start);
            let (direct_a, direct_b) = contrast.products(&direct);
            assert!((a - direct_a).abs() < 1e-9, "{kind:?} {start}: {a} {direct_a}");
            assert!((b - direct_b).abs() < 1e-9, "{kind:?} {start}: {b} {direct_b}");
            assert!((square - direct.norm_squared()).abs() < 1e-9, "{kind:?} {start}");
        }
    }

    #[test]
    fn a_step_is_found_between_the_cells_beside_it() {
        let (cells, contrast, shape) = example();
        let stepped = with_time_course(&cells, &shape, Course::Step, 0.5) * 30.0;
        let contrast = contrast.with_residual(&contrast.residual + stepped);
        let candidate = Candidate { shape, courses: &[Course::Whole, Course::Step, Course::Ramp] };
        let time_course = of(&cells, &contrast, &candidate, 1.0, &[10.0, 30.0]).expect("a time course");
        assert_eq!((time_course.kind, time_course.sure), (Course::Step, true));
        assert!((time_course.start.at - 0.5).abs() < 1e-9, "{:?}", time_course.start);
        assert!(time_course.start.low < 0.5 && time_course.start.high > 0.5, "{:?}", time_course.start);
    }
}
