//! Known weights on the load cell: its scale, and what the line's pressure adds to it.

use super::table::{Table, stays};
use super::{Measured, Uncertainty};
use crate::bench::BenchName;
use crate::numerics::least_squares::by_blocks;
use pam_data::error::Result;
use pam_data::recording::Quantity;

const CHECK: &str = "dead weights on the load cell";
/// From this pressure on the line counts as under pressure, Pa.
const PRESSED: f64 = 2e4;

/// No weight is what is written on it: those of the workshop are wrong by up to this share (class M3 of OIML R 111).
const WEIGHT_ERROR: f64 = 5e-4;

/// Scale of the cell and thrust of the line.
pub(super) fn measure(table: &Table) -> Result<Vec<Measured>> {
    let (read, weight) = (table.need(Quantity::Force)?, table.reference(Quantity::Force)?);
    let pressure = table.find(Quantity::Pressure).filter(|p| {
        let pressed = p.iter().filter(|p| **p > PRESSED).count();
        pressed * 10 > p.len() && pressed * 10 < 9 * p.len()
    });
    let off: Vec<f64> = read.iter().zip(weight).map(|(r, w)| r - w).collect();
    let mut columns = vec![weight.to_vec(), vec![1.0; read.len()]];
    // The gauge's own noise must not make stays.
    let line: Option<Vec<f64>> =
        pressure.map(|p| p.iter().map(|p| if *p > PRESSED { 1.0 } else { 0.0 }).collect());
    let block = line.as_ref().map_or_else(|| stays(&[weight]), |l| stays(&[weight, l]));
    if let Some(p) = pressure {
        columns.push(p.to_vec());
    }
    // A zero that drifts on meanwhile must not pass for what the line does.
    if let Some(t) = table.find(Quantity::Time) {
        let middle = 0.5 * (t.first().unwrap_or(&0.0) + t.last().unwrap_or(&0.0));
        columns.push(t.iter().map(|t| t - middle).collect());
    }
    let Some(found) = by_blocks(&columns, &off, &block, table.rising_time()) else {
        return Err(table.poor(
            "the weights do not determine gain and offset: use at least three different ones, each for some seconds; where the line was \
             under pressure, use all of them with and without pressure",
        ));
    };
    let gain = found.values[0];
    let uncertain =
        Uncertainty::with_reference(found.deviations[0], found.freedom, WEIGHT_ERROR * (1.0 + gain));
    let mut measured = vec![Measured {
        fault: BenchName::ForceGain,
        parameters: vec![gain, 0.0],
        deviations: vec![Some(uncertain.deviation), None],
        freedom: uncertain.freedom,
        text: format!(
            "the cell reads {:+.2} ± {:.2} % of the load",
            100.0 * gain,
            100.0 * uncertain.half_width()
        ),
        check: CHECK,
    }];
    if pressure.is_some() {
        // F = (1 + γ)(W + c P) + o
        let thrust = found.values[2] / (1.0 + gain);
        let uncertain = Uncertainty::of(found.deviations[2] / (1.0 + gain), found.freedom);
        measured.push(Measured {
            fault: BenchName::CrossTalk,
            parameters: vec![thrust],
            deviations: vec![Some(uncertain.deviation)],
            freedom: uncertain.freedom,
            text: format!(
                "the line pushes with {:+.3} ± {:.3} N per 100 kPa",
                1e5 * thrust,
                1e5 * uncertain.half_width()
            ),
            check: CHECK,
        });
    }
    Ok(measured)
}
