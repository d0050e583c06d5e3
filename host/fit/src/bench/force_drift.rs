//! The load cell's zero drifts.
//!
//! ```text
//! F_add = r t + w (1 − e^(−t/τ)) + c LP_τ(F) + z θ
//! ```
//! `r`, N/s, a steady drift over the campaign's time `t`; `w`, N, a warm-up over `τ`, s; `c` (dimensionless) the cell's own creep after its load `F`; `z`,
//! N/K, the zero's dependence on temperature, `θ` counted from the first reading (zero where none is measured). Laws to choose
//! from. Tare at the beginning, between levels and at the end.

use model_core::effects::{
    Changed, Class, Context, Course, Effect, Experiment, Fading, ForceShape, Info, Inspect, Link, Memory,
    Owner, Parameter, Start, Traits, Vented, decay,
};
use model_core::scalar::Scalar;

type Cell = Fading<1, 1>;
const FIRST_TEMPERATURE: usize = Cell::SLOTS;

/// See the [module](self).
pub(super) struct ForceDrift;

impl Effect for ForceDrift {
    // memory: see Fading, then the first temperature
    const INFO: Info = Info {
        name: "force-drift",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("r", "rate", "N/s", -1.0e-2, 1.0e-2),
            Parameter::amplitude("w", "warm_up", "N", -20.0, 20.0),
            Parameter::amplitude("c", "creep_part", "", -0.01, 0.01),
            Parameter::amplitude("z", "zero_per_kelvin", "N/K", -2.0, 2.0),
            Parameter::shape("τ", "settling_time", "s", 30.0, 1.0e4),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[Cell::slot(0, 0)],
        equation: "F = r·t + w·(1 − exp(−t/τ)) + c·LP_τ(F) + z·θ",
        summary: "The zero of the load cell drifts during the recording.",
        source: "creep of 0.02 to 0.05 % of full scale in 20 to 30 minutes: manufacturers of load cells (VPG technical note VPGT-02)",
    };

    const TRAITS: Traits =
        Traits::shown_by(Experiment::VentedReadings).vented(Vented::Everything).slow().changed(
            Changed::new(Class::Zero, Owner::Sensor, "ΔF = δ·t/T")
                .sized("drift_to_end", "N")
                // A drift over one campaign does not show that of the next, so it is not correctable.
                .adds(ForceShape::Time)
                .courses(&[Course::Ramp])
                .inspect(Inspect::LoadCellWarmUp),
        );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        Cell::step(memory, context.dt, &[parameters[4]], &[context.force()]);
        if memory[FIRST_TEMPERATURE] == T::ZERO {
            memory[FIRST_TEMPERATURE] = context.temperature;
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let load = context.force();
        let crept = load - Cell::value(memory, 0, load);
        let warmed = T::ONE - decay(context.time.max(T::ZERO) / parameters[4].max(T::from_f32(1.0e-3)));
        let warmth = if context.temperature > T::ZERO {
            context.temperature - memory[FIRST_TEMPERATURE]
        } else {
            T::ZERO
        };
        parameters[0] * context.time + parameters[1] * warmed + parameters[2] * crept + parameters[3] * warmth
    }
}
