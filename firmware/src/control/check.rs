//! Whether settings can be used: every number in a range that is stated here, every limit where its sensor can reach it.
//!
//! A range says what a value can sensibly be on any muscle of up to some metres and some kilonewtons; nothing in it is tuned. What a
//! board's converters can deliver is [`Hardware`]'s.

use model_core::link::can::Address;
use model_core::link::messages::{Field, Refusal};
use model_core::link::settings::{CanLine, Joint, Regulator, SensorScale, Settings};

use crate::board::{Hardware, Span};
use crate::tick::TICK_S;

/// A value and the range that it must be in.
type Bound = (f32, f32, f32);

/// Longest times of the watches, ticks. A reading that is out of range does harm within some tens of milliseconds; a regulator answers
/// within some tenths of a second; a user who takes a cable away is noticed within a minute. An armed device is vented, so it may
/// wait for an hour; a host that keeps it alive every tenth of a second must not be disarmed by a few lost frames.
const MOST_DEBOUNCE: u16 = 20;
const MOST_JUMPS: u16 = 64;
const MOST_FOLLOW: u16 = 2_000;
const MOST_STUCK: u16 = 10_000;
const MOST_OVERRUN: u16 = 50;
const MOST_SILENCE: u32 = 60_000;
const MOST_HOLD: u32 = 600_000;
const LEAST_ARMED: u32 = 1_000;
const MOST_ARMED: u32 = 3_600_000;
const MOST_VENT: u32 = 30_000;
/// Largest gains, in the units of the loops: a thousand times what moves a muscle by its whole range at the smallest error that a
/// sensor resolves.
const MOST_GAIN: f32 = 1e9;
/// Largest force, N, length, m, and torque, N·m.
const MOST_FORCE: f32 = 100e3;
const MOST_LENGTH: f32 = 2.0;
const MOST_TORQUE: f32 = 10e3;
/// Highest pressure of any muscle, Pa.
const MOST_PRESSURE: f32 = 5e6;
/// Fastest pressure, Pa/s: from nothing to 10 bar within a tick.
const MOST_RATE: f32 = 1e9;

/// Looks at every number of new settings.
///
/// # Errors
/// [`Refusal::Value`] with the group that a wrong number is in.
pub fn check_settings(settings: &Settings, hardware: &Hardware) -> Result<(), Refusal> {
    let groups = [
        // First: the spans of all others depend on them.
        (Field::Scale, scales(settings, hardware)),
        (Field::ForceLoop, force_loop(settings, hardware)),
        (Field::StrokeLoop, stroke_loop(settings)),
        (Field::Joint, joint(&settings.joint)),
        (Field::Regulator, regulator(&settings.regulator, hardware)),
        (Field::Command, command(settings)),
        (Field::Valves, valves(settings, hardware)),
        (Field::Can, can(&settings.can, hardware)),
        (Field::Limits, limits(settings, hardware)),
        (Field::SensorWatch, sensors(settings, hardware)),
        (Field::Watch, watch(settings, hardware)),
        (Field::Bands, all(&[(settings.motion_band_m, 1e-9, 0.1), (settings.pressure_band_pa, 1e-3, 1e6)])),
    ];
    match groups.into_iter().find(|(_, good)| !good) {
        Some((field, _)) => Err(Refusal::Value(field)),
        None => Ok(()),
    }
}

/// Replaces each group that cannot be used by the board's own values; returns whether there was one.
pub fn repair_settings(settings: &mut Settings, hardware: &Hardware) -> bool {
    let own = &hardware.settings;
    let mut repaired = false;
    // Each iteration repairs one of twelve groups; a repaired scale may spoil limits and watches.
    for _ in 0..12 {
        let Err(Refusal::Value(field)) = check_settings(settings, hardware) else { break };
        match field {
            Field::ForceLoop => settings.force_loop = own.force_loop,
            Field::StrokeLoop => settings.stroke_loop = own.stroke_loop,
            Field::Joint => settings.joint = own.joint,
            Field::Regulator => settings.regulator = own.regulator,
            Field::Limits => settings.limits = own.limits,
            Field::SensorWatch => {
                (settings.pressure, settings.stroke, settings.force) = (own.pressure, own.stroke, own.force);
            }
            Field::Watch => settings.watch = own.watch,
            Field::Bands => {
                (settings.motion_band_m, settings.pressure_band_pa) =
                    (own.motion_band_m, own.pressure_band_pa);
            }
            Field::Scale => settings.scales = own.scales,
            Field::Command => settings.command = own.command,
            Field::Valves => settings.valves = own.valves,
            Field::Can => settings.can = own.can,
            Field::SetPoint | Field::Reference | Field::Rate => *settings = *own,
        }
        repaired = true;
    }
    repaired
}

/// Written so that a number that is none is in no range.
#[inline(never)]
fn all(bounds: &[Bound]) -> bool {
    bounds.iter().all(|(value, low, high)| value >= low && value <= high)
}

