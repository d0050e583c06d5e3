//! The bodies of requests, answers and topics. SI units, named in the fields; closed enums, never text.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Bytes of a table or trace in one piece.
pub const PIECE: usize = 256;
/// Points in one [`Evaluate`].
pub const POINTS: usize = 16;
/// Variables that one trace records.
pub const TRACE_VARIABLES: usize = 16;
/// Values in one [`TracePiece`].
pub const TRACE_PIECE: usize = 64;
/// Points of a reference table in one piece.
pub const REFERENCE_PIECE: usize = 32;
/// Past faults that are kept.
pub const FAULT_LOG: usize = 8;

/// Which muscle of the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Side {
    /// The first, or the only one.
    #[default]
    Agonist,
    /// The second of a pair.
    Antagonist,
}

impl Side {
    /// Both, in order.
    pub const ALL: [Self; 2] = [Self::Agonist, Self::Antagonist];

    /// 0 or 1.
    pub const fn index(self) -> usize {
        match self {
            Self::Agonist => 0,
            Self::Antagonist => 1,
        }
    }
}

/// What the controller controls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Mode {
    /// Nothing: zero pressure.
    #[default]
    Vent,
    /// Pressure.
    Pressure,
    /// Force.
    Force,
    /// Stroke.
    Stroke,
    /// Angle and stiffness of a joint with two muscles.
    Pair,
}

/// States of safety. Nothing but a host's request leads towards `Running`, and no fault is left without one.
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

/// What went wrong. The number on the wire is the bit in [`Settings::hold_on`](super::settings::Settings::hold_on).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// A reading is outside what the sensor can give: broken wire, short circuit.
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
    /// No new set-point for too long.
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
    /// A calculation gave something that is no number.
    NotANumber,
}

impl Fault {
    /// All of them, in the order of their codes.
    pub const ALL: [Self; 18] = [
        Self::SensorRange,
        Self::SensorStuck,
        Self::SensorNoisy,
        Self::SensorsDisagree,
        Self::SensorsSilent,
        Self::PressureNotRising,
        Self::PressureNotFalling,
        Self::OverPressure,
        Self::OverStroke,
        Self::OverSpeed,
        Self::OverForce,
        Self::SetPointSilence,
        Self::LoopOverrun,
        Self::TableMissing,
        Self::TableInvalid,
        Self::BrownOut,
        Self::Watchdog,
        Self::NotANumber,
    ];

    /// Its number, 0 for the first of [`Fault::ALL`].
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// Which sensor a fault is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Sensor {
    /// Pressure.
    Pressure,
    /// Stroke.
    Stroke,
    /// Load cell.
    Force,
}

/// A fault as it happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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

/// Faults since the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Faults {
    /// The one that stopped the device, until it is cleared.
    pub latched: Option<FaultReport>,
    /// How often each happened, in the order of [`Fault::ALL`].
    pub counts: [u16; 18],
}

/// Asks for one past fault: 0 the last, 1 the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PastFault {
    /// How far back, less than [`FAULT_LOG`].
    pub back: u8,
}

/// Why a device refuses a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
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

/// A table as the device knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableInfo {
    /// Length of the image in bytes.
    pub length: u32,
    /// CRC-32 of the image.
    pub crc: u32,
    /// Counts commits of this muscle; a roll-back goes back by one.
    pub generation: u32,
    /// Whether an older table is kept that [`rollback`](super::endpoints) would restore.
    pub has_previous: bool,
}

/// Identity and limits of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
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

/// Why a device started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StartedBy {
    /// Power came on.
    #[default]
    Power,
    /// The host or a person asked.
    Request,
    /// The watchdog.
    Watchdog,
    /// The supply sagged.
    BrownOut,
}

/// What a device is doing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// State of safety.
    pub state: State,
    /// Mode.
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
    /// Wanted forces that the table could not give, and were limited.
    pub saturated_ticks: u32,
}

/// Starts a mode; from `Armed`, or from `Running` to change over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Start {
    /// What to control.
    pub mode: Mode,
}

/// What is wanted, in the terms of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum SetPoint {
    /// Pressure, Pa.
    Pressure(f32),
    /// Force, N.
    Force(f32),
    /// Stroke, m.
    Stroke(f32),
    /// A joint.
    Pair {
        /// Angle, rad.
        angle_rad: f32,
        /// Stiffness, N·m/rad.
        stiffness_nm_per_rad: f32,
    },
}

