//! Why a device says no.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{Fault, Mode, Side, State};

/// Why a device refuses a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// The number is no endpoint of this schema.
    UnknownEndpoint,
    /// The body is not the endpoint's request.
    Malformed,
    /// Not in this state.
    WrongState(State),
    /// A fault is latched; clear it first.
    Latched(Fault),
    /// The condition of this fault still holds.
    StillFaulty(Fault),
    /// The muscle has no table.
    NoTable(Side),
    /// The set-point or reference does not belong to the running mode.
    WrongMode(Mode),
    /// A value is not finite or out of range.
    Value(Field),
    /// The table is refused.
    Table(TableFault),
    /// The store failed.
    Store(StoreFault),
    /// The answer does not fit, or asks beyond the end.
    Range,
    /// This board cannot do that.
    NotSupported,
    /// A joint at this angle has no such stiffness with both muscles taut and neither above its highest pressure.
    Stiffness {
        /// The least that it has, N·m/rad.
        low_nm_per_rad: f32,
        /// The greatest, N·m/rad.
        high_nm_per_rad: f32,
    },
    /// At this angle no pressures keep both muscles of a joint taut.
    Angle {
        /// The least angle at which some do, rad.
        low_rad: f32,
        /// The greatest, rad.
        high_rad: f32,
    },
}

/// The setting or value that a refusal is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Field {
    /// A set-point.
    SetPoint,
    /// A reference generator's parameter.
    Reference,
    /// Force loop.
    ForceLoop,
    /// Stroke loop.
    StrokeLoop,
    /// Joint.
    Joint,
    /// Regulator.
    Regulator,
    /// Limits.
    Limits,
    /// A sensor's watch.
    SensorWatch,
    /// Remaining watches.
    Watch,
    /// Bands of motion.
    Bands,
    /// Telemetry or trace.
    Rate,
}

/// Why a table is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum TableFault {
    /// Pieces came without a beginning.
    NotBegun,
    /// A piece does not follow the one before; this many bytes are there.
    Gap(u32),
    /// Longer than the device can keep; this many bytes fit.
    TooLong(u32),
    /// Bytes are missing; this many are there.
    Incomplete(u32),
    /// The check sum of the whole differs.
    Check,
    /// Another version of the format.
    Version {
        /// Version of the table.
        found: u16,
        /// Version that the device reads.
        known: u16,
    },
    /// The bytes are no table.
    Malformed,
    /// A number is not finite.
    NotFinite,
    /// Pressures are not in rising order.
    NotOrdered,
    /// A number is out of its range.
    OutOfRange,
    /// It carries an effect that this firmware does not know.
    UnknownEffect,
}

/// Why the store failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StoreFault {
    /// Reading or writing failed.
    Medium,
    /// No room.
    Full,
    /// There is nothing to go back to.
    NoPrevious,
    /// The bytes read back are not those written.
    Verify,
}
