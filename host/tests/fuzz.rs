//! The fuzz targets for some seconds: the seeds of `host/fuzz/seeds`, what was found before (`host/fuzz/found`), and damaged copies of both.
//!
//! The generator begins with the same number on every machine. `PAM_FUZZ_SEED` gives another one, `PAM_FUZZ_CASES` multiplies the
//! cases, and `PAM_FUZZ_SEEDS=write` writes the seeds that are made here. A case that fails is kept in the folder of test results.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};

#[path = "../fuzz/entries.rs"]
mod entries;

use entries::device::{readings, request, sound};
use model_core::image;
use model_core::link::endpoints::{
    Arm, BeginTable, ClearFault, CommitTable, Disarm, Endpoint, EvaluateTable, GetStatus, KeepAlive,
    SendTablePiece, SetReference, SetSettings, SetTelemetry, SetTo, StartMode, Stop,
};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode_bytes};
use model_core::link::messages::{self, Mode, Reference, Session, SetPoint};
use model_core::link::settings::Settings;
use pam_fit::table_file::{About, TableFile};

/// Marsaglia's xorshift64*.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    /// A seed with some bytes flipped, replaced, repeated, taken out or cut off.
    fn damaged(&mut self, seed: &[u8]) -> Vec<u8> {
        let mut bytes = seed.to_vec();
        for _ in 0..=self.below(4) {
            let (at, count) = (self.below(bytes.len()), self.below(12));
            let end = (at + count).min(bytes.len());
            match self.below(6) {
                0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at..end].fill([0, 0xff, b'9', b','][self.below(4)]),
                2 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece.repeat(1 + self.below(3)));
                }
                3 => drop(bytes.drain(at..end)),
                4 if self.below(4) == 0 => bytes.truncate(at),
                _ => {
                    let noise: Vec<u8> = (0..count).map(|_| self.next() as u8).collect();
                    bytes.splice(at..end, noise);
                }
            }
        }
        bytes
    }
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable)
        .ok()
        .map(|text| text.parse().unwrap_or_else(|_| panic!("{variable}={text} is no number")))
}

fn folder(kind: &str, target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(kind).join(target)
}

/// The files of a folder in the order of their names; none where there is no folder.
fn files(folder: &Path) -> Vec<Vec<u8>> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// The recordings of other programs with these endings, which are kept for the tests of the readers.
fn recordings(endings: &[&str]) -> Vec<Vec<u8>> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/tests/fixtures");
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(fixtures).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.retain(|path| endings.iter().any(|ending| path.to_string_lossy().ends_with(ending)));
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Makes what fails in a target a failure of the test that names the case.
fn attempt(target: &str, entry: fn(&[u8]), bytes: &[u8]) {
    if let Err(failure) = catch_unwind(AssertUnwindSafe(|| entry(bytes))) {
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{target}"));
        std::fs::write(&kept, bytes).unwrap();
        eprintln!("the case is kept in {}; move it to host/fuzz/found/{target}/NAME", kept.display());
        resume_unwind(failure);
    }
}

/// Every seed as it is, and a number of damaged ones. `made` are the seeds that are made here and kept in the repository.
fn run(target: &str, entry: fn(&[u8]), made: &[Vec<u8>], more: &[Vec<u8>], cases: usize) {
    let kept = folder("seeds", target);
    if std::env::var("PAM_FUZZ_SEEDS").is_ok_and(|wish| wish == "write") {
        std::fs::create_dir_all(&kept).unwrap();
        for (at, seed) in made.iter().enumerate() {
            std::fs::write(kept.join(format!("made-{at:02}")), seed).unwrap();
        }
    }
    let seeds: Vec<Vec<u8>> =
        files(&kept).into_iter().chain(files(&folder("found", target))).chain(more.iter().cloned()).collect();
    assert!(!seeds.is_empty(), "no seeds of {target}");
    assert!(
        made.len() <= files(&kept).len(),
        "PAM_FUZZ_SEEDS=write cargo test -p host --test fuzz writes the seeds"
    );
    let mut random = Random(number("PAM_FUZZ_SEED").unwrap_or(0x9e37_79b9_7f4a_7c15).max(1));
    attempt(target, entry, &[]);
    for seed in &seeds {
        attempt(target, entry, seed);
    }
    for case in 0..cases * number("PAM_FUZZ_CASES").unwrap_or(1) as usize {
        attempt(target, entry, &random.damaged(&seeds[case % seeds.len()]));
    }
}

fn csv() -> Vec<u8> {
    let rows = (0..30).map(|i| format!("{}.5,{},{:.3},{}\n", i, 100 + i, 0.1 * f64::from(i), 50 - i));
    ("time_s,pressure_kPa,displacement_mm,force_N\n".to_owned() + &rows.collect::<String>()).into_bytes()
}

