//! One muscle at work: its table, its readings, its loops and its regulator.

use model_core::link::messages::{Fault, Sensor, SideSample};
use model_core::link::settings::Settings;
use model_core::motion::MotionTracker;
use model_core::scalar::Scalar;

use super::motion_settings;
use super::standing::Standing;
use crate::board::{Command, Hardware, Readings};
use crate::health::{Health, Sample};
use crate::modes::{Integral, Model, Seat};
use crate::regulator::{Air, Bounds, Law, RegulatorState};
use crate::signals::{Filters, Speed, Sums};
use crate::valves::{PairOfValves, Valves, Volume};
use crate::watch::{Finding, Seen, SideWatch};

/// Ticks after a reading that was false in which none is remembered: as many as a fault may wait for the next good one.
const DOUBT_TICKS: u8 = 20;

/// One muscle at work.
#[derive(Debug)]
pub(super) struct Actuator {
    pub(super) model: Seat,
    pub(super) motion: MotionTracker<f32>,
    /// Speed of the stroke before its filter.
    pub(super) unfiltered: Speed,
    /// Ticks for which no reading is remembered after one that was false.
    pub(super) doubt: u8,
    pub(super) watch: SideWatch,
    pub(super) regulator: RegulatorState,
    /// The valves in place of a regulator.
    pub(super) valves: PairOfValves,
    /// What may be demanded of the regulator and commanded, by settings, board and table.
    pub(super) bounds: Bounds,
    pub(super) trim: Integral,
    pub(super) stroke_loop: Integral,
    pub(super) guess_pa: f32,
    /// Sign of what the limits took from the last demand.
    pub(super) saturation: f32,
    /// Readings of this tick before the filters, which the watches judge.
    pub(super) readings: Option<Readings>,
    /// The same of the second pressure sensor, Pa.
    pub(super) second_pa: Option<f32>,
    pub(super) filters: Filters,
    pub(super) sums: Sums,
    pub(super) sample: SideSample,
    pub(super) command: Command,
    pub(super) force_demand_n: f32,
    pub(super) forward_pa: f32,
    pub(super) trim_pa: f32,
    /// Force by the table at this tick's readings, N; none without a table or without readings that are numbers.
    pub(super) model_n: Option<f32>,
    /// The load cell against the table.
    pub(super) health: Health,
    /// Where the stroke has stood still.
    pub(super) standing: Standing,
}

impl Actuator {
    #[inline(always)]
    pub(super) fn new(settings: &Settings, model: Seat, bounds: Bounds) -> Self {
        Self {
            model,
            motion: MotionTracker::new(motion_settings(settings)),
            unfiltered: Speed::default(),
            doubt: 0,
            watch: SideWatch::default(),
            regulator: RegulatorState::default(),
            valves: PairOfValves::default(),
            bounds,
            trim: Integral::default(),
            stroke_loop: Integral::default(),
            guess_pa: 0.0,
            saturation: 0.0,
            readings: None,
            second_pa: None,
            filters: Filters::new(&settings.scales),
            sums: Sums::default(),
            sample: SideSample::default(),
            command: Command::VENT,
            force_demand_n: 0.0,
            forward_pa: 0.0,
            trim_pa: 0.0,
            model_n: None,
            health: Health::default(),
            standing: Standing::default(),
        }
    }

    /// What the watches look at.
    #[inline(always)]
    pub(super) fn seen(&self, most_above_n: f32, settings: &Settings) -> Seen {
        let filters = settings.scales.stroke.filter_s > 0.0;
        Seen {
            readings: self.readings,
            second_pa: self.second_pa,
            speed_m_per_s: if filters { self.unfiltered.speed() } else { self.motion.motion().speed },
            command: self.command,
            expected_pa: self.regulator.model_pa(),
            model_n: self.model_n,
            most_above_n,
        }
    }

