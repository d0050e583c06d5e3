//! What a controller reads and writes by [`fields`] is what postcard, another implementation, reads and writes by `serde`.

use model_core::fields::{self, Fields};
use model_core::link::frame::MAX_BODY;
use model_core::link::messages::{
    DeviceInfo, Evaluate, Evaluated, Event, FaultReport, Faults, ForgetMemory, PastFault, ReferenceOrder,
    ReferencePoints, Refusal, SetPointOrder, Side, Start, Status, TableBegin, TableInfo, TablePiece,
    TableRead, Telemetry, TelemetryRate, TraceArm, TraceInfo, TracePiece, TraceRead,
};
use model_core::link::settings::Settings;
use model_core::table::MuscleTable;
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

const ROOM: usize = 2 * MAX_BODY;

/// Both write a value similar, and into as much room as it takes.
fn written_alike<V: Fields + Serialize>(value: &mut V) -> Result<(), TestCaseError> {
    let (mut theirs, mut ours) = ([0; ROOM], [0; ROOM]);
    let theirs = postcard::to_slice(value, &mut theirs).expect("room").to_vec();
    let length = fields::write(value, &mut ours).expect("room");
    prop_assert_eq!(&ours[..length], &theirs[..]);
    prop_assert_eq!(fields::write(value, &mut ours[..length]), Some(length));
    if length > 0 {
        prop_assert_eq!(fields::write(value, &mut ours[..length - 1]), None);
    }
    Ok(())
}

/// Any bytes are a value to both or to neither, and the same value. Gives whether they were one.
fn read_alike<V: Fields + Serialize + DeserializeOwned>(
    bytes: &[u8],
    place: &mut V,
) -> Result<bool, TestCaseError> {
    let there = fields::read(bytes, place);
    let theirs = postcard::from_bytes::<V>(bytes);
    prop_assert_eq!(there, theirs.is_ok(), "{:?}", bytes);
    let Ok(mut theirs) = theirs else { return Ok(false) };
    let (mut first, mut second) = ([0; ROOM], [0; ROOM]);
    // Bytes, not values: a number that is none equals nothing.
    prop_assert_eq!(
        postcard::to_slice(place, &mut first).expect("room"),
        postcard::to_slice(&theirs, &mut second).expect("room")
    );
    written_alike(&mut theirs)?;
    Ok(true)
}

/// A table as it arrives in a place that held another.
fn used_table() -> MuscleTable {
    model_core::table::example()
}

/// Bytes of which many are small, as numbers of variants and lengths are. None has the eighth bit: a number of a variant in more
/// bytes than it needs is read by postcard alone.
fn bytes() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![8 => 0..3_u8, 3 => 0..20_u8, 1 => 0..128_u8];
    prop::collection::vec(byte, 0..400)
}

macro_rules! alike {
    ($bytes:expr, $seen:expr; $($message:ty),* $(,)?) => {
        $($seen |= usize::from(read_alike::<$message>($bytes, &mut Default::default())?) << line_of(stringify!($message));)*
    };
}

const READ: [&str; 24] = [
    "DeviceInfo",
    "Evaluate",
    "Evaluated",
    "FaultReport",
    "Faults",
    "ForgetMemory",
    "PastFault",
    "ReferenceOrder",
    "ReferencePoints",
    "SetPointOrder",
    "Side",
    "Start",
    "Status",
    "TableBegin",
    "TableInfo",
    "TablePiece",
    "TableRead",
    "Telemetry",
    "TelemetryRate",
    "TraceArm",
    "TraceInfo",
    "TracePiece",
    "TraceRead",
    "Settings",
];

fn line_of(name: &str) -> usize {
    READ.iter().position(|one| *one == name).expect("listed")
}

#[test]
fn any_bytes_are_the_same_message_to_both() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let seen = std::cell::Cell::new(0_usize);
    for _ in 0..20_000 {
        use proptest::strategy::ValueTree;
        let bytes = bytes().new_tree(&mut runner).expect("bytes").current();
        let mut here = seen.get();
        let mut tried = || -> Result<(), TestCaseError> {
            alike!(&bytes, here; DeviceInfo, Evaluate, Evaluated, FaultReport, Faults, ForgetMemory, PastFault, ReferenceOrder,
                ReferencePoints, SetPointOrder, Side, Start, Status, TableBegin, TableInfo, TablePiece, TableRead, Telemetry,
                TelemetryRate, TraceArm, TraceInfo, TracePiece, TraceRead, Settings);
            if let Ok(mut refusal) = postcard::from_bytes::<Refusal>(&bytes) {
                written_alike(&mut refusal)?;
            }
            if let Ok(mut event) = postcard::from_bytes::<Event>(&bytes) {
                written_alike(&mut event)?;
            }
            read_alike(&bytes, &mut used_table())?;
            Ok(())
        };
        tried().expect("alike");
        seen.set(here);
    }
    let missed: Vec<_> = READ.iter().enumerate().filter(|(at, _)| seen.get() >> at & 1 == 0).collect();
    assert!(missed.is_empty(), "no draw was a {missed:?}");
}

#[test]
fn a_table_and_the_settings_are_written_alike() {
    written_alike(&mut used_table()).expect("a table");
    written_alike(&mut Settings::default()).expect("settings");
    let mut place = MuscleTable::empty();
    let mut bytes = [0; ROOM];
    let length = fields::write(&mut used_table(), &mut bytes).expect("room");
    assert!(read_alike(&bytes[..length], &mut place).expect("alike"));
    assert_eq!(place, used_table());
}

proptest! {
    #[test]
    fn numbers_of_any_size_are_written_and_read_alike(a: u16, b: u32, c: u64, shift in 0..64_u32, end in 0..10_usize) {
        for mut number in [c, c >> shift, u64::MAX >> shift] {
            written_alike(&mut number)?;
            let mut bytes = [0; 16];
            let length = fields::write(&mut number, &mut bytes).expect("room");
            let cut = &bytes[..length.min(end)];
            // Too large for the smaller ones, or cut off.
            for bytes in [&bytes[..length], cut] {
                read_alike(bytes, &mut 0_u64)?;
                read_alike(bytes, &mut 0_u32)?;
                read_alike(bytes, &mut 0_u16)?;
            }
        }
        written_alike(&mut (a.min(300)))?;
        let (mut a, mut b) = (a, b);
        written_alike(&mut a)?;
        written_alike(&mut b)?;
    }
}
