//! `host campaign` from outside: whole, interrupted by a signal, ended by SIGKILL, and resumed.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

fn campaign(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host"));
    command
        .args(["campaign", "--emulate", "mini", "--on", "native", "--minutes", "2.5", "--speed", "10", "-o"])
        .arg(folder.join("c"))
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .env_remove("PAM_PORT")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// Rows of every file of the campaign, also of unfinished ones: whole lines below the header.
fn rows(folder: &Path) -> Vec<String> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder.join("c"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| {
            let name = p.file_name().unwrap().to_string_lossy().into_owned();
            // Checks of the bench have a clock of their own.
            let check = ["dead_weights", "rigid_bar", "gauge_check", "weighing", "closed_valve"]
                .iter()
                .any(|c| name.contains(c));
            name.contains(".csv") && !check
        })
        .collect();
    files.sort();
    let mut all = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(file).unwrap();
        let whole = text.rfind('\n').map_or("", |i| &text[..i]);
        all.extend(whole.lines().skip(1).map(str::to_owned));
    }
    all
}

/// Waits until a recording grows, however slow the machine is.
fn until_rows(folder: &Path, child: &mut Child, more_than: usize) {
    let deadline = Instant::now() + Duration::from_secs(300);
    while !folder.join("c").exists() || rows(folder).len() <= more_than {
        assert!(child.try_wait().unwrap().is_none(), "the campaign ended early");
        assert!(Instant::now() < deadline, "no rows come");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_killed_campaign_loses_no_row_and_continues() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut child = campaign(folder).spawn().unwrap();
    until_rows(folder, &mut child, 60);
    child.kill().unwrap();
    child.wait().unwrap();
    let before = rows(folder);
    let mut child = campaign(folder).spawn().unwrap();
    until_rows(folder, &mut child, before.len() + 100);
    // Ctrl-C.
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, rustix::process::Signal::INT).unwrap();
    assert!(child.wait().unwrap().success(), "an interruption is not a failure");
    let after = rows(folder);
    assert!(before.iter().all(|row| after.contains(row)), "a row is gone");
    let document: Value =
        serde_json::from_slice(&std::fs::read(folder.join("c/campaign.json")).unwrap()).unwrap();
    assert_eq!(
        (document["schema"].as_str(), document["complete"].as_bool()),
        (Some("pam-campaign/1"), Some(false))
    );
    assert!(campaign(folder).status().unwrap().success());
    let last = rows(folder);
    assert!(after.iter().all(|row| last.contains(row)), "a row is gone");
    let document: Value =
        serde_json::from_slice(&std::fs::read(folder.join("c/campaign.json")).unwrap()).unwrap();
    assert_eq!(document["complete"].as_bool(), Some(true), "{document:#}");
    let steps = document["steps"].as_array().unwrap();
    assert!(steps.iter().all(|s| s["why"].as_str().unwrap().ends_with('.')), "{steps:#?}");
    let numbers: Vec<u64> = steps.iter().map(|s| s["number"].as_u64().unwrap()).collect();
    assert!(numbers.windows(2).all(|w| w[1] > w[0]), "{numbers:?}");
    for file in ["table.pam", "report.html", "fit.html", "diagnosis.html"] {
        assert!(folder.join("c").join(file).exists(), "{file}");
    }
    // The clock is one: no time comes twice.
    let mut times: Vec<f64> = last.iter().map(|r| r.split(',').next().unwrap().parse().unwrap()).collect();
    times.sort_by(f64::total_cmp);
    assert!(times.windows(2).all(|w| w[1] > w[0]), "the clock of the campaign went back");
}

#[test]
fn a_muscle_without_a_limit_is_refused_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let muscle = folder.path().join("m.toml");
    let text = "name = 'm'\nkind = 'contractile'\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
                bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n";
    std::fs::write(&muscle, text).unwrap();
    let rig = folder.path().join("rig.toml");
    std::fs::write(&rig, "axis = 'weight'\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["campaign", "--port", "tcp:127.0.0.1:9", "--muscle"])
        .arg(&muscle)
        .arg("--rig")
        .arg(&rig)
        .arg("-o")
        .arg(folder.path().join("c"))
        .env("XDG_CONFIG_HOME", folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("weight_N"), "{said}");
}

#[test]
fn a_rig_that_the_virtual_bench_does_not_have_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let rig = folder.path().join("rig.toml");
    std::fs::write(&rig, "axis = \"weight\"\nweight_N = 30\n").unwrap();
    let made = campaign(folder.path()).arg("--rig").arg(&rig).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(made.status.code(), Some(2));
    let said = String::from_utf8_lossy(&made.stderr).into_owned();
    assert!(said.contains("no hanging weight"), "{said}");
}

/// Setpoints arrive too late then, and steps are recorded without use.
#[test]
fn a_speed_that_the_program_cannot_follow_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["campaign", "--emulate", "mini", "--speed", "200", "-o"])
        .arg(folder.path().join("c"))
        .env("XDG_CONFIG_HOME", folder.path())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&made.stderr);
    assert_eq!(made.status.code(), Some(2), "{message}");
    assert!(message.contains("--speed is at most 100"), "{message}");
    assert!(!folder.path().join("c").exists());
}
