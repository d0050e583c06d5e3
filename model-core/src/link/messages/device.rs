//! What a device is and does.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{Fault, Mode, State, TableHealth, TableInfo};
use crate::fields::{codes, fields};

/// Identity and limits of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DeviceInfo {
    /// Ticks of the control loop in a second.
    pub ticks_per_s: u32,
    /// Muscles that the board can drive.
    pub muscles: u8,
    /// Longest table image, bytes.
    pub table_capacity: u32,
    /// Values that a trace holds.
    pub trace_capacity: u32,
    /// Points that a reference table holds.
    pub reference_capacity: u32,
    /// Tables in use.
    pub tables: [Option<TableInfo>; 2],
    /// Why the device last started.
    pub started_by: StartedBy,
}

fields!(DeviceInfo {
    ticks_per_s,
    muscles,
    table_capacity,
    trace_capacity,
    reference_capacity,
    tables,
    started_by
});

codes! {
    /// Why a device started.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum StartedBy {
        /// Power came on.
        #[default]
        Power,
        /// The host or a user asked.
        Request,
        /// The watchdog.
        Watchdog,
        /// The supply sagged.
        BrownOut,
    }
}

/// What a device is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// State of safety.
    pub state: State,
    /// What the controller controls.
    pub mode: Mode,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// Device time, µs.
    pub time_us: u64,
    /// Ticks of the control loop since the start.
    pub ticks: u64,
    /// Ticks that came too late.
    pub overruns: u32,
    /// Whole frames received.
    pub frames_good: u32,
    /// Frames refused.
    pub frames_bad: u32,
    /// Telemetry that found no room.
    pub telemetry_dropped: u32,
    /// Demanded forces that the table could not give, and were limited.
    pub saturated_ticks: u32,
    /// Times that received bytes were lost: the receiver was not read in time, or the line was disturbed.
    pub line_errors: u32,
    /// Times that the CAN controller was off the bus after too many errors (bus-off), and came back on its own.
    pub bus_offs: u32,
    /// Whether the tables still describe their muscles.
    pub tables: [TableHealth; 2],
}

fields!(Status {
    state,
    mode,
    fault,
    time_us,
    ticks,
    overruns,
    frames_good,
    frames_bad,
    telemetry_dropped,
    saturated_ticks,
    line_errors,
    bus_offs,
    tables
});
