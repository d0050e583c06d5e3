//! Recordings of LabVIEW and of robots, made by other programs (`fixtures/make_robot_files.py`) and by the library `mcap`.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use pam_data::error::{DataCode, Error};
use pam_data::recording::import_guess::guess;
use pam_data::recording::{Import, Quantity, Reader, Recording};
use proptest::prelude::*;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn by(description: &str, path: &Path) -> Result<Vec<Recording>, Error> {
    let import = Import::parse(description).unwrap_or_else(|e| panic!("{description}: {e}"));
    Reader::new().import(Some(&import)).file(path)
}

/// The rows of `recording.csv`; `start` is the time of the first, s.
fn assert_the_rows(read: &[Recording], start: f64, tolerance: f64) {
    let text = Reader::new().file(&fixture("recording.csv")).unwrap();
    assert_eq!((read.len(), read[0].len()), (1, text[0].len()));
    let close = |what: &str, a: &[f64], b: &[f64], from: f64, scale: f64| {
        for (i, (x, y)) in a.iter().zip(b).enumerate() {
            assert!((x - from - y).abs() <= tolerance * scale, "{what} {i}: {x} {y}");
        }
    };
    // Seconds since 1970 as a double are exact to a quarter of a microsecond.
    close("time", &read[0].time, &text[0].time, start, 1.0);
    close("pressure", &read[0].pressure, &text[0].pressure, 0.0, 1e5);
    close("stroke", &read[0].stroke, &text[0].stroke, 0.0, 1e-3);
    close("force", read[0].require_force().unwrap(), text[0].require_force().unwrap(), 0.0, 50.0);
}

const EPOCH: f64 = 1.7e9;

#[test]
fn a_bag_of_ros_2_is_described_and_read() {
    let guessed = guess(&fixture("ros2.mcap"), None).unwrap();
    let named: Vec<(Quantity, &str)> =
        guessed.columns.iter().map(|c| (c.quantity, c.header.as_str())).collect();
    assert_eq!(
        named,
        [
            (Quantity::Time, "time_s"),
            (Quantity::Pressure, "muscle/pressure_kPa.data"),
            (Quantity::Displacement, "muscle.stroke_mm.0"),
            (Quantity::Force, "load.wrench.force.x"),
        ],
        "{}",
        guessed.description
    );
    // The rule of the join is printed, and stays in the description.
    let is_described = guessed.description.contains("a row is a message of muscle/pressure_kPa");
    assert!(is_described && guessed.description.contains("interpolated linearly"), "{}", guessed.description);
    assert!(guessed.description.contains("the log time of each message"), "{}", guessed.description);
    let read = by(&guessed.description, &fixture("ros2.mcap")).unwrap();
    assert_the_rows(&read, EPOCH, 1e-6);
}

#[test]
fn a_bag_of_ros_1_is_read_by_the_stamps_of_its_headers() {
    let guessed = guess(&fixture("ros1.mcap"), None).unwrap();
    assert!(guessed.description.contains("the stamp in the header"), "{}", guessed.description);
    assert!(guessed.unused.iter().any(|c| c == "muscle.exposure.secs"), "{:?}", guessed.unused);
    // Names of array elements say nothing; the user does.
    let description = "[columns.time]\ncolumn = \"time_s\"\nunit = \"s\"\n[columns.pressure]\ncolumn = \"muscle.values.0\"\nunit = \"kPa\"\n\
                       [columns.displacement]\ncolumn = \"muscle.values.1\"\nunit = \"mm\"\n\
                       [columns.force]\ncolumn = \"force_N.values.0\"\nunit = \"N\"\n";
    assert_the_rows(&by(description, &fixture("ros1.mcap")).unwrap(), EPOCH, 1e-6);
}

#[test]
fn waveforms_of_labview_have_their_time() {
    assert_the_rows(&Reader::new().file(&fixture("recording.tdms")).unwrap(), 0.0, 1e-12);
    let guessed = guess(&fixture("recording_rates.tdms"), None).unwrap();
    assert!(guessed.description.contains("interpolated linearly"), "{}", guessed.description);
    let read = by(&guessed.description, &fixture("recording_rates.tdms")).unwrap();
    // The pressure is stored with single precision, and the last value of the force is none of the text.
    assert_eq!(read[0].len(), 40);
    let text = Reader::new().file(&fixture("recording.csv")).unwrap();
    for (i, force) in read[0].require_force().unwrap()[..39].iter().enumerate() {
        assert!((force - text[0].require_force().unwrap()[i]).abs() < 1e-9, "{i}");
        assert!((read[0].pressure[i] - text[0].pressure[i]).abs() < 0.05, "{i}");
    }
}