/// A recording of an emulated controller's samples, as `host record` writes it.
fn mcap() -> Vec<u8> {
    use model_core::link::messages::{Mode, SideSample, State, Telemetry};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let paths = [path.clone()];
    let mut recorder =
        pam_device::recorder::Recorder::create(&paths, &serde_json::json!({"host": "1"})).unwrap();
    for i in 0..20_u64 {
        let side = SideSample { force_n: 50.0, pressure_pa: 1e5, ..SideSample::default() };
        recorder
            .push(&Telemetry {
                time_us: 1000 * i,
                tick: i,
                state: State::Running,
                mode: Mode::Force,
                setpoint: 1.0,
                setpoint_second: 0.0,
                sides: [side].into_iter().collect(),
            })
            .unwrap();
    }
    recorder.finish(&serde_json::json!({"ended_by": "time"})).unwrap();
    std::fs::read(path).unwrap()
}

/// A request in the form of the target that feeds the device.
fn ask<E: Endpoint>(body: &E::Request) -> Vec<u8> {
    let mut wire = [0; MAX_WIRE];
    let header = Header { kind: Kind::Request, id: E::ID, sequence: 1 };
    let length = model_core::link::frame::encode(header, body, &mut wire).unwrap();
    let mut accumulator = model_core::link::frame::Accumulator::new();
    let frame = wire[..length].iter().find_map(|byte| match accumulator.push(*byte) {
        Some(Ok(frame)) => Some(frame.body.to_vec()),
        _ => None,
    });
    request(E::ID, &frame.unwrap())
}

/// Conversations with a device: a run in pressure, one in force with a table of its own, faults, settings, noise on the line.
fn conversations() -> Vec<Vec<u8>> {
    let session = Session { id: 7 };
    let start = |mode| ask::<StartMode>(&messages::Start { mode, session });
    let to = |set_point| ask::<SetTo>(&messages::SetPointOrder { set_point, session });
    let alive = ask::<KeepAlive>(&session);
    let mut buffer = [0; image::MAX_LEN];
    let image = image::write(&model_core::table::example(), &mut buffer).unwrap().to_vec();
    let crc = model_core::check::of_image(&image);
    let begin = messages::TableBegin { side: messages::Side::Agonist, length: image.len() as u32, crc };
    let pieces: Vec<u8> = image
        .chunks(messages::PIECE)
        .enumerate()
        .flat_map(|(at, bytes)| {
            let offset = (at * messages::PIECE) as u32;
            ask::<SendTablePiece>(&messages::TablePiece {
                offset,
                bytes: heapless::Vec::from_slice(bytes).unwrap(),
            })
        })
        .collect();
    let table = [ask::<BeginTable>(&begin), pieces, ask::<CommitTable>(&())].concat();
    let settings = Settings { hold_on: u32::MAX, ..Settings::default() };
    let wave = Reference::Sine { mean: 200e3, amplitude: 100e3, frequency_hz: 2.0 };
    let reference = ask::<SetReference>(&messages::ReferenceOrder { reference: wave, session });
    let rate = ask::<SetTelemetry>(&messages::TelemetryRate { every_ticks: 3 });
    let armed = [sound(1), ask::<Arm>(&session)].concat();
    let pressure = [
        armed.clone(),
        start(Mode::Pressure),
        to(SetPoint::Pressure(300e3)),
        rate,
        sound(20),
        alive.clone(),
        reference,
        sound(20),
        readings(5, [250, 20, 20]),
        ask::<GetStatus>(&()),
        ask::<ClearFault>(&()),
        sound(4),
    ];
    let force = [
        table.clone(),
        armed.clone(),
        start(Mode::Force),
        to(SetPoint::Force(50.0)),
        sound(10),
        readings(60, [100, 20, 60]),
        alive.clone(),
        readings(3, [255, 20, 60]),
        ask::<Disarm>(&()),
    ];
    let stroke = [
        table,
        ask::<EvaluateTable>(&messages::Evaluate::default()),
        armed.clone(),
        start(Mode::Stroke),
        sound(30),
    ];
    let held = [
        ask::<SetSettings>(&settings),
        armed,
        start(Mode::Pressure),
        to(SetPoint::Pressure(200e3)),
        sound(8),
        readings(9, [50, 255, 20]),
        sound(40),
        ask::<Stop>(&()),
        alive,
    ];
    vec![pressure.concat(), force.concat(), stroke.concat(), held.concat(), vec![20; 21]]
}

#[test]
fn frames() {
    let mut wire = [0; MAX_WIRE];
    let mut seed = Vec::new();
    for (id, body) in [(1, &b"body"[..]), (7, &[0; 40]), (200, &[])] {
        let header = Header { kind: Kind::Request, id, sequence: 9 };
        let length = encode_bytes(header, body, &mut wire).unwrap();
        seed.extend_from_slice(&wire[..length]);
    }
    run("frame", entries::frame, &[seed], &[], 20_000);
}

