//! A friction factor that differs between shortening and lengthening.
//!
//! With `k_F ± Δk/2` for the two directions the base model's `−s k_F F` gains an even part: `F_add = −(Δk/2) · F_quasi` while a
//! direction is known. In a recording of full loops it cannot be reported from a gain of the load cell or the gauge; a dwell
//! approached from both sides can show.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct FrictionAsymmetry;

impl Effect for FrictionAsymmetry {
    const INFO: Info = Info {
        name: "friction-asymmetry",
        link: Link::Friction,
        parameters: &[Parameter::amplitude("Δk", "factor_difference", "", -0.2, 0.2)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −(Δk/2)·s²·F_quasi",
        summary: "Friction is larger in one direction than in the other.",
        source: "M. Capace et al., Actuators 8(2) (2019) 49, doi 10.3390/act8020049; D. B. Reynolds et al. 2003, doi 10.1114/1.1554921",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::RestsFromBothSides).changed(Changed::new(
        Class::Gain,
        Owner::Muscle,
        "friction differs between the directions",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let known = context.direction * context.direction;
        -known * parameters[0] * T::from_f32(0.5) * context.quasi
    }
}
