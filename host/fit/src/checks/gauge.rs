//! A reference gauge beside the bench's own: its scale. Its zero is a part of the dead band in every model, and stays there.

use super::table::{Table, stays};
use super::{Measured, Uncertainty};
use crate::bench::BenchName;
use crate::numerics::least_squares::by_blocks;
use pam_data::error::Result;
use pam_data::recording::Quantity;

/// The reference is wrong itself, by up to this share of its range (class 0.1 of EN 837-1).
const REFERENCE_ERROR: f64 = 1e-3;

/// Scale of the gauge.
pub(super) fn measure(table: &Table) -> Result<Vec<Measured>> {
    let (read, known) = (table.need(Quantity::Pressure)?, table.reference(Quantity::Pressure)?);
    let off: Vec<f64> = read.iter().zip(known).map(|(r, k)| r - k).collect();
    let columns = [known.to_vec(), vec![1.0; read.len()]];
    let found = by_blocks(&columns, &off, &stays(&[known]), table.rising_time());
    let Some(found) = found else {
        return Err(table.poor(
            "the pressures do not separate gain from offset: use at least three different ones, each for some seconds",
        ));
    };
    // The law counts what is missing: the muscle has (1 + γ) of what is read.
    let missing = 1.0 / (1.0 + found.values[0]) - 1.0;
    let uncertain = Uncertainty::with_reference(found.deviations[0], found.freedom, REFERENCE_ERROR)
        .scaled((1.0 + found.values[0]).powi(-2));
    Ok(vec![Measured {
        fault: BenchName::GaugeGain,
        parameters: vec![missing, 0.0],
        deviations: vec![Some(uncertain.deviation), None],
        freedom: uncertain.freedom,
        text: format!(
            "the muscle has {:+.2} ± {:.2} % of what the gauge reads",
            100.0 * missing,
            100.0 * uncertain.half_width()
        ),
        check: "a reference gauge beside the bench's",
    }])
}
