//! What a device says without a request.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{FaultReport, Mode, Side, State};
use crate::fields::{fields, one_of};

/// Sets the stream of telemetry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TelemetryRate {
    /// One sample every n ticks; 0 stops.
    pub every_ticks: u16,
}

fields!(TelemetryRate { every_ticks });

/// One muscle at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct SideSample {
    /// Measured gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Measured stroke, m.
    pub stroke_m: f32,
    /// Measured force, N.
    pub force_n: f32,
    /// Demanded pressure, Pa: feed-forward and trim.
    pub pressure_demand_pa: f32,
    /// Command to the regulator, Pa.
    pub command_pa: f32,
    /// Force by the table at the measured pressure and stroke, N; 0 without a table.
    pub model_n: f32,
}

fields!(SideSample { pressure_pa, stroke_m, force_n, pressure_demand_pa, command_pa, model_n });

/// One tick as the device saw it. The frame's sequence number counts samples: a gap is a loss on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Device time of the tick, µs.
    pub time_us: u64,
    /// Number of the tick.
    pub tick: u64,
    /// State of safety.
    pub state: State,
    /// What the controller controls.
    pub mode: Mode,
    /// The setpoint, in the unit of the mode.
    pub setpoint: f32,
    /// A pair's second value.
    pub setpoint_second: f32,
    /// The muscles in use.
    pub sides: Vec<SideSample, 2>,
}

fields!(Telemetry { time_us, tick, state, mode, setpoint, setpoint_second, sides });

/// What the board measures on one muscle before any scale: volts at the pins of a board with converters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Signals {
    /// Pressure sensor.
    pub pressure: f32,
    /// Stroke sensor.
    pub stroke: f32,
    /// Load cell.
    pub force: f32,
    /// Second pressure sensor, where the board has an input for it.
    pub second_pressure: Option<f32>,
}

fields!(Signals { pressure, stroke, force, second_pressure });

/// Requests the signals of a muscle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SignalsRead {
    /// The muscle.
    pub side: Side,
}

fields!(SignalsRead { side });

/// Means of all signals of a muscle since they were last read, for calibration; at most 10 s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct MeanSignals {
    /// Ticks with readings in the mean; without any, the rest is zero.
    pub ticks: u16,
    /// Mean of each signal of the muscle's sensors.
    pub mean: Signals,
    /// Mean of the supply air's signal, where the board has an input for it.
    pub supply: Option<f32>,
    /// Whether the enable input was closed in the last tick.
    pub enabled: bool,
}

fields!(MeanSignals { ticks, mean, supply, enabled });

/// Something that happened, reported without a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Event {
    /// A fault stopped the device.
    Fault(FaultReport),
    /// The state changed.
    State(State),
    /// A trace is full.
    TraceFull,
}

one_of!(Event { 0 Fault { 0: report }, 1 State { 0: state }, 2 TraceFull {} });
