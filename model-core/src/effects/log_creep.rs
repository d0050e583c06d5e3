//! Creep that continues with the logarithm of time: five fading branches, one per decade.
//!
//! ```text
//! dq_i/dt = du/dt − q_i/τ_i,  τ_i = τ_0 · (1, 10, … 10⁴)
//! F_add = (1 − s k_F) a · Σ q_i        or, of the pull,    F_add = −(1 − s k_F) a · Σ (u − q_i)
//! ```
//! After a step of the drive the force falls by `a` times the step in each decade of time. Up to `3000 τ_0` this differs from
//! `−a log10(1 + 5 t/τ_0)` by less than 0.11 `a`; then the creep ends, as every real creep must. The memory covers earlier runs: a load
//! held for an hour still shows in the next run.
//!
//! Three drives, three laws (their amplitudes may be tried singly):
//!
//! | amplitude | drive `u` | shows |
//! | --- | --- | --- |
//! | `relaxing_part_per_decade` | [`F_b`](Context::bladder) where the muscle pulls, N | stress fades in proportion to the bladder's stress |
//! | `strain_modulus_per_decade`, Pa | `c_1 = (V_B/L) ε_z − t L² ε_x/(2πN²R)`, m² | stress fades in proportion to strain, regardless of the pressure |
//! | `yielding_part_per_decade` | `F_quasi` where the muscle pulls, N | the pull itself yields: braid, ends and wall give under load, also at constant length |
//!
//! The stress of a bladder is known from the tests that gave its coefficients, in which it had settled; the force of the gas has no such
//! delay. For the drive by the pull, the memory begins at zero: the muscle hung unloaded before the first row. For the drives of the
//! bladder the memory begins settled, and stresses from before the recording fade.

use super::{
    Changed, Class, Context, Effect, Experiment, Fading, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// Branches, one per decade.
const DECADES: usize = 5;
type Spectrum = Fading<DECADES, 3>;

fn times<T: Scalar>(first: T) -> [T; DECADES] {
    [1.0, 10.0, 100.0, 1000.0, 1.0e4].map(|decade| first * T::from_f32(decade))
}

/// The pull of a muscle that pulls, N.
fn pull<T: Scalar>(context: &Context<T>) -> T {
    context.quasi.max(T::ZERO)
}

/// See the [module](self).
pub(super) struct LogCreep;

impl Effect for LogCreep {
    // memory: see Fading, five time constants, three drives
    const INFO: Info = Info {
        name: "log-creep",
        link: Link::Memory,
        parameters: &[
            Parameter::amplitude("a", "relaxing_part_per_decade", "", 2.0e-3, 0.2),
            Parameter::amplitude("E_c", "strain_modulus_per_decade", "Pa", 1.0e3, 5.0e5),
            Parameter::amplitude("a_F", "yielding_part_per_decade", "", -0.1, 0.1),
            Parameter::shape("τ_0", "first_time", "s", 0.03, 30.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[
            Spectrum::slot(0, 0),
            Spectrum::slot(0, 1),
            Spectrum::slot(0, 2),
            Spectrum::slot(0, 3),
            Spectrum::slot(0, 4),
        ],
        equation: "F = (1 − s·k_F)·[a·Σq_i(F_b) + E_c·Σq_i(c_1) − a_F·Σ(u − q_i)(F_quasi)], τ_i = τ_0·(1, 10, … 10⁴)",
        summary: "At constant length and pressure the force creeps by the same amount in each decade of time; earlier runs still act.",
        source: "S. M. Clarke, F. Elias, E. M. Terentjev, European Physical Journal E 2 (2000) 335–341, doi 10.1007/s101890050015; W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::LongHolds).changed(
        Changed::new(Class::Relaxation, Owner::Muscle, "force creeps with the logarithm of time")
            .remembering(),
    );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let times = times(parameters[3]);
        let (elastic, _) = context.loads();
        let drives = [elastic, context.unit_elastic(), pull(context)];
        if Spectrum::is_new(memory) {
            Spectrum::step(memory, T::ZERO, &times, &[drives[0], drives[1], T::ZERO]);
        }
        Spectrum::step(memory, context.dt, &times, &drives);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let (elastic, _) = context.loads();
        let pull = pull(context);
        let yielded = pull * T::from_f32(DECADES as f32) - Spectrum::value(memory, 2, pull);
        context.rubbed(
            parameters[0] * Spectrum::value(memory, 0, elastic)
                + parameters[1] * Spectrum::value(memory, 1, context.unit_elastic())
                - parameters[2] * yielded,
        )
    }
}
