//! The fuzz targets for a moment, with a fixed generator: the same cases on every machine.
#![allow(clippy::unwrap_used)] // what fails here fails the test

#[path = "../fuzz/entries.rs"]
mod entries;

use model_core::image;
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode_bytes};
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

/// Every seed as it is, and a number of damaged ones.
fn run(entry: fn(&[u8]), seeds: &[Vec<u8>], cases: usize) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    entry(&[]);
    for seed in seeds {
        entry(seed);
    }
    for case in 0..cases {
        entry(&random.damaged(&seeds[case % seeds.len()]));
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

/// A MATLAB file of version 5 with one array.
fn matlab() -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(126, b' ');
    file.extend(b"IM");
    let mut array = Vec::new();
    for (kind, data) in [
        (6_u32, [6_u32, 0].map(u32::to_le_bytes).concat()),
        (5, [12_u32, 1].map(u32::to_le_bytes).concat()),
        (1, b"time_s\0\0".to_vec()),
        (9, (0..12).flat_map(|i| f64::from(i).to_le_bytes()).collect()),
    ] {
        array.extend(kind.to_le_bytes());
        array.extend((data.len() as u32).to_le_bytes());
        array.extend(data);
    }
    file.extend(14_u32.to_le_bytes());
    file.extend((array.len() as u32).to_le_bytes());
    file.extend(array);
    file
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
    run(entries::frame, &[seed], 20_000);
}

#[test]
fn table_images() {
    let mut buffer = [0; image::MAX_LEN];
    let seed = image::write(&model_core::table::example(), &mut buffer).unwrap().to_vec();
    run(entries::image, &[seed], 5_000);
}

#[test]
fn table_files() {
    let about = About { muscle: "mini".into(), ..About::default() };
    let seed = TableFile { table: model_core::table::example(), about }.to_bytes().unwrap();
    run(entries::table_file, &[seed], 5_000);
}

#[test]
fn recordings() {
    run(entries::reader, &[csv(), mcap(), matlab()], 1_500);
}

#[test]
fn import_descriptions() {
    let description =
        b"delimiter = \";\"\nskip_lines = 1\n[columns.force]\ncolumn = 3\n[columns.pressure]\ncolumn = 2\n";
    let seed = [&description[..], b"\0", &csv()].concat();
    let muscle = b"name = \"m\"\nkind = \"push\"\nrest_length_mm = 3\nbraid_angle_deg= 77\n".to_vec();
    run(entries::import, &[seed, muscle], 1_500);
}

#[test]
fn mcap_files() {
    run(entries::mcap, &[mcap()], 600);
}

#[test]
fn logs() {
    let seeds = [
        vec![1, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        vec![2; 40],
        vec![3, 0, 9, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 65, 66],
    ];
    run(entries::log, &seeds, 5_000);
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
    run(entries::setpoint_profile, &seeds.map(|s| s.as_bytes().to_vec()), 5_000);
}
