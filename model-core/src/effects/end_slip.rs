//! An end slipped in its clamp at one moment: from then on the muscle is longer by `δ` than its stroke says.
//!
//! ```text
//! F_add = −∂F/∂x · δ    from t = t_s on
//! ```
//! `x` is the contraction stroke, `δ`, m, positive when slipping gave length; `t_s`, s, on the clock of the campaign. A slip at or before
//! time zero is there from the first reading; once seen it stays (the memory is kept over a power cycle). First order in `δ`.

use super::{
    Axis, BenchCheck, Changed, Class, Context, Course, Effect, Experiment, ForceShape, Info, Inspect, Link,
    Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct EndSlip;

impl Effect for EndSlip {
    const INFO: Info = Info {
        name: "end-slip",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("δ", "slip", "m", -5.0e-3, 5.0e-3),
            Parameter::shape("t_s", "slip_time", "s", 0.0, 1.0e5).along(Axis::Time),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −∂F/∂x·δ for t ≥ t_s",
        summary: "At one moment an end slipped in its fitting, and the length of all later readings is wrong.",
        source: "a step of the rest length at a change point; sensitivity of the base model",
    };

    const TRAITS: Traits =
        Traits::shown_by(Experiment::VentedLength).check(BenchCheck::VentedLength).changed(
            Changed::new(Class::EndSlip, Owner::RigOrMuscle, "ΔF = δ·∂F/∂x from one moment on")
                .sized("slip", "m")
                .adds(ForceShape::StrokeStep)
                .courses(&[Course::Step])
                .inspect(Inspect::EndFittings),
        );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        if context.time >= parameters[1] {
            memory[0] = T::ONE;
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        -parameters[0] * memory[0] * context.slope()
    }
}
