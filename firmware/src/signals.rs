//! From a board's signals to readings: scale, filter, and the means that a calibration uses.

use model_core::link::messages::{MeanSignals, Signals};
use model_core::link::settings::{Scales, SensorScale};

use crate::board::Readings;
use crate::tick::TICK_S;

/// Ticks of a mean: then it is complete. 1 s reduces white noise to 1/30, and a sum of so few values of 24 bits keeps 16 of them.
const COMPLETE: u16 = 1_000;

/// The readings of a muscle's signals, before any filter.
#[inline]
pub fn readings(signals: &Signals, scales: &Scales) -> Readings {
    Readings {
        pressure_pa: scales.pressure.reading(signals.pressure),
        stroke_m: scales.stroke.reading(signals.stroke),
        force_n: scales.force.reading(signals.force),
    }
}

/// A first-order low-pass filter: `y += (x − y) · Δt / (T + Δt)`. It begins at its first reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Filter(Option<f32>);

impl Filter {
    /// The next value. A reading that is not a number passes through and is forgotten.
    fn next(&mut self, reading: f32, scale: &SensorScale) -> f32 {
        if !(scale.filter_s > 0.0) || !reading.is_finite() {
            self.0 = None;
            return reading;
        }
        let before = self.0.unwrap_or(reading);
        let now = before + (reading - before) * (TICK_S / (scale.filter_s + TICK_S));
        self.0 = Some(now);
        now
    }
}

/// The filters of one muscle's sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Filters {
    /// Whether any of them filters.
    filters: bool,
    pressure: Filter,
    stroke: Filter,
    force: Filter,
}

impl Filters {
    /// At the first reading, with these scales.
    pub fn new(scales: &Scales) -> Self {
        let filters = [scales.pressure, scales.stroke, scales.force].iter().any(|scale| scale.filter_s > 0.0);
        Self { filters, ..Self::default() }
    }

    /// The readings that the control laws use.
    #[inline]
    pub fn next(&mut self, now: &Readings, scales: &Scales) -> Readings {
        if !self.filters {
            return *now;
        }
        self.filtered(now, scales)
    }

    #[inline(never)]
    fn filtered(&mut self, now: &Readings, scales: &Scales) -> Readings {
        Readings {
            pressure_pa: self.pressure.next(now.pressure_pa, &scales.pressure),
            stroke_m: self.stroke.next(now.stroke_m, &scales.stroke),
            force_n: self.force.next(now.force_n, &scales.force),
        }
    }
}

/// Time constant of a speed, s: that of the tracker of the filtered motion.
const SPEED_S: f32 = 0.02;

/// Speed of a stroke before its filter, for the watch: `v += (Δx/Δt − v) · Δt / (T + Δt)`. A filter would hide how fast a load that has come
/// off moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Speed {
    last_m: Option<f32>,
    speed_m_per_s: f32,
}

impl Speed {
    /// The next reading; it is a number.
    pub fn next(&mut self, stroke_m: f32) {
        let last_m = self.last_m.replace(stroke_m).unwrap_or(stroke_m);
        let now = (stroke_m - last_m) * (1.0 / TICK_S);
        self.speed_m_per_s += (now - self.speed_m_per_s) * (TICK_S / (SPEED_S + TICK_S));
    }

    /// The speed, m/s.
    pub fn speed(&self) -> f32 {
        self.speed_m_per_s
    }
}

/// Sums of a muscle's signals over the first second after they were last taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// Whether someone reads them: without a reader, a tick costs nothing.
    read: bool,
    ticks: u16,
    sums: [f32; 5],
    second_pressure: bool,
    supply: bool,
}

impl Sums {
    /// Adds one tick, until the mean is complete.
    #[inline]
    pub fn add(&mut self, now: &Signals, supply: Option<f32>) {
        if self.read {
            self.add_read(now, supply);
        }
    }

    #[inline(never)]
    fn add_read(&mut self, now: &Signals, supply: Option<f32>) {
        self.ticks += 1;
        self.read = self.ticks < COMPLETE;
        self.second_pressure = now.second_pressure.is_some();
        self.supply = supply.is_some();
        let second = now.second_pressure.unwrap_or(0.0);
        let values = [now.pressure, now.stroke, now.force, second, supply.unwrap_or(0.0)];
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += value;
        }
    }

    /// Gives the means and restarts.
    pub fn take(&mut self, answer: &mut MeanSignals) {
        let Self { ticks, sums, second_pressure, supply, .. } =
            core::mem::replace(self, Self { read: true, ..Self::default() });
        let [pressure, stroke, force, second, air] = sums.map(|sum| sum / f32::from(ticks.max(1)));
        answer.ticks = ticks;
        answer.mean = Signals { pressure, stroke, force, second_pressure: second_pressure.then_some(second) };
        answer.supply = supply.then_some(air);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::settings::Settings;

    #[test]
    fn a_filter_begins_at_its_first_reading_and_follows_with_its_time_constant() {
        let mut filter = Filter::default();
        let scale = SensorScale { filter_s: 0.02, ..SensorScale::SAME };
        assert_eq!(filter.next(5.0, &scale), 5.0);
        let after = (0..20).map(|_| filter.next(6.0, &scale)).last().expect("a value");
        // 1 − 1/e, and the error of a step of a twentieth of the time constant.
        assert!((after - 5.0 - 0.632).abs() < 0.01, "{after}");
        assert!(filter.next(f32::NAN, &scale).is_nan(), "a failed sensor is not hidden");
        assert_eq!(filter.next(7.0, &scale), 7.0, "and leaves nothing behind");
        assert_eq!(filter.next(9.0, &SensorScale::SAME), 9.0, "without a filter");
    }

    #[test]
    fn means_are_those_of_the_first_second_after_they_were_read() {
        let mut sums = Sums::default();
        let mut answer = MeanSignals::default();
        sums.take(&mut answer);
        assert_eq!(answer.ticks, 0, "no one has read them before");
        for tick in 0..3_000_u16 {
            let force = if tick < 1_000 { 1.6 + 1e-3 * f32::from(tick % 2) } else { 99.0 };
            let now = Signals { pressure: 0.3, stroke: 1.0, force, second_pressure: Some(0.31) };
            sums.add(&now, None);
        }
        sums.take(&mut answer);
        assert_eq!((answer.ticks, answer.supply), (1_000, None));
        assert!((answer.mean.force - 1.6005).abs() < 2e-5, "{}", answer.mean.force);
        assert!(answer.mean.second_pressure.is_some_and(|mean| (mean - 0.31).abs() < 1e-5));
        sums.take(&mut answer);
        assert_eq!((answer.ticks, answer.mean.force), (0, 0.0), "nothing since");
    }

    #[test]
    fn a_scale_may_fall_and_has_its_value_at_zero() {
        let mut scales = Settings::DEFAULT.scales;
        scales.stroke = SensorScale { at_zero: 0.05, per_unit: -0.01, filter_s: 0.0 };
        let now = readings(&Signals { stroke: 2.0, ..Signals::default() }, &scales);
        assert!((now.stroke_m - 0.03).abs() < 1e-7);
    }
}