/// A file with JSON topics: rows of topic, time in ms, message.
fn json_file(rows: &[(&str, u64, String)]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer: Writer<_> = WriteOptions::new().compression(None).create(&mut file).unwrap();
    let mut channels: BTreeMap<&str, u16> = BTreeMap::new();
    for (sequence, (topic, ms, text)) in rows.iter().enumerate() {
        let channel_id = *channels
            .entry(topic)
            .or_insert_with(|| writer.add_channel(0, topic, "json", &BTreeMap::new()).unwrap());
        let log_time = 1_000_000 * ms;
        let header =
            MessageHeader { channel_id, sequence: sequence as u32, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

const JSON: &str = "[columns.time]\ncolumn = \"time_s\"\nunit = \"s\"\n[columns.pressure]\ncolumn = \"p.kPa\"\nunit = \"kPa\"\n\
                    [columns.displacement]\ncolumn = \"x.mm\"\nunit = \"mm\"\n";

fn read_json(rows: &[(&str, u64, String)], description: &str) -> Result<Vec<Recording>, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, json_file(rows)).unwrap();
    by(description, &path)
}

/// Pressures each 10 ms from 0 to 1 s, strokes each 30 ms from 95 ms on, with a pause where `pause` says so.
fn two_rates(pause: impl Fn(u64) -> bool) -> Vec<(&'static str, u64, String)> {
    let mut rows: Vec<_> = (0..=100).map(|i| ("/p", 10 * i, format!("{{\"kPa\": {}}}", 100 + i))).collect();
    let strokes = (0..30).map(|i| 95 + 30 * i).filter(|ms| !pause(*ms));
    rows.extend(strokes.map(|ms| ("/x", ms, format!("{{\"mm\": {}, \"note\": \"a\"}}", ms as f64 / 100.0))));
    rows.push(("/other", 5, "{\"v\": [1, {\"w\": true}]}".into()));
    rows
}

#[test]
fn topics_of_different_rates_meet_at_the_times_of_the_pressure() {
    let read = read_json(&two_rates(|_| false), JSON).unwrap();
    // From the first stroke to the last: 95 to 965 ms.
    assert_eq!((read[0].len(), read[0].time[0], read[0].time[86]), (87, 0.1, 0.96));
    for (t, x) in read[0].time.iter().zip(&read[0].stroke) {
        assert!((x - t * 10.0 / 1e3).abs() < 1e-12, "{t} {x}");
    }
}

#[test]
fn a_pause_of_a_topic_is_not_filled_in() {
    // Eleven messages are missing: 395 ms to 755 ms are twelve intervals of 30 ms, more than ten.
    let rows = two_rates(|ms| (400..730).contains(&ms));
    let error = read_json(&rows, JSON).unwrap_err();
    assert!(error.code() == DataCode::RecordingNotFinite, "{error}");
    assert_eq!(error.place().column.as_deref(), Some("x.mm"));
    let read = read_json(&rows, &format!("missing = \"skip\"\n{JSON}")).unwrap();
    assert_eq!((read[0].len(), read[0].skipped), (51, 36), "{:?}", read[0].time);
    // Three lost messages are not a pause.
    assert_eq!(read_json(&two_rates(|ms| (400..490).contains(&ms)), JSON).unwrap()[0].len(), 87);
}

#[test]
fn topics_without_a_common_time_are_reported() {
    let mut rows = two_rates(|_| false);
    for (topic, ms, _) in &mut rows {
        *ms += if *topic == "/x" { 5000 } else { 0 };
    }
    let error = read_json(&rows, JSON).unwrap_err().to_string();
    assert!(error.contains("no time in common") && error.contains("`p`"), "{error}");
}

#[test]
fn files_that_are_not_read_are_reported_with_what_helps() {
    let folder = tempfile::tempdir().unwrap();
    for (bytes, said) in [
        (&b"#ROSBAG V2.0\n"[..], "mcap convert"),
        (b"SQLite format 3\0", "ros2 bag convert"),
        (b"TDSm\x0e\0\0\0", "leads out of the file"),
        (b"\x89MCAP0\r\n", "in the middle of a record"),
    ] {
        let path = folder.path().join("file");
        std::fs::write(&path, bytes).unwrap();
        let error = Reader::new().file(&path).unwrap_err();
        let text = format!("{} {:?}", error.cause(), error);
        assert!(text.contains(said), "{text}");
    }
    let error = read_json(&[("/p", 0, "[1]".into())], JSON).unwrap_err().to_string();
    assert!(error.contains("number 1 does not fit its definition"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn damaged_copies_end_in_an_error_or_in_sound_rows(which in 0_usize..4, at: prop::sample::Index, byte: u8, cut: bool) {
        let name = ["ros2.mcap", "ros1.mcap", "recording.tdms", "recording_rates.tdms"][which];
        let mut bytes = std::fs::read(fixture(name)).unwrap();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        if cut {
            bytes.truncate(at);
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&file, &bytes).unwrap();
        if let Ok(guessed) = guess(file.path(), None)
            && let Ok(import) = Import::parse(&guessed.description)
            && let Ok(read) = Reader::new().import(Some(&import)).file(file.path())
        {
            for recording in read {
                recording.check().unwrap();
            }
        }
    }
}
