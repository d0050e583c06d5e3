//! Friction proportional to a power of speed: `F_add = −s · c · |F_quasi| · (|v|/v_1)^m`, `v_1 = 1 mm/s`.
//!
//! `c` (dimensionless) is the share of the force lost at 1 mm/s, `m` the exponent: 0 would be the table's own friction, 1 a viscous
//! one. Rubber and sheaths give small exponents. Holds over the decades of speed that were recorded; at rest the force is zero.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct RatePower;

impl Effect for RatePower {
    const INFO: Info = Info {
        name: "rate-power",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("c", "share_at_1_mm_per_s", "", 0.001, 0.2),
            Parameter::shape("m", "exponent", "", 0.1, 0.7),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −s·c·|F_quasi|·(|v|/1 mm/s)^m",
        summary: "Resistance grows with speed, but much less than in proportion.",
        source: "M. Bennington et al. 2023, arXiv 2301.04684; M. A. Mat Dzahir and S. Yamamoto, Applied Sciences 9(12) (2019) 2538, doi 10.3390/app9122538",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds).changed(Changed::new(
        Class::SlowSpeed,
        Owner::Muscle,
        "friction by a power of speed",
    ));

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [(|v|/v_1)^m], so that a search for pressure does not compute the power again.
        let speed = context.speed.abs() * T::from_f32(1.0e3);
        memory[0] = if speed > T::ZERO {
            let exponent = parameters[1].clamp(T::ZERO, T::from_f32(3.0));
            (exponent * speed.min(T::from_f32(1.0e6)).ln()).exp()
        } else {
            T::ZERO
        };
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        -context.direction * parameters[0] * context.quasi.abs() * memory[0]
    }
}
