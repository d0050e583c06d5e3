//! Settings of a controller: everything a user may choose, in one message that the store keeps.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::fields::{codes, fields};

mod can;
mod valves;

pub use can::CanLine;
pub use valves::ValvePair;

codes! {
    /// Where the pressure for a demanded force comes from before any trim.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum FeedForward {
        /// The inverse of the muscle's table.
        #[default]
        Table,
        /// The ideal braid alone, `P = F · 4πN² / (3L² − B²)`: no bladder, no deadband, no friction.
        Gaylord,
        /// None: feedback does everything.
        Off,
    }
}

codes! {
    /// What a fault does to the regulator. Either way the fault is latched and the state is `Fault`.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Reaction {
        /// Command zero pressure immediately.
        #[default]
        Vent,
        /// Keep the last command, for loads that must not fall; over-pressure never allows it.
        Hold,
    }
}

/// Trim of force on a load cell, added to the feed-forward pressure:
/// `trim = K_p e + K_i ∫ e dt`, `e = F_wanted − F_measured`, the integral stopped where the command saturates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ForceLoop {
    /// Proportional gain, Pa/N.
    pub proportional_pa_per_n: f32,
    /// Integral gain, Pa/(N·s).
    pub integral_pa_per_n_s: f32,
    /// Largest trim to either side, Pa; zero switches the trim off.
    pub trim_limit_pa: f32,
}

fields!(ForceLoop { proportional_pa_per_n, integral_pa_per_n_s, trim_limit_pa });

/// Stroke loop around the force feed-forward:
/// `F = F_load + K_p e + K_i ∫ e dt − K_d v`, `e = x_wanted − x`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct StrokeLoop {
    /// Proportional gain, N/m.
    pub proportional_n_per_m: f32,
    /// Integral gain, N/(m·s).
    pub integral_n_per_m_s: f32,
    /// Damping, N·s/m.
    pub damping_n_s_per_m: f32,
    /// Load that the muscle is known to carry, N.
    pub load_n: f32,
    /// Stiffness of the load, N/m: force grows by it with the demanded stroke.
    pub load_stiffness_n_per_m: f32,
    /// Largest force that the loop may demand, N.
    pub force_limit_n: f32,
}

fields!(StrokeLoop {
    proportional_n_per_m,
    integral_n_per_m_s,
    damping_n_s_per_m,
    load_n,
    load_stiffness_n_per_m,
    force_limit_n
});

/// Two muscles on one pulley: strokes are `x_rest ± r θ`, the torque is `r (F_agonist − F_antagonist)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Joint {
    /// Radius of the pulley, m.
    pub radius_m: f32,
    /// Stroke of both muscles at angle zero, m.
    pub rest_stroke_m: f32,
    /// Proportional gain, N·m/rad.
    pub proportional_nm_per_rad: f32,
    /// Integral gain, N·m/(rad·s).
    pub integral_nm_per_rad_s: f32,
    /// Damping, N·m·s/rad.
    pub damping_nm_s_per_rad: f32,
    /// Largest torque that the loop may demand, N·m.
    pub torque_limit_nm: f32,
}

fields!(Joint {
    radius_m,
    rest_stroke_m,
    proportional_nm_per_rad,
    integral_nm_per_rad_s,
    damping_nm_s_per_rad,
    torque_limit_nm
});

/// Model of the pressure regulator, found by the host: `gain · (command + offset)` behind a first-order lag, a rate limit
/// and a deadband. The controller inverts the parts that can be inverted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Regulator {
    /// Pressure reached for each pascal commanded.
    pub gain: f32,
    /// Added to the command before the gain, Pa.
    pub offset_pa: f32,
    /// Time constant of the lag, s.
    pub lag_s: f32,
    /// Time in which the line fills the muscle at its rest length, s; it takes longer as the muscle widens.
    pub line_s: f32,
    /// Largest rate of pressure, Pa/s.
    pub rate_pa_per_s: f32,
    /// Half width of the band within which the regulator does not answer, Pa.
    pub deadband_pa: f32,
    /// Largest command, Pa.
    pub command_max_pa: f32,
    /// How much of lag and line is inverted by lead: 1 all, 0 none, nor is anything added for what the pressure lacks.
    pub lead: f32,
}

