//! Calibration of a sensor: from known values and the signals at them to the scale in the settings.
//!
//! ```
//! use pam_device::calibration::{Pair, scale_through};
//! use model_core::link::settings::SensorScale;
//!
//! // A load cell amplifier: 1.65 V without a load, 1.5 mV for a newton.
//! let pairs = [(0.0, 1.65), (50.0, 1.725), (100.0, 1.80)].map(|(value, signal)| Pair { value, signal });
//! let found = scale_through(&pairs, &SensorScale::SAME)?;
//! assert!((found.scale.per_unit - 666.7).abs() < 0.1);
//! assert!((found.scale.at_zero + 1100.0).abs() < 0.1);
//! # Ok::<(), pam_data::error::Error>(())
//! ```

use model_core::link::messages::MeanSignals;
use model_core::link::settings::{Scales, SensorScale, Settings};

use pam_data::error::{DataCode, Error, Result};

/// A sensor with a scale in the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Pressure at the muscle.
    Pressure,
    /// Stroke sensor.
    Stroke,
    /// Load cell.
    Force,
    /// Second pressure sensor at the muscle.
    SecondPressure,
    /// Pressure of the supply air.
    Supply,
}

impl Sensor {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Pressure, Self::Stroke, Self::Force, Self::SecondPressure, Self::Supply];

    /// Name for commands and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Stroke => "stroke",
            Self::Force => "force",
            Self::SecondPressure => "second-pressure",
            Self::Supply => "supply",
        }
    }

    /// Unit of its values in commands, and how many SI units it is.
    #[must_use]
    pub const fn unit(self) -> (&'static str, f64) {
        match self {
            Self::Pressure | Self::SecondPressure | Self::Supply => ("kPa", 1e3),
            Self::Stroke => ("mm", 1e-3),
            Self::Force => ("N", 1.0),
        }
    }

    /// Its scale.
    #[must_use]
    pub const fn scale(self, scales: &Scales) -> SensorScale {
        match self {
            Self::Pressure => scales.pressure,
            Self::Stroke => scales.stroke,
            Self::Force => scales.force,
            Self::SecondPressure => scales.second_pressure,
            Self::Supply => scales.supply,
        }
    }

    /// Its scale, to be changed.
    pub const fn scale_mut(self, settings: &mut Settings) -> &mut SensorScale {
        let scales = &mut settings.scales;
        match self {
            Self::Pressure => &mut scales.pressure,
            Self::Stroke => &mut scales.stroke,
            Self::Force => &mut scales.force,
            Self::SecondPressure => &mut scales.second_pressure,
            Self::Supply => &mut scales.supply,
        }
    }

    /// Its mean signal, if the board measures it.
    #[must_use]
    pub fn signal(self, means: &MeanSignals) -> Option<f32> {
        (means.ticks > 0).then_some(match self {
            Self::Pressure => Some(means.mean.pressure),
            Self::Stroke => Some(means.mean.stroke),
            Self::Force => Some(means.mean.force),
            Self::SecondPressure => means.mean.second_pressure,
            Self::Supply => means.supply,
        })?
    }
}

/// A known value, in SI units, and the signal at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Known value.
    pub value: f64,
    /// Mean signal of the sensor at this value, in the board's unit: volts on a board with converters.
    pub signal: f64,
}

/// A scale and how well it passes through its pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The scale; its filter is that of before.
    pub scale: SensorScale,
    /// Value of the scale less known value, for each pair, SI units.
    pub errors: Vec<f64>,
}

/// Least part of the largest signal by which signals of different values must differ, so that a slope means something: ten times the
/// resolution of a converter of 12 bits.
const LEAST_SPREAD: f64 = 2.5e-3;

