//! The seals hold: a set is answered once, answers and truths cannot be changed afterwards, and a tool that says nothing is
//! neither praised for names nor blamed for alarms.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn trials(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trials")).args(arguments).output().expect("the command starts")
}

fn scratch(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("pam-trials-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).expect("a scratch directory");
    dir
}

/// A tool that answers every campaign with the same JSON.
fn tool(dir: &Path, name: &str, json: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let path = dir.join(name);
    let script = format!(
        "#!/bin/sh\nwhile [ $# -gt 0 ]; do case \"$1\" in --json) shift; printf '%s' '{json}' > \"$1\";; esac; shift; done\n"
    );
    std::fs::write(&path, script).expect("written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("executable");
    path
}

const SILENT: &str = r#"{"schema":"pam-diagnose/1","verdict":"consistent","missing":[],"where":[]}"#;

#[test]
fn a_silent_tool_raises_no_alarm_and_names_nothing_and_seals_hold() {
    let dir = scratch("silent");
    let set = dir.join("set");
    let set_name = set.display().to_string();
    let made = trials(&["generate", "--set", "dev", "--n", "12", "-o", &set_name]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let again = trials(&["generate", "--set", "dev", "--n", "12", "-o", &set_name]);
    assert!(!again.status.success(), "a set is never overwritten");

    let early = trials(&["score", &set_name, "--no-held-out"]);
    assert!(!early.status.success(), "seals stay closed before the answers");

    let silent = tool(&dir, "silent", SILENT).display().to_string();
    assert!(trials(&["answer", &set_name, "--host", &silent]).status.success());
    let second = trials(&["answer", &set_name, "--host", &silent]);
    assert!(!second.status.success(), "answers are given once");

    let scored = trials(&["score", &set_name, "--no-held-out"]);
    assert!(scored.status.success(), "{}", String::from_utf8_lossy(&scored.stderr));
    let report = std::fs::read_to_string(set.join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let rate = |what: &str| (report["all"][what]["k"].as_u64(), report["all"][what]["n"].as_u64());
    assert_eq!(rate("false_alarms_clean").0, Some(0));
    assert_eq!(rate("class_right").0, Some(0));
    assert!(rate("class_right").1 > Some(0));
    assert_eq!(report["all"]["probabilities"], 0);

    let answer = set.join("answers").join("0003.json");
    std::fs::write(&answer, SILENT.replace("consistent", "explained")).expect("written");
    let forged = trials(&["score", &set_name, "--no-held-out"]);
    assert!(!forged.status.success(), "a changed answer is seen");
    std::fs::write(&answer, SILENT).expect("written");
    let truth = set.join("sealed").join("0003").join("truth.json");
    let text = std::fs::read_to_string(&truth).expect("a truth");
    std::fs::write(&truth, text.replace("null-", "null- ")).expect("written");
    let text = std::fs::read_to_string(&truth).expect("a truth");
    std::fs::write(&truth, text + "\n").expect("written");
    assert!(!trials(&["score", &set_name, "--no-held-out"]).status.success(), "a changed truth is seen");
    let _ = std::fs::remove_dir_all(&dir);
}

#[test]
fn answering_continues_where_it_was_interrupted_and_a_part_can_be_judged() {
    let dir = scratch("part");
    let set = dir.join("set");
    let set_name = set.display().to_string();
    assert!(trials(&["generate", "--set", "dev", "--n", "8", "-o", &set_name]).status.success());
    let silent = tool(&dir, "silent", SILENT).display().to_string();
    let none = trials(&["answer", &set_name, "--host", &silent, "--minutes", "0"]);
    assert!(none.status.success() && !set.join("answers").join("0000.json").exists());
    assert!(trials(&["answer", &set_name, "--host", &silent]).status.success());
    let lines = std::fs::read_to_string(set.join("frozen.jsonl")).expect("frozen answers");
    assert_eq!(lines.lines().count(), 8);
    // As if it had been interrupted before the last three.
    let ledger = std::fs::read_to_string(set.join("ledger.json")).expect("a ledger");
    let mut open: serde_json::Value = serde_json::from_str(&ledger).expect("JSON");
    (open["answers"], open["seconds"]) = (serde_json::json!([]), serde_json::json!([]));
    std::fs::write(set.join("ledger.json"), open.to_string()).expect("written");
    let kept: Vec<&str> = lines
        .lines()
        .filter(|l| !["5", "6", "7"].iter().any(|i| l.contains(&format!("\"id\":{i},"))))
        .collect();
    std::fs::write(set.join("frozen.jsonl"), kept.join("\n") + "\n").expect("written");
    let other = tool(&dir, "other", &SILENT.replace("consistent", "unexplained")).display().to_string();
    assert!(!trials(&["answer", &set_name, "--host", &other]).status.success(), "a set has one tool");
    assert!(!trials(&["score", &set_name, "--no-held-out"]).status.success(), "seals stay closed");
    assert!(trials(&["score", &set_name, "--no-held-out", "--close"]).status.success());
    let report = std::fs::read_to_string(set.join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["trials"].as_array().map(Vec::len), Some(5));
    let _ = std::fs::remove_dir_all(&dir);
}

#[test]
fn a_tool_that_always_cries_wolf_is_blamed_for_every_null() {
    let dir = scratch("wolf");
    let set = dir.join("set").display().to_string();
    assert!(trials(&["generate", "--set", "dev", "--n", "8", "-o", &set]).status.success());
    let json = r#"{"schema":"pam-diagnose/1","verdict":"explained","missing":[{"effect":"viscous-damping","probability":0.95}]}"#;
    let wolf = tool(&dir, "wolf", json).display().to_string();
    assert!(trials(&["answer", &set, "--host", &wolf]).status.success());
    assert!(trials(&["score", &set, "--no-held-out"]).status.success());
    let report = std::fs::read_to_string(Path::new(&set).join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    for null in ["false_alarms_clean", "false_alarms_nasty", "outside_confident"] {
        assert_eq!(report["all"][null]["k"], report["all"][null]["n"], "{null}");
    }
    assert!(report["all"]["calibration_error"].as_f64() > Some(0.5));
    // The short proof fails for it, and for a tool that never says anything.
    let silent = tool(&dir, "silent", SILENT).display().to_string();
    for host in [&wolf, &silent] {
        let other = dir.join("short").display().to_string();
        let _ = std::fs::remove_dir_all(&other);
        let proof = trials(&["prove", "--set", "dev", "--n", "8", "--check", "-o", &other, "--host", host]);
        assert!(!proof.status.success(), "{host} passes");
    }
    let _ = std::fs::remove_dir_all(&dir);
}
