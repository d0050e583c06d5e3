//! The tracking error of a run: measurement minus setpoint.

use model_core::link::messages::Telemetry;
use model_core::link::settings::Joint;
use pam_device::setpoint_profile::Quantity;

/// In its first second a vented muscle fills, at any setpoint, µs.
const FILLING: u64 = 1_000_000;

/// Errors squared and summed.
#[derive(Debug, Default)]
pub(super) struct Squares {
    pub samples: u64,
    sum: f64,
}

impl Squares {
    fn add(&mut self, error: f64) {
        self.samples += 1;
        self.sum += error * error;
    }

    pub(super) fn rms(&self, quantity: Quantity) -> Option<f64> {
        (self.samples > 0).then(|| (self.sum / self.samples as f64).sqrt() / quantity.scale())
    }
}

/// Deviation of the measurement from the setpoint: over all the time, and after the muscle had filled.
#[derive(Debug)]
pub(super) struct TrackingError {
    joint: Joint,
    begun: Option<u64>,
    pub all: Squares,
    pub settled: Squares,
}

impl TrackingError {
    pub(super) fn new(joint: Joint) -> Self {
        Self { joint, begun: None, all: Squares::default(), settled: Squares::default() }
    }

    pub(super) fn add(&mut self, quantity: Quantity, sample: &Telemetry) {
        let Some(side) = sample.sides.first() else { return };
        let measured = match quantity {
            Quantity::Force => side.force_n,
            Quantity::Pressure => side.pressure_pa,
            Quantity::Stroke => side.stroke_m,
            Quantity::Angle { .. } => match sample.sides.get(1) {
                Some(other) => (side.stroke_m - other.stroke_m) / (2.0 * self.joint.radius_m),
                None => return,
            },
        };
        let error = f64::from(measured - sample.setpoint);
        if error.is_finite() {
            let begun = *self.begun.get_or_insert(sample.time_us);
            self.all.add(error);
            if sample.time_us.saturating_sub(begun) >= FILLING {
                self.settled.add(error);
            }
        }
    }

    pub(super) fn to_text(&self, quantity: Quantity) -> String {
        let unit = quantity.unit();
        match (self.all.rms(quantity), self.settled.rms(quantity)) {
            (Some(all), Some(settled)) => {
                format!(
                    ", tracking error {settled:.3} {unit} rms after the first second, {all:.3} {unit} with it"
                )
            }
            (Some(all), None) => format!(", tracking error {all:.3} {unit} rms"),
            (None, _) => String::new(),
        }
    }
}
