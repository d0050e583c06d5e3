//! The pressure regulator as a controller models it, found from steps of pressure.
//!
//! ```text
//! dp/dt = clamp((gain · (command + offset) − p) / lag, ±rate)
//! ```
//! Gain and offset come from where the steps settle, the lag from the shape of the steps between: the one whose simulated
//! pressure lies nearest to the measured one.

use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::messages::Telemetry;
use model_core::link::settings::{Regulator, Settings};

use super::Client;
use super::course::{Course, Quantity};
use super::run::{Plan, run};
use crate::error::{Code, Error, Result};

/// What the steps showed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Pressure for each pascal commanded.
    pub gain: f64,
    /// Added to the command, Pa.
    pub offset_pa: f64,
    /// Time constant, s.
    pub lag_s: f64,
    /// Steepest change seen, Pa/s.
    pub rate_pa_per_s: f64,
    /// Root mean square of measured less simulated pressure, Pa.
    pub misfit_pa: f64,
}

/// Seconds at each step.
const HOLD: f64 = 0.6;
/// Share of a step, at its end, that counts as settled.
const SETTLED: f64 = 0.3;

/// Steps a device's pressure between two values (Pa) and finds its regulator.
///
/// # Errors
/// As [`run`]; [`Code::DeviceVerify`] when the pressure does not follow.
pub fn identify(client: &mut Client, low_pa: f64, high_pa: f64) -> Result<Found> {
    let mut samples: Vec<(f64, f64, f64)> = Vec::new();
    let plan = Plan {
        quantity: Quantity::Pressure,
        course: Course::Steps { values: vec![low_pa as f32, high_pa as f32], hold_s: HOLD },
        seconds: Some(4.0 * HOLD),
        every_ticks: 1,
    };
    let take = |s: &Telemetry| {
        if let Some(side) = s.sides.first() {
            samples.push((s.time_us as f64 * 1e-6, f64::from(side.command_pa), f64::from(side.pressure_pa)));
        }
        Ok(())
    };
    run(client, &plan, take, || false)?;
    // The first step starts from a vented muscle.
    let start = samples.first().map_or(0.0, |s| s.0) + HOLD;
    samples.retain(|s| s.0 >= start);
    from_samples(&samples).ok_or_else(|| {
        Error::new(
            Code::DeviceVerify,
            "the pressure does not follow its command, so no regulator can be found",
        )
        .help("is the supply air open, and is the pressure sensor where the muscle is?")
    })
}

/// Finds a regulator from samples of time (s), command (Pa) and measured pressure (Pa).
#[must_use]
pub fn from_samples(samples: &[(f64, f64, f64)]) -> Option<Found> {
    let (gain, offset) = settled(samples)?;
    let misfit = |lag: f64| simulate(samples, gain, offset, lag);
    // Golden section over the logarithm of the lag: one valley between a millisecond and a second.
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (1e-3_f64.ln(), 1.0_f64.ln());
    for _ in 0..40 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if misfit(a.exp()) < misfit(b.exp()) { high = b } else { low = a }
    }
    let lag = (0.5 * (low + high)).exp();
    // Slopes over 5 ms, so that noise of the sensor does not pass for speed.
    let rate = samples
        .windows(6)
        .map(|w| ((w[5].2 - w[0].2) / (w[5].0 - w[0].0)).abs())
        .filter(|r| r.is_finite())
        .fold(0.0, f64::max);
    let found = Found { gain, offset_pa: offset, lag_s: lag, rate_pa_per_s: rate, misfit_pa: misfit(lag) };
    (found.misfit_pa.is_finite() && (0.2..5.0).contains(&gain) && rate > 0.0).then_some(found)
}

