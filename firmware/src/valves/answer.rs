//! Whether the reading of the pressure answers what the valves let in.
//!
//! The loop of a pair is closed over the pressure sensor: one that is frozen a little below the command would have the muscle filled up to
//! the pressure of the supply. What the fill valve has let in since the reading last rose is therefore counted:
//!
//! ```text
//! n  =  Σ (filled − 2 · vented − 1.5 · widened)  −  leak · t            never below zero
//! ```
//! It begins again at zero where the reading has risen by an eighth of it, and by more than noise. Beyond half of `watch.follow_pa` for as long
//! as the reading may lag, no sensor answers: it is blocked, or the air does not arrive.
//!
//! The factors are as far as the numbers of a user may be wrong. Rates that are measured differ by less than two; without a table, the muscle
//! has up to four times the volume that is counted on. Without a table a muscle that moves takes an unknown amount of air, so that only one
//! at rest is judged. Close to the pressure of the supply there is nothing left to be exceeded.

use model_core::link::settings::Settings;
use model_core::scalar::Scalar;

use crate::tick::TICK_S;

/// Part of what has been let in by which the reading rises at least.
const ANSWER: f32 = 0.125;
/// A rise that is more than the noise of a sensor, Pa.
const NOISE_PA: f32 = 5e3;
/// How much more vents and a widening muscle count than the valves' rates say.
const VENTED: f32 = 2.0;
const WIDENED: f32 = 1.5;
/// Part of `watch.follow_pa` that may be let in without an answer, and the least such pressure: more than noise hides.
const SHARE: f32 = 0.5;
const LEAST_PA: f32 = 50e3;
/// The most that a leak may take, as a part of `watch.follow_pa` in a second; and as a part of the rate that the loop orders at the end of the
/// band in which it rests. Where more leaks, the leak is a fault.
const LEAK_PER_S: f32 = 0.1;
const LEAK_OF_BAND: f32 = 0.5;
/// Bands of a still stroke that a muscle without a table may move by.
const STILL_BANDS: f32 = 2.0;

/// How the volume of a muscle is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Volume {
    /// By a table.
    Known,
    /// Only that it stays the same as long as this stroke does, m; one that is not a number says nothing.
    Still(f32),
}

/// What a pulse does, Pa of a muscle that stays as it is: filled, or negative where it vents.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pulse {
    /// What the valve lets in or out.
    pub through_pa: f32,
    /// What the muscle takes by its own widening in the same time.
    pub widened_pa: f32,
}

/// What the valves have let in and no reading has shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    unseen_pa: f32,
    /// Lowest reading and the stroke since it began.
    lowest_pa: f32,
    stroke_m: f32,
    /// Periods in a row in which it has been too much.
    periods: u16,
    missing: bool,
}

impl Answer {
    /// What the valves have let in without an answer, Pa, once it is too much.
    #[inline(always)]
    pub fn missing_pa(&self) -> Option<f32> {
        if self.missing { Some(self.unseen_pa) } else { None }
    }

    /// One period: the reading at its beginning, and what the pulse of the one before has done.
    pub fn judge(&mut self, measured_pa: f32, volume: Volume, before: Pulse, settings: &Settings) {
        let (valves, watch) = (&settings.valves, &settings.watch);
        let (lag_s, length_s) = (settings.regulator.lag_s, f32::from(valves.period_ticks) * TICK_S);
        let through_pa = if before.through_pa < 0.0 { VENTED * before.through_pa } else { before.through_pa };
        let rests_pa = valves.band_pa.at_least(0.5 * valves.fill_pa_per_s * valves.least_s);
        let leak = (LEAK_PER_S * watch.follow_pa).at_most(LEAK_OF_BAND * rests_pa / lag_s);
        self.unseen_pa += through_pa - WIDENED * before.widened_pa.at_least(0.0) - leak * length_s;
        self.lowest_pa = self.lowest_pa.at_most(measured_pa);
        let answers = (ANSWER * self.unseen_pa).at_least(NOISE_PA);
        let still = match volume {
            Volume::Known => true,
            Volume::Still(stroke_m) => {
                (stroke_m - self.stroke_m).abs() <= STILL_BANDS * settings.motion_band_m
            }
        };
        // With positive comparisons: a number that is none begins again, and has a watch of its own.
        let counts = still
            && self.unseen_pa > 0.0
            && measured_pa - self.lowest_pa < answers
            && valves.supply_pa - measured_pa > watch.follow_pa;
        if !counts {
            let stroke_m = if let Volume::Still(stroke_m) = volume { stroke_m } else { 0.0 };
            *self = Self { lowest_pa: measured_pa, stroke_m, ..Self::default() };
            return;
        }
        let bad = self.unseen_pa > (SHARE * watch.follow_pa).at_least(LEAST_PA);
        self.periods = if bad { self.periods.saturating_add(1) } else { 0 };
        self.missing = bad && f32::from(self.periods) * length_s > lag_s;
    }
}
