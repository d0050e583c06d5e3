//! How faults are noticed, and how soon.
//!
//! | fault | noticed after |
//! | --- | --- |
//! | sensor out of range, no readings, over-pressure, over-stroke, over-force, over-speed | `debounce_ticks` in a row (default 2), so the command changes within 3 ms |
//! | sensor stuck | `stuck_ticks` of bit-equal readings while the command moved by 20 kPa |
//! | sensor noisy | the last of `noisy_jumps` jumps within 256 ticks |
//! | sensors disagree | `disagree_ticks` of table and load cell apart by `disagree_n`; where that is zero, in modes that control the stroke, of a table that is above the load cell by half of the blocked force |
//! | stroke does not move | without a load cell, while the stroke of one muscle is controlled: `follow_ticks` of a force of the table that has risen by half of the blocked force and the load of the settings, while the stroke has stayed within its band |
//! | pressure sensors disagree | `follow_ticks` of the two apart by `second_pressure_pa` |
//! | supply pressure low | `follow_ticks` below `supply_low_pa` |
//! | enable open | `debounce_ticks` |
//! | pressure not following | `follow_ticks` of pressure and regulator's model apart by `follow_pa`; of a pair of valves also as in [`valves`](crate::valves) |
//! | not vented | `debounce_ticks` above `vented_pa` once the command has been to vent for `vent_ticks`; a vented muscle whose pressure rises again, as when it is stretched by hand, has `vent_ticks` from then on |
//! | hold ended | `hold_ticks` of a held command |
//! | setpoint silence | `silence_ticks` without one |
//! | host silence | `host_silence_ticks` without a whole frame, while running and not `autonomous` |
//! | loop overrun | `overrun_ticks` missed in a row |
//!
//! Every finding of a tick is reported, not only the first: one that a fault may be held for must not hide one that vents. In which
//! states each is a fault is in [`safety`](crate::safety).
//!
//! Over-speed looks at the filtered speed (time constant 20 ms of the motion tracker). Jumps are forgotten by slices of 64 ticks, so that
//! no more than 320 ticks are ever looked back on.

use model_core::link::messages::{Fault, Sensor};
use model_core::link::settings::{SensorWatch, Settings};

use crate::board::{Command, Readings};

mod calm;

/// What a watch found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The fault.
    pub fault: Fault,
    /// Its sensor.
    pub sensor: Option<Sensor>,
    /// The value judged.
    pub value: f32,
    /// The limit it crossed.
    pub limit: f32,
}

/// A count of ticks in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct InARow(u16);

impl InARow {
    /// Counts, or begins again; returns whether there have been enough.
    pub(crate) fn count(&mut self, bad: bool, enough: u16) -> bool {
        self.0 = if bad { self.0.saturating_add(1) } else { 0 };
        bad && self.0 >= enough.max(1)
    }

    /// Whether the last tick was bad.
    pub(crate) fn is_counting(self) -> bool {
        self.0 > 0
    }
}

/// The change of command that a live sensor cannot ignore, Pa.
const EXCITED_PA: f32 = 20e3;
/// Ticks of a slice of time, at whose end the oldest of four whole ones is forgotten.
const SLICE: u8 = 64;

/// Jumps within the last four to five slices. Any 256 ticks lie within them, wherever a slice ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Jumps {
    now: u8,
    /// A byte for each of four whole slices.
    before: u32,
}

impl Jumps {
    fn count(&mut self) -> u32 {
        self.now += 1;
        // Two bytes immediately: all four together may come to more than one of them holds.
        let pairs = (self.before & 0x00FF_00FF) + (self.before >> 8 & 0x00FF_00FF);
        u32::from(self.now) + (pairs >> 16) + (pairs & 0xFFFF)
    }

