//! Warmth changes the bladder's stiffness and the friction.
//!
//! ```text
//! dw/dt = (power − w)/τ,   power = s F_quasi dx/dt
//! F_add = −(1 − s k_F) (a_w w + a_T θ) F_b + (b_w w + b_T θ) s k_F F_quasi
//! ```
//! `θ`, K, is the measured temperature less that of the first reading (columns of zeros where none is measured). Without a thermometer
//! the muscle is taken to warm with the mean power `w`, W, that it exchanges with its load, over the thermal time `τ`, s (5 to 30
//! minutes). `a` softens the bladder's part of the pull, `F_b` ([`Context::bladder`]), and `b` the friction, per watt or per kelvin. Entropic rubber stiffens by 0.34 %/K
//! (`a_T = −0.0034`); filled rubber near its transition softens. Recovers at rest with the same `τ`, unlike wear.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct ThermalSoftening;

impl Effect for ThermalSoftening {
    const INFO: Info = Info {
        name: "thermal-softening",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("a_w", "softening_per_watt", "1/W", -2.0, 2.0),
            Parameter::amplitude("b_w", "friction_loss_per_watt", "1/W", -2.0, 2.0),
            Parameter::amplitude("a_T", "softening_per_kelvin", "1/K", -0.02, 0.02),
            Parameter::amplitude("b_T", "friction_loss_per_kelvin", "1/K", -0.02, 0.05),
            Parameter::shape("τ", "thermal_time", "s", 100.0, 3000.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[0],
        equation: "F = −(1 − s·k_F)·(a_w·w + a_T·θ)·F_b + (b_w·w + b_T·θ)·s·k_F·F_quasi, τ·dw/dt = s·F_quasi·dx/dt − w",
        summary: "Work warms the muscle, which changes the stiffness of its rubber; at rest it cools again.",
        source: "M. Doumit and S. Pardoel, Mechanical Systems and Signal Processing 91 (2017) 93–110; L. R. G. Treloar, The Physics of Rubber Elasticity, 1975",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::RepeatsAfterRest).slow().changed(
        Changed::new(Class::Softening, Owner::Muscle, "the bladder softens as it warms").remembering(),
    );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [w, pending time, pending work, last stroke, seen, first temperature, step that the share holds for, share]
        if memory[4] == T::ZERO {
            memory[4] = T::ONE;
            memory[3] = context.stroke;
        }
        if memory[5] == T::ZERO {
            memory[5] = context.temperature;
        }
        let moved = context.stroke - memory[3];
        memory[3] = context.stroke;
        // Signed by the direction, so that a noisy stroke at rest adds nothing on average.
        memory[2] += context.direction * context.quasi * moved;
        memory[1] += context.dt.max(T::ZERO);
        let tau = parameters[4].max(T::from_f32(1.0e-2));
        // Minutes of `τ` against milliseconds of a tick: single precision needs larger steps.
        if memory[1] >= tau * T::from_f32(1.0e-3) {
            if memory[6] != memory[1] {
                memory[6] = if memory[1].is_finite() { memory[1] } else { T::ZERO };
                memory[7] = -(-(memory[1] / tau)).exp_m1();
            }
            memory[0] += (memory[2] / memory[1] - memory[0]) * memory[7];
            memory[1] = T::ZERO;
            memory[2] = T::ZERO;
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let work = memory[0];
        let warmth = if context.temperature > T::ZERO { context.temperature - memory[5] } else { T::ZERO };
        let friction = context.direction * context.friction * context.quasi;
        (parameters[1] * work + parameters[3] * warmth) * friction
            - context.rubbed((parameters[0] * work + parameters[2] * warmth) * context.bladder())
    }
}
