//! Whether a pressure counts from vacuum although nothing says so: a question for the user, since a reading of one atmosphere may be meant.

use super::sample::Sample;
use super::{Guess, roles};
use crate::recording::Quantity;
use crate::short_number::short;

/// The standard atmosphere, Pa; the pressure of the day differs by a few per cent of it.
pub(super) const ATMOSPHERE: f64 = 101_325.0;
/// What an absolute sensor reads of a vented muscle, Pa: from a laboratory at 1500 m to a day of high pressure.
const VENTED: (f64, f64) = (83e3, 107e3);
/// Readings at the beginning of a file that are read.
const AT_START: usize = 20;
/// The muscle is slack where its force is below this share of the largest.
const SLACK: f64 = 0.03;
/// Where the highest pressure is this many times the lowest, the lowest is not a tested level.
const FAR_ABOVE: f64 = 2.0;

/// Adds the question if the pressure is absolute where its lowest readings are those of the atmosphere, and the muscle is slack there at the
/// beginning, or the pressure is much higher later.
pub(super) fn ask(sample: &Sample, guess: &mut Guess) {
    let readings = |quantity: Quantity| {
        let column = guess.columns.iter().find(|c| c.quantity == quantity)?;
        let n = (0..sample.columns.len()).find(|n| roles::source(sample, *n) == column.source)?;
        Some((column, &sample.columns[n]))
    };
    let Some((pressure, column)) = readings(Quantity::Pressure) else { return };
    let Some(unit) = Quantity::Pressure.unit(pressure.unit) else { return };
    if column.name.absolute() || pressure.offset != 0.0 {
        return;
    }
    let si = |v: f64| v * pressure.scale * unit.scale;
    let (low, high) = column.range();
    let vented = |p: f64| (VENTED.0..=VENTED.1).contains(&p);
    if !vented(si(low)) {
        return;
    }
    let start =
        column.values().take(AT_START).map(si).sum::<f64>() / column.values().take(AT_START).count() as f64;
    let slack = readings(Quantity::Force).is_some_and(|(_, force)| {
        let (least, most) = force.range();
        let mut first = force.values().take(AT_START);
        most > least && first.all(|f| f.abs() <= SLACK * least.abs().max(most.abs()))
    });
    if !(vented(start) && slack || si(high) > FAR_ABOVE * si(low)) {
        return;
    }
    let why = if slack { ", where the muscle is slack" } else { "" };
    let offset = short(-ATMOSPHERE / unit.scale);
    let question = format!(
        "is {} absolute pressure? It begins at {} kPa and is {} kPa at least{why}, about the pressure of the atmosphere; if the sensor counts \
         from vacuum, write offset = {offset} under [columns.pressure]",
        pressure.header,
        short(start * 1e-3),
        short(si(low) * 1e-3)
    );
    guess.checks.push(question.into());
}
