//! The message for each invalid recording: one line per case, kept as a snapshot.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use pam_data::error::Error;
use pam_data::recording::{Import, Reader, Recording};

fn read(folder: &Path, name: &str, bytes: &[u8], import: Option<&str>) -> Result<Vec<Recording>, Error> {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    let import = import.map(Import::parse).transpose()?;
    Reader::new().import(import.as_ref()).file(&path)
}

const HEADER: &str = "time_s,pressure_kPa,displacement_mm,force_N\n";

fn table(rows: usize, change: impl Fn(usize) -> Option<&'static str>) -> Vec<u8> {
    let mut text = HEADER.to_owned();
    for i in 0..rows {
        match change(i) {
            Some(line) => writeln!(text, "{line}").unwrap(),
            None => writeln!(text, "{},{},{},{}", i as f64 * 0.1, 300, i as f64 * 0.01, 50).unwrap(),
        }
    }
    text.into_bytes()
}

fn line_12(line: &'static str) -> Vec<u8> {
    table(40, move |i| (i == 10).then_some(line))
}

#[test]
fn every_bad_input_is_reported_with_place_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let with_header =
        |header: &str| [header.as_bytes(), b"\n", &table(20, |_| None)[HEADER.len()..]].concat();
    let utf16: Vec<u8> = table(20, |_| None).into_iter().flat_map(|b| [b, 0]).collect();
    let clock_of_whole_seconds = String::from_utf8(table(40, |_| None)).unwrap();
    let clock_of_whole_seconds = HEADER.to_owned()
        + &clock_of_whole_seconds
            .lines()
            .skip(1)
            .map(|l| {
                let (time, rest) = l.split_once(',').unwrap();
                format!("{},{rest}\n", time.split('.').next().unwrap())
            })
            .collect::<String>();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(&table(4000, |_| None)).unwrap();
    let gzip = gzip.finish().unwrap();
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("empty", vec![]),
        ("blank", b" \n\n \n".to_vec()),
        ("header-only", HEADER.into()),
        ("three-rows", table(3, |_| None)),
        ("text", line_12("1.0,300,oops,50")),
        ("control-characters", line_12("1.0,\u{1b}[31m,0.1,50")),
        ("empty-cell", line_12("1.0,,0.1,50")),
        ("dashes", line_12("1.0,---,0.1,50")),
        ("nan", line_12("1.0,300,NaN,50")),
        ("infinite", line_12("1.0,300,0.1,-inf")),
        ("overflow", line_12("1.0,300,0.1,1e999")),
        ("na", line_12("1.0,300,N/A,50")),
        ("backwards", line_12("0.5,300,0.1,50")),
        ("repeated", line_12("0.9,300,0.1,50")),
        ("short-line", line_12("1.0,300,0.1")),
        ("long-line", line_12("1.0,300,0.1,50,7")),
        ("decimal-commas", line_12("1,0,300,0,0,1,50,0")),
        ("open-quote", line_12("1.0,\"300,0.1,50")),
        ("vacuum", line_12("1.0,-500,0.1,50")),
        ("counts-as-newtons", line_12("1.0,300,0.1,16777215")),
        ("no-pressure", with_header("time_s,presure_kPa,displacement_mm,force_N")),
        ("no-time", with_header("Time,pressure_kPa,displacement_mm,force_N")),
        ("no-stroke", with_header("time_s,pressure_kPa,x,force_N")),
        ("case", with_header("time_s,pressure_kpa,displacement_mm,force_N")),
        ("unit", with_header("time_s,pressure_mmHg,displacement_mm,force_N")),
        ("force-unit", with_header("time_s,pressure_kPa,displacement_mm,force_kgf")),
        ("no-unit", with_header("time_s,pressure,displacement_mm,force_N")),
        ("twice", with_header("time_s,pressure_kPa,displacement_mm,pressure_bar")),
        ("same", with_header("time_s,pressure_kPa,displacement_mm,pressure_kPa")),
        ("length", with_header("time_s,pressure_kPa,length_mm,force_N")),
        ("no-header", table(20, |_| None)[HEADER.len()..].to_vec()),
        ("bars", String::from_utf8(table(20, |_| None)).unwrap().replace(',', "|").into_bytes()),
        ("utf16-no-mark", utf16),
        ("date", line_12("2026-03-01 10:00:01,300,0.1,50")),
        ("time-of-day", line_12("10:00:01.5,300,0.1,50")),
        ("thousands", line_12("1.0,\"1,300.5\",0.1,50")),
        ("row-twice", line_12("0.9,300,0.09,50")),
        ("coarse-clock", clock_of_whole_seconds.into_bytes()),
        ("header-below", [b"Bench 5\nOperator: Jo\n\n", &table(20, |_| None)[..]].concat()),
        ("binary", (0..20_000u32).flat_map(|i| (i.wrapping_mul(2_654_435_761)).to_le_bytes()).collect()),
        ("excel", b"PK\x03\x04rest of a spreadsheet".to_vec()),
        ("excel-97", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1rest of a spreadsheet".to_vec()),
        ("hdf5-cut", b"\x89HDF".to_vec()),
        ("one-line", vec![b'7'; 9 << 20]),
        (
            "carriage-returns",
            String::from_utf8(table(20, |_| None)).unwrap().replace('\n', "\r").into_bytes(),
        ),
        ("cut.gz", gzip[..gzip.len() / 2].to_vec()),
        ("damaged.zst", [&[0x28, 0xb5, 0x2f, 0xfd][..], &[0xff; 40]].concat()),
    ];
    let mut messages = String::new();
    for (name, bytes) in cases {
        let error = read(folder.path(), name, &bytes, None).expect_err(name);
        let text = error.to_string().replace(&format!("{}/", folder.path().display()), "");
        writeln!(messages, "{name}: [{}] {text}\n    {}", error.code().name(), error.advice().unwrap_or("-"))
            .unwrap();
    }
    let absent = Reader::new().file(&folder.path().join("absent.csv")).unwrap_err();
    let is_folder = Reader::new().file(folder.path()).unwrap_err();
    for error in [absent, is_folder] {
        let text = error.to_string().replace(&folder.path().display().to_string(), "FOLDER");
        writeln!(messages, "[{}] {text}", error.code().name()).unwrap();
    }
    insta::assert_snapshot!(messages);
}

