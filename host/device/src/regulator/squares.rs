//! The deadband of a regulator, by squares of command around a pressure: halving between sizes that are missed and sizes
//! that are answered.

/// Sizes of squares, Pa from top to bottom.
const SIZES: [f64; 9] = [200.0, 400.0, 500.0, 630.0, 800.0, 1_000.0, 1_400.0, 2_000.0, 4_000.0];
/// Seconds at each level of a square, and squares of each size.
const LEVEL: f64 = 0.2;
const COUNT: usize = 4;
/// How long a command that a limit keeps from being reached is waited for, s.
const PATIENCE: f64 = 1.0;
/// Each size begins from the middle, come to from so far below that no regulator misses it, Pa: one that holds what it last
/// answered to would take part of the square before.
const FROM: f64 = 20e3;
/// Levels of a size with the two before.
const LEVELS: usize = 2 + 2 * COUNT;

/// A search at work.
#[derive(Debug, Clone)]
pub(super) struct Search {
    middle: f64,
    gain: f64,
    /// Sizes below this are missed, from `high` on they are answered.
    low: usize,
    high: usize,
    /// How many levels of this size were requested, the last of them, Pa, and when, s.
    setpoint: usize,
    wanted: f64,
    since: f64,
    /// When the device's command came to it, s, and its last command, Pa.
    seen: Option<f64>,
    command: f64,
    /// Command and pressure, Pa, since then.
    samples: Vec<(f64, f64)>,
}

impl Search {
    /// Around a command (Pa), for a regulator of a gain.
    pub(super) fn new(middle: f64, gain: f64) -> Self {
        Self {
            middle,
            gain,
            low: 0,
            high: SIZES.len(),
            setpoint: 0,
            wanted: middle,
            since: 0.0,
            seen: None,
            command: middle,
            samples: Vec::new(),
        }
    }

    /// The half width of the deadband, Pa, once it is known; `Some(None)` where not even the largest square was answered.
    pub(super) fn found(&self) -> Option<Option<f64>> {
        (self.low == self.high).then(|| match self.high {
            0 => Some(0.0),
            // Between a square that is missed and one that is answered: halfway, by ratio.
            high => SIZES.get(high).map(|size| 0.5 * (SIZES[high - 1] * size).sqrt()),
        })
    }

    /// Takes a sample of command and pressure, Pa.
    pub(super) fn take(&mut self, command: f64, pressure: f64) {
        self.command = command;
        self.samples.push((command, pressure));
    }

    /// The command that is demanded from a time (s) on, when it changes, Pa. A level lasts from when the device is seen to command it: samples
    /// that come late and together do not shorten it.
    pub(super) fn next(&mut self, time: f64) -> Option<f64> {
        if self.found().is_some() {
            return None;
        }
        if self.setpoint > 0 {
            let there = (self.command - self.wanted).abs() < 1.0 || time - self.since > PATIENCE;
            self.seen = self.seen.or(there.then_some(time));
            if self.seen.is_none_or(|seen| time - seen < LEVEL) {
                return None;
            }
        }
        if self.setpoint == LEVELS {
            let middle = (self.low + self.high) / 2;
            if self.answer(SIZES[middle]) > 0.5 * self.gain * SIZES[middle] {
                self.high = middle;
            } else {
                self.low = middle + 1;
            }
            self.setpoint = 0;
            self.samples.clear();
            if self.found().is_some() {
                return None;
            }
        }
        let size = SIZES[(self.low + self.high) / 2];
        self.wanted = match self.setpoint {
            0 => self.middle - FROM,
            1 => self.middle,
            n if n % 2 == 0 => self.middle + 0.5 * size,
            _ => self.middle - 0.5 * size,
        };
        self.setpoint += 1;
        (self.since, self.seen) = (time, None);
        Some(self.wanted)
    }

    /// How far the pressure goes with squares of a size, Pa from top to bottom. Slow drift of the supply is taken out of each
    /// level by the one before and the one after.
    fn answer(&self, size: f64) -> f64 {
        // Levels as they were commanded, each by its second half: mean pressure.
        let mut levels: Vec<(f64, f64)> = Vec::new();
        for level in self.samples.chunk_by(|a, b| (a.0 - b.0).abs() < 1.0) {
            let tail = &level[level.len() / 2..];
            let mean = tail.iter().map(|s| s.1).sum::<f64>() / tail.len() as f64;
            levels.push((level[0].0 - self.middle, mean));
        }
        let answers: Vec<f64> = levels
            .windows(3)
            .filter(|w| w.iter().all(|level| (level.0.abs() - 0.5 * size).abs() < 0.1 * size))
            .map(|w| (w[1].1 - 0.5 * (w[0].1 + w[2].1)) * w[1].0.signum())
            .collect();
        answers.iter().sum::<f64>() / answers.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regulator of a deadband, its noise and its ripple, until the search has found something; `late` ticks come together, and what
    /// is queried on them is commanded after them.
    fn searched(band: f64, late: usize) -> (Option<f64>, f64) {
        let (gain, lag) = (1.02, 0.03);
        let mut seed = 7_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            200.0 * (f64::from(seed >> 16) / 32_768.0 - 1.0)
        };
        let mut search = Search::new(175e3, gain);
        let (mut command, mut held, mut p, mut time) = (175e3_f64, 175e3, gain * 175e3, 0.0);
        let mut next_command = command;
        while search.found().is_none() && time < 120.0 {
            let bunch: Vec<(f64, f64, f64)> = (0..late)
                .map(|_| {
                    if (command - held).abs() > band {
                        held = command;
                    }
                    let ripple = 250.0 * (23.0_f64 * time).sin();
                    p += (gain * held + ripple - p) * (1.0 - (-1e-3_f64 / lag).exp());
                    time += 1e-3;
                    (time, command, p + noise())
                })
                .collect();
            for (time, command, p) in bunch {
                search.take(command, p);
                next_command = search.next(time).unwrap_or(next_command);
            }
            command = next_command;
        }
        (search.found().expect("within a minute"), time)
    }

    #[test]
    fn a_deadband_is_found_between_two_sizes_within_ten_seconds() {
        for (band, low, high) in [(300.0, 250.0, 315.0), (450.0, 400.0, 500.0), (900.0, 700.0, 1_000.0)] {
            let (half, seconds) = searched(band, 1);
            let half = half.expect("one was answered");
            assert!((low..=high).contains(&half), "{half} Pa for {band} Pa");
            assert!(seconds < 10.0, "{seconds} s");
        }
        assert_eq!(searched(0.0, 1).0, Some(0.0));
        assert_eq!(searched(5e3, 1).0, None);
    }

    #[test]
    fn samples_that_come_late_and_together_show_the_same() {
        for late in [150, 450, 1_700] {
            let half = searched(450.0, late).0.expect("one was answered");
            assert!((400.0..=500.0).contains(&half), "{half} Pa with {late} samples at once");
        }
    }
}