fields!(Regulator { gain, offset_pa, lag_s, line_s, rate_pa_per_s, deadband_pa, command_max_pa, lead });

/// Limits of operation; crossing one is a fault.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Limits {
    /// Largest measured pressure, Pa.
    pub pressure_pa: f32,
    /// Least stroke, m (negative: stretched beyond rest).
    pub stroke_min_m: f32,
    /// Largest stroke, m.
    pub stroke_max_m: f32,
    /// Largest speed of stroke, m/s.
    pub speed_m_per_s: f32,
    /// Largest measured force, N.
    pub force_n: f32,
    /// Fastest change of the demanded pressure, Pa/s.
    pub slew_pa_per_s: f32,
}

fields!(Limits { pressure_pa, stroke_min_m, stroke_max_m, speed_m_per_s, force_n, slew_pa_per_s });

/// How one sensor is watched, in its own unit (Pa, m or N).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorWatch {
    /// Whether the sensor is there at all.
    pub fitted: bool,
    /// Readings below are impossible: a broken wire or a short.
    pub low: f32,
    /// Readings above are impossible.
    pub high: f32,
    /// Largest credible change from one tick to the next.
    pub jump: f32,
    /// Ticks of bit-equal readings, while the command moves, after which the sensor counts as stuck; 0 never.
    pub stuck_ticks: u16,
}

fields!(SensorWatch { fitted, low, high, jump, stuck_ticks });

/// How a sensor's signal becomes a reading: `reading = at_zero + per_unit · signal`, then a first-order low-pass filter for the
/// control laws. Watches judge readings before the filter, so that it delays none of them. A signal is what the board measures: volts
/// at the pin on a board with converters; on an emulated board the sensor's own value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorScale {
    /// Reading at a signal of zero, in the sensor's unit (Pa, m or N).
    pub at_zero: f32,
    /// Change of the reading with the signal, in the sensor's unit per unit of the signal; negative for a sensor that falls.
    pub per_unit: f32,
    /// Time constant of the filter, s; zero for none.
    pub filter_s: f32,
}

impl SensorScale {
    /// The signal is the reading.
    pub const SAME: Self = Self { at_zero: 0.0, per_unit: 1.0, filter_s: 0.0 };

    /// The reading of a signal, before the filter.
    #[inline]
    #[must_use]
    pub fn reading(&self, signal: f32) -> f32 {
        self.at_zero + self.per_unit * signal
    }
}

fields!(SensorScale { at_zero, per_unit, filter_s });

/// Scales of all sensors. Both muscles of a pair have the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Scales {
    /// Pressure at the muscle, Pa.
    pub pressure: SensorScale,
    /// Stroke, m.
    pub stroke: SensorScale,
    /// Load cell, N.
    pub force: SensorScale,
    /// Second pressure sensor at the same muscle, Pa; its filter is not used.
    pub second_pressure: SensorScale,
    /// Pressure of the supply air, Pa; its filter is not used.
    pub supply: SensorScale,
}

fields!(Scales { pressure, stroke, force, second_pressure, supply });

/// Signal to the pressure regulator, as a part of the range of the board's output: `low` at no pressure, 1 at `full_pa`. An output of
/// 0–10 V has a low of 0, one of 4–20 mA a low of 0.2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct CommandOutput {
    /// Part of the range at no pressure.
    pub low: f32,
    /// Pressure of the regulator at the end of the range, Pa.
    pub full_pa: f32,
}

