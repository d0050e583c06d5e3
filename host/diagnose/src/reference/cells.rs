//! Residuals and shapes as means over cells of pressure and direction.

use super::criteria::{BEYOND, CELLS, CREEP_START, MOST_CELLS, POINT_BINS};
use super::runs::{Run, Runs};
use super::surface::{Surface, bin};

/// Weighted means over the settled rows of a run in one direction and sixth of the pressure range.
#[derive(Debug, Clone, Default)]
pub(super) struct Cell {
    /// Index among all runs; the first of those joined.
    pub run: usize,
    pub number: usize,
    pub mounting: usize,
    pub after: bool,
    pub direction: f64,
    pub bin: usize,
    /// See [`Means`].
    pub means: Means,
    /// Effective number of rows, 1/Σw².
    pub rows: f64,
    /// No recording: what the reference's other lengths say, with their error.
    pub interpolated: bool,
}

/// What is averaged.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Means {
    /// F − S, N.
    pub residual: f64,
    pub pressure: f64,
    /// Mean of the directions before, N.
    pub force: f64,
    pub by_pressure: f64,
    pub by_stroke: f64,
    /// The slope that a step within AFTER counts with.
    pub step_by_stroke: f64,
    /// ln(1 + time since mounting).
    pub mounted: f64,
    /// ln(1 + time in the run).
    pub begun: f64,
    /// Clock of AFTER, 0 to 1.
    pub clock: f64,
    /// 0 where the actuator is slack, 1 where it pulls as usual.
    pub active: f64,
    pub force_by_stroke: f64,
    pub pressure_by_pressure: f64,
    /// F − P ∂F/∂P: the elastic part.
    pub elastic: f64,
    /// Variance of the surface, N².
    pub variance: f64,
    /// What a lag of a given size does, N; filled in where one is tested.
    pub lag: f64,
}

impl Means {
    fn add(&mut self, w: f64, o: &Self) {
        let pairs = [
            (&mut self.residual, o.residual),
            (&mut self.pressure, o.pressure),
            (&mut self.force, o.force),
            (&mut self.by_pressure, o.by_pressure),
            (&mut self.by_stroke, o.by_stroke),
            (&mut self.step_by_stroke, o.step_by_stroke),
            (&mut self.mounted, o.mounted),
            (&mut self.begun, o.begun),
            (&mut self.clock, o.clock),
            (&mut self.active, o.active),
            (&mut self.force_by_stroke, o.force_by_stroke),
            (&mut self.pressure_by_pressure, o.pressure_by_pressure),
            (&mut self.elastic, o.elastic),
            (&mut self.variance, o.variance),
            (&mut self.lag, o.lag),
        ];
        for (to, from) in pairs {
            *to += w * from;
        }
    }
}

/// What a row contributes.
pub(super) fn row(run: &Run, i: usize, surface: &Surface, duration: f64) -> Means {
    let (p, d) = (run.pressure[i], run.direction[i]);
    let c = &surface.curves[run.mounting];
    let at = |curve: &[f64]| surface.at(curve, p);
    let (force, by_pressure, by_stroke) = (at(&c.force), at(&c.by_pressure), at(&c.by_stroke));
    let t = run.time[i] - run.time[0];
    Means {
        residual: run.force[i] - surface.force(run.mounting, p, d) - by_stroke * run.shift,
        pressure: p,
        force,
        by_pressure,
        by_stroke,
        step_by_stroke: if c.own_by_stroke.is_empty() { by_stroke } else { at(&c.own_by_stroke) },
        mounted: ((run.since_mounted + t) / CREEP_START).ln_1p(),
        begun: (t / CREEP_START).ln_1p(),
        clock: if run.after { (run.since_after + t) / duration.max(1e-9) } else { 0.0 },
        active: (by_pressure / surface.usual_slope).clamp(0.0, 1.0),
        force_by_stroke: force * by_stroke,
        pressure_by_pressure: p * by_pressure,
        elastic: force - p * by_pressure,
        variance: at(&c.variance[usize::from(d < 0.0)]),
        lag: 0.0,
    }
}

/// A cell's direction and pressure bin, and its rows with their weights.
type Members = ((f64, usize), Vec<(usize, f64)>);

/// What a lag does to the rows of a run, N.
pub(super) type LagTrace<'a> = &'a dyn Fn(&Run) -> Vec<f64>;

