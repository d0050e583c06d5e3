//! Friction that builds up over a distance after a reversal: four Maxwell elements that stick, stretch and slip.
//!
//! ```text
//! dz_i = dξ/d_i, held within ±1        d_i = (δ/2) · (1, 1/2, 1/4, 1/8)
//! F_add = (a · k_F |F_quasi| + F_d) (s − ¼ Σ z_i)
//! ```
//! `ξ` is the strands' travel (the stroke, or at held length what the pressure would have moved), m; `δ` the travel after a reversal
//! until all slide, m; `a` the part of the table's own friction that builds up so, `F_d`, N, a dry friction that does. Once all
//! slide nothing is added: the base model's jump at the reversal is what is taken back. Memory is bounded by one per element, and
//! it has the loops' own memory: return to a reversal closes its loop.
//! Before the first full travel the elements' state is unknown; they begin in the middle.

use super::{
    BraidTravel, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start,
    Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct PreslidingHysteresis;

impl Effect for PreslidingHysteresis {
    const INFO: Info = Info {
        name: "presliding-hysteresis",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("a", "share_of_friction", "", 0.1, 1.5),
            Parameter::amplitude("F_d", "dry_friction", "N", 0.1, 20.0),
            Parameter::shape("δ", "sliding_travel", "m", 2.0e-5, 1.0e-2),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Branch,
        fading: &[],
        equation: "F = (a·k_F·|F_quasi| + F_d)·(s − ¼·Σz_i), dz_i = dξ/d_i within ±1, d_i = δ/2^i, i = 1…4",
        summary: "After a reversal the strands stretch before they slide, so friction builds up over a distance.",
        source: "F. Al-Bender, V. Lampaert, J. Swevers, Chaos 14 (2004) 446–460, doi 10.1063/1.1741752 (generalized Maxwell slip); T. Vo-Minh et al., Mechatronics 20 (2010) 402–414 (for a pneumatic muscle)",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::NestedLoops)
        .made_from_base()
        .consistent(no_more_than_the_friction)
        .changed(
            Changed::new(Class::TurningMemory, Owner::Muscle, "friction builds up after a reversal")
                .remembering(),
        );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [z_1…z_4, last stroke, last pressure, seen]
        let travel = BraidTravel::step(context, memory, 4);
        let mut by = (travel + travel) / parameters[2].max(T::from_f32(1.0e-6));
        for z in &mut memory[..4] {
            *z = (*z + by).clamp(-T::ONE, T::ONE);
            by += by;
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let built = (memory[0] + memory[1] + memory[2] + memory[3]) * T::from_f32(0.25);
        let friction = parameters[0] * context.friction * context.quasi.abs() + parameters[1];
        friction * (context.direction - built)
    }
}

/// No more can build up than the friction that the table has: `a` is 1 at most, and 2 where strokes so short that not all strands slide have
/// halved the table's friction.
fn no_more_than_the_friction(amplitudes: &[f64], _shapes: &[f64]) -> bool {
    !matches!(amplitudes, [share, ..] if !(*share <= 2.0))
}
