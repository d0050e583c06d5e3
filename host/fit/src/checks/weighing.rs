//! The load cell with and without muscle and fittings: the weight that hangs in its reading.

use super::table::{Table, stays};
use super::{Measured, Uncertainty};
use crate::bench::BenchName;
use crate::numerics::least_squares::by_blocks;
use pam_data::error::Result;
use pam_data::recording::Quantity;

/// Standard gravity, m/s² (as in the law).
pub(super) const GRAVITY: f64 = 9.806_65;

/// What the cell reads more with everything attached. A zero that is wrong is the same in both, and one that drifts has its own column.
pub(super) fn measure(table: &Table) -> Result<Vec<Measured>> {
    let (read, attached) = (table.need(Quantity::Force)?, table.attached()?);
    let mut columns = vec![attached.to_vec(), vec![1.0; read.len()]];
    if let Some(t) = table.find(Quantity::Time) {
        let middle = 0.5 * (t.first().unwrap_or(&0.0) + t.last().unwrap_or(&0.0));
        columns.push(t.iter().map(|t| t - middle).collect());
    }
    let Some(found) = by_blocks(&columns, read, &stays(&[attached]), table.rising_time()) else {
        return Err(table.poor(
            "the readings do not separate the weight from a drift: read the cell with and without muscle and fittings in turn, twice each \
             at least, for some seconds",
        ));
    };
    // A weight pulls the reading by +W; the law counts what it takes from it: F = −g m.
    let uncertain = Uncertainty::of(found.deviations[0], found.freedom);
    Ok(vec![Measured {
        fault: BenchName::Gravity,
        parameters: vec![-found.values[0] / GRAVITY, 0.0],
        deviations: vec![Some(uncertain.deviation / GRAVITY), None],
        freedom: uncertain.freedom,
        text: format!(
            "muscle and fittings add {:+.3} ± {:.3} N to the reading",
            found.values[0],
            uncertain.half_width()
        ),
        check: "the load cell with and without muscle and fittings",
    }])
}
