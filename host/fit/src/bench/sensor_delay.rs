//! The force reading is late against stroke and pressure.
//!
//! ```text
//! F_add = −δ (∂F/∂x v + g (1 − s k_F) dP/dt)    or    F_add = −κ (F − LP_τ(F))    or    F_add = −κ_d (F − F(t − τ))
//! ```
//! `δ < 0`, s, a skew between the channels, of which the stroke is the late one, to first order and away from reversals; or a first-order
//! filter of time constant `τ`, s, in the force channel, `κ = 1` for the whole, which also rounds the jumps at reversals; or a dead time `τ`,
//! s, of a converter or a line, which brings a jump late and whole. `F`, N, is the base model's force. Laws to choose from. A late force is
//! never described to first order only: away from reversals that would be friction.

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, Fading, ForceShape, Info, Inspect, Link, MEMORY, Memory,
    Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

type Filter = Fading<1, 1>;
/// Behind the filter: which way the muscle went, where it was, how fast.
const WAY: usize = Filter::SLOTS;
const STROKE: usize = WAY + 1;
const SPEED: usize = WAY + 2;
/// Behind them: the number of knots in the recent course of the force, then each knot's age and force, the newest first.
const COUNT: usize = WAY + 3;
const FIRST: usize = COUNT + 1;
const KNOTS: usize = (MEMORY - FIRST) / 2;
/// The force runs straight between two knots, which are at most this share of the dead time apart where the readings allow it.
const APART: f64 = 0.25;

/// See the [module](self).
pub(super) struct SensorDelay;

impl Effect for SensorDelay {
    // memory: see Fading, one time constant, the force as drive; then the recent course of the force
    const INFO: Info = Info {
        name: "sensor-delay",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("δ", "skew", "s", -0.1, 0.0).bounded(),
            Parameter::amplitude("κ", "filtered_part", "", 0.1, 1.2).bounded(),
            Parameter::amplitude("κ_d", "delayed_part", "", 0.1, 1.2).bounded(),
            Parameter::shape("τ", "filter_time", "s", 1.0e-3, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −δ·(∂F/∂x·v + g·(1 − s·k_F)·dP/dt), or F = −κ·(F − LP_τ(F)), or F = −κ_d·(F − F(t − τ))",
        summary: "The force channel lags behind the other channels.",
        source: "first-order filter, skew or dead time; 1 to 100 ms are usual",
    };

    const TRAITS: Traits =
        Traits::shown_by(Experiment::Speeds).made_from_base().consistent(passes_no_more).changed(
            Changed::new(Class::SensorDelay, Owner::Sensor, "F(t) = S(P(t − τ))")
                .sized("delay", "s")
                // The delay is the first parameter: a reading that is late to first order adds to the expected force.
                .adds(ForceShape::LateForce)
                .class_in_strokes(Class::RateOrPhase)
                .correctable()
                .inspect(Inspect::ForceChannel),
        );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let time = parameters[3];
        if context.dt >= (time * T::from_f64(20.0)).max(T::ONE) {
            // The force during a pause is unknown; the reading has caught up with it since.
            memory.fill(T::ZERO);
        }
        match reversal(context, memory) {
            Some(reversal) => {
                catch_up(memory, time, (context.dt - reversal.since).max(T::ZERO), reversal.before);
                Filter::step(memory, T::ZERO, &[time], &[reversal.after]);
                add(memory, reversal.after);
                catch_up(memory, time, reversal.since, context.force());
            }
            None => catch_up(memory, time, context.dt, context.force()),
        }
        memory[WAY] = context.direction;
        memory[STROKE] = context.stroke;
        memory[SPEED] = context.speed;
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let rate = context.slope() * context.speed + context.pull_per_pressure() * context.pressure_rate;
        let now = context.force();
        let filtered = Filter::value(memory, 0, now);
        let delayed = now - before(memory, parameters[3]).unwrap_or(now);
        -(parameters[0] * rate + parameters[1] * filtered + parameters[2] * delayed)
    }
}

/// A reversal between the moment before and this one, where friction jumps.
struct Reversal<T> {
    /// Time since, s.
    since: T,
    /// Forces on either side of it, N.
    before: T,
    after: T,
}

/// The reversal since the last sample, if any: where the strokes before and after it meet, each extrapolated at its speed; halfway if they
/// do not move towards it.
fn reversal<T: Scalar>(context: &Context<T>, memory: &Memory<T>) -> Option<Reversal<T>> {
    let came = memory[WAY];
    let (speed, dt) = (memory[SPEED], context.dt);
    let ways = came * context.direction < T::ZERO;
    let speeds = speed * came > T::ZERO && context.speed * context.direction > T::ZERO;
    if !ways {
        return None;
    }
    let meet = (context.stroke - memory[STROKE] - context.speed * dt) / (speed - context.speed);
    let until = if speeds { meet.max(T::ZERO).min(dt) } else { dt * T::from_f32(0.5) };
    let since = dt - until;
    let pull = context.quasi - context.stiffness * context.speed * since;
    let going = |way: T| Context { direction: way, ..*context }.rubbed(pull);
    Some(Reversal { since, before: going(came), after: going(context.direction) })
}

