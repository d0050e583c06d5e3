//! Why a device says no.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{Fault, Mode, Side, State, UpdateFault};
use crate::fields::one_of;

/// Why a device refuses a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// The number is not an endpoint of this schema.
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
    /// The setpoint or reference does not belong to the running mode.
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
    /// Another session armed the device or started its mode.
    OtherSession,
    /// Another firmware is refused.
    Update(UpdateFault),
}

one_of!(Refusal {
    0 UnknownEndpoint {},
    1 Malformed {},
    2 WrongState { 0: state },
    3 Latched { 0: fault },
    4 StillFaulty { 0: fault },
    5 NoTable { 0: side },
    6 WrongMode { 0: mode },
    7 Value { 0: field },
    8 Table { 0: fault },
    9 Store { 0: fault },
    10 Range {},
    11 NotSupported {},
    12 Stiffness { low_nm_per_rad: low, high_nm_per_rad: high },
    13 Angle { low_rad: low, high_rad: high },
    14 OtherSession {},
    15 Update { 0: fault },
});

/// The setting or value that a refusal is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Field {
    /// A setpoint.
    #[default]
    SetPoint,
    /// A reference generator's parameter.
    Reference,
    /// Force loop.
    ForceLoop,
    /// Stroke loop.
    StrokeLoop,
    /// Settings of the joint that two muscles move.
    Joint,
    /// Settings of the pressure regulator.
    Regulator,
    /// Limits of operation.
    Limits,
    /// A sensor's watch.
    SensorWatch,
    /// Remaining watches.
    Watch,
    /// Bands of motion.
    Bands,
    /// Telemetry or trace.
    Rate,
    /// Scale or filter of a sensor.
    Scale,
    /// Signal to the pressure regulator.
    Command,
    /// Pair of on/off valves.
    Valves,
    /// Line to a CAN bus.
    Can,
}

one_of!(Field { 0 SetPoint {}, 1 Reference {}, 2 ForceLoop {}, 3 StrokeLoop {}, 4 Joint {}, 5 Regulator {}, 6 Limits {}, 7 SensorWatch {}, 8 Watch {}, 9 Bands {}, 10 Rate {}, 11 Scale {}, 12 Command {}, 13 Valves {}, 14 Can {} });

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
    /// The bytes are not a table.
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

one_of!(TableFault {
    0 NotBegun {},
    1 Gap { 0: offset },
    2 TooLong { 0: length },
    3 Incomplete { 0: length },
    4 Check {},
    5 Version { found: found, known: known },
    6 Malformed {},
    7 NotFinite {},
    8 NotOrdered {},
    9 OutOfRange {},
    10 UnknownEffect {},
});

/// Why the store failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StoreFault {
    /// Reading or writing failed.
    #[default]
    Medium,
    /// No room.
    Full,
    /// No previous table to go back to.
    NoPrevious,
    /// The bytes read back are not those written.
    Verify,
}

one_of!(StoreFault { 0 Medium {}, 1 Full {}, 2 NoPrevious {}, 3 Verify {} });
