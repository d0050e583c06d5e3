//! The residual of an effect after a base model is refitted: the part that a diagnosis can see.

use nalgebra::{DMatrix, DVector};
use virtual_bench::friction::BraidFriction;
use virtual_bench::recording::Row;
use virtual_bench::tube::Geometry;

/// A base to refit: its scales, and whether it is flexible.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base<'a> {
    pub stroke: f64,
    pub force: f64,
    pub geometry: Geometry,
    pub friction: &'a BraidFriction,
    pub flexible: bool,
    /// Whether friction follows what the base changes in the core force.
    pub rubs: bool,
}

/// Columns of the stiff base.
const STIFF: usize = 13;

impl Base<'_> {
    fn columns(&self) -> usize {
        if self.flexible { 6 } else { STIFF }
    }

    /// Columns at one row. The flexible base has its own set per file. The stiff one shares a larger set: whatever depends on
    /// the stroke alone could be the bladder's energy, so that is given every freedom, in stroke and in radius; then the
    /// deadband, and friction straight in the pressure.
    fn row(&self, r: &Row, way: f64) -> Vec<f64> {
        let (u, f) = (r.stroke / self.stroke, r.force / self.force);
        let g = &self.geometry;
        // What changes the core force changes the friction with it.
        let rubbed = if self.rubs { 1.0 - way * self.friction.factor(r.pressure) } else { 1.0 };
        let mut row =
            vec![rubbed, rubbed * u, rubbed * u * u, rubbed * u.powi(3), rubbed * u.powi(4), way * f];
        if !self.flexible {
            let q = g.braid_radius(g.rest_length - r.stroke) / g.radius - 1.0;
            row[0] *= g.pulling_area(g.rest_length - r.stroke) * 1e6;
            row.extend([u.powi(6), q, q * q, q.powi(3), q.powi(4)].map(|c| rubbed * c));
            row.extend([1, 2].map(|power| way * f * (r.pressure / 5e5).powi(power)));
        }
        row
    }
}

/// The residual of a difference after a base is refitted, row by row and file by file; vented files are left out of the
/// fit and have nothing left.
fn left(difference: &[f64], files: &[Vec<Row>], base: Base<'_>) -> Vec<Vec<f64>> {
    let (columns, flexible) = (base.columns(), base.flexible);
    let way = |file: &[Row], i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(file.len() - 1));
        (file[b].stroke - file[a].stroke).signum()
    };
    let mut normal = DMatrix::<f64>::zeros(columns, columns);
    let mut rhs = DVector::<f64>::zeros(columns);
    let mut at = 0;
    let mut starts = Vec::new();
    let mut solutions: Vec<Option<DVector<f64>>> = Vec::new();
    let solve = |a: &DMatrix<f64>, y: &DVector<f64>| a.clone().svd(true, true).solve(y, 1e-12).ok();
    for file in files {
        starts.push(at);
        if flexible {
            normal.fill(0.0);
            rhs.fill(0.0);
        }
        let pressed = file.iter().map(|r| r.pressure).fold(0.0, f64::max) > 20e3;
        if pressed {
            for i in (0..file.len()).step_by((file.len() / 600).max(1)) {
                let b = DVector::from_vec(base.row(&file[i], way(file, i)));
                normal += &b * b.transpose();
                rhs += b * difference[at + i];
            }
        }
        solutions.push(if flexible && pressed { solve(&normal, &rhs) } else { None });
        at += file.len();
    }
    let shared = if flexible { None } else { solve(&normal, &rhs) };
    files
        .iter()
        .zip(starts)
        .zip(&solutions)
        .map(|((file, at), own)| {
            let pressed = file.iter().map(|r| r.pressure).fold(0.0, f64::max) > 20e3;
            let Some(x) = own.as_ref().or(shared.as_ref()).filter(|_| pressed) else {
                return vec![0.0; file.len()];
            };
            (0..file.len())
                .map(|i| {
                    let b = DVector::from_vec(base.row(&file[i], way(file, i)));
                    difference[at + i] - b.dot(x)
                })
                .collect()
        })
        .collect()
}

/// The lesser residual, when friction follows the base's changes and when it does not: an effect that either
/// reading absorbs counts as absorbed.
pub(super) fn least_left(difference: &[f64], files: &[Vec<Row>], base: Base<'_>) -> Vec<Vec<f64>> {
    let (a, b) = (left(difference, files, base), left(difference, files, Base { rubs: false, ..base }));
    if rms(&a) < rms(&b) { a } else { b }
}

pub(super) fn rms(rows: &[Vec<f64>]) -> f64 {
    let n: usize = rows.iter().filter(|f| f.iter().any(|v| *v != 0.0)).map(Vec::len).sum();
    (rows.iter().flatten().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt()
}
