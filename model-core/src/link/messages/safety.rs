//! States of safety, faults, and what is reported of them.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{Mode, Side, SideSample};
use crate::fields::{codes, fields};

/// Past faults that are kept.
pub const FAULT_LOG: usize = 8;

codes! {
    /// States of safety. Only a request of a host leads towards `Running`, and no fault is left without one.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum State {
        /// After every start: vented, answers questions.
        #[default]
        Disarmed,
        /// Ready: watches run, still vented.
        Armed,
        /// In control.
        Running,
        /// Stopped by a fault, which stays until it is cleared.
        Fault,
    }
}

codes! {
    /// What went wrong. The number on the wire is the bit in [`Settings::hold_on`](crate::link::settings::Settings::hold_on).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Fault {
        /// A reading is outside what the sensor can give: broken wire, short circuit.
        #[default]
        SensorRange,
        /// A reading does not change although the command moves.
        SensorStuck,
        /// A reading jumps about.
        SensorNoisy,
        /// Readings contradict each other: force from the table and from the load cell.
        SensorsDisagree,
        /// No readings at all: bus or converter silent.
        SensorsSilent,
        /// Pressure stays below what is commanded: burst, leak, no supply.
        PressureNotRising,
        /// Pressure stays above what is commanded: jammed valve, blocked line.
        PressureNotFalling,
        /// More pressure than allowed.
        OverPressure,
        /// Stroke outside its limits.
        OverStroke,
        /// Faster than allowed: the load has come off.
        OverSpeed,
        /// More force than allowed.
        OverForce,
        /// No new setpoint for too long.
        SetPointSilence,
        /// Ticks were missed.
        LoopOverrun,
        /// The mode needs a table and there is none.
        TableMissing,
        /// A table in use is no longer what was checked.
        TableInvalid,
        /// The supply sagged.
        BrownOut,
        /// The watchdog restarted the device.
        Watchdog,
        /// A calculation gave something that is not a number.
        NotANumber,
        /// No keep-alive request of the session that started the mode: its program has ended or its line is cut.
        HostSilence,
        /// The kept settings are damaged, or another firmware wrote them: look at them and send them again.
        SettingsInvalid,
        /// Pressure is in a muscle that has been vented for long enough to be empty.
        NotVented,
        /// A command was held for as long as the settings allow, and was vented.
        HoldEnded,
        /// The crystal's clock failed; the processor runs on its own oscillator.
        ClockFailed,
        /// The test of regulator and dump valve before arming failed.
        ValveTest,
        /// The two pressure sensors of a muscle disagree.
        PressureSensorsDisagree,
        /// The supply air is below the least pressure of the settings.
        SupplyPressureLow,
        /// The enable input is open: an emergency stop, or its wire is broken.
        EnableOpen,
    }
}

impl Fault {
    /// Its number, 0 for the first of [`Fault::ALL`].
    pub const fn code(self) -> u8 {
        self as u8
    }
}

codes! {
    /// Which sensor a fault is about.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Sensor {
        /// Pressure sensor.
        #[default]
        Pressure,
        /// Stroke sensor.
        Stroke,
        /// Load cell.
        Force,
    }
}

/// A fault as it happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct FaultReport {
    /// What went wrong.
    pub fault: Fault,
    /// On which muscle.
    pub side: Side,
    /// On which sensor, where one can be named.
    pub sensor: Option<Sensor>,
    /// State before.
    pub from: State,
    /// Mode before.
    pub mode: Mode,
    /// Device time, µs.
    pub time_us: u64,
    /// The value that was judged, in its SI unit (a count for overruns and silence).
    pub value: f32,
    /// The limit it crossed, in the same unit.
    pub limit: f32,
    /// Last readings of that muscle.
    pub last: SideSample,
}

fields!(FaultReport { fault, side, sensor, from, mode, time_us, value, limit, last });

/// Faults since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Faults {
    /// The one that stopped the device, until it is cleared.
    pub latched: Option<FaultReport>,
    /// How often each happened, in the order of [`Fault::ALL`].
    pub counts: [u16; Fault::ALL.len()],
}

fields!(Faults { latched, counts });

/// Requests one past fault: 0 the last, 1 the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PastFault {
    /// How far back, less than [`FAULT_LOG`].
    pub back: u8,
}

fields!(PastFault { back });