/// Gain and offset by least squares over the ends of the steps.
fn settled(samples: &[(f64, f64, f64)]) -> Option<(f64, f64)> {
    let mut ends: Vec<(f64, f64)> = Vec::new();
    let mut begin = 0;
    for i in 1..=samples.len() {
        let same = i < samples.len() && (samples[i].1 - samples[begin].1).abs() < 1e3;
        if !same {
            let count = i - begin;
            let tail = &samples[i - (count as f64 * SETTLED) as usize..i];
            if tail.len() >= 50 {
                let n = tail.len() as f64;
                ends.push((
                    tail.iter().map(|s| s.1).sum::<f64>() / n,
                    tail.iter().map(|s| s.2).sum::<f64>() / n,
                ));
            }
            begin = i;
        }
    }
    let n = ends.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| ends.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|e| e.0), mean(&|e| e.1));
    let spread = mean(&|e| (e.0 - x).powi(2));
    if !(n >= 2.0 && spread > 1e6) {
        return None;
    }
    let gain = mean(&|e| (e.0 - x) * (e.1 - y)) / spread;
    // pressure = gain · (command + offset)
    (gain > 0.0).then(|| (gain, y / gain - x))
}

fn simulate(samples: &[(f64, f64, f64)], gain: f64, offset: f64, lag: f64) -> f64 {
    let Some(first) = samples.first() else { return f64::NAN };
    let (mut p, mut squares) = (first.2, 0.0);
    for pair in samples.windows(2) {
        let dt = pair[1].0 - pair[0].0;
        p += (gain * (pair[0].1 + offset) - p) * (1.0 - (-dt / lag).exp());
        squares += (p - pair[1].2).powi(2);
    }
    (squares / samples.len().max(1) as f64).sqrt()
}

impl Found {
    /// The settings with this regulator, its lag inverted, and no faster a wish than the regulator can follow.
    #[must_use]
    pub fn settings(&self, base: Settings) -> Settings {
        let mut settings = base;
        settings.regulator = Regulator {
            gain: self.gain as f32,
            offset_pa: self.offset_pa as f32,
            lag_s: self.lag_s as f32,
            rate_pa_per_s: self.rate_pa_per_s as f32,
            lead: 1.0,
            ..base.regulator
        };
        settings.limits.slew_pa_per_s = base.limits.slew_pa_per_s.min(self.rate_pa_per_s as f32);
        settings
    }

    /// Keeps it in a device's settings and has that confirmed.
    ///
    /// # Errors
    /// Refusals, silence, or [`Code::DeviceVerify`].
    pub fn keep(&self, client: &mut Client) -> Result<()> {
        let wanted = self.settings(client.call::<GetSettings>(&())?);
        if client.call_once::<SetSettings>(&wanted)? != wanted {
            return Err(Error::new(Code::DeviceVerify, "the device keeps other settings than it was sent"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_regulator_is_found_from_its_steps() {
        let (gain, offset, lag) = (0.97, 2_000.0, 0.035);
        let mut p = gain * (200e3 + offset);
        // A sensor's noise, repeatable: the low bits of a linear congruence.
        let mut seed = 1_u32;
        let samples: Vec<_> = (0..2400)
            .map(|i| {
                let command = if i / 600 % 2 == 0 { 200e3 } else { 300e3 };
                let seen = p;
                p += (gain * (command + offset) - p) * (1.0 - (-1e-3_f64 / lag).exp());
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (f64::from(i) * 1e-3, command, seen + 300.0 * (f64::from(seed >> 16) / 32_768.0 - 1.0))
            })
            .collect();
        let found = from_samples(&samples).unwrap();
        assert!((found.gain - gain).abs() < 2e-3 && (found.offset_pa - offset).abs() < 500.0, "{found:?}");
        assert!((found.lag_s - lag).abs() < 0.001, "{found:?}");
        assert!((found.rate_pa_per_s - 97e3 / lag).abs() < 0.15 * 97e3 / lag, "{found:?}");
        assert_eq!(from_samples(&samples[..300]), None);
        let dead: Vec<_> = samples.iter().map(|s| (s.0, s.1, 0.0)).collect();
        assert_eq!(from_samples(&dead), None);
    }
}
