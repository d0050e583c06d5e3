//! Terms of the bladder's elastic law beyond the table's order `M`.
//!
//! ```text
//! F_add = (1 − s k_F) (E_{M+1} c_{M+1} + E_{M+2} c_{M+2} + G c_H)
//! c_k = (V_B/L) ε_z^k − t L² ε_x^k/(2πN²R)        c_H = (V_B/L) h(λ_z) − t L²/(2πN²R) h(λ_x),  h(λ) = λ − 1/λ²
//! ```
//! `E_k`, Pa, do not depend on pressure; `c_H` is the neo-Hookean law of rubber in each direction, `λ = 1 + ε`, `G` its shear modulus, Pa.
//! This is the base model's own inexactness, not physics that was left out: it is offered before any effect is. High powers
//! are for the recorded range only.

use super::{Context, Effect, Experiment, Imitates, Info, Link, Memory, Parameter, Start, Traits};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct HigherOrderElasticity;

impl Effect for HigherOrderElasticity {
    const INFO: Info = Info {
        name: "higher-order-elasticity",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("E_(M+1)", "next_modulus", "Pa", -1.0e8, 1.0e8),
            Parameter::amplitude("E_(M+2)", "second_next_modulus", "Pa", -1.0e9, 1.0e9),
            Parameter::amplitude("G", "shear_modulus", "Pa", -3.0e6, 3.0e6),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = (1 − s·k_F)·[E_(M+1)·c_(M+1) + E_(M+2)·c_(M+2) + G·c_H]",
        summary: "The stress of the rubber wall has higher powers of strain than the table.",
        source: "E. G. Hocking, thesis, University of Maryland (2012), chapter 3; neo-Hookean law: L. R. G. Treloar, The Physics of Rubber Elasticity, 1975",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Varied).imitates(Imitates::ElasticOrders);

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let (z, x) = (context.axial_strain, context.radial_strain);
        let (mut axial, mut hoop) = (context.axial_area * z, context.hoop_area * x);
        let mut k = T::ONE;
        // The table's order is at most six; the bound keeps a wrong context from turning the loop endless.
        while k < context.order.min(T::from_f32(16.0)) {
            axial *= z;
            hoop *= x;
            k += T::ONE;
        }
        axial *= z;
        hoop *= x;
        let next = axial - hoop;
        let second = axial * z - hoop * x;
        let rubber = |strain: T| {
            let stretch = (T::ONE + strain).max(T::from_f32(0.05));
            stretch - T::ONE / (stretch * stretch)
        };
        let hooke = context.axial_area * rubber(z) - context.hoop_area * rubber(x);
        context.rubbed(parameters[0] * next + parameters[1] * second + parameters[2] * hooke)
    }
}
