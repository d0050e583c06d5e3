//! Points at one held length, of one direction and one pressure bin, as one point.
//!
//! They share the columns of stroke and of pressure, so that their residuals differ by a number that hardly depends on the parameters. One
//! point of their mean pressure and force and of their whole weight has the same normal equations; what it lacks of the weighted sum of
//! squares is a constant. Many runs at a few lengths become as few points as the lengths, directions and bins allow.

use std::collections::HashMap;
use std::sync::Arc;

use super::design::Bin;
use super::points::Point;
use super::problem::Problem;

/// A problem of fewer points, with their weights.
pub(super) struct Condensed {
    pub problem: Problem,
    pub weights: Vec<f64>,
}

/// The sums of points that become one.
struct Cell {
    first: usize,
    weight: f64,
    pressure: f64,
    force: f64,
    stroke: f64,
}

/// About how many bins of pressure the condensed problem has: a spline of some ten nodes hardly bends within one.
const BINS: usize = 256;

/// Bins of `together` bins each, at the mean pressure of their points.
fn wide_bins(problem: &Problem, weights: &[f64], together: u32) -> Vec<Bin> {
    let design = &problem.design;
    let mut means = vec![(0.0, 0.0); design.bins.len().div_ceil(together as usize)];
    for (row, w) in design.rows.iter().zip(weights) {
        let mean = &mut means[(row.bin / together) as usize];
        mean.0 += w * row.pressure;
        mean.1 += w;
    }
    let bins = design.bins.chunks(together as usize).zip(means);
    let wide = |(bins, (sum, weight)): (&[Bin], (f64, f64))| {
        let first = &bins[0];
        if weight > 0.0 {
            Bin { phi: design.basis.at(sum / weight), group: first.group }
        } else {
            first.clone()
        }
    };
    bins.map(wide).collect()
}

/// The condensed problem; `mounting` is the index of each point's mounting. `None` where a point has no mounting, or where little would
/// be saved. Points without weight are left out.
pub(super) fn condense(problem: &Problem, weights: &[f64], mounting: &[Option<usize>]) -> Option<Condensed> {
    let rows = &problem.design.rows;
    // Bins are in the order of pressure.
    let together = problem.design.bins.len().div_ceil(BINS).max(1) as u32;
    let mut place: HashMap<(usize, i8, u32), usize> = HashMap::new();
    let mut cells: Vec<Cell> = Vec::new();
    for (i, ((row, w), mounting)) in rows.iter().zip(weights).zip(mounting).enumerate() {
        if *w <= 0.0 {
            continue;
        }
        let key = ((*mounting)?, row.direction as i8, row.bin / together);
        let at = *place.entry(key).or_insert_with(|| {
            cells.push(Cell { first: i, weight: 0.0, pressure: 0.0, force: 0.0, stroke: 0.0 });
            cells.len() - 1
        });
        let cell = &mut cells[at];
        cell.weight += w;
        cell.pressure += w * row.pressure;
        cell.force += w * row.force;
        cell.stroke += w * problem.points.list[i].stroke;
    }
    if 2 * cells.len() > rows.len() {
        return None;
    }
    let mut condensed = problem.clone();
    condensed.design.bins = wide_bins(problem, weights, together);
    let mean = |cell: &Cell| (cell.pressure / cell.weight, cell.force / cell.weight);
    condensed.design.rows = cells
        .iter()
        .map(|cell| {
            let (pressure, force) = mean(cell);
            let mut row = rows[cell.first];
            (row.pressure, row.force, row.bin) = (pressure, force, row.bin / together);
            row
        })
        .collect();
    let mut points = problem.points.without_list();
    points.list = cells
        .iter()
        .map(|cell| {
            let (pressure, force) = mean(cell);
            let stroke = cell.stroke / cell.weight;
            Point { pressure, force, stroke, ..problem.points.list[cell.first] }
        })
        .collect();
    condensed.points = Arc::new(points);
    condensed.shift = cells.iter().map(|cell| problem.shift[cell.first]).collect();
    Some(Condensed { problem: condensed, weights: cells.iter().map(|cell| cell.weight).collect() })
}