/// Lets `dt` seconds pass in the filter and for the knots of the force, which ran straight to `force`.
fn catch_up<T: Scalar>(memory: &mut Memory<T>, time: T, dt: T, force: T) {
    Filter::step(memory, dt, &[time], &[force]);
    let mut n = count(memory);
    for k in 0..n {
        memory[age(k)] += dt;
    }
    // Knots older than the first one that is as old as the dead time have no use.
    while n > 1 && memory[age(n - 2)] >= time {
        n -= 1;
    }
    memory[COUNT] = T::from_f64(n as f64);
    // The newest knot moves along with the force, except from a jump, and until it is far from the one before it.
    let follows = n > 1 && memory[age(1)] > memory[age(0)] && memory[age(1)] <= time * T::from_f64(APART);
    if follows {
        (memory[age(0)], memory[age(0) + 1]) = (T::ZERO, force);
    } else {
        add(memory, force);
    }
}

/// Adds a knot of age zero; where there is no room, the oldest one goes.
fn add<T: Scalar>(memory: &mut Memory<T>, force: T) {
    let n = count(memory).min(KNOTS - 1);
    memory.copy_within(FIRST..age(n), age(1));
    (memory[age(0)], memory[age(0) + 1]) = (T::ZERO, force);
    memory[COUNT] = T::from_f64((n + 1) as f64);
}

fn count<T: Scalar>(memory: &Memory<T>) -> usize {
    (0..KNOTS).take_while(|k| T::from_f64(*k as f64) < memory[COUNT]).count()
}

/// Where the age of a knot is kept; its force is behind it.
const fn age(knot: usize) -> usize {
    FIRST + 2 * knot
}

/// The force a dead time ago; before the first knot it was as there. `None` before anything was seen.
fn before<T: Scalar>(memory: &Memory<T>, time: T) -> Option<T> {
    let n = count(memory);
    let older = (0..n).find(|k| memory[age(*k)] >= time).or(n.checked_sub(1))?;
    let newer = older.saturating_sub(1);
    let (from, to) = (age(newer), age(older));
    let span = memory[to] - memory[from];
    let part = if span > T::ZERO { ((time - memory[from]) / span).min(T::ONE) } else { T::ONE };
    Some(memory[from + 1] + part * (memory[to + 1] - memory[from + 1]))
}

/// No filter passes more than it is given: its parts are 1 at most, and 1.3 with their error.
fn passes_no_more(amplitudes: &[f64], _shapes: &[f64]) -> bool {
    !matches!(amplitudes, [_, filtered, delayed] if !(filtered.max(*delayed) <= 1.3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 7.3;

    /// A muscle of 100 N and 50 N/mm, with a tenth of friction, that goes 2 mm/s up and down.
    fn moment(time: f64, dt: f64) -> Context<f64> {
        let phase = (time / PERIOD).rem_euclid(1.0);
        let direction = if phase < 0.5 { 1.0 } else { -1.0 };
        let stroke = 2e-3 * PERIOD * if phase < 0.5 { phase } else { 1.0 - phase };
        Context {
            dt,
            stroke,
            direction,
            speed: 2e-3 * direction,
            quasi: 800.0 - 5e4 * stroke,
            stiffness: -5e4,
            friction: 0.1,
            ..Context::NONE
        }
    }

    /// What a law adds at moments `every` milliseconds apart.
    fn added(parameters: &[f64], every: usize) -> Vec<f64> {
        let mut memory = [0.0; model_core::effects::MEMORY];
        let dt = 1e-3 * every as f64;
        (0..20_000 / every)
            .map(|i| {
                let context = moment(dt * i as f64, dt);
                SensorDelay::step(parameters, &context, &mut memory);
                SensorDelay::force(parameters, &context, &memory)
            })
            .collect()
    }

    #[test]
    fn ten_readings_a_second_show_the_same_lag_as_a_thousand() {
        for law in [[0.0, 1.0, 0.0, 0.04], [0.0, 0.0, 1.0, 0.06]] {
            let fine = added(&law, 1);
            for (i, coarse) in added(&law, 100).iter().enumerate() {
                let off = coarse - fine[100 * i];
                // The jump at a reversal is up to 160 N; the rest are the slopes on either side of it, over a part of a sample.
                assert!(off.abs() < 1.5, "{law:?}, {i}: {coarse} and {}", fine[100 * i]);
            }
        }
    }

    #[test]
    fn a_dead_time_brings_each_reversal_late_and_whole() {
        for (every, time) in [(1, 0.06), (20, 0.06), (20, 0.013), (50, 0.41)] {
            let dt = 1e-3 * every as f64;
            for (i, added) in
                added(&[0.0, 0.0, 1.0, time], every).iter().enumerate().skip(1 + (time / dt) as usize)
            {
                let now = dt * i as f64;
                let late = moment(now - time, dt).force() - moment(now, dt).force();
                assert!((added - late).abs() < 0.1, "{time} s, {i}: {added} and {late}");
            }
        }
    }

    #[test]
    fn over_a_pause_the_reading_catches_up() {
        let law = [0.0, 1.0, 0.0, 0.04];
        let mut memory = [0.0; model_core::effects::MEMORY];
        SensorDelay::step(&law, &moment(0.0, 0.0), &mut memory);
        let context = Context { dt: 5.0, ..moment(3.0, 0.1) };
        SensorDelay::step(&law, &context, &mut memory);
        assert_eq!(SensorDelay::force(&law, &context, &memory), 0.0);
    }
}
