//! ONE table of endpoints: number, name, request, response. Everything else about them is made from it.

use super::frame::{Exchange, Kind};
use super::messages::{
    DeviceInfo, Evaluate, Evaluated, FaultReport, Faults, ForgetMemory, HealthRead, HealthSums, MeanSignals,
    PastFault, ReferenceOrder, ReferencePoints, Refusal, RollBack, Session, SetPointOrder, SignalsRead,
    Start, Status, TableBegin, TableInfo, TablePiece, TableRead, TelemetryRate, TraceArm, TraceInfo,
    TracePiece, TraceRead, UpdateBegin, UpdatePiece, UpdateStatus,
};
use super::messages::{Event, Telemetry};
use super::settings::Settings;
use crate::fields::{self, Fields};
use postcard_schema::{Schema, key::hash::fnv1a64::hash_ty_path};
use serde::{Serialize, de::DeserializeOwned};

/// A question and its answer.
pub trait Endpoint {
    /// What the host sends.
    type Request: Serialize + DeserializeOwned + Schema;
    /// What the device answers.
    type Response: Serialize + DeserializeOwned + Schema;
    /// Number in the frame's header.
    const ID: u8;
    /// Name, for people.
    const NAME: &'static str;
}

/// One row of the table, for tools that list it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Number in the frame's header.
    pub id: u8,
    /// Name, for people.
    pub name: &'static str,
    /// Type of the setpoint, one of [`messages`](super::messages) or [`settings`](super::settings).
    pub request: &'static str,
    /// Type of what is answered.
    pub response: &'static str,
    /// What it does, in Markdown.
    pub what: &'static str,
    /// Hash of number, name, request and response.
    pub hash: u64,
}

