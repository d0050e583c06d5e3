//! The load cell does not read zero without load: `F_add = b`, N.
//!
//! Ten seconds of a vented, slack muscle at either end of a recording settle it; without them free tables absorb it.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Course, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory,
    Owner, Parameter, Start, Traits, Vented,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct ForceOffset;

impl Effect for ForceOffset {
    const INFO: Info = Info {
        name: "force-offset",
        link: Link::Reading,
        parameters: &[Parameter::amplitude("b", "offset", "N", -50.0, 50.0)],
        depends_on_pressure: false,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = b",
        summary: "The zero of the load cell is wrong.",
        source: "zero balance of ±1 to 5 % of rated output before taring: manufacturers of load cells",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::VentedReadings)
        .check(BenchCheck::Weighing)
        .vented(Vented::Constant)
        .changed(
            Changed::new(Class::Zero, Owner::Sensor, "ΔF = b")
                .sized("offset", "N")
                .adds(ForceShape::Constant)
                // One that grows is a drift.
                .courses(&[Course::Whole, Course::Step])
                .correctable()
                .inspect(Inspect::LoadCellZero),
        );

    fn force<T: Scalar>(parameters: &[T], _context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0]
    }
}
