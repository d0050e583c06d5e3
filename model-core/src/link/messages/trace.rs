//! A record of the loop's variables.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::fields::{codes, fields};

/// Variables that one trace records.
pub const TRACE_VARIABLES: usize = 16;

/// Values in one [`TracePiece`].
pub const TRACE_PIECE: usize = 64;

codes! {
    /// Variables of the loop that a trace can record.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Variable {
        /// Measured pressure, Pa.
        #[default]
        Pressure,
        /// Measured stroke, m.
        Stroke,
        /// Measured force, N.
        Force,
        /// Speed of stroke, m/s.
        Speed,
        /// Direction of friction, −1 to 1.
        Direction,
        /// First value requested.
        Setpoint,
        /// Demanded force, N.
        ForceDemand,
        /// Feed-forward pressure, Pa.
        FeedForward,
        /// Trim, Pa.
        Trim,
        /// Demanded pressure after its limits, Pa.
        PressureDemand,
        /// Command to the regulator, Pa.
        Command,
        /// Pressure of the regulator's model, Pa.
        ModelPressure,
        /// Force by the table, N.
        ModelForce,
        /// State of safety as a number.
        State,
        /// Time that the step took, µs.
        StepTime,
        /// Measured pressure of the second muscle, Pa.
        SecondPressure,
        /// Measured stroke of the second muscle, m.
        SecondStroke,
        /// Measured force of the second muscle, N.
        SecondForce,
        /// Command to the second regulator, Pa.
        SecondCommand,
    }
}

codes! {
    /// When a trace begins.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Trigger {
        /// Immediately, with the next tick.
        #[default]
        Now,
        /// With the next start of a mode or reference.
        Start,
        /// It runs round and round and stops with a fault, so that it shows what led there.
        UntilFault,
    }
}

/// Arms a trace; what an earlier one recorded is forgotten.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TraceArm {
    /// What to record.
    pub variables: Vec<Variable, TRACE_VARIABLES>,
    /// One record every n ticks, at least 1.
    pub every_ticks: u16,
    /// When the recording begins.
    pub trigger: Trigger,
}

fields!(TraceArm { variables, every_ticks, trigger });

/// A trace as it stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TraceInfo {
    /// Whether it has ended and can be read.
    pub complete: bool,
    /// Records in it.
    pub records: u32,
    /// Tick of the first record.
    pub first_tick: u64,
    /// Ticks between records.
    pub every_ticks: u16,
    /// The variables of each record, in order.
    pub variables: Vec<Variable, TRACE_VARIABLES>,
}

fields!(TraceInfo { complete, records, first_tick, every_ticks, variables });

/// Requests values of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TraceRead {
    /// Record to begin with.
    pub record: u32,
}

fields!(TraceRead { record });

/// Values of whole records, one record after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct TracePiece {
    /// The values.
    pub values: Vec<f32, TRACE_PIECE>,
}

fields!(TracePiece { values });
