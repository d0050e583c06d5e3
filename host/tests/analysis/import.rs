//! `host import --guess`, as a new user calls it: a description that the other commands take, and an exit status that says whether it is enough.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::Path;
use std::process::{Command, Output};

fn host(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_host"))
        .args(words)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The recordings of the virtual bench as a European spreadsheet with German names saves them.
fn as_spreadsheets(folder: &Path) -> Vec<String> {
    let made = host::demo::campaign::record("mini", 1, folder).unwrap();
    let other = |path: &std::path::PathBuf| {
        let rows = std::fs::read_to_string(path).unwrap();
        let rows =
            rows.lines().skip(1).map(|l| l.replace(',', ";").replace('.', ",") + "\n").collect::<String>();
        let name = format!("{}.txt", path.file_stem().unwrap().to_str().unwrap());
        std::fs::write(
            folder.join(&name),
            format!("Bank 2\nZeit [s];Druck [kPa];Weg [mm];Kraft [N]\n{rows}"),
        )
        .unwrap();
        name
    };
    made.recordings.iter().map(other).collect()
}

#[test]
fn a_description_that_was_guessed_gives_the_fit_of_the_usual_files() {
    let folder = tempfile::tempdir().unwrap();
    let files = as_spreadsheets(folder.path());
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let guessed = host(folder.path(), &[&["import", "-o", "bench.toml", "--guess"], &files[..]].concat());
    assert!(guessed.status.success(), "{}", text(&guessed.stderr));
    let said = text(&guessed.stdout);
    for part in ["decimal commas", "Druck [kPa]", "1 line above the names", "semicolons"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let fit = |import: &[&str], files: &[&str]| {
        let output = host(
            folder.path(),
            &[&["fit", "--muscle", "muscle.toml", "--json", "-"], import, files].concat(),
        );
        let json: serde_json::Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)));
        (json["samples"].clone(), json["rms_N"].as_f64().unwrap())
    };
    let usual: Vec<String> = files.iter().map(|f| f.replace(".txt", ".csv")).collect();
    let usual: Vec<&str> = usual.iter().map(String::as_str).collect();
    let (by_guess, plain) = (fit(&["--import", "bench.toml"], &files), fit(&[], &usual));
    assert_eq!(by_guess.0, plain.0);
    assert!((by_guess.1 - plain.1).abs() < 1e-9, "{by_guess:?} {plain:?}");
    // An existing file is replaced only with the option for it.
    let again = host(folder.path(), &["import", "-o", "bench.toml", "--guess", files[0]]);
    assert_eq!(again.status.code(), Some(2));
    // Without -o the description alone is on standard output.
    let printed = host(folder.path(), &["import", "--guess", files[0]]);
    assert!(
        text(&printed.stdout).starts_with("# Import description of ")
            && text(&printed.stderr).contains("Druck")
    );
}

#[test]
fn a_file_that_lacks_something_ends_with_status_1_and_the_list() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..20).map(|i| format!("{},300\n", 0.1 * f64::from(i))).collect();
    std::fs::write(folder.path().join("a.csv"), format!("t_s,p_kPa\n{rows}")).unwrap();
    let output = host(folder.path(), &["import", "--guess", "a.csv", "-o", "a.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("no column of displacement, length or contraction"));
    assert!(folder.path().join("a.toml").exists());
    std::fs::write(folder.path().join("b.csv"), "no table\n").unwrap();
    let none = host(folder.path(), &["import", "--guess", "b.csv"]);
    assert_eq!(none.status.code(), Some(1));
    assert!(text(&none.stderr).contains("no table of numbers"), "{}", text(&none.stderr));
}

/// A pipe gives its rows once, and the guess needs them several times.
#[test]
fn a_file_is_guessed_from_a_pipe() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..200)
        .map(|i| {
            format!("{:.2};{};{:.3};{}\n", 0.05 * f64::from(i), 300 + i % 3, 0.01 * f64::from(i), 90 - i % 60)
        })
        .collect();
    let mut child = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["import", "--guess", "-"])
        .env("XDG_CONFIG_HOME", folder.path())
        .env_remove("PAM_SETTINGS")
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let table = format!("t_s;p_kPa;x_mm;F_N\n{rows}");
    child.stdin.take().unwrap().write_all(table.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("[columns.force]"));
    assert!(text(&output.stderr).contains("1 recording;"), "{}", text(&output.stderr));
}
