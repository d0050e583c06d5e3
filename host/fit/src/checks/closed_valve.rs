//! The valve between supply and muscle is closed: how fast the pressure falls.
//!
//! ```text
//! dP/dt = −r P        r: rate of the loss, 1/s
//! λ = r T             the part of the pressure that the flow r P costs on its way; T: the time in which the line fills the muscle
//! ```
//! Nothing measures `T`; the lag of the pressure in the catalogue has its range. So the check shows if a leak can matter, and if it
//! must; its size follows from the recordings.

use super::Uncertainty;
use super::table::Table;
use crate::bench::Candidate;
use model_core::effects::EffectName;
use pam_data::error::Result;
use pam_data::pluralise::pluralise;
use pam_data::recording::Quantity;

/// Readings before a valve closes whose mean is the pressure at which it closed.
const BEFORE: usize = 5;
/// Pressure from which on closing a valve shows a leak, Pa.
const PRESSED: f64 = 2e4;
/// A loss is followed down to this share of the pressure at which the valve closed: below it, flow through a small leak is slower.
const FOLLOWED: f64 = 0.5;
/// The fewest times that the valve closes.
const FEWEST: usize = 2;

/// A loss of air behind a closed valve.
#[derive(Clone, Debug, PartialEq)]
pub struct Loss {
    /// Share of the pressure that is lost each second.
    pub rate: f64,
    /// Half of its 95 % interval.
    pub half_width: f64,
}

impl Loss {
    /// Which check measured it, as text.
    pub const CHECK: &str = "a closed valve";

    /// The rate with its interval, as text with practical units.
    #[must_use]
    pub fn description(&self) -> String {
        format!(
            "behind the closed valve {:.3} ± {:.3} % of the pressure is lost per second, which costs at least {:.2} % of the pressure at \
             the muscle",
            100.0 * self.rate,
            100.0 * self.half_width,
            100.0 * self.lost_part().0
        )
    }

    /// The part of the pressure that the loss may cost between gauge and muscle, at the least and at the most.
    #[must_use]
    pub fn lost_part(&self) -> (f64, f64) {
        let (shortest, longest) = filling_time();
        ((self.rate - self.half_width).max(0.0) * shortest, (self.rate + self.half_width).max(0.0) * longest)
    }
}

/// In which time lines fill muscles, s: the range of the catalogue.
fn filling_time() -> (f64, f64) {
    let lag = Candidate::Muscle(EffectName::PressureLag).info();
    let filling = lag.parameters.iter().find(|p| p.name == "filling_time");
    filling.map_or((0.0, f64::INFINITY), |p| (p.low, p.high))
}

/// The rate of the loss, by the times that the valve was closed.
pub(super) fn measure(table: &Table) -> Result<Loss> {
    let (closed, pressure) = (table.valve_closed()?, table.need(Quantity::Pressure)?);
    let time = table.need(Quantity::Time)?;
    if !time.is_sorted() {
        return Err(table.poor("the time does not rise from row to row"));
    }
    let closings =
        (BEFORE..time.len()).filter(|i| closed[*i] > 0.0 && closed[i - BEFORE..*i].iter().all(|c| *c == 0.0));
    let rates: Vec<f64> = closings.filter_map(|i| rate(time, pressure, closed, i)).collect();
    let n = rates.len();
    if n < FEWEST {
        return Err(table.poor(format!(
            "the valve closes {} at more than {:.0} kPa: close it at least {FEWEST} times, each after {BEFORE} readings or more \
             with the valve open, and for some seconds",
            pluralise(n, "time"),
            PRESSED * 1e-3
        )));
    }
    let mean = rates.iter().sum::<f64>() / n as f64;
    let variance = rates.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let uncertain = Uncertainty::of((variance / n as f64).sqrt(), (n - 1) as f64);
    Ok(Loss { rate: mean, half_width: uncertain.half_width() })
}

/// How fast the pressure falls after the valve closes at a row, 1/s; nothing for a vented muscle or a single reading.
fn rate(time: &[f64], pressure: &[f64], closed: &[f64], first: usize) -> Option<f64> {
    let begin = pressure[first - BEFORE..first].iter().sum::<f64>() / BEFORE as f64;
    let end = closed[first..].iter().position(|c| *c == 0.0).map_or(closed.len(), |n| first + n);
    if begin < PRESSED || end - first < 2 {
        return None;
    }
    // From the pressure before the valve closes to the end, or to where a half of it is lost.
    let last = (first..end).find(|i| pressure[*i] < FOLLOWED * begin).unwrap_or(end - 1);
    let closed_at = 0.5 * (time[first - 1] + time[first]);
    let seconds = time[last] - closed_at;
    (seconds > 0.0).then(|| (begin / pressure[last].max(1e-3 * begin)).ln() / seconds)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

    use super::*;

    /// A muscle at 400 kPa whose valve is closed three times for 20 s.
    fn table(rate: f64) -> Result<Loss> {
        let mut text = String::from("time_s,pressure_kPa,valve_closed\n");
        for i in 0..900 {
            let (t, phase) = (0.1 * f64::from(i), 0.1 * f64::from(i % 300));
            let closed = phase >= 10.0;
            let noise = 0.05 * (7.3 * f64::from(i)).sin();
            let p = if closed { 400.0 * (-rate * (phase - 9.95)).exp() } else { 400.0 };
            text += &format!("{t:.2},{:.4},{}\n", p + noise, i32::from(closed));
        }
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("closed_valve.csv");
        std::fs::write(&file, text).unwrap();
        measure(&Table::read(&file)?)
    }

    #[test]
    fn the_rate_of_a_loss_is_measured_with_its_interval() {
        for rate in [0.0, 1e-4, 5e-3, 0.3, 10.0] {
            let found = table(rate).unwrap();
            assert!(
                (found.rate - rate).abs() <= found.half_width.max(1e-5 + 0.02 * rate),
                "{rate} {found:?}"
            );
        }
    }

    #[test]
    fn a_tight_muscle_loses_nothing_that_matters_and_a_leaking_one_does() {
        assert!(table(1e-4).unwrap().lost_part().1 < 1e-3);
        assert!(table(10.0).unwrap().lost_part().0 > 5e-3);
    }

    #[test]
    fn a_valve_that_never_closes_is_an_error_with_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("open.csv");
        let rows: String = (0..50).map(|i| format!("{i},400.0,0\n")).collect();
        std::fs::write(&file, format!("time_s,pressure_kPa,valve_closed\n{rows}")).unwrap();
        let error = measure(&Table::read(&file).unwrap()).unwrap_err().to_string();
        assert!(error.contains("close it at least 2 times"), "{error}");
    }
}
