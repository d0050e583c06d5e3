//! The pressure regulator as a controller models it, found from steps of pressure.
//!
//! ```text
//! dp₁/dt = clamp((gain · (command + offset) − p₁) / lag, ±rate)        at the regulator
//! dp/dt  = (p₁ − p) / (line · V/V₀)                                    in the muscle
//! ```
//! Gain and offset come from where the steps settle; lag, line and rate from the shape of the steps between: those whose simulated
//! pressure lies nearest to the measured one. The muscle's volume at the stroke that it had, `V/V₀`, is that of the device's table;
//! without a table the muscle counts as at rest length. The deadband is what small squares of command show: a regulator that
//! misses them does not answer in step with them.

mod squares;

use std::cell::RefCell;

use model_core::image;
use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::messages::{Reference, Side, Telemetry};
use model_core::link::settings::{Regulator, Settings};
use model_core::units::Length;

use self::squares::Search;
use super::run::{Ending, Plan, run, run_asking};
use super::setpoint_profile::{Quantity, SetpointProfile};
use super::{Client, tables};
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// What the steps showed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Pressure for each pascal commanded.
    pub gain: f64,
    /// Added to the command, Pa.
    pub offset_pa: f64,
    /// Time constant of the regulator, s.
    pub lag_s: f64,
    /// Time in which the line fills the muscle at its rest length, s; zero where the steps show none.
    pub line_s: f64,
    /// Fastest change, Pa/s: the regulator's limit, or the steepest seen where the steps did not reach a limit.
    pub rate_pa_per_s: f64,
    /// Whether the steps reached the limit.
    pub rate_limited: bool,
    /// Half width of the band within which the regulator does not answer, Pa, where it was looked for.
    pub deadband_pa: Option<f64>,
    /// Root mean square of measured less simulated pressure, Pa.
    pub misfit_pa: f64,
}

/// Seconds at each step.
const HOLD: f64 = 0.5;
/// A line counts where the misfit with it is at most this share of that without.
const LINE_EXPLAINS: f64 = 0.97;
/// Share of a step, at its end, that counts as settled.
const SETTLED: f64 = 0.3;

/// Steps a device's pressure between two values (Pa) and identifies its regulator, except the deadband. The steps are commands of the
/// regulator itself, not those that an earlier model of it makes of a demand. The device's settings are restored also where the steps fail, but
/// not where this program is stopped or the device is disconnected: it then keeps those of the steps, a gain of one without offset, line, lead
/// and deadband, until settings are sent. [`Found::keep`] stores the result.
///
/// # Errors
/// As [`run`]; [`DeviceCode::DeviceVerify`] when the pressure does not follow.
pub fn identify(client: &mut Client, low_pa: f64, high_pa: f64) -> Result<Found> {
    with_plain_commands(client, |client| steps(client, low_pa, high_pa, &|| false))
}

