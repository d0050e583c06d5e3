//! The force reading is late against stroke and pressure.
//!
//! ```text
//! F_add = −δ (∂F/∂x v + g (1 − s k_F) dP/dt)    or    F_add = −κ (F − LP_τ(F))    or    F_add = −κ_d (F − D_τ(F)),  D_τ = LP⁴_{τ/4}
//! ```
//! `δ`, s, a skew between the channels, to first order and away from reversals (negative: the stroke is the late one); or a first-order filter
//! of time constant `τ`, s, in the force channel, `κ = 1` for the whole, which also rounds the jumps at reversals; or a delay by `τ` behind a
//! converter's filter: four equal filters in a row, which bring a jump late and not immediately. `F`, N, is the base model's force. Laws to
//! choose from.

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, Fading, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

type Filter = Fading<1, 1>;
/// Filters in a row behind a delay.
const ROW: usize = 4;
/// A step goes through the row in pieces, at most this many, as the input of each filter bends within the step.
const PIECES: usize = 12;
/// Where they begin in the memory: whether anything was seen, the force, what each filter gives.
const SEEN: usize = Filter::SLOTS;
/// Behind them: which way the muscle went, where it was, how fast.
const WAY: usize = SEEN + 2 + ROW;
const STROKE: usize = WAY + 1;
const SPEED: usize = WAY + 2;

/// See the [module](self).
pub(super) struct SensorDelay;

impl Effect for SensorDelay {
    // memory: see Fading, one time constant, the force as drive; then the row of filters
    const INFO: Info = Info {
        name: "sensor-delay",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("δ", "skew", "s", -0.1, 0.1).bounded(),
            Parameter::amplitude("κ", "filtered_part", "", 0.1, 1.2).bounded(),
            Parameter::amplitude("κ_d", "delayed_part", "", 0.1, 1.2).bounded(),
            Parameter::shape("τ", "filter_time", "s", 1.0e-3, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −δ·(∂F/∂x·v + g·(1 − s·k_F)·dP/dt), or F = −κ·(F − LP_τ(F)), or F = −κ_d·(F − D_τ(F))",
        summary: "The force channel lags behind the other channels.",
        source: "first-order filter or skew; 1 to 100 ms are usual",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds)
        .consistent(passes_no_more)
        .changed(Changed::new(Class::SensorDelay, Owner::Sensor, "F(t) = S(P(t − τ))").sized("delay", "s"));

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        let time = parameters[3];
        if context.dt >= (time * T::from_f64(20.0)).max(T::ONE) {
            // The force during a pause is unknown; the reading has caught up with it since.
            memory.fill(T::ZERO);
        }
        match turn(context, memory) {
            Some(turn) => {
                catch_up(memory, time, (context.dt - turn.since).max(T::ZERO), turn.before);
                catch_up(memory, time, T::ZERO, turn.after);
                catch_up(memory, time, turn.since, context.force());
            }
            None => catch_up(memory, time, context.dt, context.force()),
        }
        memory[WAY] = context.direction;
        memory[STROKE] = context.stroke;
        memory[SPEED] = context.speed;
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let rate = context.slope() * context.speed + context.pull_per_pressure() * context.pressure_rate;
        let filtered = Filter::value(memory, 0, context.force());
        let delayed =
            if memory[SEEN] == T::ZERO { T::ZERO } else { context.force() - memory[SEEN + 1 + ROW] };
        -(parameters[0] * rate + parameters[1] * filtered + parameters[2] * delayed)
    }
}

/// A turn between the moment before and this one, where friction jumps.
struct Turn<T> {
    /// Time since, s.
    since: T,
    /// Forces on either side of it, N.
    before: T,
    after: T,
}

/// The reversal since the last sample, if any: where the strokes before and after it meet, each extrapolated at its speed.
fn turn<T: Scalar>(context: &Context<T>, memory: &Memory<T>) -> Option<Turn<T>> {
    let came = memory[WAY];
    let (speed, dt) = (memory[SPEED], context.dt);
    let ways = came * context.direction < T::ZERO;
    let speeds = speed * came > T::ZERO && context.speed * context.direction > T::ZERO;
    if !(ways && speeds) {
        return None;
    }
    let until = (context.stroke - memory[STROKE] - context.speed * dt) / (speed - context.speed);
    let since = dt - until.max(T::ZERO).min(dt);
    let pull = context.quasi - context.stiffness * context.speed * since;
    let going = |way: T| Context { direction: way, ..*context }.rubbed(pull);
    Some(Turn { since, before: going(came), after: going(context.direction) })
}

/// Lets `dt` seconds pass in both kinds of filter, while the force ran straight to `force`.
fn catch_up<T: Scalar>(memory: &mut Memory<T>, time: T, dt: T, force: T) {
    Filter::step(memory, dt, &[time], &[force]);
    if memory[SEEN] == T::ZERO {
        memory[SEEN] = T::ONE;
        memory[SEEN + 1..SEEN + 2 + ROW].fill(force);
        return;
    }
    let row = &mut memory[SEEN + 1..SEEN + 2 + ROW];
    let time = time.max(T::from_f32(1.0e-4)) / T::from_f64(ROW as f64);
    let dt = dt.max(T::ZERO);
    let pieces = (1..PIECES).find(|n| dt <= time * T::from_f64(0.5 * *n as f64)).unwrap_or(PIECES);
    let part = T::ONE / T::from_f64(pieces as f64);
    let (dt, began) = (dt * part, row[0]);
    let kept = (-dt / time).exp();
    // Exact where the input runs straight between two moments.
    let mean = if dt > T::ZERO { (T::ONE - kept) * time / dt } else { T::ONE };
    for piece in 1..=pieces {
        let mut input = (row[0], began + (force - began) * part * T::from_f64(piece as f64));
        row[0] = input.1;
        for output in &mut row[1..] {
            let before = *output;
            *output = kept * before + (T::ONE - mean) * input.1 + (mean - kept) * input.0;
            input = (before, *output);
        }
    }
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
    fn over_a_pause_the_reading_catches_up() {
        let law = [0.0, 1.0, 0.0, 0.04];
        let mut memory = [0.0; model_core::effects::MEMORY];
        SensorDelay::step(&law, &moment(0.0, 0.0), &mut memory);
        let context = Context { dt: 5.0, ..moment(3.0, 0.1) };
        SensorDelay::step(&law, &context, &mut memory);
        assert_eq!(SensorDelay::force(&law, &context, &memory), 0.0);
    }
}
