//! Import descriptions by guess: units, zeros, and clocks as laboratories write them.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::fmt::Write;

use pam_data::recording::import_guess::{Guess, guess};
use pam_data::recording::{Import, Reader, Recording};

/// One loop: time in s, gauge pressure in kPa, stroke in mm, force in N. The muscle is slack and vented for the first two seconds.
fn readings() -> Vec<[f64; 4]> {
    let at = |i: u32| {
        let (t, pressure) = (0.05 * f64::from(i), if i < 40 { 0.0 } else { 300.0 + f64::from(i % 3) });
        let stroke = if i < 40 { 0.0 } else { 4.0 * (1.0 - (f64::from(i - 40) / 40.0 - 1.0).abs()) };
        [t, pressure, stroke, if i < 40 { 0.0 } else { 90.0 - 20.0 * stroke }]
    };
    (0..120).map(at).collect()
}

/// A file of these readings under a header, each row written by `line`.
fn file(header: &str, line: impl Fn([f64; 4]) -> String) -> String {
    readings().into_iter().fold(format!("{header}\n"), |mut text, row| {
        writeln!(text, "{}", line(row)).unwrap();
        text
    })
}

fn by_guess(text: &str) -> (Guess, Recording) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench.csv");
    std::fs::write(&path, text).unwrap();
    let guessed = guess(&path, None).unwrap_or_else(|e| panic!("{text}: {e}"));
    let import =
        Import::parse(&guessed.description).unwrap_or_else(|e| panic!("{}: {e}", guessed.description));
    let reader = Reader::with_rest_length(0.1).import(Some(&import));
    let mut read = reader.file(&path).unwrap_or_else(|e| panic!("{}\n{e}", guessed.description));
    assert_eq!(read.len(), 1, "{}", guessed.description);
    (guessed, read.remove(0))
}

/// Reads a file by its guess, and compares every row with what was written: within 1 Pa, 1 µm, 1 mN, 1 µs.
fn read_back(text: &str) -> Guess {
    let (guessed, r) = by_guess(text);
    let force = r.require_force().unwrap_or_else(|e| panic!("{}\n{e}", guessed.description));
    for (i, [t, p, x, f]) in readings().into_iter().enumerate() {
        let context = format!("row {i}\n{}", guessed.description);
        assert!((r.time[i] - r.time[0] - t).abs() < 1e-6, "{} s, {context}", r.time[i] - r.time[0]);
        assert!((r.pressure[i] - 1e3 * p).abs() < 1.0, "{} Pa, {context}", r.pressure[i]);
        assert!((r.stroke[i] - 1e-3 * x).abs() < 1e-6, "{} m, {context}", r.stroke[i]);
        assert!((force[i] - f).abs() < 1e-3, "{} N, {context}", force[i]);
    }
    guessed
}

/// A row with its pressure and force by factors and offsets, time in s and stroke in mm.
fn row([t, p, x, f]: [f64; 4], pressure: impl Fn(f64) -> f64, force: impl Fn(f64) -> f64) -> String {
    format!("{t:.3},{:.7},{x:.5},{:.7}", pressure(p), force(f))
}

const ATMOSPHERE: f64 = 101.325;
const PSI: f64 = 6.894_757_293_168;
const GRAVITY: f64 = 9.806_65;

#[test]
fn a_unit_that_counts_from_vacuum_loses_one_atmosphere() {
    let psi = |p: f64| (p + ATMOSPHERE) / PSI;
    let bar = |p: f64| (p + ATMOSPHERE) / 100.0;
    let kpa = |p: f64| p + ATMOSPHERE;
    let same = |f: f64| f;
    let files = [
        file("Time (s),Pressure (psia),Stroke (mm),Force (N)", |r| row(r, psi, same)),
        file("t_s,p_psia,x_mm,F_N", |r| row(r, psi, same)),
        file("Time [s],Pressure [bar(a)],Stroke [mm],Force [N]", |r| row(r, bar, same)),
        file("Time (s),Pressure (bar(a)),Stroke (mm),Force (N)", |r| row(r, bar, same)),
        file("time s,Pressure bar (a),stroke mm,force N", |r| row(r, bar, same)),
        file("Time [s],Pressure [kPa abs],Stroke [mm],Force [N]", |r| row(r, kpa, same)),
        file("t_s,pressure_kPa_abs,x_mm,F_N", |r| row(r, kpa, same)),
        file("time,pressure,stroke,force\ns,mbar abs.,mm,N", |r| row(r, |p| 10.0 * kpa(p), same)),
        file("Zeit [s],Absolutdruck [bar],Weg [mm],Kraft [N]", |r| row(r, bar, same)),
    ];
    for text in files {
        let guessed = read_back(&text);
        let notes = guessed
            .checks
            .iter()
            .filter(|c| c.text().contains("one standard atmosphere is subtracted"))
            .count();
        assert_eq!(notes, 1, "{}", guessed.description);
    }
}

