//! Import descriptions by guess: files as laboratories write them, and real recordings where they are present.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::fmt::Write;
use std::path::{Path, PathBuf};

use pam_data::recording::import_guess::{Guess, guess};
use pam_data::recording::{Import, Quantity, Reader, Recording};
use proptest::prelude::*;

/// Reads a text with its proposed import description.
fn by_guess(text: &str, rest_length: Option<f64>) -> (Guess, Vec<Recording>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench_300kPa.csv");
    std::fs::write(&path, text).unwrap();
    let guessed = guess(&path, None).unwrap_or_else(|e| panic!("{text}: {e}"));
    let import =
        Import::parse(&guessed.description).unwrap_or_else(|e| panic!("{}: {e}", guessed.description));
    let reader = rest_length.map_or_else(Reader::new, Reader::with_rest_length).import(Some(&import));
    let read = reader.file(&path).unwrap_or_else(|e| panic!("{}\n{e}", guessed.description));
    (guessed, read)
}

/// Rows of a slow stroke: time in s, pressure in bar, stroke in mm, force in N.
fn rows(line: impl Fn([f64; 4]) -> String) -> String {
    (0..40).fold(String::new(), |mut text, i| {
        let stroke = 4.0 * (1.0 - (f64::from(i) / 20.0 - 1.0).abs());
        let row = [0.05 * f64::from(i), 3.0 + 0.01 * f64::from(i % 3), stroke, 90.0 - 20.0 * stroke];
        writeln!(text, "{}", line(row)).unwrap();
        text
    })
}

fn assert_the_rows(text: &str, recording: &Recording) {
    assert_eq!(recording.len(), 40, "{text}");
    assert!((recording.time[39] - recording.time[0] - 1.95).abs() < 1e-9, "{text}");
    assert!((recording.pressure[1] - 301e3).abs() < 1e-3, "{text}: {}", recording.pressure[1]);
    assert!((recording.stroke[20] - 4e-3).abs() < 1e-9, "{text}: {}", recording.stroke[20]);
    assert!((recording.require_force().unwrap()[20] - 10.0).abs() < 1e-6, "{text}");
}

fn plain(row: [f64; 4]) -> String {
    row.map(|v| format!("{v:.4}")).join(",")
}

fn commas(row: [f64; 4]) -> String {
    row.map(|v| format!("{v:.4}").replace('.', ",")).join(";")
}

#[test]
fn files_of_laboratories_are_read_by_what_is_guessed() {
    let files = [
        format!("t_s,Pressure [bar],stroke (mm),F (N)\n{}", rows(plain)),
        format!("Zeit [s];Druck [bar];Weg [mm];Kraft [N]\n{}", rows(commas)),
        format!("Zeit;Druck;Weg;Kraft\ns;bar;mm;N\n{}", rows(commas)),
        // No unit but what the values allow.
        format!("time,pressure,displacement,load cell\n{}", rows(plain)),
        // A test machine: a title, remarks, tabs, further columns, other units.
        format!(
            "Tensile test 7\nOperator: NN\n\nTime (ms)\tForce (lbf)\tCrosshead (in)\tPressure (psi)\tValve\n{}",
            rows(|[t, p, x, f]| format!(
                "{}\t{}\t{}\t{}\topen",
                t * 1e3,
                f / 4.448_221_615_260_5,
                2.0 - x / 25.4,
                p * 14.503_773_773
            ))
        ),
        // Blanks, a remark with the names, and a force that is negative as the muscle pulls.
        format!(
            "# time_s p_bar x_mm F_N\n{}",
            rows(|[t, p, x, f]| format!(" {t:.3}  {p:.4} {x:.4} {:.4}", -f))
        ),
        format!(
            "Temps (s)|Pression (bar)|Course (mm)|Effort (daN)\n{}",
            rows(|[t, p, x, f]| [t, p, x, f / 10.0].map(|v| format!("{v:.5}")).join("|"))
        ),
    ];
    for text in files {
        let (_, read) = by_guess(&text, None);
        assert_eq!(read.len(), 1, "{text}");
        assert_the_rows(&text, &read[0]);
    }
}

#[test]
fn a_pressure_of_the_name_or_of_the_lines_above_is_taken() {
    let three = |[t, _, x, f]: [f64; 4]| format!("{t:.3},{x:.3},{f:.3}");
    let (guessed, read) = by_guess(&format!("time_s,displacement_mm,force_N\n{}", rows(three)), None);
    assert_eq!((read[0].pressure[0], guessed.patterns[0].text), (300e3, "file_name"));
    let above = format!("Test pressure: 3,02 bar\ntime_s,displacement_mm,force_N\n{}", rows(three));
    let (guessed, read) = by_guess(&above, None);
    assert_eq!(
        (read[0].pressure[0], guessed.patterns[0].text),
        (302e3, "preamble"),
        "{}",
        guessed.description
    );
}