/// Row weights of one run: the settled rows within the range, by cell.
pub(super) fn members(run: &Run, surface: &Surface) -> Vec<Members> {
    let beyond = BEYOND * (surface.high - surface.low);
    let inside = |p: f64| p >= surface.low - beyond && p <= surface.high + beyond;
    let mut cells = vec![Vec::new(); 2 * CELLS];
    for i in (0..run.time.len()).filter(|i| run.settled[*i] && inside(run.pressure[*i])) {
        let side = usize::from(run.direction[i] < 0.0);
        cells[side * CELLS + bin(run.pressure[i], surface.low, surface.high, CELLS)].push(i);
    }
    let mut kept = Vec::new();
    for (place, rows) in cells.into_iter().enumerate().filter(|(_, r)| !r.is_empty()) {
        let (side, bin_) = (place / CELLS, place % CELLS);
        // A bin of many rows is a hold: it must not outvote a ramp. Bins at the border of two cells count by their rows in each.
        let mut own = [0.0_f64; POINT_BINS];
        rows.iter().for_each(|i| own[bin(run.pressure[*i], surface.low, surface.high, POINT_BINS)] += 1.0);
        let weight =
            |i: &usize| 1.0 / own[bin(run.pressure[*i], surface.low, surface.high, POINT_BINS)].sqrt();
        let total: f64 = rows.iter().map(weight).sum();
        let weighted = rows.iter().map(|i| (*i, weight(i) / total)).collect();
        kept.push(((if side == 0 { 1.0 } else { -1.0 }, bin_), weighted));
    }
    kept
}

/// Rows beyond the reference's pressures, and all settled rows.
pub(super) fn beyond(run: &Run, surface: &Surface) -> (usize, usize) {
    let beyond = BEYOND * (surface.high - surface.low);
    let settled = (0..run.time.len()).filter(|i| run.settled[*i]);
    settled.fold((0, 0), |(out, all), i| {
        let p = run.pressure[i];
        (out + usize::from(!(p >= surface.low - beyond && p <= surface.high + beyond)), all + 1)
    })
}

/// The cells of all runs. `lag` gives what a lag does to the rows of a run of AFTER, N.
pub(super) fn cells(all: &Runs, surface: &Surface, lag: Option<LagTrace<'_>>) -> Vec<Cell> {
    let mut cells = Vec::new();
    for (index, run) in all.runs.iter().enumerate() {
        let late = lag.filter(|_| run.after).map(|of| of(run));
        for ((direction, bin), rows) in members(run, surface) {
            let mut means = Means::default();
            for (i, w) in &rows {
                let mut one = row(run, *i, surface, all.duration);
                one.lag = late.as_ref().map_or(0.0, |l| l[*i]);
                means.add(*w, &one);
            }
            cells.push(Cell {
                run: index,
                number: run.number,
                mounting: run.mounting,
                after: run.after,
                direction,
                bin,
                means,
                rows: 1.0 / rows.iter().map(|(_, w)| w * w).sum::<f64>(),
                interpolated: false,
            });
        }
    }
    let mut cells = join(cells);
    let made = interpolated(&cells, all);
    cells.extend(made);
    cells
}

/// Root mean square over the cells of AFTER.
pub(super) fn rms_after(cells: &[Cell], shape: &nalgebra::DVector<f64>) -> f64 {
    let own = || cells.iter().zip(shape.iter()).filter(|(c, _)| c.after);
    let count = own().count().max(1) as f64;
    (own().map(|(_, s)| s * s).sum::<f64>() / count).sqrt()
}

/// For every cell of AFTER at a length that the reference does not have, one of BEFORE without a difference: its error is that of the
/// interpolation.
fn interpolated(cells: &[Cell], all: &Runs) -> Vec<Cell> {
    let mut made: std::collections::BTreeMap<(usize, bool, usize), Cell> = std::collections::BTreeMap::new();
    for cell in cells.iter().filter(|c| c.after && all.is_interpolated(c.mounting)) {
        made.entry((cell.mounting, cell.direction < 0.0, cell.bin)).or_insert_with(|| Cell {
            run: all.runs.len() + cell.mounting,
            after: false,
            means: Means { residual: 0.0, lag: 0.0, ..cell.means },
            interpolated: true,
            ..cell.clone()
        });
    }
    made.into_values().collect()
}

/// Joins neighbouring runs of a mounting in pairs until few enough cells are left.
fn join(mut cells: Vec<Cell>) -> Vec<Cell> {
    while cells.len() > MOST_CELLS {
        let key = |c: &Cell| (c.after, c.mounting, c.number / 2, c.direction < 0.0, c.bin);
        let count = cells.len();
        let mut joined: Vec<(Cell, f64)> = Vec::new();
        let mut places = std::collections::BTreeMap::new();
        for cell in cells {
            match places.get(&key(&cell)) {
                Some(&at) => {
                    let (to, n): &mut (Cell, f64) = &mut joined[at];
                    to.means.add(1.0, &cell.means);
                    to.rows += cell.rows;
                    *n += 1.0;
                }
                None => {
                    places.insert(key(&cell), joined.len());
                    joined.push((cell, 1.0));
                }
            }
        }
        cells = joined
            .into_iter()
            .map(|(mut cell, n)| {
                let mut means = Means::default();
                means.add(1.0 / n, &cell.means);
                cell.means = means;
                cell.number /= 2;
                cell
            })
            .collect();
        // The first run of a pair names both, so that their cells stay together.
        let mut first = std::collections::BTreeMap::new();
        for c in &mut cells {
            c.run = *first.entry((c.after, c.mounting, c.number)).or_insert(c.run);
        }
        if cells.len() == count {
            break;
        }
    }
    cells
}
