//! What a table is wrong by where nothing changed: a Gaussian covariance beside what repeats.
//!
//! A table states its rms error on the recordings that it was fitted to. Equations that do not fit are wrong in a smooth way over the
//! pressure, similarly in both directions, and mostly by another amount at each length. How much larger the error is in the cells that are
//! compared is not stated: several factors are tried, and AFTER itself says how probable each is.

use nalgebra::DMatrix;

use super::cells::Cell;
use super::criteria::{
    REPEATABILITY_PULLS, TABLE_ERROR_COMMON, TABLE_ERROR_DIRECTIONS, TABLE_ERROR_FRICTION,
    TABLE_ERROR_LENGTH, TABLE_ERROR_SLACK, TABLE_ERROR_ZERO,
};

/// Covariance of the table's error, N². `error`: its rms in a cell where the actuator pulls, N.
pub(super) fn covariance(cells: &[Cell], range: f64, error: f64) -> DMatrix<f64> {
    // Where the actuator begins to pull the error is as large as elsewhere: the table's threshold is wrong, too.
    let size =
        |c: &Cell| if c.means.active > REPEATABILITY_PULLS { error } else { TABLE_ERROR_SLACK * error };
    DMatrix::from_fn(cells.len(), cells.len(), |i, j| {
        let (a, b) = (&cells[i], &cells[j]);
        let apart = (a.means.pressure - b.means.pressure) / range / TABLE_ERROR_LENGTH;
        let way = if a.direction * b.direction > 0.0 { 1.0 } else { TABLE_ERROR_DIRECTIONS };
        let own = if a.mounting == b.mounting { 1.0 - TABLE_ERROR_COMMON } else { 0.0 };
        // A rough function: where the actuator goes slack the error has a kink.
        let smooth = (-apart.abs()).exp() * way;
        let (f, g) = (a.direction * a.means.force, b.direction * b.means.force);
        size(a) * size(b) * (TABLE_ERROR_COMMON + own) * smooth
            + f * g * TABLE_ERROR_FRICTION.powi(2) * (TABLE_ERROR_COMMON + own)
            + (TABLE_ERROR_ZERO * error).powi(2)
    })
}