#[test]
fn a_unit_that_counts_from_the_atmosphere_stays_as_it_is() {
    let (bar, psi) = (|p: f64| p / 100.0, |p: f64| p / PSI);
    let same = |f: f64| f;
    let files = [
        file("Time (s),Pressure (bar(g)),Stroke (mm),Force (N)", |r| row(r, bar, same)),
        file("Time (s),Pressure (barg),Stroke (mm),Force (N)", |r| row(r, bar, same)),
        file("Time (s),Pressure [psi gauge],Stroke (mm),Force (N)", |r| row(r, psi, same)),
        file("Zeit [s],Druck [barü],Weg [mm],Kraft [N]", |r| row(r, bar, same)),
        file("t_s,p_psig,x_mm,F_N", |r| row(r, psi, same)),
    ];
    for text in files {
        let guessed = read_back(&text);
        assert!(!guessed.description.contains("offset"), "{}", guessed.description);
    }
}

#[test]
fn a_vented_muscle_at_one_atmosphere_is_a_question() {
    let absolute = |p: f64| p + 99.2;
    let text = file("time_s,pressure_kPa,displacement_mm,force_N", |r| row(r, absolute, |f| f));
    let (guessed, read) = by_guess(&text);
    let question = guessed.checks.iter().find(|c| c.text().contains("is pressure_kPa absolute pressure?"));
    let question = question.unwrap_or_else(|| panic!("{}", guessed.description));
    assert!(question.text().contains("99.2 kPa") && question.text().contains("slack"), "{question}");
    assert!(question.text().contains("write offset = -101.3 under [columns.pressure]"), "{question}");
    assert!((read.pressure[0] - 99.2e3).abs() < 1.0, "nothing is subtracted");
    assert!(guessed.description.contains(&format!("# - {question}")));
    // A loop at 100 kPa by a gauge, under load from the beginning, is none; nor is a vented gauge.
    let loaded = |[t, _, x, f]: [f64; 4]| format!("{t:.3},100.2,{x:.3},{:.3}", f + 30.0);
    for text in [
        file("time_s,pressure_kPa,displacement_mm,force_N", loaded),
        file("time_s,pressure_kPa,displacement_mm,force_N", |r| row(r, |p| p, |f| f)),
    ] {
        let (guessed, _) = by_guess(&text);
        assert!(!guessed.description.contains("absolute"), "{}", guessed.description);
    }
}

#[test]
fn forces_are_read_in_every_unit_of_a_balance() {
    let kpa = |p: f64| p;
    let pound = 0.453_592_37 * GRAVITY;
    let units = [
        ("Force (lbf)", pound),
        ("Force [ozf]", pound / 16.0),
        ("Load (oz)", pound / 16.0),
        ("F_kgf", GRAVITY),
        ("Kraft [kp]", GRAVITY),
        ("Load cell (g)", 1e-3 * GRAVITY),
        ("force_gf", 1e-3 * GRAVITY),
        ("Force / daN", 10.0),
    ];
    for (header, factor) in units {
        let header = format!("time_s,pressure_kPa,stroke_mm,{header}");
        read_back(&file(&header, |r| row(r, kpa, |f| f / factor)));
    }
}

/// What a column holds at a stroke, mm.
type Convert = fn(f64) -> f64;

#[test]
fn strokes_and_lengths_are_read_in_inches_per_cent_and_ratios() {
    // L0 is 100 mm: 4 mm are 4 %.
    let headers: [(&str, Convert); 9] = [
        ("Stroke (in)", |x| x / 25.4),
        ("Length [inches]", |x| (100.0 - x) / 25.4),
        ("Contraction [%]", |x| x),
        ("Contraction rate (%)", |x| x),
        ("contraction ratio", |x| x / 100.0),
        ("ΔL/L0 [-]", |x| x / 100.0),
        ("dL/L0 (%)", |x| -x),
        ("L/L0", |x| 1.0 - x / 100.0),
        ("Length (% of L0)", |x| 100.0 - x),
    ];
    for (header, convert) in headers {
        let text = file(&format!("time_s,pressure_kPa,{header},force_N"), |[t, p, x, f]| {
            format!("{t:.3},{p:.4},{:.8},{f:.4}", convert(x))
        });
        read_back(&text);
    }
}

