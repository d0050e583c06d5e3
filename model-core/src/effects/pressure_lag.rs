//! The pressure at the muscle differs from that at the sensor while air flows between them.
//!
//! ```text
//! δP = −R_f · LP_τ(dV/dt) − T · LP_τ(dP/dt) − T_c/V_0 · [V · LP_τ(dP/dt) + (P + P_a) · LP_τ(dV/dt)]
//! F_add = g (1 − s k_F) δP        dV/dt = g(L) v        V = π R² L        P_a = 101.3 kPa
//! ```
//! A shortening muscle swells (`g = dV/dx`, m², by virtual work) and draws air through its line: the pressure inside is lower
//! than at the regulator by the flow times the line's resistance `R_f`, Pa·s/m³. When the regulator raises the pressure the muscle's follows
//! after the filling time `T`, s. Where it is the mass flow that is proportional to the pressure difference, as through a valve's small
//! opening, both are one: the gas law `d(p V)/dt = −V_0 δP/T_c` of the absolute pressure `p` with the charging time `T_c`, s, that the muscle
//! has at rest length (`V_0`). `LP_τ` is a first-order lag. First order in `δP`; a choked line is not linear.

use super::{
    Changed, Class, Context, Effect, Experiment, Fading, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// `P_a`, Pa.
const ATMOSPHERE: f32 = 101_325.0;
/// The least volume over π, m³, that is divided by.
const SMALLEST: f32 = 1.0e-12;

type Line = Fading<1, 2>;

/// See the [module](self).
pub(super) struct PressureLag;

impl Effect for PressureLag {
    // memory: see Fading, one time constant, two drives; a drive less its over-stress is its low-pass.
    const INFO: Info = Info {
        name: "pressure-lag",
        link: Link::Air,
        parameters: &[
            Parameter::amplitude("R_f", "flow_resistance", "Pa·s/m³", 1.0e6, 1.0e11),
            Parameter::amplitude("T", "filling_time", "s", 1.0e-3, 1.0).bounded(),
            Parameter::amplitude("T_c", "charging_time", "s", 1.0e-3, 1.0).bounded(),
            Parameter::shape("τ", "time_constant", "s", 5.0e-3, 2.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −g·(1 − s·k_F)·[R_f·LP_τ(g·v) + T·LP_τ(dP/dt) + T_c/V_0·(V·LP_τ(dP/dt) + (P + P_a)·LP_τ(g·v))]",
        summary: "Air needs time to flow through the line, so the pressure in the muscle lags behind the sensor.",
        source: "simplified lumped model for pneumatic tubes, doi 10.1080/13873954.2017.1280512; E. Richer and Y. Hurmuzlu, J. Dynamic Systems, Measurement and Control 122 (2000) 416–425",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds).changed(Changed::new(
        Class::RateOrPhase,
        Owner::RigOrMuscle,
        "pressure at the muscle lags",
    ));

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let drives = [context.area * context.speed, context.pressure_rate];
        Line::step(memory, context.dt, &[parameters[3]], &drives);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let (flow, rise) = (context.area * context.speed, context.pressure_rate);
        let (flow, rise) = (flow - Line::value(memory, 0, flow), rise - Line::value(memory, 1, rise));
        // π takes itself out of both volumes.
        let volume = |radius: T, length: T| radius * radius * length;
        let swollen = volume(context.radius, context.length) * rise
            + (context.pressure + T::from_f32(ATMOSPHERE)) * flow * T::from_f32(core::f32::consts::FRAC_1_PI);
        let lost = parameters[0] * flow
            + parameters[1] * rise
            + parameters[2] * swollen
                / volume(context.rest_radius, context.rest_length).at_least(T::from_f32(SMALLEST));
        -context.pull_per_pressure() * lost
    }
}
