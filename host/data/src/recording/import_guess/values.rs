//! What the values of a column say: the unit that a name does not say, and whether a unit can be right.

use super::others::Range;
use super::sample::SampleColumn;
use crate::recording::Quantity;
use crate::recording::time_of_day::DAY;
use crate::short_number::short;
use crate::statistics::extremes;
use crate::statistics::median;

/// Gauge pressures of pneumatic muscles, Pa: from the threshold of a thin bladder to the compressed air of a building.
pub(super) const PRESSURES: (f64, f64) = (100e3, 1e6);
/// Strokes of pneumatic muscles on a bench, m.
const STROKES: (f64, f64) = (1e-3, 0.5);
/// Times between rows, s: loggers record at 2 Hz to 20 kHz.
const INTERVALS: (f64, f64) = (5e-5, 0.5);
/// A muscle contracts by less than this: the fibres of every braid are at 54.7° before (the bound of the readers, too).
const CONTRACTION: f64 = 0.5;

/// The unit that the values of a quantity suggest, with the others that they allow.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Suggested {
    pub unit: &'static str,
    pub scale: f64,
    pub others: Vec<&'static str>,
}

impl Suggested {
    /// The unit with its scale, as it is spelled.
    pub(super) fn spelled(&self) -> &'static str {
        match self.scale {
            1e-3 if self.unit == "ms" => "µs",
            1e-6 if self.unit == "ms" => "ns",
            DAY => "days",
            _ => self.unit,
        }
    }
}

