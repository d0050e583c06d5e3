//! The force that a table gives, tabulated as recordings would be.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

use super::criteria::{GRID, SAME_STROKE, TABLE_SURFACE_STEP};
use super::runs::Runs;
use super::surface::{Curves, Surface};
use pam_data::error::{DataCode, Error, Result};
use pam_fit::table_file::{StoredMounting, TableFile};

/// What the fit found a held stroke to be off by, m; zero where it did not look.
fn offset(table: &TableFile, held: f64) -> f64 {
    let near = |m: &&StoredMounting| (m.stroke - held).abs() <= SAME_STROKE;
    let apart = |m: &StoredMounting| (m.stroke - held).abs();
    let nearest = table.about.mountings.iter().filter(near).min_by(|a, b| apart(a).total_cmp(&apart(b)));
    nearest.map_or(0.0, |m| m.offset)
}

/// The slopes over the length as AFTER itself shows them, for a step within it: the lengths before and after the step are the same, so
/// that the recordings know this slope better than the table does. Nothing is filled in where AFTER has one length, or too few rows.
pub(super) fn fill_own_slopes(surface: &mut Surface, runs: &Runs) {
    let mut alone = runs.clone();
    alone.runs.iter_mut().for_each(|r| r.after = false);
    let Some(own) = Surface::of(&alone).ok().filter(|own| own.curves.len() > 1) else { return };
    let step = (surface.high - surface.low) / (GRID - 1) as f64;
    let pressure: Vec<f64> = (0..GRID).map(|g| surface.low + step * g as f64).collect();
    for (curve, from) in surface.curves.iter_mut().zip(&own.curves) {
        curve.own_by_stroke = pressure.iter().map(|p| own.at(&from.by_stroke, *p)).collect();
    }
}

/// A table's surface at the mountings of AFTER, over the pressures that AFTER has and the table was made for.
///
/// # Errors
/// A table that cannot be evaluated, or no common pressures.
pub(super) fn of(table: &TableFile, runs: &Runs) -> Result<Surface> {
    let muscle =
        Muscle::<f64>::build(&table.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let tested = table.table.tested;
    let (least, most) = (f64::from(tested.pressure_low.pascals()), f64::from(tested.pressure_high.pascals()));
    let values = || runs.side(true).flat_map(|r| r.pressure.iter().copied());
    let (seen_low, seen_high) =
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let (low, high) = (least.max(seen_low), most.min(seen_high));
    if !(high > low) {
        return Err(Error::new(
            DataCode::RecordingOutOfRange,
            format!(
                "the table was made for {:.0} to {:.0} kPa, the recordings have {:.0} to {:.0} kPa",
                least / 1e3,
                most / 1e3,
                seen_low / 1e3,
                seen_high / 1e3
            ),
        )
        .help("give a table or recordings of the same pressures"));
    }
    let force =
        |p: f64, x: f64, d: f64| muscle.force(Pressure::from_pascals(p), Length::from_metres(x), d).newtons();
    let mean = |p: f64, x: f64| (force(p, x, 1.0) + force(p, x, -1.0)) / 2.0;
    let grid: Vec<f64> = (0..GRID).map(|i| low + (high - low) * i as f64 / (GRID - 1) as f64).collect();
    let step = (high - low) / (GRID - 1) as f64;
    let curves = runs
        .strokes
        .iter()
        // What the fit found of a held mounting is none of a motion's.
        .map(|held| if runs.moving { *held } else { held + offset(table, *held) })
        .map(|x| Curves {
            force: grid.iter().map(|p| mean(*p, x)).collect(),
            gap: grid.iter().map(|p| (force(*p, x, 1.0) - force(*p, x, -1.0)) / 2.0).collect(),
            by_pressure: grid
                .iter()
                .map(|p| (mean(p + step, x) - mean(p - step, x)) / (2.0 * step))
                .collect(),
            by_stroke: grid
                .iter()
                .map(|p| {
                    (mean(*p, x + TABLE_SURFACE_STEP) - mean(*p, x - TABLE_SURFACE_STEP))
                        / (2.0 * TABLE_SURFACE_STEP)
                })
                .collect(),
            variance: [vec![0.0; GRID], vec![0.0; GRID]],
            own_by_stroke: Vec::new(),
        })
        .collect::<Vec<_>>();
    let largest = curves.iter().flat_map(|c| c.force.iter().copied()).fold(0.0, f64::max);
    if !(largest > 0.0) {
        return Err(Error::new(
            DataCode::TableInvalid,
            "the table gives no force at these lengths and pressures",
        )
        .help("is it the table of this actuator?"));
    }
    let mut surface = Surface { low, high, curves, usual_slope: 0.0, largest };
    surface.find_usual_slope();
    Ok(surface)
}
