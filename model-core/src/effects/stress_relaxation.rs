//! A standard linear solid beside the muscle: part of every change of stress fades with time constant `τ`.
//!
//! ```text
//! dq/dt = du/dt − q/τ        F_add = (1 − s k_F) a · q
//! ```
//! Three drives, three laws (their amplitudes may be tried singly):
//!
//! | amplitude | drive `u` | shows |
//! | --- | --- | --- |
//! | `relaxing_part` | [`F_b`](Context::bladder) where the muscle pulls, N | stress fades in proportion to the bladder's stress |
//! | `strain_modulus`, Pa | `c_1 = (V_B/L) ε_z − t L² ε_x/(2πN²R)`, m² | stress fades in proportion to strain, regardless of the pressure |
//! | `settling_part` | `−F_G(P′, L)` where the muscle pulls, N | the pull follows the pressure late: braid and wall settle under load, also at constant length |
//!
//! `q` is the over-stress of a drive. For a spectrum over decades see `log-creep`. The memory begins settled: at rest for long in the
//! state of the first reading; an over-stress left from before fades as `e^(−t/τ)`.

use super::{
    Changed, Class, Context, Effect, Experiment, Fading, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

type Solid = Fading<1, 3>;

/// See the [module](self).
pub(super) struct StressRelaxation;

impl Effect for StressRelaxation {
    // memory: see Fading, one time constant, three drives
    const INFO: Info = Info {
        name: "stress-relaxation",
        link: Link::Memory,
        parameters: &[
            Parameter::amplitude("a", "relaxing_part", "", 0.01, 0.6),
            Parameter::amplitude("E_v", "strain_modulus", "Pa", 1.0e4, 3.0e6),
            Parameter::amplitude("g_P", "settling_part", "", -0.3, 0.3),
            Parameter::shape("τ", "time_constant", "s", 0.3, 1000.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[Solid::slot(0, 0)],
        equation: "F = (1 − s·k_F)·[a·q(F_b) + E_v·q(c_1) − g_P·q(F_G)], dq/dt = du/dt − q/τ",
        summary: "After each change of length or pressure the force decays towards its final value, as in all rubber.",
        source: "W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::LongHolds).changed(
        Changed::new(Class::Relaxation, Owner::Muscle, "part of the bladder's stress relaxes").remembering(),
    );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let (elastic, gaylord) = context.loads();
        let drives = [elastic, context.unit_elastic(), gaylord];
        Solid::step(memory, context.dt, &[parameters[3]], &drives);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let (elastic, gaylord) = context.loads();
        context.rubbed(
            parameters[0] * Solid::value(memory, 0, elastic)
                + parameters[1] * Solid::value(memory, 1, context.unit_elastic())
                - parameters[2] * Solid::value(memory, 2, gaylord),
        )
    }
}
