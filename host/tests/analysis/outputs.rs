//! What comes out of a command is what went in: pipes are hashed as they are read, and output that is lost is a failure.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::Path;
use std::process::{Command, Output};

use pam_fit::table_file::{TableFile, sha256};

fn run(folder: &Path, script: &str) -> Output {
    Command::new("bash")
        .args(["-c", &format!("set -o pipefail; {script}")])
        .env("HOST", env!("CARGO_BIN_EXE_host"))
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .current_dir(folder)
        .output()
        .unwrap()
}

fn messages(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A small campaign of the virtual bench and its muscle.
fn campaign(folder: &Path) {
    let made = host::demo::campaign::record("mini", 1, folder).unwrap();
    assert!(made.recordings.len() > 2);
}

#[test]
fn a_pipe_is_hashed_as_it_is_read_and_the_command_ends() {
    let folder = tempfile::tempdir().unwrap();
    campaign(folder.path());
    let first = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "csv"))
        .min()
        .unwrap();
    let name = first.file_name().unwrap().to_str().unwrap();
    // A program that opens the pipe a second time never ends: the time-out ends it with status 124.
    let output = run(
        folder.path(),
        &format!(
            "mkfifo pipe && (cat {name} > pipe &) && timeout 300 \"$HOST\" fit --muscle muscle.toml \
             pipe $(ls *.csv | grep -v {name}) -o out.pam"
        ),
    );
    assert!(output.status.success(), "{:?} {}", output.status, messages(&output));
    let table = TableFile::read(folder.path().join("out.pam")).unwrap();
    let source = table.about.sources.iter().find(|s| s.path == "pipe").unwrap();
    assert_eq!(source.sha256, sha256(&first).unwrap());
    assert!(source.samples > 0);
    let others = table.about.sources.iter().filter(|s| s.path != "pipe");
    for other in others {
        assert_eq!(other.sha256, sha256(folder.path().join(&other.path)).unwrap());
    }
}

#[test]
fn a_result_that_cannot_be_printed_is_a_failure_unless_its_reader_left() {
    let folder = tempfile::tempdir().unwrap();
    campaign(folder.path());
    for command in [
        "\"$HOST\" fit --muscle muscle.toml *.csv --json - > /dev/full",
        "\"$HOST\" fit --muscle muscle.toml *.csv -o a.pam && \"$HOST\" table show a.pam > /dev/full",
        "\"$HOST\" completions bash > /dev/full",
    ] {
        let output = run(folder.path(), command);
        assert_eq!(output.status.code(), Some(1), "{command}: {}", messages(&output));
        assert!(messages(&output).contains("standard output"), "{command}: {}", messages(&output));
    }
    let output = run(folder.path(), "\"$HOST\" fit --muscle muscle.toml *.csv --json - | head -c 10");
    assert!(output.status.success(), "{}", messages(&output));
}

#[test]
fn a_device_that_never_ends_is_refused_within_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    // The limit of address space makes a program that takes more than a gigabyte fail in another way.
    for command in
        ["table show /dev/zero", "fit --muscle /dev/zero a.csv", "fit --muscle muscle.toml /dev/zero"]
    {
        campaign(folder.path());
        let output = run(folder.path(), &format!("ulimit -v 3000000; timeout 300 \"$HOST\" {command}"));
        assert_eq!(output.status.code(), Some(1), "{command}: {}", messages(&output));
    }
}
