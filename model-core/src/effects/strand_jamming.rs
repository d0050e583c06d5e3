//! The strands lock against each other near the greatest contraction: `F_add = −(1 − s k_F) k_j · max(0, ε − ε_j)²`.
//!
//! `ε = ΔL/L0`; `ε_j` where the strands begin to touch; `k_j`, N, how hard the wall is. One-sided. The true wall is steeper the further one
//! goes; beyond a few per cent past `ε_j` the square is too soft.

use super::{
    Axis, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct StrandJamming;

impl Effect for StrandJamming {
    const INFO: Info = Info {
        name: "strand-jamming",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("k_j", "wall_stiffness", "N", 3.0e2, 1.0e7),
            Parameter::shape("ε_j", "jamming_contraction", "", 0.02, 0.35).along(Axis::Contraction),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −(1 − s·k_F)·k_j·max(0, ε − ε_j)²",
        summary: "Near full contraction the strands of the braid touch and lock, which stops the muscle.",
        source: "S. Davis and D. Caldwell, Int. J. Robotics Research 25 (2006) 359–369, doi 10.1177/0278364906063227",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::EndOfStroke).changed(Changed::new(
        Class::Alone(Self::INFO.name),
        Owner::Muscle,
        "strands lock at the stroke's end",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let over = (context.contraction - parameters[1]).max(T::ZERO);
        -context.rubbed(parameters[0] * over * over)
    }
}
