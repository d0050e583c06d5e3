//! The tick in which there is nothing to report and nothing to count: nearly every one of a muscle under control.
//!
//! A tick counts as calm only if all that [`SideWatch::check`] judges is within its limits by comparisons that a number which is not one
//! fails, and nothing is being counted. Anything else is left to [`SideWatch::check`], with nothing changed here.

use super::{EXCITED_PA, OneSensor, Seen, SideWatch};
use model_core::link::settings::{SensorWatch, Settings};

impl OneSensor {
    #[inline(always)]
    fn is_calm(&self, watch: &SensorWatch, value: f32, command_pa: f32) -> bool {
        let moved = (value - self.last).abs();
        value >= watch.low
            && value <= watch.high
            && moved <= watch.jump
            && (moved > 0.0 || (command_pa - self.command_at_change).abs() <= EXCITED_PA)
    }

    #[inline(always)]
    fn pass(&mut self, value: f32, command_pa: f32) {
        if value != self.last {
            self.command_at_change = command_pa;
        }
        self.last = value;
    }

    fn counts(&self) -> u16 {
        self.out.0 | self.same
    }
}

impl SideWatch {
    /// Whether a row is being counted.
    pub(super) fn counts(&self) -> bool {
        let rows = [
            self.silent,
            self.over_pressure,
            self.over_stroke,
            self.over_speed,
            self.over_force,
            self.disagree,
            self.low,
            self.high,
            self.not_vented,
            self.second,
        ];
        let sensors = self.pressure.counts() | self.stroke.counts() | self.force.counts();
        rows.iter().fold(sensors, |all, row| all | row.0) != 0
    }

    /// Looks at one tick and lets it pass if it is calm. Otherwise nothing is changed, and [`SideWatch::check`] has to look at it.
    #[inline(always)]
    pub(crate) fn pass(&mut self, seen: &Seen, settings: &Settings) -> bool {
        let watch = &settings.watch;
        let Some(now) = &seen.readings else { return false };
        // A vented muscle and a second sensor have rules of their own.
        if !self.quiet || seen.command.vent || watch.second_pressure_pa > 0.0 {
            return false;
        }
        let command_pa = seen.command.pressure_pa;
        let limits = &settings.limits;
        let (has_pressure, has_stroke, has_force) =
            (settings.pressure.fitted, settings.stroke.fitted, settings.force.fitted);
        if has_pressure
            && !(self.pressure.is_calm(&settings.pressure, now.pressure_pa, command_pa)
                && now.pressure_pa <= limits.pressure_pa
                && (now.pressure_pa - seen.expected_pa).abs() <= watch.follow_pa)
        {
            return false;
        }
        if has_stroke
            && !(self.stroke.is_calm(&settings.stroke, now.stroke_m, command_pa)
                && now.stroke_m >= limits.stroke_min_m
                && now.stroke_m <= limits.stroke_max_m
                && seen.speed_m_per_s.abs() <= limits.speed_m_per_s)
        {
            return false;
        }
        if has_force {
            let agrees = match seen.model_n {
                Some(model_n) if watch.disagree_n > 0.0 => (model_n - now.force_n).abs() <= watch.disagree_n,
                Some(model_n) if seen.most_above_n > 0.0 => model_n - now.force_n <= seen.most_above_n,
                _ => true,
            };
            if !(agrees
                && self.force.is_calm(&settings.force, now.force_n, command_pa)
                && now.force_n <= limits.force_n)
            {
                return false;
            }
        }
        self.vented_ticks = 0;
        self.next_tick();
        if has_pressure {
            self.pressure.pass(now.pressure_pa, command_pa);
        }
        if has_stroke {
            self.stroke.pass(now.stroke_m, command_pa);
        }
        if has_force {
            self.force.pass(now.force_n, command_pa);
        }
        true
    }
}