/// The straight line through pairs by least squares. One pair moves the scale's zero and keeps its slope.
///
/// # Errors
/// No pair, a pair that is not finite, or several pairs at nearly the same signal or value.
pub fn scale_through(pairs: &[Pair], before: &SensorScale) -> Result<Calibration> {
    let invalid = |cause: &str, help: &str| Err(Error::new(DataCode::CallInvalid, cause).help(help));
    if pairs.is_empty() || pairs.iter().any(|pair| !(pair.value.is_finite() && pair.signal.is_finite())) {
        return invalid("the calibration has no pair of a known value and a signal", "give finite numbers");
    }
    let count = pairs.len() as f64;
    let mean = |of: fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    let (signal, value) = (mean(|pair| pair.signal), mean(|pair| pair.value));
    let per_unit = if pairs.len() == 1 {
        f64::from(before.per_unit)
    } else {
        let spread = pairs.iter().map(|pair| (pair.signal - signal).abs()).fold(0.0, f64::max);
        let largest = pairs.iter().map(|pair| pair.signal.abs()).fold(f64::MIN_POSITIVE, f64::max);
        let square: f64 = pairs.iter().map(|pair| (pair.signal - signal).powi(2)).sum();
        let product: f64 = pairs.iter().map(|pair| (pair.signal - signal) * (pair.value - value)).sum();
        if !(spread >= LEAST_SPREAD * largest) || product == 0.0 {
            return invalid(
                "the signals of the known values hardly differ",
                "choose values that cover most of the sensor's range, and check that its signal follows",
            );
        }
        product / square
    };
    let at_zero = value - per_unit * signal;
    let scale = SensorScale { at_zero: at_zero as f32, per_unit: per_unit as f32, ..*before };
    let errors = pairs.iter().map(|pair| at_zero + per_unit * pair.signal - pair.value).collect();
    Ok(Calibration { scale, errors })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(pairs: &[(f64, f64)]) -> Vec<Pair> {
        pairs.iter().map(|&(value, signal)| Pair { value, signal }).collect()
    }

    #[test]
    fn one_pair_moves_the_zero_and_several_give_the_line_with_its_errors() {
        let before = SensorScale { at_zero: -125e3, per_unit: 375e3, filter_s: 0.002 };
        let zeroed = scale_through(&pairs(&[(0.0, 0.34)]), &before).unwrap();
        assert_eq!((zeroed.scale.per_unit, zeroed.scale.filter_s), (375e3, 0.002));
        assert!((zeroed.scale.at_zero + 127.5e3).abs() < 0.1);
        let line =
            scale_through(&pairs(&[(0.0, 3.0), (10.0, 2.0), (20.0, 1.0), (30.0, 0.1)]), &before).unwrap();
        assert!((line.scale.per_unit + 10.30).abs() < 0.01, "{}: the sensor falls", line.scale.per_unit);
        let sum: f64 = line.errors.iter().sum();
        assert!(sum.abs() < 1e-9 && line.errors.iter().any(|error| error.abs() > 0.2));
    }

    #[test]
    fn pairs_that_give_no_line_are_refused() {
        for wrong in [
            &[][..],
            &[(f64::NAN, 1.0)],
            &[(0.0, 1.0), (50.0, 1.0)],
            &[(0.0, 1.65), (100.0, 1.6501)],
            &[(10.0, 1.0), (10.0, 2.0)],
        ] {
            assert!(scale_through(&pairs(wrong), &SensorScale::SAME).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn each_sensor_has_a_scale_of_its_own_and_a_signal_only_where_one_is_measured() {
        let mut settings = Settings::default();
        for (at, sensor) in Sensor::ALL.into_iter().enumerate() {
            sensor.scale_mut(&mut settings).at_zero = at as f32 + 1.0;
        }
        for (at, sensor) in Sensor::ALL.into_iter().enumerate() {
            assert_eq!(sensor.scale(&settings.scales).at_zero, at as f32 + 1.0);
        }
        let mut means = MeanSignals::default();
        assert_eq!(Sensor::Force.signal(&means), None, "nothing was measured");
        means.ticks = 1;
        assert_eq!((Sensor::Force.signal(&means), Sensor::Supply.signal(&means)), (Some(0.0), None));
    }
}