fn force_loop(settings: &Settings, hardware: &Hardware) -> bool {
    let f = &settings.force_loop;
    all(&[
        (f.proportional_pa_per_n, 0.0, MOST_GAIN),
        (f.integral_pa_per_n_s, 0.0, MOST_GAIN),
        (f.trim_limit_pa, 0.0, hardware.command_ceiling_pa),
    ])
}

fn stroke_loop(settings: &Settings) -> bool {
    let s = &settings.stroke_loop;
    all(&[
        (s.proportional_n_per_m, 0.0, MOST_GAIN),
        (s.integral_n_per_m_s, 0.0, MOST_GAIN),
        (s.damping_n_s_per_m, 0.0, MOST_GAIN),
        (s.load_n, -MOST_FORCE, MOST_FORCE),
        (s.load_stiffness_n_per_m, -MOST_GAIN, MOST_GAIN),
        (s.force_limit_n, 1e-3, MOST_FORCE),
    ])
}

fn joint(j: &Joint) -> bool {
    all(&[
        (j.radius_m, 1e-4, MOST_LENGTH),
        (j.rest_stroke_m, -MOST_LENGTH, MOST_LENGTH),
        (j.proportional_nm_per_rad, 0.0, MOST_GAIN),
        (j.integral_nm_per_rad_s, 0.0, MOST_GAIN),
        (j.damping_nm_s_per_rad, 0.0, MOST_GAIN),
        (j.torque_limit_nm, 1e-3, MOST_TORQUE),
    ])
}

fn regulator(r: &Regulator, hardware: &Hardware) -> bool {
    all(&[
        // A regulator whose gain is further from one is wired or scaled wrongly.
        (r.gain, 0.1, 10.0),
        (r.offset_pa, -200e3, 200e3),
        // Slower than ten seconds nothing is controlled.
        (r.lag_s, 0.0, 10.0),
        (r.line_s, 0.0, 10.0),
        (r.rate_pa_per_s, 1e3, MOST_RATE),
        (r.deadband_pa, 0.0, 100e3),
        (r.command_max_pa, 1e3, hardware.command_ceiling_pa),
        (r.lead, 0.0, 1.0),
    ])
}

/// Spans of readings that any scale may give: a sensor for less or more belongs to no muscle.
const PRESSURE_SPAN: (f32, f32) = (20e3, 20e6);
const STROKE_SPAN: (f32, f32) = (1e-3, 10.0);
const FORCE_SPAN: (f32, f32) = (1.0, 1e6);
/// Slowest filter, s: a tenth of a second delays a control law by more than any regulator does.
const MOST_FILTER: f32 = 0.1;

/// A scale gives a span that a sensor can have, and zero pressure lies within the span of a pressure sensor.
fn scale(scale: &SensorScale, signals: &Span, (least, most): (f32, f32), zero: bool) -> bool {
    let span = signals.scaled(scale);
    all(&[
        (span.high - span.low, least, most),
        (span.low, -most, most),
        (span.high, -most, most),
        (scale.filter_s, 0.0, MOST_FILTER),
    ]) && (!zero || (span.low < 0.0 && span.high > 0.0))
}

fn scales(settings: &Settings, hardware: &Hardware) -> bool {
    let s = &settings.scales;
    let optional = |one: &SensorScale, signals: &Option<Span>| {
        signals.as_ref().is_none_or(|signals| scale(one, signals, PRESSURE_SPAN, true))
            && one.at_zero.is_finite()
            && one.per_unit.is_finite()
            && all(&[(one.filter_s, 0.0, MOST_FILTER)])
    };
    scale(&s.pressure, &hardware.pressure, PRESSURE_SPAN, true)
        && scale(&s.stroke, &hardware.stroke, STROKE_SPAN, false)
        && scale(&s.force, &hardware.force, FORCE_SPAN, false)
        && optional(&s.second_pressure, &hardware.second_pressure)
        && optional(&s.supply, &hardware.supply)
}

/// The end of the output's range is a pressure that a regulator can have, and the largest command lies within the range.
fn command(settings: &Settings) -> bool {
    let c = &settings.command;
    // 4–20 mA begins at 0.2; more than half the range below no pressure is a mistake.
    all(&[(c.low, 0.0, 0.5), (c.full_pa, 10e3, MOST_PRESSURE)])
        && settings.regulator.command_max_pa <= c.full_pa
}

/// An address needs a board with a CAN controller.
fn can(can: &CanLine, hardware: &Hardware) -> bool {
    CanLine::RATES.contains(&can.kbit_per_s)
        && (!can.is_used() || (hardware.can && Address::new(can.address).is_some()))
}

/// Periods of a pair of valves, ticks: shorter, valves that switch in 1 ms are hardly ever open; longer, no muscle is controlled.
const PERIODS: core::ops::RangeInclusive<u16> = 4..=50;
/// The pressure is corrected once in a period and acts up to a period later. With a lag of two periods or more, every correction is at most
/// half of the error, so that the loop does not swing; a filter of a quarter of the lag is a further eighth of that.
const LAG_PERIODS: f32 = 2.0;
const FILTER_LAGS: f32 = 0.25;
/// Longest dead time, shortest pulse and time apart, s: valves that need longer are none for pulses.
const MOST_SWITCHING: f32 = 10e-3;
/// Largest band of pressure, Pa.
const MOST_BAND: f32 = 100e3;