/// A wave that the device makes itself, in the unit of the mode's first value (Pa, N, m, rad); it begins at once and
/// holds its last value at its end. A pair's stiffness is the last set-point's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Reference {
    /// None: set-points of the host.
    SetPoint,
    /// `mean + amplitude · sin(2π f t)`, for ever.
    Sine {
        /// Mean.
        mean: f32,
        /// Amplitude.
        amplitude: f32,
        /// Frequency, Hz.
        frequency_hz: f32,
    },
    /// Rise, hold, fall, rest, again and again.
    Trapezoid {
        /// Lower value.
        low: f32,
        /// Upper value.
        high: f32,
        /// Time of each ramp, s.
        ramp_s: f32,
        /// Time at each value, s.
        hold_s: f32,
    },
    /// A sine whose frequency goes from one value to another in proportion to time.
    Chirp {
        /// Mean.
        mean: f32,
        /// Amplitude.
        amplitude: f32,
        /// First frequency, Hz.
        from_hz: f32,
        /// Last frequency, Hz.
        to_hz: f32,
        /// Duration, s.
        duration_s: f32,
    },
    /// The points sent by `reference_points`, joined by straight lines.
    Table {
        /// Time between points, s.
        step_s: f32,
        /// Whether to begin again at the end.
        repeat: bool,
    },
}

/// Points of the reference table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ReferencePoints {
    /// Place of the first; 0 begins a new table.
    pub offset: u16,
    /// The points, in the unit of the mode.
    pub points: Vec<f32, REFERENCE_PIECE>,
}

/// Sets the stream of telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TelemetryRate {
    /// One sample every so many ticks; 0 stops.
    pub every_ticks: u16,
}

/// One muscle at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct SideSample {
    /// Measured gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Measured stroke, m.
    pub stroke_m: f32,
    /// Measured force, N.
    pub force_n: f32,
    /// Wanted pressure, Pa: feed-forward and trim.
    pub wanted_pa: f32,
    /// Command to the regulator, Pa.
    pub command_pa: f32,
    /// Force by the table at the measured pressure and stroke, N; 0 without a table.
    pub model_n: f32,
}

/// One tick as the device saw it. The frame's sequence number counts samples: a gap is a loss on the way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Device time of the tick, µs.
    pub time_us: u64,
    /// Number of the tick.
    pub tick: u64,
    /// State of safety.
    pub state: State,
    /// Mode.
    pub mode: Mode,
    /// What was asked for, in the unit of the mode.
    pub asked: f32,
    /// A pair's second value.
    pub asked_second: f32,
    /// The muscles in use.
    pub sides: Vec<SideSample, 2>,
}

/// Something that happened, told without being asked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Event {
    /// A fault stopped the device.
    Fault(FaultReport),
    /// The state changed.
    State(State),
    /// A trace is full.
    TraceFull,
}

/// Begins an upload; whatever was begun before is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableBegin {
    /// Muscle the table is for.
    pub side: Side,
    /// Length of the image in bytes.
    pub length: u32,
    /// CRC-32 of the image.
    pub crc: u32,
}

/// One piece of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TablePiece {
    /// Place of the first byte.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, PIECE>,
}

/// Asks for a piece of the table in use, from the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TableRead {
    /// Muscle.
    pub side: Side,
    /// Place of the first byte.
    pub offset: u32,
}

/// A point to evaluate the table at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Point {
    /// Gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Stroke, m.
    pub stroke_m: f32,
}

/// Asks the device what its table says, so that a host can compare bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Evaluate {
    /// Muscle.
    pub side: Side,
    /// Direction of motion: −1 lengthening, 0 unknown, 1 shortening.
    pub direction: i8,
    /// The points.
    pub points: Vec<Point, POINTS>,
}

/// What the table says at the points asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Evaluated {
    /// Force and pressure at each point.
    pub values: Vec<Value, POINTS>,
}

/// The table at one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Value {
    /// Force, N.
    pub force_n: f32,
    /// Pressure that the inverse gives for this force, Pa.
    pub pressure_pa: f32,
}

/// Variables of the loop that a trace can record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Variable {
    /// Measured pressure, Pa.
    Pressure,
    /// Measured stroke, m.
    Stroke,
    /// Measured force, N.
    Force,
    /// Speed of stroke, m/s.
    Speed,
    /// Direction of friction, −1 to 1.
    Direction,
    /// First value asked for.
    Asked,
    /// Wanted force, N.
    WantedForce,
    /// Feed-forward pressure, Pa.
    FeedForward,
    /// Trim, Pa.
    Trim,
    /// Wanted pressure after its limits, Pa.
    WantedPressure,
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

/// When a trace begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Trigger {
    /// At once.
    Now,
    /// With the next start of a mode or reference.
    Start,
    /// It runs round and round and stops with a fault, so that it shows what led there.
    UntilFault,
}

/// Arms a trace; what an earlier one recorded is forgotten.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TraceArm {
    /// What to record.
    pub variables: Vec<Variable, TRACE_VARIABLES>,
    /// One record every so many ticks, at least 1.
    pub every_ticks: u16,
    /// When.
    pub trigger: Trigger,
}

/// A trace as it stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
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

/// Asks for values of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TraceRead {
    /// Record to begin with.
    pub record: u32,
}

/// Values of whole records, one record after the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct TracePiece {
    /// The values.
    pub values: Vec<f32, TRACE_PIECE>,
}

/// What happens to an effect's remembered state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ForgetMemory {
    /// Muscle whose history is forgotten: a new one was fitted.
    pub side: Side,
}
