//! A leak at the muscle draws a steady flow, and the line drops pressure for it: `F_add = −g (1 − s k_F) · λ · P`.
//!
//! `λ` (dimensionless) is the part of the gauge pressure lost between sensor and muscle. It holds for a laminar leak behind a
//! laminar line at a regulated pressure; a closed muscle that leaks shows it in the measured pressure itself, and nothing is
//! missing. From force alone it cannot be reported from a wrong gain of the gauge: close the valve for a minute and watch.

use super::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Info, Inspect, Link, Memory, Owner, Parameter,
    Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct Leak;

impl Effect for Leak {
    const INFO: Info = Info {
        name: "leak",
        link: Link::Air,
        parameters: &[Parameter::amplitude("λ", "lost_part", "", 1.0e-3, 0.2)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −g·(1 − s·k_F)·λ·P",
        summary: "The muscle leaks, so its pressure is lower than the pressure at the gauge.",
        source: "continuity of laminar flow through line and leak in series; leak-down recordings of Festo muscles lose 5 to 480 kPa in two minutes",
    };

    const TRAITS: Traits =
        Traits::shown_by(Experiment::ClosedValve).check(BenchCheck::ClosedValve).loses_air().changed(
            Changed::new(
                Class::Gain,
                Owner::RigOrMuscle,
                "air lost on the way costs pressure; behind closed valves dP/dt = −λ·P",
            )
            .inspect(Inspect::Leaks),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        -context.pull_per_pressure() * parameters[0] * context.pressure
    }
}
