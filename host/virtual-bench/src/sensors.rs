//! Instruments: what they record instead of the truth.
//!
//! `reading = stuck(quantise(clip(anti-alias(low-pass(delay(bend((1 + gain) x) + offset + drift t − creep))) + coloured + white +
//! outlier)))`

use crate::rng::Rng;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// One instrument; units are those of its quantity (Pa, m, N).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensor {
    /// Relative error of the calibration.
    pub gain: f64,
    /// Zero error.
    pub offset: f64,
    /// Zero drift per second.
    pub drift: f64,
    /// Bend of the characteristic: departure from the straight line through zero and range, at half of the range, as a part of
    /// it; and the range.
    pub bend: (f64, f64),
    /// Creep of the sensing element under load: part of the reading that comes late, and its time, s.
    pub creep: (f64, f64),
    /// Low-pass time constant, s.
    pub lag: f64,
    /// Time constant of the two equal lags of the filter before the converter, s.
    pub anti_alias: f64,
    /// Pure delay, s.
    pub delay: f64,
    /// Standard deviation of white noise.
    pub white: f64,
    /// Standard deviation of coloured noise, and its correlation time, s.
    pub coloured: (f64, f64),
    /// Probability of an outlier per sample, and its size in white standard deviations.
    pub outliers: (f64, f64),
    /// Step of the converter; 0 for none.
    pub quantum: f64,
    /// Reading at which the converter is full; 0 for none.
    pub full_scale: f64,
    /// Probability that the converter is not ready and gives its last sample again.
    pub stuck: f64,
}

/// An instrument at work.
#[derive(Debug, Clone)]
pub struct Channel {
    with: Sensor,
    rng: Rng,
    coloured: f64,
    filtered: Option<f64>,
    crept: f64,
    smooth: Option<(f64, f64)>,
    held: f64,
    line: VecDeque<(f64, f64)>,
    now: f64,
}

impl Channel {
    /// Instrument `with`, its noise drawn from `seed` and its own name.
    pub fn new(with: Sensor, seed: u64, name: &str) -> Self {
        let mut rng = Rng::stream(seed, name);
        let coloured = with.coloured.0 * rng.normal();
        Self {
            with,
            rng,
            coloured,
            filtered: None,
            crept: 0.0,
            smooth: None,
            held: 0.0,
            line: VecDeque::new(),
            now: 0.0,
        }
    }

    /// The analogue part: call at every simulation step.
    pub fn follow(&mut self, dt: f64, truth: f64) {
        self.now += dt;
        let w = &self.with;
        let mut x = (1.0 + w.gain) * truth;
        if w.bend.0 != 0.0 && w.bend.1 > 0.0 {
            let u = x / w.bend.1;
            x += 4.0 * w.bend.0 * w.bend.1 * u * (1.0 - u);
        }
        if w.creep.0 != 0.0 {
            self.crept += (x - self.crept) * (1.0 - (-dt / w.creep.1.max(1e-6)).exp());
            x -= w.creep.0 * (x - self.crept);
        }
        x += w.offset + w.drift * self.now;
        if w.delay > 0.0 {
            self.line.push_back((self.now, x));
            while self.line.len() > 1 && self.line[1].0 <= self.now - w.delay {
                self.line.pop_front();
            }
            x = self.line.front().map_or(x, |l| l.1);
        }
        let before = self.filtered.unwrap_or(x);
        x = if w.lag > 0.0 { x + (before - x) * (-dt / w.lag).exp() } else { x };
        self.filtered = Some(x);
        if w.anti_alias > 0.0 {
            let (mut one, mut two) = self.smooth.unwrap_or((x, x));
            let blend = 1.0 - (-dt / w.anti_alias).exp();
            one += (x - one) * blend;
            two += (one - two) * blend;
            self.smooth = Some((one, two));
        }
    }