    /// Whether what is read may be remembered: it is within the ranges of its sensors, and has not jumped within the longest glitch.
    pub(super) fn trusts(&mut self, now: &Readings, settings: &Settings) -> bool {
        if !self.watch.may_be(now, settings) {
            self.doubt = DOUBT_TICKS;
            return false;
        }
        self.doubt = self.doubt.saturating_sub(1);
        self.doubt == 0
    }

    /// Lets the air out, and nothing of what was demanded stays.
    #[inline]
    pub(super) fn vent(&mut self, law: &Law) {
        // A muscle that has been empty since the last tick, as one that is not there.
        if self.model_n.is_none() && self.command.vent && self.regulator.is_empty(law) {
            return;
        }
        self.empty(law);
    }

    #[inline(never)]
    fn empty(&mut self, law: &Law) {
        let air = self.air();
        self.regulator.vent(&air, law);
        self.command = Command::VENT;
        self.sample.pressure_demand_pa = 0.0;
    }

    /// What the valves do with this tick's command, where they are fitted in place of a regulator.
    #[inline(always)]
    pub(super) fn pulse(&mut self, settings: &Settings) -> Valves {
        if settings.valves.is_fitted() { self.step_valves(settings) } else { Valves::Absent }
    }

    #[inline(never)]
    fn step_valves(&mut self, settings: &Settings) -> Valves {
        // Without a reading in this tick nothing is known of the pressure.
        let measured_pa = if self.readings.is_some() { self.sample.pressure_pa } else { f32::NAN };
        let air = self.air();
        let volume = match (self.present(), settings.stroke.fitted) {
            (Some(_), _) => Volume::Known,
            (None, true) => Volume::Still(self.sample.stroke_m),
            (None, false) => Volume::Still(f32::NAN),
        };
        self.valves.step(&self.command, measured_pa, &air, volume, settings)
    }

    /// The pair of valves fills, and the reading of the pressure does not answer.
    #[inline(always)]
    pub(super) fn unanswered(&self) -> Option<Finding> {
        let unseen_pa = self.valves.unanswered_pa()?;
        let value = self.sample.pressure_pa;
        Some(Finding {
            fault: Fault::PressureNotRising,
            sensor: Some(Sensor::Pressure),
            value,
            limit: value + unseen_pa,
        })
    }

    /// Limits by settings, board and table, of which one has changed.
    pub(super) fn bound(&mut self, settings: &Settings, hardware: &Hardware, law: &Law) {
        let most = self.model.as_ref().map_or(f32::MAX, |model| model.muscle.max_pressure().pascals());
        let high_pa = most.at_most(settings.limits.pressure_pa).at_most(hardware.command_ceiling_pa);
        self.bounds = law.bounds(high_pa);
    }

    /// One tick of the comparison of load cell and table, which counts while the muscle is controlled and has a load cell.
    pub(super) fn compare(&mut self, counts: bool) {
        if !self.health.tick() {
            return;
        }
        let (Some(model_n), true) = (self.model_n, counts) else { return self.health.interrupt() };
        let Some(model) = self.model.as_ref() else { return self.health.interrupt() };
        let SideSample { pressure_pa, stroke_m, force_n, .. } = self.sample;
        if !self.health.scales().covers(pressure_pa, stroke_m, model_n) {
            return self.health.interrupt();
        }
        let (by_pressure, by_stroke) = model.slopes(pressure_pa);
        let direction = model.direction();
        self.health.sample(&Sample {
            measured_n: force_n,
            model_n,
            pressure_pa,
            by_pressure,
            by_stroke,
            direction,
        });
    }

    /// The air in the muscle, as far as a table gives it.
    pub(super) fn air(&self) -> Air {
        self.present().map_or_else(Air::default, |model| model.air(self.motion.motion().speed))
    }

    /// The table, if it has been brought to this tick.
    pub(super) fn present(&self) -> Option<&Model> {
        if self.model_n.is_some() { self.model.as_ref() } else { None }
    }
}
