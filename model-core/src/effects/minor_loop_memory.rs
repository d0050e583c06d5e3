//! Loops within loops that remember at the reversal: six play operators (Prandtl and Ishlinskii).
//!
//! ```text
//! y_i = play of half-width r_i of the strands' travel ξ        r_i = r · i/6,  i = 1…6
//! F_add = −(A + A_P P) · Σ (ξ − y_i) / Σ r_i
//! ```
//! `r`, m, is the half-width of the widest play; `A`, N, and `A_P`, N/Pa, the force on a full loop, constant or growing with
//! pressure. What is kept is `ξ − y_i`, which lies within `±r_i`; the rest of the play is a function of stroke alone and belongs
//! to the base model. Plays of evenly spread widths, all equally steep, are Preisach's relays spread evenly below a width: inner loops
//! of any size are thin lenses, unlike those of `presliding-hysteresis`, whose elements crowd at small travels. Independent of speed; an
//! extremum is wiped out once the muscle goes beyond it. On loops wider than `2r` it is a dry friction. Before the first full travel
//! the state is unknown; it begins in the middle.

use super::{
    Axis, BraidTravel, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter,
    Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct MinorLoopMemory;

impl Effect for MinorLoopMemory {
    const INFO: Info = Info {
        name: "minor-loop-memory",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("A", "loop_force", "N", 0.1, 30.0),
            Parameter::amplitude("A_P", "loop_force_per_pressure", "N/Pa", 1.0e-7, 5.0e-5),
            Parameter::shape("r", "widest_play", "m", 5.0e-5, 3.0e-2).along(Axis::Travel),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Branch,
        fading: &[],
        equation: "F = −(A + A_P·P)·Σ(ξ − y_i)/Σr_i, y_i = play of ξ, r_i each way, r_i = r·i/6, i = 1…6",
        summary: "Inside a large loop the force depends on the points of earlier reversals, at any speed.",
        source: "Y. Liu et al., Strojniški vestnik 63 (2017) 56–64, doi 10.5545/sv-jme.2016.4027 (Prandtl–Ishlinskii operators for a pneumatic muscle); P. Krejčí and K. Kuhnen, IEE Proc. Control Theory and Applications 148 (2001) 185–192",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::NestedLoops).made_from_base().changed(
        Changed::new(Class::TurningMemory, Owner::Muscle, "small loops remember at the reversal")
            .remembering(),
    );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [(ξ − y_i)/r, i = 1…6; last stroke, last pressure, seen]
        let by = BraidTravel::step(context, memory, 6) / parameters[2].max(T::from_f32(1.0e-6));
        let mut width = T::ZERO;
        for stretch in &mut memory[..6] {
            width += T::from_f64(1.0 / 6.0);
            *stretch = (*stretch + by).clamp(-width, width);
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let mut sum = T::ZERO;
        for stretch in &memory[..6] {
            sum += *stretch;
        }
        // The widths' sum: (1 + 2 + … + 6)/6.
        -(parameters[0] + parameters[1] * context.pressure.max(T::ZERO)) * sum * T::from_f64(6.0 / 21.0)
    }
}
