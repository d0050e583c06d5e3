//! The power is cut at random moments of an upload: the old table or the new one is there, whole, every time.

use std::io::Write;
use std::time::Duration;

use emulator_tests::machine::Folder;
use emulator_tests::{Machine, Options, image_of, upload};
use model_core::check;
use model_core::link::endpoints::{BeginTable, CommitTable, Endpoint, SendTablePiece};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode};
use model_core::link::messages::{PIECE, Side, TableBegin, TablePiece};
use model_core::table::{self, MuscleTable};
use model_core::units::Pressure;
use pam_device::tables;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

fn numbered(n: u32) -> MuscleTable {
    MuscleTable { deadband: Pressure::from_pascals(50e3 + n as f32), ..table::example() }
}

fn frame<E: Endpoint>(request: &E::Request, wire: &mut Vec<u8>) {
    let mut frame = [0; MAX_WIRE];
    let header = Header { kind: Kind::Request, id: E::ID, sequence: wire.len() as u16 };
    let length = encode(header, request, &mut frame).expect("it fits");
    wire.extend_from_slice(&frame[..length]);
}

/// A whole upload as the bytes of its requests, none of which waits for an answer.
fn requests(image: &[u8]) -> Vec<u8> {
    let mut wire = vec![0];
    let begin = TableBegin { side: Side::Agonist, length: image.len() as u32, crc: check::of_image(image) };
    frame::<BeginTable>(&begin, &mut wire);
    for (n, piece) in image.chunks(PIECE).enumerate() {
        let bytes = heapless::Vec::from_slice(piece).expect("it fits");
        frame::<SendTablePiece>(&TablePiece { offset: (n * PIECE) as u32, bytes }, &mut wire);
    }
    frame::<CommitTable>(&(), &mut wire);
    wire
}

/// The power is cut within these times of the upload's first byte, in turn, µs.
const LONGEST_US: [u64; 4] = [3_000, 12_000, 60_000, 250_000];

/// `PAM_LONG=1` cuts the power three hundred times.
#[test]
fn a_plug_pulled_at_any_moment_leaves_a_whole_table() {
    let kills = if std::env::var_os("PAM_LONG").is_some() { 300 } else { 15 };
    let folder = Folder::new();
    let mut random = StdRng::seed_from_u64(4);
    let mut kept = image_of(&numbered(0));
    let Ok(machine) = Machine::start(folder.path(), Options::default()) else { return };
    upload(&mut machine.client(), Side::Agonist, &numbered(0));
    machine.kill();
    let (mut old, mut new) = (0, 0);
    for n in 1..=kills {
        let Ok(machine) = Machine::start(folder.path(), Options::default()) else { return };
        // The device is awake once it says hello.
        drop(machine.client());
        let next = image_of(&numbered(n));
        machine.link().write_all(&requests(&next)).expect("the line takes it");
        // From before the first byte to after the commit, however busy the machine that emulates the board is.
        let longest = LONGEST_US[n as usize % LONGEST_US.len()];
        std::thread::sleep(Duration::from_micros(random.random_range(0..longest)));
        machine.kill();
        let Ok(machine) = Machine::start(folder.path(), Options::default()) else { return };
        let there = tables::read(&mut machine.client(), Side::Agonist).expect("it reads").expect("a table");
        if there == next {
            new += 1;
        } else {
            assert!(there == kept, "neither the old nor the new table after power cut {n}");
            old += 1;
        }
        kept = there;
        machine.kill();
    }
    eprintln!("{kills} plugs pulled: {old} times the old table, {new} times the new");
}
