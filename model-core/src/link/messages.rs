//! The bodies of requests, answers and topics. SI units, named in the fields; closed enums, never text.

mod device;
mod health;
mod refusal;
mod requests;
mod safety;
mod table;
mod telemetry;
mod trace;
mod update;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::fields::codes;

pub use self::device::{DeviceInfo, StartedBy, Status};
pub use self::health::{COLUMNS, HealthRead, HealthSums, LAGGED, SHAPES, SUMS, Shape, TableHealth, WATCHED};
pub use self::refusal::{Field, Refusal, StoreFault, TableFault};
pub use self::requests::{
    REFERENCE_PIECE, Reference, ReferenceOrder, ReferencePoints, Session, SetPoint, SetPointOrder, Start,
};
pub use self::safety::{FAULT_LOG, Fault, FaultReport, Faults, PastFault, Sensor, State};
pub use self::table::{
    Evaluate, Evaluated, ForgetMemory, PIECE, POINTS, Point, RollBack, TableBegin, TableInfo, TablePiece,
    TableRead, Value,
};
pub use self::telemetry::{Event, MeanSignals, SideSample, Signals, SignalsRead, Telemetry, TelemetryRate};
pub use self::trace::{
    TRACE_PIECE, TRACE_VARIABLES, TraceArm, TraceInfo, TracePiece, TraceRead, Trigger, Variable,
};
pub use self::update::{Installed, UpdateBegin, UpdateFault, UpdatePiece, UpdateStatus};

codes! {
    /// Which muscle of the board.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Side {
        /// The first, or the only one.
        #[default]
        Agonist,
        /// The second of a pair.
        Antagonist,
    }
}

impl Side {
    /// 0 or 1.
    pub const fn index(self) -> usize {
        match self {
            Self::Agonist => 0,
            Self::Antagonist => 1,
        }
    }
}

codes! {
    /// What the controller controls.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
    pub enum Mode {
        /// Nothing: zero pressure.
        #[default]
        Vent,
        /// Gauge pressure of one muscle, Pa.
        Pressure,
        /// Force of one muscle, N.
        Force,
        /// Contraction stroke of one muscle, m.
        Stroke,
        /// Angle and stiffness of a joint with two muscles.
        Pair,
    }
}