    fn next_slice(&mut self) {
        self.before = self.before << 8 | u32::from(self.now);
        self.now = 0;
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct OneSensor {
    seen: bool,
    out: InARow,
    same: u16,
    last: f32,
    command_at_change: f32,
    jumps: Jumps,
}

impl OneSensor {
    /// Whether a reading may be true alone and after the one before. What is not fitted is not judged.
    fn may_be(&self, watch: &SensorWatch, value: f32) -> bool {
        let calm = !self.seen || (value - self.last).abs() <= watch.jump;
        !watch.fitted || (value >= watch.low && value <= watch.high && calm)
    }

    fn check(
        &mut self,
        sensor: Sensor,
        watch: &SensorWatch,
        settings: &Settings,
        value: f32,
        command_pa: f32,
    ) -> Option<Finding> {
        if !watch.fitted {
            return None;
        }
        let found = |fault, value, limit| Some(Finding { fault, sensor: Some(sensor), value, limit });
        // With `!(…)`, a reading that is not a number counts as outside.
        let outside = !(value >= watch.low && value <= watch.high);
        if self.out.count(outside, settings.watch.debounce_ticks) {
            return found(Fault::SensorRange, value, if value < watch.low { watch.low } else { watch.high });
        }
        let last = core::mem::replace(&mut self.last, value);
        if !core::mem::replace(&mut self.seen, true) {
            self.command_at_change = command_pa;
            return None;
        }
        let enough = u32::from(settings.watch.noisy_jumps.max(1));
        if (value - last).abs() > watch.jump && self.jumps.count() >= enough {
            return found(Fault::SensorNoisy, value, watch.jump);
        }
        if value != last {
            self.same = 0;
            self.command_at_change = command_pa;
        } else if (command_pa - self.command_at_change).abs() > EXCITED_PA {
            self.same = self.same.saturating_add(1);
            if watch.stuck_ticks > 0 && self.same >= watch.stuck_ticks {
                return found(Fault::SensorStuck, value, f32::from(watch.stuck_ticks));
            }
        }
        None
    }
}

/// What the watches of one muscle remember.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideWatch {
    pressure: OneSensor,
    stroke: OneSensor,
    force: OneSensor,
    silent: InARow,
    over_pressure: InARow,
    over_stroke: InARow,
    over_speed: InARow,
    over_force: InARow,
    disagree: InARow,
    low: InARow,
    high: InARow,
    not_vented: InARow,
    second: InARow,
    /// Ticks for which the muscle has had time to vent: since the command is to vent and the pressure was at half of its limit or below.
    vented_ticks: u32,
    /// Ticks of the slice in which jumps are being counted, none before the first readings.
    slice: u8,
    /// Whether every fitted sensor has been read, and no row is being counted.
    quiet: bool,
}

/// What one muscle's watches look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Readings of this tick, before any filter.
    pub readings: Option<Readings>,
    /// Reading of the second pressure sensor, Pa.
    pub second_pa: Option<f32>,
    /// Filtered speed, m/s.
    pub speed_m_per_s: f32,
    /// Command of the last tick.
    pub command: Command,
    /// Pressure expected by the regulator's model, Pa.
    pub expected_pa: f32,
    /// Force by the table, where there is one, N.
    pub model_n: Option<f32>,
    /// By how much that may be above the load cell where the settings do not compare them, N; zero for no comparison.
    pub most_above_n: f32,
}

impl SideWatch {
    /// Whether the readings of pressure and stroke of a tick that has not been examined yet may be true.
    pub(crate) fn may_be(&self, now: &Readings, settings: &Settings) -> bool {
        self.pressure.may_be(&settings.pressure, now.pressure_pa)
            && self.stroke.may_be(&settings.stroke, now.stroke_m)
    }

    /// Restarts, except for how long the muscle has been vented.
    pub fn restart(&mut self) {
        *self = Self { vented_ticks: self.vented_ticks, ..Self::default() };
    }

    /// Looks at one tick and reports every finding, the gravest first.
    pub fn check(&mut self, seen: &Seen, settings: &Settings, report: &mut dyn FnMut(Finding)) {
        self.check_all(seen, settings, report);
        self.quiet = seen.readings.is_some() && !self.counts();
    }

    fn check_all(&mut self, seen: &Seen, settings: &Settings, report: &mut dyn FnMut(Finding)) {
        let watch = &settings.watch;
        self.vented_ticks = if seen.command.vent { self.vented_ticks.saturating_add(1) } else { 0 };
        let silent = self.silent.count(seen.readings.is_none(), watch.debounce_ticks);
        let Some(now) = seen.readings else {
            if silent {
                let (value, limit) = (f32::from(self.silent.0), f32::from(watch.debounce_ticks));
                report(Finding { fault: Fault::SensorsSilent, sensor: None, value, limit });
            }
            return;
        };
        self.next_tick();
        self.check_sensors(&now, seen.command, settings, report);
        self.check_limits(&now, seen, settings, report);
        self.check_second(now.pressure_pa, seen.second_pa, settings, report);
        self.check_pressure(now.pressure_pa, seen.expected_pa, settings, report);
        let above = seen.model_n.map_or(0.0, |model| model - now.force_n);
        let (miss, limit) = match watch.disagree_n > 0.0 {
            true => (above.abs(), watch.disagree_n),
            false => (above, seen.most_above_n),
        };
        let apart = settings.force.fitted && limit > 0.0 && miss > limit;
        if self.disagree.count(apart, watch.disagree_ticks) {
            report(Finding { fault: Fault::SensorsDisagree, sensor: None, value: miss, limit });
        }
    }

    fn next_tick(&mut self) {
        if self.slice == SLICE {
            self.slice = 0;
            for sensor in [&mut self.pressure, &mut self.stroke, &mut self.force] {
                sensor.jumps.next_slice();
            }
        }
        self.slice += 1;
    }

    fn check_sensors(
        &mut self,
        now: &Readings,
        command: Command,
        settings: &Settings,
        report: &mut dyn FnMut(Finding),
    ) {
        let command_pa = if command.vent { 0.0 } else { command.pressure_pa };
        if let Some(found) =
            self.pressure.check(Sensor::Pressure, &settings.pressure, settings, now.pressure_pa, command_pa)
        {
            report(found);
        }
        if let Some(found) =
            self.stroke.check(Sensor::Stroke, &settings.stroke, settings, now.stroke_m, command_pa)
        {
            report(found);
        }
        if let Some(found) =
            self.force.check(Sensor::Force, &settings.force, settings, now.force_n, command_pa)
        {
            report(found);
        }
    }