    /// The converter: one sample, `dt` (s) after the last.
    pub fn sample(&mut self, dt: f64) -> f64 {
        let w = &self.with;
        if w.coloured.0 > 0.0 {
            let decay = (-dt / w.coloured.1.max(1e-9)).exp();
            self.coloured =
                self.coloured * decay + w.coloured.0 * (1.0 - decay * decay).sqrt() * self.rng.normal();
        }
        let settled = self.smooth.map(|s| s.1).or(self.filtered).unwrap_or(0.0);
        let mut y = settled + self.coloured;
        if w.white > 0.0 {
            y += w.white * self.rng.normal();
        }
        if w.outliers.0 > 0.0 && self.rng.chance(w.outliers.0) {
            y += w.white * w.outliers.1 * if self.rng.chance(0.5) { 1.0 } else { -1.0 };
        }
        if w.full_scale > 0.0 {
            y = y.clamp(-w.full_scale, w.full_scale);
        }
        let read = if w.quantum > 0.0 { (y / w.quantum).round() * w.quantum } else { y };
        if !(w.stuck > 0.0 && self.rng.chance(w.stuck)) {
            self.held = read;
        }
        self.held
    }
}

/// The three instruments of a bench.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Instruments {
    /// Pressure, Pa.
    pub pressure: Sensor,
    /// Stroke, m.
    pub stroke: Sensor,
    /// Force, N.
    pub force: Sensor,
}

impl Instruments {
    /// Good laboratory instruments for a muscle of this blocked force (N), stroke (m) and pressure (Pa): coloured and white
    /// noise of a few parts in ten thousand of the range, sixteen-bit converters, no zero error.
    pub fn laboratory(force: f64, stroke: f64, pressure: f64) -> Self {
        let sensor = |range: f64| Sensor {
            white: 2e-4 * range,
            coloured: (3e-4 * range, 2.0),
            quantum: range / 32_768.0,
            ..Sensor::default()
        };
        Self {
            pressure: sensor(pressure),
            stroke: Sensor {
                white: 5e-5 * stroke,
                coloured: (2e-5 * stroke, 2.0),
                quantum: stroke / 32_768.0,
                ..Sensor::default()
            },
            force: sensor(force),
        }
    }

    /// Perfect instruments.
    pub fn ideal() -> Self {
        Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delayed_and_lagging_channel_lags_a_ramp_by_their_sum() {
        let mut c = Channel::new(Sensor { lag: 0.02, delay: 0.05, ..Sensor::default() }, 1, "x");
        let mut t = 0.0;
        for _ in 0..2000 {
            t += 1e-3;
            c.follow(1e-3, t);
        }
        assert!((t - c.sample(1e-3) - 0.07).abs() < 2e-3);
    }

    #[test]
    fn a_bent_creeping_cell_is_right_at_its_range_in_the_end_and_wrong_before() {
        let with = Sensor { bend: (1e-3, 100.0), creep: (2e-3, 30.0), anti_alias: 0.01, ..Sensor::default() };
        let mut c = Channel::new(with, 1, "x");
        let mut at = |truth: f64, seconds: f64| {
            for _ in 0..(seconds * 100.0) as usize {
                c.follow(0.01, truth);
            }
            c.sample(0.1)
        };
        assert!((at(100.0, 1.0) - 99.8).abs() < 0.02, "creep holds two parts in a thousand back at first");
        assert!((at(100.0, 600.0) - 100.0).abs() < 1e-3);
        assert!((at(50.0, 600.0) - 50.1).abs() < 1e-3, "the bend at half of the range");
    }

    #[test]
    fn a_converter_that_is_not_ready_repeats_itself() {
        let mut c = Channel::new(Sensor { stuck: 0.3, ..Sensor::default() }, 5, "x");
        let mut repeats = 0;
        let mut last = f64::NAN;
        for i in 0..10_000 {
            c.follow(0.1, f64::from(i));
            let now = c.sample(0.1);
            repeats += i32::from(now == last);
            last = now;
        }
        assert!((2_700..3_300).contains(&repeats), "{repeats}");
    }

    #[test]
    fn coloured_noise_has_the_required_deviation_and_memory() {
        let mut c = Channel::new(Sensor { coloured: (2.0, 1.0), ..Sensor::default() }, 3, "x");
        c.follow(0.1, 0.0);
        let y: Vec<f64> = (0..40_000).map(|_| c.sample(0.1)).collect();
        let var = y.iter().map(|v| v * v).sum::<f64>() / y.len() as f64;
        let lag = y.windows(11).map(|w| w[0] * w[10]).sum::<f64>() / y.len() as f64;
        assert!((var - 4.0).abs() < 0.5 && (lag / var - (-1f64).exp()).abs() < 0.08, "{var} {lag}");
    }
}