/// The units for which a value lies within bounds in SI: (name of the unit, further scale, factor to SI).
fn allowed(value: f64, bounds: (f64, f64), units: &[(&'static str, f64, f64)]) -> Option<Suggested> {
    let mut fits = units.iter().filter(|(_, _, si)| (bounds.0..=bounds.1).contains(&(value * si)));
    let (unit, scale, _) = *fits.next()?;
    Some(Suggested { unit, scale, others: fits.map(|(u, ..)| *u).collect() })
}

/// A unit for values whose name says none; `None` where they fit none or several quantities need none. `others`: what the same column
/// holds in other files of the bench, since the first may be that of the lowest pressure.
pub(super) fn suggested(quantity: Quantity, column: &SampleColumn, others: &[Range]) -> Option<Suggested> {
    let (low, high) = column.range();
    let widest = others.iter().map(|r| r.high - r.low).fold(high - low, f64::max);
    let high = others.iter().map(|r| r.high).fold(high, f64::max);
    match quantity {
        Quantity::Pressure | Quantity::PressureCommand => {
            let units = [
                ("kPa", 1.0, 1e3),
                ("bar", 1.0, 1e5),
                ("psi", 1.0, 6894.757),
                ("MPa", 1.0, 1e6),
                ("Pa", 1.0, 1.0),
            ];
            allowed(high, PRESSURES, &units)
        }
        Quantity::Displacement | Quantity::Length | Quantity::RestLength => {
            let size = if quantity == Quantity::Displacement { widest } else { high };
            allowed(size, STROKES, &[("mm", 1.0, 1e-3), ("m", 1.0, 1.0), ("in", 1.0, 0.0254)])
        }
        Quantity::Time => {
            let units =
                [("s", 1.0, 1.0), ("ms", 1.0, 1e-3), ("ms", 1e-3, 1e-6), ("ms", 1e-6, 1e-9), ("s", DAY, DAY)];
            allowed(interval(column)?, INTERVALS, &units)
        }
        Quantity::Force => Some(Suggested { unit: "N", scale: 1.0, others: vec!["kg", "lbf"] }),
        Quantity::Temperature => Some(Suggested { unit: "C", scale: 1.0, others: vec![] }),
        _ => Some(Suggested { unit: "", scale: 1.0, others: vec![] }),
    }
}

/// What is added to times in days, s, so that they count from 1970: a spreadsheet counts them from the end of 1899, MATLAB from year 0.
pub(super) fn epoch_of_days(column: &SampleColumn) -> f64 {
    /// Days of the years from 1982 to 2063, and what they are for 1970-01-01.
    const COUNTS: [((f64, f64), f64); 2] = [((30e3, 60e3), 25_569.0), ((724e3, 754e3), 719_529.0)];
    let (low, high) = column.range();
    let counted = COUNTS.iter().find(|((from, to), _)| low >= *from && high <= *to);
    counted.map_or(0.0, |(_, days)| -days * DAY)
}

/// Whether all numbers are the same.
pub(super) fn is_constant(column: &SampleColumn) -> bool {
    let (low, high) = column.range();
    low == high
}

/// The median step between rows.
pub(super) fn interval(column: &SampleColumn) -> Option<f64> {
    let mut steps: Vec<f64> =
        column.numbers.windows(2).map(|w| w[1] - w[0]).filter(|s| s.is_finite() && *s > 0.0).collect();
    (!steps.is_empty()).then(|| median(&mut steps))
}

/// Whether the values increase from row to row except for at most one step in twenty, as time does that begins again with each run.
pub(super) fn increases(column: &SampleColumn) -> bool {
    let steps = column.numbers.windows(2).count();
    let up = column.numbers.windows(2).filter(|w| w[1] > w[0]).count();
    column.is_numeric() && steps >= 9 && 20 * (steps - up) <= steps
}

/// Whether values count rows: whole numbers in steps of one, which do not show the time.
pub(super) fn counts_rows(column: &SampleColumn) -> bool {
    column.numbers.windows(2).all(|w| w[1] - w[0] == 1.0) && column.numbers.iter().all(|v| v.fract() == 0.0)
}

/// What is odd about the values of a quantity, given in SI units.
pub(super) fn doubt(quantity: Quantity, low: f64, high: f64) -> Option<String> {
    let peak = low.abs().max(high.abs());
    match quantity {
        Quantity::Pressure if !(10e3..=2e6).contains(&peak) => {
            Some(format!("the highest pressure would be {} kPa: is the unit right?", short(high * 1e-3)))
        }
        Quantity::Force if !(0.5..=20e3).contains(&peak) => {
            Some(format!("the largest force would be {} N: is the unit right?", short(peak)))
        }
        Quantity::Displacement if !(0.2e-3..=0.6).contains(&(high - low)) && high > low => {
            Some(format!("the stroke would be {} mm: is the unit right?", short((high - low) * 1e3)))
        }
        Quantity::Contraction if peak >= CONTRACTION => Some(format!(
            "a contraction of {} is impossible for a braided muscle: it may be relative to something else than the rest length",
            short(peak)
        )),
        _ => None,
    }
}

/// Correlation of force with displacement at equal pressure: negative where the displacement shortens the muscle.
pub(super) fn force_against(stroke: &[f64], force: &[f64], pressure: Option<&[f64]>) -> Option<f64> {
    let fx = correlation(force, stroke)?;
    let Some((fp, xp)) = pressure.and_then(|p| Some((correlation(force, p)?, correlation(stroke, p)?)))
    else {
        return Some(fx);
    };
    let partial = (fx - fp * xp) / ((1.0 - fp * fp) * (1.0 - xp * xp)).sqrt();
    partial.is_finite().then_some(partial)
}

/// Correlation of pressure with displacement where the pressure varies on purpose: positive where the displacement shortens the muscle.
pub(super) fn pressure_against(stroke: &[f64], pressure: &[f64]) -> Option<f64> {
    is_varied(pressure).then(|| correlation(pressure, stroke))?
}

/// Whether a pressure varies on purpose, by more than a regulator's droop.
pub(super) fn is_varied(pressure: &[f64]) -> bool {
    /// A regulator's droop is less than this share of the highest pressure.
    const VARIED: f64 = 0.5;
    let finite = pressure.iter().copied().filter(|p| p.is_finite());
    let (low, high) = extremes(finite);
    high - low > VARIED * low.abs().max(high.abs())
}

fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let both = || a.iter().zip(b).filter(|(x, y)| x.is_finite() && y.is_finite());
    let n = both().count() as f64;
    let mean = both().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (a, b) in both() {
        let (x, y) = (a - mean.0, b - mean.1);
        (xx, yy, xy) = (xx + x * x, yy + y * y, xy + x * y);
    }
    let r = xy / (xx * yy).sqrt();
    r.is_finite().then_some(r)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: impl IntoIterator<Item = f64>) -> SampleColumn {
        SampleColumn { numbers: values.into_iter().collect(), ..SampleColumn::default() }
    }

    #[test]
    fn values_suggest_the_unit_that_a_muscle_allows() {
        let unit = |q, high: f64| suggested(q, &column([0.0, high]), &[]).map(|s| s.unit);
        assert_eq!(unit(Quantity::Pressure, 620.0), Some("kPa"));
        assert_eq!(unit(Quantity::Pressure, 6.2), Some("bar"));
        assert_eq!(unit(Quantity::Pressure, 90.0), Some("psi"));
        assert_eq!(unit(Quantity::Pressure, 0.62), Some("MPa"));
        assert_eq!(unit(Quantity::Pressure, 620e3), Some("Pa"));
        assert_eq!(unit(Quantity::Pressure, 12.0), None);
        assert_eq!(unit(Quantity::Displacement, 35.0), Some("mm"));
        assert_eq!(unit(Quantity::Displacement, 0.035), Some("m"));
        let at = |step: f64| {
            suggested(Quantity::Time, &column((0..20).map(|i| f64::from(i) * step)), &[]).expect("a unit")
        };
        assert_eq!((at(0.01).unit, at(10.0).unit), ("s", "ms"));
        assert_eq!((at(1000.0).unit, at(1000.0).scale), ("ms", 1e-3));
        // Nanoseconds since 1970.
        let epoch = suggested(Quantity::Time, &column((0..20).map(|i| 1.7e18 + 3.3e7 * f64::from(i))), &[]);
        assert_eq!(epoch.map(|s| (s.spelled(), s.scale)), Some(("ns", 1e-6)));
        // 120 may be kPa or psi, and is reported so.
        assert_eq!(
            suggested(Quantity::Pressure, &column([0.0, 120.0]), &[]).map(|s| s.others),
            Some(vec!["psi"])
        );
    }

    #[test]
    fn force_falls_with_contraction_at_equal_pressure() {
        let n = 200;
        let pressure: Vec<f64> = (0..n).map(|i| 100.0 + f64::from(i % 7) * 80.0).collect();
        let stroke: Vec<f64> = (0..n).map(|i| f64::from(i % 11)).collect();
        let force: Vec<f64> = pressure.iter().zip(&stroke).map(|(p, x)| 0.3 * p - 4.0 * x).collect();
        let against = force_against(&stroke, &force, Some(&pressure)).expect("a correlation");
        assert!(against < -0.95, "{against}");
        let length: Vec<f64> = stroke.iter().map(|x| 50.0 - x).collect();
        assert!(force_against(&length, &force, Some(&pressure)).is_some_and(|r| r > 0.95));
        assert_eq!(force_against(&[1.0, 1.0], &[1.0, 2.0], None), None);
    }
}