impl CommandOutput {
    /// Part of the output's range for a pressure, 0 to 1; a pressure that is not a number gives `low`.
    #[inline]
    #[must_use]
    pub fn part(&self, pressure_pa: f32) -> f32 {
        let wanted = pressure_pa / self.full_pa;
        let part = if wanted > 0.0 { wanted } else { 0.0 };
        self.low + (1.0 - self.low) * if part > 1.0 { 1.0 } else { part }
    }
}

fields!(CommandOutput { low, full_pa });

/// The remaining watches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Watch {
    /// Readings out of range in a row before the fault, ticks.
    pub debounce_ticks: u16,
    /// Jumps within 256 ticks before a sensor counts as noisy.
    pub noisy_jumps: u16,
    /// Largest difference of measured and modelled force, N; 0 switches the comparison off.
    pub disagree_n: f32,
    /// How long force may disagree, ticks.
    pub disagree_ticks: u16,
    /// Largest difference between measured pressure and the regulator's model, Pa.
    pub follow_pa: f32,
    /// How long pressure may stay away, ticks.
    pub follow_ticks: u16,
    /// How long a streamed setpoint stays good, ticks; 0 without end. References of the device are not setpoints.
    pub silence_ticks: u32,
    /// How long a running mode continues without a keep-alive request of the session that owns it, ticks; above zero.
    pub host_silence_ticks: u32,
    /// Whether a running mode may continue without a host without end. Off unless a user sets it.
    pub autonomous: bool,
    /// Ticks missed in a row before the fault.
    pub overrun_ticks: u16,
    /// Longest time that a fault may hold the last command before it is vented, ticks.
    pub hold_ticks: u32,
    /// Largest pressure of a muscle that counts as vented, Pa; above the error of the sensor's zero.
    pub vented_pa: f32,
    /// How long a muscle may take to be vented, ticks.
    pub vent_ticks: u32,
    /// Pressure of the test of regulator and dump valve before arming, Pa; zero for none. Best below the muscle's deadband.
    pub valve_test_pa: f32,
    /// How long the device stays armed without a keep-alive request of the session that armed it, ticks; then it is disarmed.
    pub armed_silence_ticks: u32,
    /// Largest difference between the two pressure sensors of a muscle, Pa; zero where there is only one.
    pub second_pressure_pa: f32,
    /// Least pressure of the supply air from arming on, Pa; zero where it is not measured.
    pub supply_low_pa: f32,
    /// Whether the enable input must be closed; open, it is a fault. An emergency stop interrupts its circuit.
    pub enable_input: bool,
}

fields!(Watch {
    debounce_ticks,
    noisy_jumps,
    disagree_n,
    disagree_ticks,
    follow_pa,
    follow_ticks,
    silence_ticks,
    host_silence_ticks,
    autonomous,
    overrun_ticks,
    hold_ticks,
    vented_pa,
    vent_ticks,
    valve_test_pa,
    armed_silence_ticks,
    second_pressure_pa,
    supply_low_pa,
    enable_input
});

/// Everything a user may choose. One for the device; both muscles of a pair share it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Settings {
    /// Source of the feed-forward pressure.
    pub feed_forward: FeedForward,
    /// Trim of force.
    pub force_loop: ForceLoop,
    /// Stroke loop.
    pub stroke_loop: StrokeLoop,
    /// The joint of an antagonist pair.
    pub joint: Joint,
    /// The pressure regulator.
    pub regulator: Regulator,
    /// Limits of operation.
    pub limits: Limits,
    /// Watch of the pressure sensor, Pa.
    pub pressure: SensorWatch,
    /// Watch of the stroke sensor, m.
    pub stroke: SensorWatch,
    /// Watch of the load cell, N.
    pub force: SensorWatch,
    /// Remaining watches.
    pub watch: Watch,
    /// Bit n set: the fault of code n holds the last command instead of venting.
    pub hold_on: u32,
    /// Half a second's band of stroke within which a reversal is noise, m.
    pub motion_band_m: f32,
    /// Band of pressure within which a reversal at held length is noise, Pa.
    pub pressure_band_pa: f32,
    /// Scales, filters and calibration of the sensors.
    pub scales: Scales,
    /// Signal to the pressure regulator.
    pub command: CommandOutput,
    /// A pair of on/off valves in place of the regulator.
    pub valves: ValvePair,
    /// The line to a CAN bus.
    pub can: CanLine,
}