/// Valves need outputs of the board, and a pressure sensor over which the loop is closed. A command above the supply is never reached, and
/// a period has room for the shortest pulse in the other direction.
fn valves(settings: &Settings, hardware: &Hardware) -> bool {
    let v = &settings.valves;
    let regulator = &settings.regulator;
    let length_s = TICK_S * f32::from(v.period_ticks);
    all(&[
        (v.supply_pa, 10e3, MOST_PRESSURE),
        (v.fill_pa_per_s, 1e3, MOST_RATE),
        (v.vent_pa_per_s, 1e3, MOST_RATE),
        (v.dead_s, 0.0, MOST_SWITCHING),
        (v.least_s, 0.0, MOST_SWITCHING),
        (v.apart_s, 0.0, MOST_SWITCHING),
        (v.band_pa, 0.0, MOST_BAND),
    ]) && (!v.is_fitted()
        || (hardware.valve_pair
            && settings.pressure.fitted
            && PERIODS.contains(&v.period_ticks)
            && regulator.lag_s >= LAG_PERIODS * length_s
            && settings.scales.pressure.filter_s <= FILTER_LAGS * regulator.lag_s
            && regulator.command_max_pa <= v.supply_pa
            && v.dead_s + v.least_s + v.apart_s <= length_s))
}

/// A limit beyond what its converter can deliver would never be crossed.
fn limits(settings: &Settings, hardware: &Hardware) -> bool {
    let l = &settings.limits;
    let pressure = hardware.pressure.scaled(&settings.scales.pressure);
    let stroke = hardware.stroke.scaled(&settings.scales.stroke);
    let force = hardware.force.scaled(&settings.scales.force);
    all(&[
        (l.speed_m_per_s, 1e-4, 100.0),
        (l.slew_pa_per_s, 1e3, MOST_RATE),
        (l.pressure_pa, 1e3, MOST_PRESSURE),
        (l.force_n, 1e-3, MOST_FORCE),
    ]) && l.pressure_pa < pressure.high
        && l.force_n < force.high
        && l.stroke_min_m > stroke.low
        && l.stroke_min_m < l.stroke_max_m
        && l.stroke_max_m < stroke.high
}

/// The ends of a watch lie within the converter's, so that a wire that pulls it to either end is noticed.
fn sensors(settings: &Settings, hardware: &Hardware) -> bool {
    let sensors = [
        (&settings.pressure, hardware.pressure.scaled(&settings.scales.pressure)),
        (&settings.stroke, hardware.stroke.scaled(&settings.scales.stroke)),
        (&settings.force, hardware.force.scaled(&settings.scales.force)),
    ];
    sensors.into_iter().all(|(watch, span)| {
        let width = span.high - span.low;
        !watch.fitted
            || (watch.low > span.low
                && watch.low < watch.high
                && watch.high < span.high
                && all(&[(watch.jump, 1e-9, width)])
                && watch.stuck_ticks <= MOST_STUCK)
    })
}

fn watch(settings: &Settings, hardware: &Hardware) -> bool {
    let w = &settings.watch;
    let least_test_pa = 2.0 * w.vented_pa;
    let pressure = hardware.pressure.scaled(&settings.scales.pressure);
    let supply_high = hardware.supply.map_or(0.0, |span| span.scaled(&settings.scales.supply).high);
    let second_most = hardware.second_pressure.map_or(0.0, |_| pressure.high);
    all(&[
        (w.disagree_n, 0.0, hardware.force.scaled(&settings.scales.force).high),
        (w.follow_pa, 1e3, pressure.high),
        (w.vented_pa, 100.0, 100e3),
        // An input that the board does not have cannot be watched.
        (w.second_pressure_pa, 0.0, second_most),
        (w.supply_low_pa, 0.0, supply_high),
    ]) && (!w.enable_input || hardware.enable_input)
        && (w.valve_test_pa == 0.0 || all(&[(w.valve_test_pa, least_test_pa, 200e3)]))
        && (1..=MOST_DEBOUNCE).contains(&w.debounce_ticks)
        && (1..=MOST_JUMPS).contains(&w.noisy_jumps)
        && (1..=MOST_FOLLOW).contains(&w.disagree_ticks)
        && (1..=MOST_FOLLOW).contains(&w.follow_ticks)
        && w.silence_ticks <= MOST_SILENCE
        && (1..=MOST_SILENCE).contains(&w.host_silence_ticks)
        && (LEAST_ARMED..=MOST_ARMED).contains(&w.armed_silence_ticks)
        && (1..=MOST_OVERRUN).contains(&w.overrun_ticks)
        && w.hold_ticks <= MOST_HOLD
        && (100..=MOST_VENT).contains(&w.vent_ticks)
}

#[cfg(test)]
mod range_tests;
#[cfg(test)]
mod tests;
