//! The pressure that the bladder takes from the gas relaxes over decades of time, and outlives the recording.
//!
//! ```text
//! F_add = (1 − s k_F) [ (c/5) Σ r_i(F_w) − (b/5) Σ r_i(g e) − d g e ]        e = 1 − e^(−P/P_c)
//! dr_i/dt = (u − r_i)/τ_i        τ_i = 1, 10, 100, 10³, 10⁴ s        F_w = −F_b, between 0 and P g
//! ```
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | `F_w` | what the wall takes from the pull of the gas ([`Context::bladder`]); no more than there is | N |
//! | `c` | share of it that relaxes over the whole spectrum, a fifth in each decade | – |
//! | `e` | contact of bladder and braid, which builds up with pressure | – |
//! | `d` | pressure that contact takes immediately; the base model's deadband is the part that no pressure gives back | Pa |
//! | `b` | pressure that contact takes in addition with time | Pa |
//! | `P_c` | pressure over which contact builds up | Pa |
//!
//! One memory with two signs: where the wall resists much (shortened) the pull grows with the logarithm of time, at full length it
//! falls. The sign changes where the wall takes `b/c`. Nothing recovers faster than it came: a vented muscle forgets over the same
//! decades. The memory begins unloaded: before its first reading, and when it is remounted, a muscle hung vented for long.
//!
//! The law was found on isometric recordings; under motion it is a prediction. `log-creep` differs: its three laws are alternatives
//! with one free time, of which none changes its sign with length.

use super::{Context, Effect, Experiment, Fading, Info, Link, Memory, Parameter, Start, Traits, decay};
use crate::scalar::Scalar;

/// Branches, one per decade.
const DECADES: usize = 5;
/// Their time constants, s. Without a free time the law stays linear; a spectrum over five decades hardly depends on where it begins.
const TIMES: [f32; DECADES] = [1.0, 10.0, 100.0, 1.0e3, 1.0e4];
type Spectrum = Fading<DECADES, 2>;

/// `g e`, m²: the area times the contact at a pressure.
fn contact<T: Scalar>(parameters: &[T], context: &Context<T>) -> T {
    let width = parameters[3].at_least(T::from_f32(1.0));
    context.area * (T::ONE - decay(context.pressure.max(T::ZERO) / width))
}

/// The drives: `F_w`, N, and `g e`, m².
fn drives<T: Scalar>(parameters: &[T], context: &Context<T>) -> [T; 2] {
    let (wall, _) = context.loads();
    [-wall, contact(parameters, context)]
}

/// `Σ r_i` of a drive: the drive less its over-stress, over all branches.
fn relaxed<T: Scalar>(memory: &Memory<T>, drive: usize) -> T {
    // At a drive of zero the sum of the over-stresses is Σ (q_i − u) of the last drive u.
    T::ZERO - Spectrum::value(memory, drive, T::ZERO)
}

/// See the [module](self).
pub(super) struct BladderCreep;

impl Effect for BladderCreep {
    // memory: see Fading, five time constants, two drives
    const INFO: Info = Info {
        name: "bladder-creep",
        link: Link::Memory,
        parameters: &[
            Parameter::amplitude("c", "relaxed_share", "", 0.02, 1.0),
            Parameter::amplitude("b", "creeping_contact", "Pa", 1.0e3, 2.0e5),
            Parameter::amplitude("d", "contact", "Pa", 1.0e3, 2.0e5),
            Parameter::shape("P_c", "contact_pressure", "Pa", 2.0e4, 4.0e5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = (1 − s·k_F)·[(c/5)·Σr_i(F_w) − (b/5)·Σr_i(g·e) − d·g·e], e = 1 − exp(−P/P_c), τ_i = 1, 10, … 10⁴ s",
        summary: "The bladder takes a part of the pressure, and gives it back or takes more over decades of time; the next recordings remember it.",
        source: "linear viscoelasticity with a flat spectrum over decades: W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976; S. M. Clarke, F. Elias, E. M. Terentjev, European Physical Journal E 2 (2000) 335–341, doi 10.1007/s101890050015",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::LongHolds).between_recordings();

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let times = TIMES.map(T::from_f32);
        if Spectrum::is_new(memory) {
            Spectrum::step(memory, T::ZERO, &times, &[T::ZERO, T::ZERO]);
        }
        Spectrum::step(memory, context.dt, &times, &drives(parameters, context));
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let share = T::from_f32(1.0 / DECADES as f32);
        context.rubbed(
            share * (parameters[0] * relaxed(memory, 0) - parameters[1] * relaxed(memory, 1))
                - parameters[2] * contact(parameters, context),
        )
    }
}
