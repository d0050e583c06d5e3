//! The pressure sensor is late: the true pressure is ahead by `τ dP/dt`, so
//! `F_add = g (1 − s k_F) · τ · dP/dt`.
//!
//! `τ`, s. First order: for ramps slower than the sensor. Invisible while the pressure is constant. The muscle's own lag behind the
//! regulator (`pressure-lag`) has the opposite sign.

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner, Parameter,
    Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct PressureSensorLag;

impl Effect for PressureSensorLag {
    const INFO: Info = Info {
        name: "pressure-sensor-lag",
        link: Link::Air,
        parameters: &[Parameter::amplitude("τ", "delay", "s", 1.0e-3, 0.1).bounded()],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = g·(1 − s·k_F)·τ·dP/dt",
        summary: "The pressure sensor responds late.",
        source: "first-order sensor; time constants of 1 to 50 ms are usual",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::PressureRamps).made_from_base().changed(
        Changed::new(Class::PressureSensorLag, Owner::Sensor, "P reads late by a first-order lag τ")
            .sized("time_constant", "s")
            .adds(ForceShape::LatePressure)
            .correctable()
            .inspect(Inspect::PressureLine),
    );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0] * context.pull_per_pressure() * context.pressure_rate
    }
}
