//! The link of the real image: hello, tables, garbage, pulled plugs.

use std::io::{Read, Write};
use std::time::Duration;

use emulator_tests::machine::{Folder, PATIENCE};
use emulator_tests::{Machine, Options, image_of, upload};
use model_core::check;
use model_core::link::endpoints::BeginTable;
use model_core::link::endpoints::{
    CommitTable, EvaluateTable, GetInfo, GetStatus, Restart, RollBackTable, SendTablePiece,
};
use model_core::link::hello::Board;
use model_core::link::messages::{
    Evaluate, Mode, PIECE, Point, Refusal, RollBack, Side, State, TableBegin, TableFault, TablePiece,
};
use model_core::muscle::{AtStroke, Muscle};
use model_core::single_precision;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use pam_device::{Client, Port, tables};

fn board(folder: &Folder) -> Option<Machine> {
    Machine::start(folder.path(), Options::default()).ok()
}

#[test]
fn it_says_hello_and_wakes_up_disarmed_and_vented() {
    let folder = Folder::new();
    let Some(machine) = board(&folder) else { return };
    let mut client = machine.client();
    assert_eq!(client.hello().board, Board::Mps2An386 as u8);
    let status = client.call::<GetStatus>(&()).expect("a status");
    assert_eq!((status.state, status.mode, status.fault), (State::Disarmed, Mode::Vent, None));
    let info = client.call::<GetInfo>(&()).expect("its limits");
    assert_eq!((info.ticks_per_s, info.tables), (1000, [None, None]));
}

#[test]
fn a_table_is_uploaded_read_back_rolled_back_and_there_after_a_restart() {
    let folder = Folder::new();
    let Some(mut machine) = board(&folder) else { return };
    let mut client = machine.client();
    let first = table::example();
    let second = MuscleTable { deadband: Pressure::from_kilopascals(60.0), ..table::example() };
    upload(&mut client, Side::Agonist, &first);
    upload(&mut client, Side::Agonist, &second);
    let kept = |client: &mut Client| tables::read(client, Side::Agonist).expect("it reads").expect("a table");
    assert_eq!(kept(&mut client), image_of(&second));
    let info = client.call::<GetInfo>(&()).expect("its tables").tables[0].expect("a table");
    let request = RollBack { side: Side::Agonist, generation: info.generation };
    // Asked twice, as a host does whose answer was lost: it goes back once.
    for _ in 0..2 {
        client.call::<RollBackTable>(&request).expect("there is one before");
    }
    assert_eq!(kept(&mut client), image_of(&first));
    let starts = client.hello().starts;
    client.call_once::<Restart>(&()).expect("it answers before it restarts");
    // QEMU keeps the line while the board starts again.
    drop(client);
    let mut client = machine.client_after(starts);
    assert_eq!(client.hello().starts, starts + 1);
    assert_eq!(kept(&mut client), image_of(&first));
    // A plug that is pulled is no different.
    machine.kill();
    let Some(machine) = board(&folder) else { return };
    let mut client = machine.client();
    assert_eq!(client.hello().starts, starts + 2);
    assert_eq!(kept(&mut client), image_of(&first));
}