#[test]
fn clocks_are_read_in_every_unit_and_as_time_stamps() {
    let rest = |[_, p, x, f]: [f64; 4]| format!("{p:.4},{x:.5},{f:.4}");
    let header = |time: &str| format!("{time},pressure_kPa,stroke_mm,force_N");
    let of_day = |t: f64| format!("13:{:02}:{:06.3}", 59 + (t as u32) / 60, t % 60.0);
    let files = [
        file(&header("t [ms]"), |r| format!("{:.1},{}", 1e3 * r[0], rest(r))),
        file(&header("Time (µs)"), |r| format!("{:.0},{}", 1e6 * r[0], rest(r))),
        // The Greek letter, which looks the same.
        file(&header("Time (\u{3bc}s)"), |r| format!("{:.0},{}", 1e6 * r[0], rest(r))),
        file(&header("micros"), |r| format!("{:.0},{}", 1e6 * r[0], rest(r))),
        file(&header("Elapsed (min)"), |r| format!("{:.9},{}", r[0] / 60.0, rest(r))),
        file(&header("time in minutes"), |r| format!("{:.9},{}", r[0] / 60.0, rest(r))),
        file(&header("Timestamp"), |r| format!("2026-11-21T{},{}", of_day(r[0]), rest(r))),
        file(&header("datetime"), |r| format!("2026-11-21 {}+01:00,{}", of_day(r[0]), rest(r))),
        file(&header("Date"), |r| format!("\"2026-11-21 {}Z\",{}", of_day(r[0]), rest(r))),
        file(&header("Date,Time"), |r| format!("2026-11-21,{},{}", of_day(r[0]), rest(r))),
        file(&header("Uhrzeit"), |r| format!("{},{}", of_day(r[0]), rest(r))),
        // Seconds since 1970.
        file(&header("unix_time"), |r| format!("{:.3},{}", 1_795_219_200.0 + r[0], rest(r))),
    ];
    for text in files {
        read_back(&text);
    }
}

#[test]
fn spreadsheets_with_decimal_commas_are_read_with_their_time_stamps_and_two_rows_of_header() {
    let comma = |v: f64, digits: usize| format!("{v:.digits$}").replace('.', ",");
    let cells = |[_, p, x, f]: [f64; 4]| format!("{};{};{}", comma(p / 100.0, 6), comma(x, 5), comma(f, 4));
    let stamp = |t: f64| format!("21.11.2026 13:30:{}", comma(t + 100.0, 3).split_off(1));
    let files = [
        file("Zeit [s];Druck [bar];Weg [mm];Kraft [N]", |r| format!("{};{}", comma(r[0], 3), cells(r))),
        file("Zeit;Druck;Weg;Kraft\n[s];[bar];[mm];[N]", |r| format!("{};{}", comma(r[0], 3), cells(r))),
        file("Messung 12;;;\n;;;\nZeit;Druck;Weg;Kraft\ns;bar;mm;N", |r| {
            format!("{};{}", comma(r[0], 3), cells(r))
        }),
        file("Datum/Uhrzeit;Druck (bar);Weg (mm);Kraft (N)", |r| format!("{};{}", stamp(r[0]), cells(r))),
        file("Zeitstempel;Druck;Weg;Kraft\n;bar;mm;N", |r| format!("{};{}", stamp(r[0]), cells(r))),
        // A spreadsheet that puts every cell between quotation marks.
        file("\"Zeit [s]\";\"Druck [bar]\";\"Weg [mm]\";\"Kraft [N]\"", |r| {
            let line = format!("{};{}", comma(r[0], 3), cells(r));
            format!("\"{}\"", line.replace(';', "\";\""))
        }),
    ];
    for text in files {
        read_back(&text);
    }
}

#[test]
fn a_stamp_that_is_ambiguous_or_damaged_is_reported() {
    let header = "Timestamp,pressure_kPa,stroke_mm,force_N";
    let american = file(header, |[t, p, x, f]| format!("11/05/2026 1:30:{t:05.2} PM,{p},{x},{f}"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench.csv");
    std::fs::write(&path, american).unwrap();
    let guessed = guess(&path, None).unwrap();
    assert!(
        guessed.unknown.iter().any(|u| u.text().contains("timestamp-month-first")),
        "{:?}",
        guessed.unknown
    );
    let iso = file(header, |[t, p, x, f]| format!("2026-11-05T13:30:{t:06.3},{p},{x},{f}"));
    std::fs::write(&path, iso.replacen("13:30:00.100", "13:61:00.100", 1)).unwrap();
    let import = Import::parse("[columns.time]\ncolumn = 1\nunit = \"timestamp\"\n").unwrap();
    let error = Reader::new().import(Some(&import)).file(&path).unwrap_err().to_string();
    assert!(error.contains("not a time stamp") && error.contains(":4"), "{error}");
    let other = Import::parse("[columns.force]\ncolumn = 1\nunit = \"timestamp\"\n").unwrap_err();
    assert!(other.to_string().contains("force has no unit `timestamp`"), "{other}");
}