#[test]
fn every_bad_import_description_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("skip_lines = -1", ""),
        ("[columns.presure]\ncolumn = 1", ""),
        ("[columns.pressure]\ncolumn = 0", ""),
        ("[columns.pressure]\ncolumn = 9", ""),
        ("[columns.pressure]\ncolumn = \"P\"", ""),
        ("[columns.pressure]\ncolumn = 2\nunit = \"mmHg\"", ""),
        ("[columns.pressure]\ncolumn = 2\nzero = \"first\"", ""),
        ("[columns.displacement]\ncolumn = 3\nzero = \"lowest\"", ""),
        ("[columns.length]\ncolumn = 3\n[columns.contraction]\ncolumn = 2", ""),
        ("[constants]\npressure = 200", ""),
        ("delimiter = \"7\"", ""),
        ("file_name = \"(\"", ""),
        ("file_name = '(?<pressure_kPa>[a-z]+)'", ""),
        ("file_name = 'run(?<run>[0-9]+)'", ""),
        ("skip_lines = 50", ""),
        ("[where]\nforce_N = 51", ""),
        ("[where]\nforce_N = \"{rest_length_mm}\"", ""),
        ("split_by = [\"run\"]", ""),
        ("[lookup]\nfile = \"absent.csv\"\nmatch = { file = \"{file}\" }", ""),
        ("decimal = \"comma\"\ndelimiter = \"comma\"", ""),
    ];
    let mut messages = String::new();
    for (import, _) in cases {
        let error = read(folder.path(), "bench", &table(20, |_| None), Some(import)).expect_err(import);
        let text = error.to_string().replace(&format!("{}/", folder.path().display()), "");
        let advice = error.advice().unwrap_or("-");
        writeln!(
            messages,
            "{}\n    [{}] {text}\n    {advice}",
            import.replace('\n', " | "),
            error.code().name()
        )
        .unwrap();
    }
    insta::assert_snapshot!(messages);
}

#[test]
fn every_value_of_a_filtered_column_is_listed_or_counted() {
    let folder = tempfile::tempdir().unwrap();
    let advice = |runs: usize| {
        let mut text = HEADER.trim_end().to_owned() + ",run\n";
        for i in 0..40 * runs {
            writeln!(text, "{},300,{},50,{}", i as f64 * 0.1, i as f64 * 0.01, i / 40 + 1).unwrap();
        }
        let error = read(folder.path(), "runs.csv", text.as_bytes(), Some("[where]\nrun = 99")).unwrap_err();
        error.advice().unwrap_or_default().to_owned()
    };
    assert!(advice(10).ends_with("run is one of 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"), "{}", advice(10));
    assert!(advice(23).ends_with("19, 20, and 3 more"), "{}", advice(23));
}