/// As [`identify`], and the deadband as well.
///
/// # Errors
/// As [`identify`].
pub fn identify_whole(
    client: &mut Client,
    low_pa: f64,
    high_pa: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Found> {
    with_plain_commands(client, |client| {
        let found = steps(client, low_pa, high_pa, stop)?;
        let deadband_pa = deadband(client, 0.5 * (low_pa + high_pa), &found, stop)?;
        Ok(Found { deadband_pa, ..found })
    })
}

/// Measures while the device commands what it is requested and corrects nothing.
fn with_plain_commands(
    client: &mut Client,
    measure: impl FnOnce(&mut Client) -> Result<Found>,
) -> Result<Found> {
    let before = client.call::<GetSettings>(&())?;
    let mut plain = before;
    plain.regulator =
        Regulator { gain: 1.0, offset_pa: 0.0, line_s: 0.0, lead: 0.0, deadband_pa: 0.0, ..before.regulator };
    client.call_once::<SetSettings>(&plain)?;
    let found = measure(client);
    // A device that is disconnected keeps its settings; the first error is reported.
    let restored = client.call_once::<SetSettings>(&before);
    let found = found?;
    restored?;
    Ok(found)
}

fn steps(client: &mut Client, low_pa: f64, high_pa: f64, stop: &dyn Fn() -> bool) -> Result<Found> {
    let mut samples: Vec<(f64, f64, f64)> = Vec::new();
    let mut stroke_m = 0.0;
    let plan = Plan {
        quantity: Quantity::Pressure,
        // The device makes them: each has its exact length, even when this program is late.
        profile: SetpointProfile::Wave(Reference::Trapezoid {
            low: low_pa as f32,
            high: high_pa as f32,
            ramp_s: 0.0,
            hold_s: HOLD as f32,
        }),
        seconds: Some(4.0 * HOLD),
        every_ticks: 1,
    };
    let take = |s: &Telemetry| {
        if let Some(side) = s.sides.first() {
            samples.push((s.time_us as f64 * 1e-6, f64::from(side.command_pa), f64::from(side.pressure_pa)));
            stroke_m += (f64::from(side.stroke_m) - stroke_m) / samples.len() as f64;
        }
        Ok(())
    };
    if run(client, &plan, take, stop)? == Ending::Stopped {
        return Err(interrupted());
    }
    // The first step starts from a vented muscle.
    let start = samples.first().map_or(0.0, |s| s.0) + HOLD;
    samples.retain(|s| s.0 >= start);
    let found = from_samples(&samples).ok_or_else(|| {
        Error::new(
            DeviceCode::DeviceVerify,
            "the pressure does not follow its command, so the regulator cannot be identified",
        )
        .help("check that the air supply is open and that the pressure sensor is connected to this muscle")
    })?;
    Ok(Found { line_s: found.line_s / fill(client, stroke_m)?, ..found })
}

/// `V/V₀` of the muscle at a stroke, m, by the device's table; 1 without one.
fn fill(client: &mut Client, stroke_m: f64) -> Result<f64> {
    let table = tables::read(client, Side::Agonist)?.and_then(|bytes| image::read(&bytes).ok());
    let Some(braid) = table.and_then(|table| table.geometry.cast::<f64>().build().ok()) else {
        return Ok(1.0);
    };
    let volume = |stroke_m: f64| braid.gas_volume(&braid.posture(Length::from_metres(stroke_m)));
    Ok((volume(stroke_m) / volume(0.0)).clamp(0.1, 100.0))
}

/// Finds a regulator from samples of time (s), command (Pa) and measured pressure (Pa).
#[must_use]
pub fn from_samples(samples: &[(f64, f64, f64)]) -> Option<Found> {
    let (gain, offset) = settled(samples)?;
    // One valley each in the logarithms of the lag, between a millisecond and a second, of the line and of the rate.
    let lag_with =
        |line: f64, rate: f64| golden(1e-3, 1.0, |lag| simulate(samples, &[gain, offset, lag, line, rate]));
    let lags_with = |rate: f64| {
        let (line, with_line) = golden(3e-4, 0.1, |line| lag_with(line, rate).1);
        let (lag, without) = lag_with(0.0, rate);
        // A line is believed where it explains what the lag alone does not; the slower of both is the regulator.
        if with_line < LINE_EXPLAINS * without {
            let (lag, misfit) = lag_with(line, rate);
            (lag.max(line), lag.min(line), misfit)
        } else {
            (lag, 0.0, without)
        }
    };
    let (free_lag, free_line, free_misfit) = lags_with(f64::INFINITY);
    // Slopes over 5 ms, so that noise of the sensor does not pass for speed.
    let steepest = samples
        .windows(6)
        .map(|w| ((w[5].2 - w[0].2) / (w[5].0 - w[0].0)).abs())
        .filter(|r| r.is_finite())
        .fold(0.0, f64::max);
    if steepest <= 0.0 {
        return None;
    }
    // No limit lies above what was seen, except for the sensor's noise; above that all fits are the same.
    let (limit, limited_misfit) = golden(0.2 * steepest, 1.1 * steepest, |rate| lags_with(rate).2);
    // A limit is believed where it explains what the lag alone does not.
    let rate_limited = limited_misfit < 0.95 * free_misfit;
    let (lag, line, misfit_pa) =
        if rate_limited { lags_with(limit) } else { (free_lag, free_line, free_misfit) };
    let found = Found {
        gain,
        offset_pa: offset,
        lag_s: lag,
        line_s: line,
        rate_pa_per_s: if rate_limited { limit } else { steepest },
        rate_limited,
        deadband_pa: None,
        misfit_pa,
    };
    (found.misfit_pa.is_finite() && (0.2..5.0).contains(&gain)).then_some(found)
}

/// The least value of a function with one valley between two positive bounds, over their logarithm: place and value.
fn golden(low: f64, high: f64, value: impl Fn(f64) -> f64) -> (f64, f64) {
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (low.ln(), high.ln());
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut a, mut b) = (at(low, high, 1.0 - ratio), at(low, high, ratio));
    let (mut at_a, mut at_b) = (value(a.exp()), value(b.exp()));
    while high - low > 2e-3 {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = at(low, high, 1.0 - ratio);
            at_a = value(a.exp());
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = at(low, high, ratio);
            at_b = value(b.exp());
        }
    }
    let place = (0.5 * (low + high)).exp();
    (place, value(place))
}

