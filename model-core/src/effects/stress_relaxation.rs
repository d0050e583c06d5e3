//! A standard linear solid beside the bladder: part of every change of stress fades with time constant `τ`.
//!
//! ```text
//! dq/dt = dF_el/dt − q/τ        F_add = g · q
//! ```
//! `F_el` is the elastic part of the base model, N; `q` the over-stress, N; `g` the relaxing part (dimensionless). The step is
//! exact for an elastic force that runs straight between two moments:
//! `q ← q a + ΔF_el (1 − a) τ/dt`, `a = e^(−dt/τ)`.

use super::{Context, Effect, Info, Link, Memory, Parameter, remembered_decay};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct StressRelaxation;

// memory: [q, last F_el, seen, dt, decay]
impl Effect for StressRelaxation {
    const INFO: Info = Info {
        name: "stress-relaxation",
        link: Link::Memory,
        parameters: &[
            Parameter::amplitude("relaxing_part", "", 0.01, 0.5),
            Parameter::shape("time_constant", "s", 0.3, 1000.0),
        ],
        depends_on_pressure: false,
        persistent: false,
        summary: "After each change of length the bladder's stress fades towards a lower value, as rubber does.",
        source: "standard linear solid; W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
    };

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let elastic = context.elastic;
        if memory[2] == T::ZERO {
            memory[1] = elastic;
            memory[2] = T::ONE;
            return;
        }
        if context.dt > T::ZERO {
            let decay = remembered_decay(context.dt, parameters[1], memory, 3);
            memory[0] =
                memory[0] * decay + (elastic - memory[1]) * (T::ONE - decay) * parameters[1] / context.dt;
            memory[1] = elastic;
        }
    }

    fn force<T: Scalar>(parameters: &[T], _context: &Context<T>, memory: &Memory<T>) -> T {
        parameters[0] * memory[0]
    }
}
