//! The model in single precision as a controller runs it: each function once in a program, and compiled with this crate.
//!
//! Everything else here is generic, or marked to be compiled with whichever crate calls it. A controller's image is built for
//! size by all means; what it does a thousand times a second is built here, where it is not slowed down for it
//! (`profile.firmware` in the workspace's manifest).

use crate::effects::{Chain, Context};
use crate::inverse::{Search, Solution};
use crate::motion::{Motion, MotionTracker};
use crate::muscle::{AtStroke, Muscle, OperatingPoint, Parts, StrokeSlopes};
use crate::units::{Force, Length, Pressure};

/// Force of the base model: [`Muscle::force`].
#[inline(never)]
pub fn force(
    muscle: &Muscle<f32>,
    pressure: Pressure<f32>,
    stroke: Length<f32>,
    direction: f32,
) -> Force<f32> {
    muscle.force(pressure, stroke, direction)
}

/// [`Muscle::at_stroke`], into its place.
#[inline(never)]
pub fn hold(muscle: &Muscle<f32>, at_stroke: &mut AtStroke<f32>, stroke: Length<f32>) {
    *at_stroke = muscle.at_stroke(stroke);
}

/// Both for one tick: the shape into its place, and the force there by the coefficients of that shape. It is [`force`] except for
/// rounding: the terms are added in another order.
#[inline(never)]
pub fn pose(
    muscle: &Muscle<f32>,
    at_stroke: &mut AtStroke<f32>,
    stroke: Length<f32>,
    pressure: Pressure<f32>,
    direction: f32,
) -> Force<f32> {
    let held = muscle.at_stroke(stroke);
    *at_stroke = held;
    muscle.pull(muscle.force_held(&held, pressure, direction))
}

/// [`Muscle::slopes`], into their place.
#[inline(never)]
fn refresh_slopes(muscle: &Muscle<f32>, at_stroke: &AtStroke<f32>, slopes: &mut StrokeSlopes<f32>) {
    *slopes = muscle.slopes(at_stroke);
}

/// Parts of the base model's force at a held stroke: [`Muscle::parts`].
#[inline(never)]
pub fn parts(muscle: &Muscle<f32>, at_stroke: &AtStroke<f32>, pressure: Pressure<f32>) -> Parts<f32> {
    muscle.parts(at_stroke, pressure)
}

/// Slope of the force over the stroke, N/m: [`Muscle::stroke_slope`].
pub fn stroke_slope(muscle: &Muscle<f32>, at_stroke: &AtStroke<f32>, pressure: Pressure<f32>) -> f32 {
    parts_and_stiffness(muscle, at_stroke, pressure).1
}

/// [`Muscle::parts`] and [`Muscle::stroke_slope`], of one look at the curves.
#[inline(never)]
pub fn parts_and_stiffness(
    muscle: &Muscle<f32>,
    at_stroke: &AtStroke<f32>,
    pressure: Pressure<f32>,
) -> (Parts<f32>, f32) {
    muscle.parts_and_stiffness(at_stroke, &muscle.slopes(at_stroke), pressure)
}

/// Pressure at which the base model gives a force: [`Muscle::pressure_for`].
#[inline(never)]
pub fn pressure_for(
    muscle: &Muscle<f32>,
    at_stroke: &AtStroke<f32>,
    direction: f32,
    force: Force<f32>,
    guess: Pressure<f32>,
    search: &Search<f32>,
) -> Solution<f32> {
    muscle.pressure_for(force, at_stroke, direction, guess, search)
}

/// The same for a stroke that nothing else is queried about.
#[inline(never)]
pub fn pressure_at(
    muscle: &Muscle<f32>,
    stroke: Length<f32>,
    direction: f32,
    force: Force<f32>,
    guess: Pressure<f32>,
    search: &Search<f32>,
) -> Solution<f32> {
    muscle.pressure_for(force, &muscle.at_stroke(stroke), direction, guess, search)
}

/// Pressure at which the model with its effects gives a force: [`Muscle::pressure_with`].
#[inline(never)]
pub fn pressure_with(
    muscle: &Muscle<f32>,
    chain: &Chain<f32>,
    point: &OperatingPoint<f32>,
    force: Force<f32>,
    guess: Pressure<f32>,
    search: &Search<f32>,
) -> Solution<f32> {
    if chain.depends_on_pressure() {
        return muscle.pressure_by_search(force, chain, point, guess, search);
    }
    let rest = Force::from_newtons(force.newtons() - effects(chain, &point.context));
    pressure_for(muscle, &point.at_stroke, point.context.direction, rest, guess, search)
}

/// Brings an operating point to the present motion and pressure: [`Muscle::update`].
#[inline(never)]
pub fn update(
    muscle: &Muscle<f32>,
    point: &mut OperatingPoint<f32>,
    motion: &Motion<f32>,
    pressure: Pressure<f32>,
) {
    hold(muscle, &mut point.at_stroke, Length::from_metres(motion.stroke));
    refresh_slopes(muscle, &point.at_stroke, &mut point.slopes);
    muscle.fill_context(point, motion, pressure);
}

/// Lets time pass in the memory of all effects: [`Chain::step`].
#[inline(never)]
pub fn step(chain: &mut Chain<f32>, context: &Context<f32>) {
    chain.step(context);
}

/// Force of all effects together, N: [`Chain::force`].
#[inline(never)]
pub fn effects(chain: &Chain<f32>, context: &Context<f32>) -> f32 {
    chain.force(context)
}

/// Gives the motion after the next readings: [`MotionTracker::step`].
#[inline(never)]
pub fn follow(tracker: &mut MotionTracker<f32>, dt: f32, stroke: f32, pressure: f32) -> &Motion<f32> {
    tracker.step(dt, stroke, pressure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table;

    #[test]
    fn the_force_of_a_tick_is_that_of_the_model() {
        let mut long = table::example();
        for _ in long.elastic.len()..table::MAX_ORDER {
            let last = long.elastic.last().cloned().expect("a curve");
            long.elastic.push(last).expect("room for another order");
        }
        for table in [table::example(), long] {
            let single = Muscle::<f32>::build(&table).expect("a valid table");
            let double = Muscle::<f64>::build(&table).expect("a valid table");
            let mut held = AtStroke::NONE;
            for n in 0..3_000_i32 {
                let (p, x) = (200.0 * n as f32, 1e-5 * (n % 300) as f32);
                let s = (n % 3 - 1) as f32;
                let (pressure, stroke) = (Pressure::from_pascals(p), Length::from_metres(x));
                let exact = double.force(pressure.cast(), stroke.cast(), f64::from(s)).newtons();
                // A thousandth of a percent of the blocked force of about 130 N.
                for near in
                    [pose(&single, &mut held, stroke, pressure, s), force(&single, pressure, stroke, s)]
                {
                    assert!(
                        (f64::from(near.newtons()) - exact).abs() < 1.3e-3,
                        "{near:?} for {exact} at {p}, {x}"
                    );
                }
                assert_eq!(held, single.at_stroke(stroke));
            }
        }
    }
}