    fn check_limits(
        &mut self,
        now: &Readings,
        seen: &Seen,
        settings: &Settings,
        report: &mut dyn FnMut(Finding),
    ) {
        let speed_m_per_s = seen.speed_m_per_s;
        let (limits, debounce) = (&settings.limits, settings.watch.debounce_ticks);
        let (has_stroke, stroke) = (settings.stroke.fitted, now.stroke_m);
        let stroke_limit =
            if stroke < limits.stroke_min_m { limits.stroke_min_m } else { limits.stroke_max_m };
        let out_of_stroke = stroke < limits.stroke_min_m || stroke > limits.stroke_max_m;
        // The higher of two pressure sensors counts: one that reads low hides nothing.
        let second_pa = seen.second_pa.filter(|_| settings.watch.second_pressure_pa > 0.0);
        let pressure_pa = match second_pa {
            Some(second_pa) if second_pa > now.pressure_pa => second_pa,
            _ => now.pressure_pa,
        };
        let over_pressure = settings.pressure.fitted && pressure_pa > limits.pressure_pa;
        let over_force = settings.force.fitted && now.force_n > limits.force_n;
        let over_speed = has_stroke && speed_m_per_s.abs() > limits.speed_m_per_s;
        let over_stroke = has_stroke && out_of_stroke;
        let counting = self.over_pressure.0 | self.over_force.0 | self.over_stroke.0 | self.over_speed.0;
        // Most ticks have nothing to count and nothing to restart.
        if !(over_pressure | over_force | over_stroke | over_speed) && counting == 0 {
            return;
        }
        let rows = [
            (&mut self.over_pressure, over_pressure, Fault::OverPressure, pressure_pa, limits.pressure_pa),
            (&mut self.over_force, over_force, Fault::OverForce, now.force_n, limits.force_n),
            (&mut self.over_stroke, over_stroke, Fault::OverStroke, stroke, stroke_limit),
            (&mut self.over_speed, over_speed, Fault::OverSpeed, speed_m_per_s, limits.speed_m_per_s),
        ];
        for (row, over, fault, value, limit) in rows {
            if row.count(over, debounce) {
                report(Finding { fault, sensor: None, value, limit });
            }
        }
    }

    /// Both pressure sensors of a muscle say the same. A second one that does not say anything, or is not a number, disagrees.
    fn check_second(
        &mut self,
        pressure_pa: f32,
        second_pa: Option<f32>,
        settings: &Settings,
        report: &mut dyn FnMut(Finding),
    ) {
        let watch = &settings.watch;
        let limit = watch.second_pressure_pa;
        if !(limit > 0.0) {
            self.second = InARow::default();
            return;
        }
        let miss = second_pa.map_or(f32::INFINITY, |second_pa| (second_pa - pressure_pa).abs());
        let apart = settings.pressure.fitted && !(miss <= limit);
        if self.second.count(apart, watch.follow_ticks) {
            let (fault, sensor) = (Fault::PressureSensorsDisagree, Some(Sensor::Pressure));
            report(Finding { fault, sensor, value: miss, limit });
        }
    }

    fn check_pressure(
        &mut self,
        pressure: f32,
        expected: f32,
        settings: &Settings,
        report: &mut dyn FnMut(Finding),
    ) {
        let (watch, fitted) = (&settings.watch, settings.pressure.fitted);
        let gap = pressure - expected;
        // The gas of a vented muscle that is stretched by hand is compressed for a moment: it gets as long to leave as after the command.
        // Half of the limit, so that noise about the limit gives no new time.
        if pressure <= 0.5 * watch.vented_pa {
            self.vented_ticks = 0;
        }
        let late = self.vented_ticks > watch.vent_ticks;
        let stands = fitted && late && pressure > watch.vented_pa;
        let (over, under) = (fitted && gap > watch.follow_pa, fitted && gap < -watch.follow_pa);
        if !(stands | over | under) && self.not_vented.0 | self.high.0 | self.low.0 == 0 {
            return;
        }
        let (above, below) = (expected + watch.follow_pa, expected - watch.follow_pa);
        let (follow, debounce) = (watch.follow_ticks, watch.debounce_ticks);
        let rows = [
            (&mut self.not_vented, stands, debounce, Fault::NotVented, watch.vented_pa),
            (&mut self.high, over, follow, Fault::PressureNotFalling, above),
            (&mut self.low, under, follow, Fault::PressureNotRising, below),
        ];
        for (row, bad, enough, fault, limit) in rows {
            if row.count(bad, enough) {
                report(Finding { fault, sensor: None, value: pressure, limit });
            }
        }
    }
}

#[cfg(test)]
mod tests;