#[test]
fn table_images() {
    let mut buffer = [0; image::MAX_LEN];
    let seed = image::write(&model_core::table::example(), &mut buffer).unwrap().to_vec();
    run("image", entries::image, &[seed], &[], 5_000);
}

#[test]
fn devices() {
    use model_core::link::messages::State;
    for (at, seed) in conversations().iter().enumerate().take(4) {
        let states = entries::device::states(seed);
        assert!(states.contains(&State::Running), "seed {at} runs nothing: {states:?}");
        assert_eq!(states.contains(&State::Fault), at != 2, "seed {at}: {states:?}");
    }
    run("device", entries::device::device, &conversations(), &[], 1_000);
}

#[test]
fn table_files() {
    let about = About { muscle: "mini".into(), ..About::default() };
    let seed = TableFile { table: model_core::table::example(), about }.to_bytes().unwrap();
    run("table_file", entries::table_file, &[seed], &[], 5_000);
}

#[test]
fn text() {
    run("csv", entries::reader, &[csv()], &recordings(&[".csv", ".tsv", ".gz", ".zst"]), 2_000);
}

#[test]
fn matlab_files() {
    run("matlab", entries::reader, &[], &recordings(&["_v5.mat", "_packed.mat", "_struct.mat"]), 1_500);
}

#[test]
fn hdf5_files() {
    run("hdf5", entries::reader, &[], &recordings(&[".h5", "_v73.mat", "v73_struct.mat"]), 600);
}

#[test]
fn parquet_files() {
    run("parquet", entries::reader, &[], &recordings(&[".parquet"]), 1_500);
}

#[test]
fn tdms_files() {
    run("tdms", entries::reader, &[], &recordings(&[".tdms"]), 1_500);
}

#[test]
fn workbooks() {
    run("workbook", entries::reader, &[], &recordings(&[".xlsx", ".ods"]), 600);
    run("sheet", entries::workbook::sheet, &entries::workbook::seeds(), &[], 1_500);
}

#[test]
fn import_descriptions() {
    let description =
        b"delimiter = \";\"\nskip_lines = 1\n[columns.force]\ncolumn = 3\n[columns.pressure]\ncolumn = 2\n";
    let seed = [&description[..], b"\0", &csv()].concat();
    let muscle = b"name = \"m\"\nkind = \"push\"\nrest_length_mm = 3\nbraid_angle_deg= 77\n".to_vec();
    run("import", entries::import, &[seed, muscle], &[], 1_500);
}

#[test]
fn guessed_descriptions() {
    let german = (0..20).map(|i| format!("{:02};3,5;{i},1;40,{}\n", i * 10, 10 + i)).collect::<String>();
    let german = format!("Versuch 7\n\nZeit [s];Druck [bar];Weg [mm];Kraft [N]\n{german}").into_bytes();
    let made = [csv(), german];
    run(
        "import_guess",
        entries::import_guess,
        &made,
        &recordings(&[".csv", ".xlsx", ".ods", "types.parquet", ".tdms"]),
        600,
    );
}

#[test]
fn mcap_files() {
    run("mcap", entries::mcap, &[mcap()], &[], 600);
}

#[test]
fn logs() {
    let seeds = [
        vec![1, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        vec![2; 40],
        vec![3, 0, 9, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 65, 66],
    ];
    run("log", entries::log, &seeds, &[], 5_000);
}

#[test]
fn setpoint_profiles() {
    let seeds = [
        "60",
        "sine mean=60 amplitude=20 frequency=0.5",
        "steps 40 60 80 hold=2",
        "trapezoid low=40 high=80 ramp=1 hold=1",
        "chirp mean=60 amplitude=10 from=0.1 to=5 duration=30",
    ];
    run("setpoint_profile", entries::setpoint_profile, &seeds.map(|s| s.as_bytes().to_vec()), &[], 5_000);
}

/// Each target of `cargo fuzz` is run here, too, and each has seeds there.
#[test]
fn every_target_is_listed() {
    let here: String = include_str!("fuzz.rs").split_whitespace().collect();
    let manifest = include_str!("../fuzz/Cargo.toml");
    let targets = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/fuzz_targets");
    let mut count = 0;
    for entry in std::fs::read_dir(targets).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let target = name.strip_suffix(".rs").unwrap();
        assert!(here.contains(&format!("run(\"{target}\"")), "{target} is not run by the tests");
        assert!(manifest.contains(&format!("name = \"{target}\"")), "{target} is not in the manifest");
        count += 1;
    }
    assert_eq!(here.matches("run(\"").count(), count, "a target is missing there");
}