#[test]
fn a_table_that_is_wrong_is_refused_and_the_old_one_stays() {
    let folder = Folder::new();
    let Some(machine) = board(&folder) else { return };
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table::example());
    let good = image_of(&table::example());
    let mut send = |bytes: &[u8], length: u32, crc: u32| -> Result<(), Refusal> {
        let begin = TableBegin { side: Side::Agonist, length, crc };
        client.try_call::<BeginTable>(&begin).expect("an answer")?;
        for (n, piece) in bytes.chunks(PIECE).enumerate() {
            let bytes = heapless::Vec::from_slice(piece).expect("it fits");
            let piece = TablePiece { offset: (n * PIECE) as u32, bytes };
            client.try_call::<SendTablePiece>(&piece).expect("an answer")?;
        }
        client.try_call::<CommitTable>(&()).expect("an answer").map(|_| ())
    };
    let whole = |bytes: &[u8]| (bytes.len() as u32, check::of_image(bytes));
    let (length, crc) = whole(&good);
    assert_eq!(send(&good, length, crc ^ 1), Err(Refusal::Table(TableFault::Check)));
    assert_eq!(
        send(&good[..length as usize - 5], length, crc),
        Err(Refusal::Table(TableFault::Incomplete(length - 5)))
    );
    assert_eq!(send(&good, 100_000, crc), Err(Refusal::Table(TableFault::TooLong(1024))));
    // A flipped bit whose outer check sum was made to fit is caught by the image's own.
    for bit in [70, 500, 1500] {
        let mut flipped = good.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let (length, crc) = whole(&flipped);
        let refused = send(&flipped, length, crc);
        assert!(matches!(refused, Err(Refusal::Table(_))), "bit {bit}: {refused:?}");
    }
    let mut other_version = good.clone();
    other_version[4] = 99;
    let (length, crc) = whole(&other_version);
    let version = TableFault::Version { found: 99, known: 1 };
    assert_eq!(send(&other_version, length, crc), Err(Refusal::Table(version)));
    assert_eq!(tables::read(&mut client, Side::Agonist).expect("it reads"), Some(good));
}

#[test]
fn garbage_on_the_line_costs_nothing_but_itself() {
    let folder = Folder::new();
    let Some(mut machine) = board(&folder) else { return };
    let mut link = machine.link();
    let mut noise = Vec::new();
    let mut seed = 1_u32;
    for _ in 0..20_000 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        noise.push((seed >> 24) as u8);
    }
    link.write_all(&noise).expect("the line takes it");
    // What came before may have opened a frame; the client ends it with a zero.
    link.set_read_timeout(Some(Duration::from_millis(300))).expect("a stream");
    let mut rest = [0; 4096];
    while link.read(&mut rest).is_ok_and(|count| count > 0) {}
    let port = Port::from_tcp(link).expect("a port");
    // A machine that emulates many boards immediately takes its time over twenty thousand bytes.
    let mut client = Client::connect(port, PATIENCE).expect("it says hello after garbage");
    let status = client.call::<GetStatus>(&()).expect("a status");
    assert_eq!(status.state, State::Disarmed);
    assert!(status.frames_bad > 10, "{status:?}");
    assert!(machine.is_running());
}

#[test]
fn host_and_target_compute_the_same_bits() {
    let folder = Folder::new();
    let Some(machine) = board(&folder) else { return };
    let mut client = machine.client();
    let table = table::example();
    upload(&mut client, Side::Agonist, &table);
    let muscle = Muscle::<f32>::build(&table).expect("a valid table");
    let mut compared = 0;
    let mut strokes = (0..25).map(|n| -0.5e-3 + 0.16e-3 * n as f32);
    for stroke_m in strokes.by_ref() {
        for direction in [-1, 0, 1] {
            let pressures = (0..16).map(|n| 20e3 + 40.3e3 * n as f32);
            let points = pressures.map(|pressure_pa| Point { pressure_pa, stroke_m }).collect();
            let request = Evaluate { side: Side::Agonist, direction, points };
            let answer = client.call::<EvaluateTable>(&request).expect("an evaluation");
            for (point, value) in request.points.iter().zip(&answer.values) {
                let pressure = Pressure::from_pascals(point.pressure_pa);
                let stroke = Length::from_metres(point.stroke_m);
                let s = f32::from(direction);
                let mut held = AtStroke::NONE;
                let force = single_precision::pose(&muscle, &mut held, stroke, pressure, s);
                let search = muscle.search();
                let found = single_precision::pressure_for(&muscle, &held, s, force, pressure, &search);
                assert_eq!(value.force_n.to_bits(), force.newtons().to_bits(), "force at {point:?}");
                assert_eq!(
                    value.pressure_pa.to_bits(),
                    found.pressure.pascals().to_bits(),
                    "inverse at {point:?}"
                );
                compared += 2;
            }
        }
    }
    assert!(compared >= 2000, "{compared} values compared");
}