fields!(Settings {
    feed_forward,
    force_loop,
    stroke_loop,
    joint,
    regulator,
    limits,
    pressure,
    stroke,
    force,
    watch,
    hold_on,
    motion_band_m,
    pressure_band_pa,
    scales,
    command,
    valves,
    can
});

impl Settings {
    /// Sensible for the muscles of the thesis on a 0–10 bar regulator.
    pub const DEFAULT: Self = Self {
        feed_forward: FeedForward::Table,
        force_loop: ForceLoop { proportional_pa_per_n: 0.0, integral_pa_per_n_s: 0.0, trim_limit_pa: 0.0 },
        stroke_loop: StrokeLoop {
            proportional_n_per_m: 5_000.0,
            integral_n_per_m_s: 20_000.0,
            damping_n_s_per_m: 50.0,
            load_n: 0.0,
            load_stiffness_n_per_m: 0.0,
            force_limit_n: 2_000.0,
        },
        joint: Joint {
            radius_m: 0.02,
            rest_stroke_m: 0.002,
            proportional_nm_per_rad: 12.0,
            integral_nm_per_rad_s: 400.0,
            damping_nm_s_per_rad: 0.2,
            torque_limit_nm: 20.0,
        },
        regulator: Regulator {
            gain: 1.0,
            offset_pa: 0.0,
            lag_s: 0.03,
            line_s: 0.0,
            rate_pa_per_s: 20e6,
            deadband_pa: 0.0,
            command_max_pa: 650e3,
            lead: 1.0,
        },
        limits: Limits {
            pressure_pa: 700e3,
            stroke_min_m: -0.01,
            stroke_max_m: 0.08,
            speed_m_per_s: 2.0,
            force_n: 3_000.0,
            slew_pa_per_s: 20e6,
        },
        pressure: SensorWatch { fitted: true, low: -50e3, high: 1_000e3, jump: 150e3, stuck_ticks: 200 },
        stroke: SensorWatch { fitted: true, low: -0.02, high: 0.2, jump: 0.01, stuck_ticks: 0 },
        force: SensorWatch { fitted: true, low: -500.0, high: 4_000.0, jump: 800.0, stuck_ticks: 200 },
        watch: Watch {
            debounce_ticks: 2,
            noisy_jumps: 8,
            disagree_n: 0.0,
            disagree_ticks: 200,
            follow_pa: 150e3,
            follow_ticks: 200,
            silence_ticks: 0,
            host_silence_ticks: 1_000,
            autonomous: false,
            overrun_ticks: 5,
            hold_ticks: 10_000,
            // Twice the error of a sensor of 1 % and 10 bar.
            vented_pa: 20e3,
            // From 7 bar to 20 kPa are 3.6 time constants: enough for a line of half a second.
            vent_ticks: 2_000,
            valve_test_pa: 0.0,
            // Time to look at the muscle between arming and starting; nothing is under pressure meanwhile.
            armed_silence_ticks: 60_000,
            second_pressure_pa: 0.0,
            supply_low_pa: 0.0,
            enable_input: false,
        },
        hold_on: 0,
        motion_band_m: 20e-6,
        pressure_band_pa: 2e3,
        scales: Scales {
            pressure: SensorScale::SAME,
            stroke: SensorScale::SAME,
            force: SensorScale::SAME,
            second_pressure: SensorScale::SAME,
            supply: SensorScale::SAME,
        },
        command: CommandOutput { low: 0.0, full_pa: 2e6 },
        valves: ValvePair::NONE,
        can: CanLine::OFF,
    };
}

impl Default for Settings {
    /// The settings that suit the muscles of the thesis: [`Settings::DEFAULT`].
    #[inline(never)]
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests;