#[test]
fn runs_in_one_file_are_separated_where_time_restarts() {
    let mut text = "condition,trial,phase,t_s,p_kPa,length_mm,force_N,force_sd_N\n".to_owned();
    for (condition, length) in [("long", 120), ("short", 110)] {
        for trial in 1..=3 {
            for i in 0..20 {
                let (phase, p) = if i < 10 { ("up", 50 * i) } else { ("down", 50 * (20 - i)) };
                writeln!(
                    text,
                    "{condition},{trial},{phase},{},{p},{length},{},0.1",
                    0.5 * f64::from(i),
                    p / 3
                )
                .unwrap();
            }
        }
    }
    let (guessed, read) = by_guess(&text, Some(0.12));
    assert_eq!((guessed.split_by.as_slice(), read.len()), (&["condition".to_owned(), "trial".into()][..], 6));
    assert_eq!(read[5].held_stroke().map(|s| (s * 1e6).round()), Some(10_000.0));
    assert_eq!(read[0].direction.as_ref().map(|d| (d[0], d[19])), Some((1, -1)));
    assert_eq!(guessed.unused, ["force_sd_N"]);
}

#[test]
fn unknown_columns_are_left_out_and_listed() {
    let text = format!(
        "time_s,pressure_kPa,stroke_mm,load [V]\n{}",
        rows(|[t, p, x, f]| format!("{t},{},{x},{}", 100.0 * p, f / 50.0))
    );
    let (guessed, read) = by_guess(&text, None);
    assert!(!guessed.has(Quantity::Force) && read[0].force.is_none());
    assert!(
        guessed.unknown.iter().any(|l| l.text().contains("scale and the offset")),
        "{:?}",
        guessed.unknown
    );
    // A contraction of 75 % is relative to something else than the rest length.
    let text = format!(
        "time_s,pressure_kPa,contraction,force_N,stroke_mm\n{}",
        rows(|[t, p, x, f]| format!("{t},{p},{},{f},{x}", 25 * (t as i32)))
    );
    let (guessed, _) = by_guess(&text, None);
    assert!(guessed.has(Quantity::Displacement) && !guessed.has(Quantity::Contraction));
}

fn data(file: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(file);
    if !path.exists() {
        eprintln!("skipped: {} is not here", path.display());
        return None;
    }
    Some(path)
}

/// Descriptions that a user wrote of the same files are the reference.
#[test]
fn real_recordings_are_read_as_by_a_handwritten_description() {
    let cases = [
        ("aarl-festo-10mm-2022/festo10_cut150mm.csv", "festo-2022-staircase", 0.132),
        ("aarl-festo-10mm-2021/festo10_rest120mm_13cm.csv", "festo-2021-staircase", 0.12),
        ("aarl-festo-10mm-2022/settled_points.csv", "festo-2022-settled", 0.233),
    ];
    for (file, description, rest) in cases {
        let Some(path) = data(file) else { continue };
        let by = |import: &Import| Reader::with_rest_length(rest).import(Some(import)).file(&path).unwrap();
        let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/imports");
        let reference = by(&Import::read(examples.join(format!("{description}.toml"))).unwrap());
        let guessed = by(&Import::parse(&guess(&path, None).unwrap().description).unwrap());
        assert_eq!(guessed.len(), reference.len(), "{file}");
        for (a, b) in guessed.iter().zip(&reference) {
            assert!(a.same_rows(b) && a.direction == b.direction, "{file}: {}", b.name);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_guess_is_a_valid_description(text in "([ -~µ°ä]{0,9}[,;\t| ]){0,40}([0-9.,;eE\"#\t +-]{0,30}\r?\n){0,30}") {
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        std::fs::write(&file, &text).unwrap();
        if let Ok(guessed) = guess(file.path(), None) {
            prop_assert!(Import::parse(&guessed.description).is_ok(), "{}", guessed.description);
        }
    }

    #[test]
    fn names_of_any_characters_give_a_valid_description(names in proptest::collection::vec("\\PC{0,12}", 2..6)) {
        let rows: String = (0..12).map(|i| vec![i.to_string(); names.len()].join("\t") + "\n").collect();
        let file = tempfile::NamedTempFile::with_suffix(".txt").unwrap();
        std::fs::write(&file, format!("{}\n{rows}", names.join("\t"))).unwrap();
        if let Ok(guessed) = guess(file.path(), None) {
            prop_assert!(Import::parse(&guessed.description).is_ok(), "{}", guessed.description);
        }
    }
}

#[test]
fn rows_in_reverse_order_are_no_recordings_of_one_row() {
    let text = rows(plain);
    let reversed = text.lines().rev().fold(String::new(), |all, line| all + line + "\n");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("newest_first.csv");
    std::fs::write(&path, format!("time_s,pressure_bar,displacement_mm,force_N\n{reversed}")).unwrap();
    let guessed = guess(&path, None).unwrap();
    assert!(!guessed.description.contains("split_by"), "{}", guessed.description);
    assert!(guessed.description.contains("time runs backwards"), "{}", guessed.description);
}

#[test]
fn a_code_for_missing_readings_does_not_turn_the_sign_of_the_force() {
    let text = rows(plain);
    let with_code = text.lines().enumerate().fold(String::new(), |all, (n, line)| {
        let (start, _) = line.rsplit_once(',').unwrap();
        all + &if n == 11 { format!("{start},-999\n") } else { format!("{line}\n") }
    });
    let (guessed, read) =
        by_guess(&format!("time_s,pressure_bar,displacement_mm,force_N\n{with_code}"), None);
    assert!(!guessed.description.contains("its sign is reversed"), "{}", guessed.description);
    assert!(read[0].require_force().unwrap()[0] > 0.0);
}
