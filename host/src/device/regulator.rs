//! The pressure regulator as a controller models it, found from steps of pressure.
//!
//! ```text
//! dp/dt = clamp((gain · (command + offset) − p) / lag, ±rate)
//! ```
//! Gain and offset come from where the steps settle, lag and rate from the shape of the steps between: those whose simulated
//! pressure lies nearest to the measured one. The deadband is what small squares of command show: a regulator that overlooks
//! them does not answer in step with them.

use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::messages::Telemetry;
use model_core::link::settings::{Regulator, Settings};

use super::Client;
use super::course::{Course, Quantity};
use super::run::{Ending, Plan, run};
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
    /// Fastest change, Pa/s: the regulator's limit, or the steepest seen where the steps did not reach a limit.
    pub rate_pa_per_s: f64,
    /// Whether the steps reached the limit.
    pub rate_limited: bool,
    /// Half width of the band within which the regulator does not answer, Pa, where it was looked for.
    pub deadband_pa: Option<f64>,
    /// Root mean square of measured less simulated pressure, Pa.
    pub misfit_pa: f64,
}

/// Squares of command by which the deadband is looked for, Pa from top to bottom; the first that is answered tells.
const SQUARES: [f64; 9] = [200.0, 400.0, 500.0, 630.0, 800.0, 1_000.0, 1_400.0, 2_000.0, 4_000.0];
/// Seconds at each level of a square, and squares of each size.
const SQUARE: (f64, usize) = (0.2, 6);

/// Seconds at each step.
const HOLD: f64 = 0.6;
/// Share of a step, at its end, that counts as settled.
const SETTLED: f64 = 0.3;

/// Steps a device's pressure between two values (Pa) and finds its regulator.
///
/// # Errors
/// As [`run`]; [`Code::DeviceVerify`] when the pressure does not follow.
pub fn identify(client: &mut Client, low_pa: f64, high_pa: f64) -> Result<Found> {
    steps(client, low_pa, high_pa, &|| false)
}

