//! Import descriptions by guess, of recordings at held lengths: in files of their own, and one after the other in one file.
#![allow(clippy::unwrap_used)] // what fails here fails the test

mod described_files;

use std::fmt::Write;

use described_files::{DescribedFiles, describe};
use pam_data::recording::import_guess::{Guess, guess_among};
use pam_data::recording::{Reader, Recording};

/// Rows of a pressure staircase at a held stroke in mm, with what else each row has.
fn staircase(begin_s: i32, stroke_mm: f64, label: &str) -> String {
    (0..40).fold(String::new(), |mut text, i| {
        let kpa = 100 + 10 * (20 - (i - 20_i32).abs());
        let force = 0.5 * f64::from(kpa) - 4.0 * stroke_mm;
        writeln!(text, "{label}{},{kpa},{stroke_mm},{force}", begin_s + i).unwrap();
        text
    })
}

fn read(files: &[(&str, String)]) -> (Guess, Vec<Recording>) {
    let DescribedFiles { guess, import, paths, .. } = &describe(files);
    let reader = Reader::with_rest_length(0.2).import(Some(import));
    (guess.clone(), paths.iter().flat_map(|path| reader.file(path).unwrap()).collect())
}

fn strokes_mm(recordings: &[Recording]) -> Vec<f64> {
    recordings.iter().map(|r| (1e6 * r.stroke[0]).round() / 1e3).collect()
}

const HEADER: &str = "time_s,pressure_kPa,displacement_mm,force_N\n";

#[test]
fn a_held_length_counts_from_the_rest_length() {
    let file = |mm| format!("{HEADER}{}", staircase(0, mm, ""));
    let (guess, recordings) = read(&[("a.csv", file(22.5)), ("b.csv", file(15.0)), ("c.csv", file(0.0))]);
    assert_eq!(strokes_mm(&recordings), [22.5, 15.0, 0.0], "{}", guess.description);
    assert!(
        guess.checks.iter().any(|c| c.text().contains("is held at 0 to 22.5 in different files")),
        "{:?}",
        guess.checks
    );
    let (guess, recordings) = read(&[("a.csv", file(22.5))]);
    assert_eq!(strokes_mm(&recordings), [22.5], "{}", guess.description);
    assert!(guess.checks.iter().any(|c| c.text().contains("is held at 22.5")), "{:?}", guess.checks);
}

#[test]
fn a_moved_length_with_a_zero_of_its_own_counts_from_the_greatest_length() {
    let rows = (0..40).fold(String::new(), |mut text, i| {
        let mm = 310.0 - 0.2 * f64::from(20 - (i - 20_i32).abs());
        writeln!(text, "{i},300,{mm},{}", 100.0 - 20.0 * (310.0 - mm)).unwrap();
        text
    });
    let (guess, recordings) = read(&[("a.csv", format!("time_s,pressure_kPa,extension_mm,force_N\n{rows}"))]);
    let longest = recordings[0].stroke.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(longest.abs() < 1e-9, "{}", guess.description);
    assert!(guess.description.contains("zero = \"longest\""), "{}", guess.description);
}

#[test]
fn a_column_that_numbers_runs_separates_them_where_the_clock_continues() {
    let runs = [(0.0, "1"), (7.5, "1"), (0.0, "2"), (7.5, "2")];
    let text = runs.iter().enumerate().fold(format!("run,mounting,{HEADER}"), |text, (i, (mm, run))| {
        text + &staircase(60 * i as i32, *mm, &format!("{run},{mm},"))
    });
    let (guess, recordings) = read(&[("all.csv", text)]);
    assert_eq!(guess.split_by, ["run", "mounting"]);
    assert_eq!(strokes_mm(&recordings), [0.0, 7.5, 0.0, 7.5]);
}

#[test]
fn a_column_that_returns_to_earlier_values_separates_no_runs() {
    let text = (0..8).fold(format!("set,{HEADER}"), |text, i| {
        text + &staircase(60 * i, 0.0, if i % 2 == 0 { "a," } else { "b," })
    });
    let (guess, recordings) = read(&[("all.csv", text)]);
    assert!(guess.split_by.is_empty() && recordings.len() == 1, "{}", guess.description);
}

#[test]
fn a_held_length_is_taken_from_the_names_of_the_files() {
    let rows = |mm| staircase(0, mm, "").replace(&format!(",{mm},"), ",");
    let file = |mm| format!("time_s,pressure_kPa,force_N\n{}", rows(mm));
    let (guess, recordings) = read(&[
        ("festo10mm_182mm_run1.csv", file(0.25)),
        ("festo10mm_159.5mm_run1.csv", file(22.5)),
        ("festo10mm_174.5 mm.csv", file(7.5)),
    ]);
    assert!(guess.unknown.is_empty(), "{:?}", guess.unknown);
    assert_eq!(strokes_mm(&recordings), [18.0, 40.5, 25.5], "{}", guess.description);
    // A diameter alone is not a length.
    let unknown = |names: [&str; 2]| {
        let folder = tempfile::tempdir().unwrap();
        let paths = names.map(|name| folder.path().join(name));
        paths.iter().for_each(|path| std::fs::write(path, file(0.25)).unwrap());
        guess_among(&paths[0], &paths[1..], None).unwrap().all_unknown()
    };
    assert!(unknown(["festo10mm_run1.csv", "festo10mm_run2.csv"]).contains("no column of displacement"));
}

#[test]
fn a_displacement_that_falls_with_rising_pressure_grows_as_the_muscle_gets_longer() {
    let rows = (0..80).fold(String::new(), |mut text, i| {
        let bar = 0.1 * f64::from(40 - (i - 40_i32).abs());
        writeln!(text, "{i},{bar},{}", -0.1 - 3.0 * bar).unwrap();
        text
    });
    let (guess, recordings) = read(&[("lifted.csv", format!("t_s,pressure_bar,displacement_mm\n{rows}"))]);
    assert!((recordings[0].stroke[40] - 12e-3).abs() < 0.2e-3, "{}", guess.description);
    assert!(
        guess.checks.iter().any(|c| c.text().starts_with("the pressure falls with displacement_mm")),
        "{:?}",
        guess.checks
    );
    // What a regulator lets the pressure fall by says nothing.
    let rows = rows.replace(",", ", ");
    let held = rows.lines().fold(String::new(), |text, row| {
        let cells: Vec<f64> = row.split(", ").map(|cell| cell.parse().unwrap()).collect();
        text + &format!("{},{},{}\n", cells[0], 3.0 + 0.01 * cells[1], cells[2])
    });
    let (guess, _) = read(&[("held.csv", format!("t_s,pressure_bar,displacement_mm\n{held}"))]);
    assert!(!guess.checks.iter().any(|c| c.text().contains("the pressure falls")), "{:?}", guess.checks);
}
