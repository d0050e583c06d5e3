//! The short version of the trials of the diagnosis against a reference, where the recordings are.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::Path;
use std::process::Command;

#[test]
fn changes_are_named_and_untouched_pairs_are_not() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !data.join("aarl-festo-10mm-2021/runs.csv").exists() {
        println!("no recordings in {}: skipped", data.display());
        return;
    }
    let folder = std::env::temp_dir().join(format!("pam-reference-short-{}", std::process::id()));
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["reference", "--short", "--data"])
        .arg(&data)
        .arg("-o")
        .arg(&folder)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let text = std::fs::read_to_string(folder.join("reference.json")).unwrap();
    let _ = std::fs::remove_dir_all(&folder);
    let answers: serde_json::Value = serde_json::from_str(&text).unwrap();
    let trials = answers[0].as_array().unwrap();
    let (changed, untouched): (Vec<_>, Vec<_>) = trials.iter().partition(|t| t["effect"].is_string());
    let exact = changed.iter().filter(|t| t["effect"] == t["answer"]["top"]).count();
    assert!(exact * 4 >= changed.len() * 3, "{exact} of {} named right at 3 %", changed.len());
    // Two per cent of the pairs of the whole set; one of this share.
    let named = untouched.iter().filter(|t| !t["answer"]["named"].as_array().unwrap().is_empty()).count();
    assert!(named <= 1, "{named} of {} untouched pairs named", untouched.len());
    // Of a table alone two per cent of the windows, too: none of this share.
    let against_table = answers[2].as_array().unwrap();
    let (changed, untouched): (Vec<_>, Vec<_>) = against_table.iter().partition(|t| t["effect"].is_string());
    let named = untouched.iter().filter(|t| !t["answer"]["named"].as_array().unwrap().is_empty()).count();
    assert!(named == 0, "{named} of {} untouched windows named against a table", untouched.len());
    let exact = changed.iter().filter(|t| t["effect"] == t["answer"]["top"]).count();
    assert!(exact * 2 >= changed.len(), "{exact} of {} named right at 5 % against a table", changed.len());
}