/// The same with the regulator's own commands, not those that an earlier model makes of them, and the deadband as well. The
/// device's settings are as before afterwards, whatever happens; [`Found::keep`] uses what was found.
///
/// # Errors
/// As [`identify`].
pub fn identify_whole(
    client: &mut Client,
    low_pa: f64,
    high_pa: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Found> {
    let before = client.call::<GetSettings>(&())?;
    let mut plain = before;
    plain.regulator =
        Regulator { gain: 1.0, offset_pa: 0.0, lead: 0.0, deadband_pa: 0.0, ..before.regulator };
    client.call_once::<SetSettings>(&plain)?;
    let found = steps(client, low_pa, high_pa, stop).and_then(|found| {
        let deadband_pa = deadband(client, 0.5 * (low_pa + high_pa), &found, stop)?;
        Ok(Found { deadband_pa, ..found })
    });
    // A device that is gone keeps what it has; the first error is the one to tell.
    let restored = client.call_once::<SetSettings>(&before);
    let found = found?;
    restored?;
    Ok(found)
}

fn steps(client: &mut Client, low_pa: f64, high_pa: f64, stop: &dyn Fn() -> bool) -> Result<Found> {
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
    if run(client, &plan, take, stop)? == Ending::Stopped {
        return Err(interrupted());
    }
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
    // One valley each in the logarithms of the lag, between a millisecond and a second, and of the rate.
    let lag_with = |rate: f64| golden(1e-3, 1.0, |lag| simulate(samples, &[gain, offset, lag, rate]));
    let (free_lag, free_misfit) = lag_with(f64::INFINITY);
    // Slopes over 5 ms, so that noise of the sensor does not pass for speed.
    let steepest = samples
        .windows(6)
        .map(|w| ((w[5].2 - w[0].2) / (w[5].0 - w[0].0)).abs())
        .filter(|r| r.is_finite())
        .fold(0.0, f64::max);
    if steepest <= 0.0 {
        return None;
    }
    // No limit lies above what was seen, but for the sensor's noise; above that all fits are the same.
    let (limit, limited_misfit) = golden(0.2 * steepest, 1.1 * steepest, |rate| lag_with(rate).1);
    // A limit is believed where it explains what the lag alone does not.
    let rate_limited = limited_misfit < 0.95 * free_misfit;
    let (lag, misfit_pa) = if rate_limited { lag_with(limit) } else { (free_lag, free_misfit) };
    let found = Found {
        gain,
        offset_pa: offset,
        lag_s: lag,
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

/// Looks for a device's deadband around a pressure (Pa) by squares of rising size; the muscle stays pressurised throughout.
///
/// # Errors
/// As [`run`].
fn deadband(
    client: &mut Client,
    middle_pa: f64,
    found: &Found,
    stop: &dyn Fn() -> bool,
) -> Result<Option<f64>> {
    let (level, count) = SQUARE;
    let mut values = vec![middle_pa as f32; 4];
    for size in SQUARES {
        for _ in 0..count {
            values.extend([(middle_pa + 0.5 * size) as f32, (middle_pa - 0.5 * size) as f32]);
        }
    }
    let seconds = level * values.len() as f64;
    let mut samples: Vec<(f64, f64)> = Vec::new();
    let plan = Plan {
        quantity: Quantity::Pressure,
        course: Course::Steps { values, hold_s: level },
        seconds: Some(seconds),
        every_ticks: 1,
    };
    let take = |s: &Telemetry| {
        if let Some(side) = s.sides.first() {
            samples.push((f64::from(side.command_pa), f64::from(side.pressure_pa)));
        }
        Ok(())
    };
    if run(client, &plan, take, stop)? == Ending::Stopped {
        return Err(interrupted());
    }
    Ok(deadband_from(&samples, middle_pa, found))
}

fn interrupted() -> Error {
    Error::new(Code::CallInvalid, "interrupted; the muscle is vented and the settings are as they were")
}

/// The deadband in samples of command and pressure (Pa) of squares around a command: the first size whose response is more
/// than half of what gain and lag would make of it.
///
/// Slow wander of the supply is taken out of each square by the one before and the one after.
fn deadband_from(samples: &[(f64, f64)], middle_pa: f64, found: &Found) -> Option<f64> {
    // Levels as they were commanded, each by its second half: mean pressure.
    let mut levels: Vec<(f64, f64)> = Vec::new();
    let mut begin = 0;
    for i in 1..=samples.len() {
        if i < samples.len() && (samples[i].0 - samples[begin].0).abs() < 1.0 {
            continue;
        }
        let tail = &samples[begin + (i - begin) / 2..i];
        if tail.len() >= 30 {
            let mean = tail.iter().map(|s| s.1).sum::<f64>() / tail.len() as f64;
            levels.push((samples[begin].0 - middle_pa, mean));
        }
        begin = i;
    }
    let mut below = 0.0;
    for size in SQUARES {
        let answers: Vec<f64> = levels
            .windows(3)
            .filter(|w| w.iter().all(|level| (level.0.abs() - 0.5 * size).abs() < 0.1 * size))
            .map(|w| (w[1].1 - 0.5 * (w[0].1 + w[2].1)) * w[1].0.signum())
            .collect();
        if answers.len() < 3 {
            return None;
        }
        let answer = answers.iter().sum::<f64>() / answers.len() as f64;
        if answer > 0.5 * found.gain * size {
            // Somewhere between a square that is overlooked and one that is answered: halfway, by ratio.
            let edge = if below > 0.0 { (below * size).sqrt() } else { 0.0 };
            return Some(0.5 * edge);
        }
        below = size;
    }
    None
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

/// Root mean square of measured less simulated pressure for gain, offset, lag and rate.
fn simulate(samples: &[(f64, f64, f64)], &[gain, offset, lag, rate]: &[f64; 4]) -> f64 {
    let Some(first) = samples.first() else { return f64::NAN };
    let (mut p, mut squares) = (first.2, 0.0);
    for pair in samples.windows(2) {
        let dt = pair[1].0 - pair[0].0;
        p += ((gain * (pair[0].1 + offset) - p) * (1.0 - (-dt / lag).exp())).clamp(-rate * dt, rate * dt);
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
        assert!(!found.rate_limited);
        assert_eq!(from_samples(&samples[..300]), None);
        let dead: Vec<_> = samples.iter().map(|s| (s.0, s.1, 0.0)).collect();
        assert_eq!(from_samples(&dead), None);
    }

    #[test]
    fn a_limit_of_rate_and_a_deadband_are_told_from_a_lag() {
        let (gain, lag, rate, band) = (1.02, 0.03, 1.5e6, 300.0);
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

        let (mut held, mut p) = (175e3_f64, gain * 175e3);
        let mut squares = Vec::new();
        for size in SQUARES {
            for n in 0..2 * SQUARE.1 {
                let command = 175e3 + if n % 2 == 0 { 0.5 } else { -0.5 } * size;
                for _ in 0..200 {
                    if (command - held).abs() > band {
                        held = command;
                    }
                    p += (gain * held - p) * (1.0 - (-1e-3_f64 / lag).exp());
                    squares.push((command, p + noise()));
                }
            }
        }
        // Squares of ±250 Pa are overlooked, those of ±315 Pa answered.
        let half = deadband_from(&squares, 175e3, &found).unwrap();
        assert!((250.0..315.0).contains(&half), "{half}");
        assert_eq!(deadband_from(&squares[..1000], 175e3, &found), None);
    }
}