/// Looks for a device's deadband around a pressure (Pa) by squares; the muscle stays pressurised throughout.
///
/// # Errors
/// As [`run`].
fn deadband(
    client: &mut Client,
    middle_pa: f64,
    found: &Found,
    stop: &dyn Fn() -> bool,
) -> Result<Option<f64>> {
    let search = RefCell::new(Search::new(middle_pa, found.gain));
    let plan = Plan {
        quantity: Quantity::Pressure,
        profile: SetpointProfile::Constant(middle_pa as f32),
        seconds: None,
        every_ticks: 4,
    };
    let take = |s: &Telemetry| {
        if let Some(side) = s.sides.first() {
            search.borrow_mut().take(f64::from(side.command_pa), f64::from(side.pressure_pa));
        }
        Ok(())
    };
    let over = || stop() || search.borrow().found().is_some();
    run_asking(client, &plan, take, over, |elapsed| search.borrow_mut().next(elapsed).map(|pa| pa as f32))?;
    search.into_inner().found().ok_or_else(interrupted)
}

fn interrupted() -> Error {
    Error::new(DataCode::CallInvalid, "interrupted; the muscle is vented and the settings are as they were")
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

/// Root mean square of measured less simulated pressure for gain, offset, lag, line and rate.
fn simulate(samples: &[(f64, f64, f64)], &[gain, offset, lag, line, rate]: &[f64; 5]) -> f64 {
    let Some(first) = samples.first() else { return f64::NAN };
    let (mut supplied, mut p, mut squares) = (first.2, first.2, 0.0);
    for pair in samples.windows(2) {
        let dt = pair[1].0 - pair[0].0;
        let before = supplied;
        supplied += ((gain * (pair[0].1 + offset) - supplied) * (1.0 - (-dt / lag).exp()))
            .clamp(-rate * dt, rate * dt);
        p = if line > 0.0 {
            p + (0.5 * (before + supplied) - p) * (1.0 - (-dt / line).exp())
        } else {
            supplied
        };
        squares += (p - pair[1].2).powi(2);
    }
    (squares / samples.len().max(1) as f64).sqrt()
}

impl Found {
    /// The settings with this regulator, its lag inverted, and no faster a demand than the regulator can follow.
    #[must_use]
    pub fn settings(&self, base: Settings) -> Settings {
        let mut settings = base;
        settings.regulator = Regulator {
            gain: self.gain as f32,
            offset_pa: self.offset_pa as f32,
            lag_s: self.lag_s as f32,
            line_s: self.line_s as f32,
            rate_pa_per_s: self.rate_pa_per_s as f32,
            deadband_pa: self.deadband_pa.map_or(base.regulator.deadband_pa, |half| half as f32),
            lead: 1.0,
            ..base.regulator
        };
        settings.limits.slew_pa_per_s = base.limits.slew_pa_per_s.min(self.rate_pa_per_s as f32);
        settings
    }

    /// Keeps it in a device's settings and has that confirmed.
    ///
    /// # Errors
    /// Refusals, silence, or [`DeviceCode::DeviceVerify`].
    pub fn keep(&self, client: &mut Client) -> Result<()> {
        let wanted = self.settings(client.call::<GetSettings>(&())?);
        if client.call_once::<SetSettings>(&wanted)? != wanted {
            return Err(Error::new(
                DeviceCode::DeviceVerify,
                "the settings read back from the device differ from those sent",
            ));
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
        assert!(!found.rate_limited);
        assert_eq!(from_samples(&samples[..300]), None);
        let dead: Vec<_> = samples.iter().map(|s| (s.0, s.1, 0.0)).collect();
        assert_eq!(from_samples(&dead), None);
    }

    #[test]
    fn a_limit_of_rate_is_distinguished_from_a_lag() {
        let (gain, lag, rate) = (1.02, 0.03, 1.5e6);
        let mut seed = 7_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            200.0 * (f64::from(seed >> 16) / 32_768.0 - 1.0)
        };
        let mut p = gain * 100e3;
        let steps: Vec<_> = (0..2400)
            .map(|i| {
                let command = if i / 600 % 2 == 0 { 100e3 } else { 250e3 };
                let seen = p;
                p +=
                    ((gain * command - p) * (1.0 - (-1e-3_f64 / lag).exp())).clamp(-rate * 1e-3, rate * 1e-3);
                (f64::from(i) * 1e-3, command, seen + noise())
            })
            .collect();
        let found = from_samples(&steps).unwrap();
        assert!(found.rate_limited && (found.rate_pa_per_s / rate - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.lag_s / lag - 1.0).abs() < 0.1 && (found.gain - gain).abs() < 2e-3, "{found:?}");
    }
}