const fn mix(hash: u64, bytes: [u8; 8]) -> u64 {
    let mut hash = hash;
    let mut at = 0;
    while at < bytes.len() {
        hash = (hash ^ bytes[at] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        at += 1;
    }
    hash
}

const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;

macro_rules! endpoints {
    ($($(#[doc = $doc:literal])* $id:literal $name:ident $marker:ident : $request:ty => $response:ty;)*) => {
        $(
            $(#[doc = $doc])*
            #[derive(Clone, Copy, Debug)]
            pub struct $marker;

            impl Endpoint for $marker {
                type Request = $request;
                type Response = $response;
                const ID: u8 = $id;
                const NAME: &'static str = stringify!($name);
            }
        )*

        /// The table, in the order of its numbers.
        pub const TABLE: &[Row] = &[$(Row {
            id: $id,
            name: stringify!($name),
            request: stringify!($request),
            response: stringify!($response),
            what: concat!($($doc),*),
            hash: mix(
                mix(mix(FNV_BASIS, [$id, 0, 0, 0, 0, 0, 0, 0]), hash_ty_path::<$request>(stringify!($name))),
                hash_ty_path::<$response>(stringify!($name)),
            ),
        }),*];

        /// What a device must be able to answer: one function for each endpoint, which fills an answer that is there already.
        pub trait Service {
            $(
                $(#[doc = $doc])*
                fn $name(&mut self, request: &$request, answer: &mut $response) -> Result<(), Refusal>;
            )*
        }

        /// Answers one request with a service, in its own place; gives the length of the answer's frame.
        pub fn answer<S: Service + ?Sized>(service: &mut S, exchange: &mut Exchange<'_>) -> Result<usize, Refusal> {
            // Chosen first and called once: a call in each arm would be most of this function.
            let handler: fn(&mut S, &mut Exchange<'_>) -> Result<usize, Refusal> = match exchange.header().id {
                $($id => |service, exchange| {
                    respond(exchange, |request: &$request, answer: &mut $response| service.$name(request, answer))
                },)*
                _ => return Err(Refusal::UnknownEndpoint),
            };
            handler(service, exchange)
        }

        /// Refuses everything.
        #[cfg(test)]
        struct Deaf;

        #[cfg(test)]
        impl Service for Deaf {
            $(fn $name(&mut self, _: &$request, _: &mut $response) -> Result<(), Refusal> {
                Err(Refusal::NotSupported)
            })*
        }
    };
}

/// Reads a request and writes the answer to it: in a function for each endpoint, so that the stack holds one message at a time.
#[inline]
fn respond<Q: Fields + Default, A: Fields + Default>(
    exchange: &mut Exchange<'_>,
    act: impl FnOnce(&Q, &mut A) -> Result<(), Refusal>,
) -> Result<usize, Refusal> {
    let mut request = Q::default();
    if !fields::read(exchange.body(), &mut request) {
        return Err(Refusal::Malformed);
    }
    let mut answer = A::default();
    act(&request, &mut answer)?;
    exchange.answer(Kind::Response, &mut answer)
}

endpoints! {
    /// Identity, limits, tables in use.
    1 info GetInfo: () => DeviceInfo;
    /// What the device is doing.
    2 status GetStatus: () => Status;
    /// `Disarmed` → `Armed`, immediately or after a test of the dump valve (`watch.valve_test_pa`); refused while pressure is in a muscle, or to another session than the owner that is not silent. The session owns the device.
    3 arm Arm: Session => Status;
    /// `Armed` → `Running`, or another mode while running. The first setpoint is what is measured. Refused to another session than the owner that is not silent. The session owns the mode.
    4 start StartMode: Start => Status;
    /// Vents and goes to `Armed`; allowed always except in `Fault`, where it vents and stays.
    5 stop Stop: () => Status;
    /// Vents and goes to `Disarmed`; in `Fault` it vents and stays.
    6 disarm Disarm: () => Status;
    /// What is demanded from now on; ends a reference. Refused to a session that does not own the mode.
    7 set_point SetTo: SetPointOrder => Status;
    /// Starts a reference generator. Refused to a session that does not own the mode.
    8 reference SetReference: ReferenceOrder => Status;
    /// Points for the reference table. Refused to a session that does not own the device, where one does.
    9 reference_points SetReferencePoints: ReferencePoints => u16;
    /// Sets the stream of telemetry; the answer is the rate in force.
    10 telemetry SetTelemetry: TelemetryRate => TelemetryRate;
    /// Faults since the start.
    11 faults GetFaults: () => Faults;
    /// One fault of the past, kept over power cycles.
    12 past_fault GetPastFault: PastFault => Option<FaultReport>;
    /// Forgets the latched fault: `Fault` → `Disarmed`, unless its condition still holds.
    13 clear_fault ClearFault: () => Status;
    /// The settings in force.
    14 settings GetSettings: () => Settings;
    /// Checks, keeps and uses settings, and confirms them where they could not be trusted; only while disarmed or in a fault, vented.
    15 set_settings SetSettings: Settings => Settings;
    /// Begins the upload of a table, which takes the shared buffer from the trace: its records are lost.
    16 table_begin BeginTable: TableBegin => ();
    /// The next piece; the answer is how many bytes are there.
    17 table_piece SendTablePiece: TablePiece => u32;
    /// Checks the whole table, uses it, keeps it; only while disarmed or in a fault, vented.
    18 table_commit CommitTable: () => TableInfo;
    /// A piece of the kept table; empty behind its end.
    19 table_read ReadTable: TableRead => TablePiece;
    /// Goes back to the table before the one of this generation; asked again, it is done once. Only while disarmed or in a fault, vented.
    20 table_rollback RollBackTable: RollBack => TableInfo;
    /// What the table says at some points.
    21 evaluate EvaluateTable: Evaluate => Evaluated;
    /// Arms a trace; an upload that was not finished is forgotten.
    22 trace_arm ArmTrace: TraceArm => TraceInfo;
    /// The trace as it stands.
    23 trace_info GetTrace: () => TraceInfo;
    /// Values of the trace.
    24 trace_read ReadTrace: TraceRead => TracePiece;
    /// Forgets a muscle's remembered history; only while disarmed or in a fault, vented.
    25 forget_memory Forget: ForgetMemory => ();
    /// Restarts the device after this answer; only while disarmed or in a fault, vented.
    26 restart Restart: () => ();
    /// Keeps an armed device or a running mode going; refused to a session that does not own it. No other request does so.
    27 keep_alive KeepAlive: Session => ();
    /// Sums of the load cell against the table, from which the host names a change.
    28 health ReadHealth: HealthRead => HealthSums;
    /// Means of a muscle's sensor signals since the last such request, before any scale, for calibration.
    29 signals ReadSignals: SignalsRead => MeanSignals;
    /// The board's own settings: those of a new device.
    30 board_settings GetBoardSettings: () => Settings;
    /// What is in the two slots for firmware; refused where a board has none, or the firmware has no key.
    31 update GetUpdate: () => UpdateStatus;
    /// Begins an installation of another firmware; only while disarmed or in a fault, vented.
    32 update_begin BeginUpdate: UpdateBegin => UpdateStatus;
    /// The next piece of the program; the answer is how many bytes are there. Only while disarmed or in a fault, vented.
    33 update_piece SendUpdatePiece: UpdatePiece => u32;
    /// Checks the whole program and makes it the one of the next start; only while disarmed or in a fault, vented.
    34 update_commit CommitUpdate: () => UpdateStatus;
    /// Confirms the program that runs: it stays. Only while disarmed or in a fault, vented.
    35 update_confirm ConfirmUpdate: () => UpdateStatus;
    /// Makes the other program the one of the next start; only while disarmed or in a fault, vented.
    36 update_revert RevertUpdate: () => UpdateStatus;
}

/// Topic of [`Telemetry`].
pub const TELEMETRY: u8 = 128;
/// Topic of [`Event`].
pub const EVENT: u8 = 129;

/// Topic of log lines: frames of `defmt`, which the host decodes with the device's image.
pub const LOG: u8 = 130;

/// Hash of the whole table, its messages and the topics: equal at both ends or they do not talk.
pub const SCHEMA_HASH: u64 = {
    let mut hash = FNV_BASIS;
    let mut at = 0;
    while at < TABLE.len() {
        hash = mix(hash, TABLE[at].hash.to_le_bytes());
        at += 1;
    }
    hash = mix(hash, hash_ty_path::<Telemetry>("telemetry"));
    hash = mix(hash, hash_ty_path::<Event>("event"));
    hash = mix(hash, hash_ty_path::<Refusal>("refusal"));
    mix(hash, (super::LINK_VERSION as u64).to_le_bytes())
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::{self, Accumulator, Header, MAX_BODY, MAX_TOPIC, MAX_WIRE};
    use crate::link::messages::{
        Fault, FaultReport, Mode, PIECE, POINTS, Sensor, Side, SideSample, State, TRACE_PIECE, Value,
    };

    #[test]
    fn numbers_rise_and_names_differ() {
        for pair in TABLE.windows(2) {
            assert!(pair[0].id < pair[1].id, "{} and {}", pair[0].name, pair[1].name);
        }
        for (at, row) in TABLE.iter().enumerate() {
            assert!(row.id > 0 && row.id < TELEMETRY, "0 is hello, from 128 on are topics");
            assert!(TABLE[..at].iter().all(|other| other.name != row.name && other.hash != row.hash));
        }
    }

    /// If this test breaks, a message or endpoint was changed on purpose: raise `LINK_VERSION` when its meaning moved,
    /// and write the new hash here.
    #[test]
    fn the_schema_changes_only_on_purpose() {
        assert_eq!(SCHEMA_HASH, 0xe738_8c4f_e542_19e0, "{SCHEMA_HASH:#018x}");
    }

    #[test]
    fn the_largest_messages_fit_a_frame() {
        let mut out = [0u8; MAX_BODY];
        let fits = |length: Result<&mut [u8], postcard::Error>| length.map(|used| used.len());
        assert!(fits(postcard::to_slice(&Settings::default(), &mut out)).is_ok_and(|n| n < 400));
        let piece =
            TablePiece { offset: u32::MAX, bytes: heapless::Vec::from_slice(&[255; PIECE]).expect("fits") };
        assert!(fits(postcard::to_slice(&piece, &mut out)).is_ok());
        let piece = TracePiece { values: heapless::Vec::from_slice(&[f32::MAX; TRACE_PIECE]).expect("fits") };
        assert!(fits(postcard::to_slice(&piece, &mut out)).is_ok());
        let values = Evaluated {
            values: heapless::Vec::from_slice(&[Value { force_n: 1.0, pressure_pa: 1.0 }; POINTS])
                .expect("fits"),
        };
        assert!(fits(postcard::to_slice(&values, &mut out)).is_ok());
        let sample = SideSample::default();
        let telemetry = Telemetry {
            time_us: u64::MAX / 2,
            tick: u64::MAX / 1000,
            state: State::Running,
            mode: Mode::Pair,
            setpoint: 1.0,
            setpoint_second: 1.0,
            sides: heapless::Vec::from_slice(&[sample; 2]).expect("fits"),
        };
        // A byte takes ten bits at 1 Mbaud: 100 bytes a millisecond, frame included, keep 1 kHz without loss.
        let header = Header { kind: Kind::Topic, id: TELEMETRY, sequence: u16::MAX };
        let mut topic = [0; MAX_TOPIC];
        assert!(frame::encode(header, &telemetry, &mut topic).is_ok_and(|n| n < 100));
        let report = FaultReport {
            fault: Fault::NotANumber,
            side: Side::Antagonist,
            sensor: Some(Sensor::Force),
            from: State::Running,
            mode: Mode::Pair,
            time_us: u64::MAX,
            value: 1.0,
            limit: 1.0,
            last: sample,
        };
        assert!(frame::encode(header, &Event::Fault(report), &mut topic).is_ok());
    }

    #[test]
    fn unknown_numbers_and_foreign_bodies_are_refused() {
        let answered = |id, body: &[u8]| {
            let mut wire = [0; MAX_WIRE];
            let header = Header { kind: Kind::Request, id, sequence: 1 };
            let length = frame::encode_bytes(header, body, &mut wire).expect("fits");
            let mut accumulator = Accumulator::new();
            for &byte in &wire[..length - 1] {
                assert!(accumulator.push(byte).is_none());
            }
            let mut exchange = accumulator.push_to_answer(0).expect("a frame").expect("whole");
            answer(&mut Deaf, &mut exchange)
        };
        assert_eq!(answered(127, &[]), Err(Refusal::UnknownEndpoint));
        assert_eq!(answered(SetTo::ID, &[9]), Err(Refusal::Malformed));
        assert_eq!(answered(GetInfo::ID, &[]), Err(Refusal::NotSupported), "read, and asked");
    }
}
