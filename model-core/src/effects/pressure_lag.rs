//! The pressure at the muscle differs from that at the sensor while air flows between them.
//!
//! ```text
//! δP = −R_f · LP_τ(dV/dt) − T · LP_τ(dP/dt)        dV/dt = g(L) v        F_add = g (1 − s k_F) δP
//! ```
//! A shortening muscle swells (`g = dV/dx`, m², by virtual work) and draws air through its line: the pressure inside is lower
//! than at the regulator by the flow times the line's resistance `R_f`, Pa·s/m³. When the regulator raises the pressure the muscle's follows
//! after the filling time `T`, s. `LP_τ` is a first-order lag. First order in `δP`; a choked or turbulent line is not linear.

use super::{Context, Effect, Fading, Info, Link, Memory, Parameter, Start};
use crate::scalar::Scalar;

type Line = Fading<1, 2>;

/// See the [module](self).
pub(super) struct PressureLag;

impl Effect for PressureLag {
    // memory: see Fading, one time constant, two drives; a drive less its over-stress is its low-pass.
    const INFO: Info = Info {
        name: "pressure-lag",
        link: Link::Air,
        parameters: &[
            Parameter::amplitude("flow_resistance", "Pa·s/m³", 1.0e6, 1.0e11),
            Parameter::amplitude("filling_time", "s", 1.0e-3, 1.0),
            Parameter::shape("time_constant", "s", 5.0e-3, 2.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −g·(1 − s·k_F)·[R_f·LP_τ(g·v) + T·LP_τ(dP/dt)]",
        summary: "Air takes time through the line, so the muscle does not have the pressure that the sensor shows.",
        source: "simplified lumped model for pneumatic tubes, doi 10.1080/13873954.2017.1280512; E. Richer and Y. Hurmuzlu, J. Dynamic Systems, Measurement and Control 122 (2000) 416–425",
    };

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let drives = [context.area * context.speed, context.pressure_rate];
        Line::step(memory, context.dt, &[parameters[2]], &drives);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let (flow, rise) = (context.area * context.speed, context.pressure_rate);
        let (flow, rise) = (flow - Line::value(memory, 0, flow), rise - Line::value(memory, 1, rise));
        -context.pull_per_pressure() * (parameters[0] * flow + parameters[1] * rise)
    }
}
