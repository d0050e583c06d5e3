//! `host history` as it is called: the virtual bench over months, and a real cylinder whose seal was swapped.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use virtual_bench::presets;
use virtual_bench::recording::Columns;

use crate::bench_campaign;

fn history(folder: &Path, arguments: &[&str]) -> (i32, Value, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_host"))
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env("PAM_SETTINGS", "")
        .arg("history")
        .args(arguments)
        .output()
        .unwrap();
    let answer = serde_json::from_slice(&out.stdout).unwrap_or(Value::Null);
    (out.status.code().unwrap(), answer, String::from_utf8_lossy(&out.stderr).into_owned())
}

/// Campaigns of the virtual bench, a folder a month; `change` is added to the measured force, N, by the number of the month.
fn months(folder: &Path, count: usize, change: impl Fn(usize, f64) -> f64) -> Vec<String> {
    let levels = &presets::miniature_pressures()[1..4];
    (0..count)
        .map(|month| {
            let name = format!("2026-{:02}-05", month + 1);
            std::fs::create_dir(folder.join(&name)).unwrap();
            for mut file in bench_campaign::files(&presets::miniature(), levels, 40 + month as u64, 10.0) {
                file.rows.iter_mut().for_each(|r| r.force += change(month, r.force));
                let path = folder.join(&name).join(format!("{}.csv", file.name));
                std::fs::write(path, file.csv(Columns::default())).unwrap();
            }
            name
        })
        .collect()
}

fn ask(folder: &Path, campaigns: &[String], more: &[&str]) -> Value {
    let mut arguments: Vec<&str> = campaigns.iter().map(String::as_str).collect();
    arguments.extend(["--json", "-"]);
    arguments.extend(more);
    let (status, answer, said) = history(folder, &arguments);
    assert_eq!(status, 0, "{said}");
    published_schemas::valid(&answer.to_string())
}

#[test]
fn a_bench_on_which_nothing_changed_has_no_changes() {
    let folder = tempfile::tempdir().unwrap();
    let campaigns = months(folder.path(), 6, |_, _| 0.0);
    let answer = ask(folder.path(), &campaigns, &["--report", "life.html", "--csv", "life.csv"]);
    assert_eq!(answer["changes"], Value::Array(Vec::new()), "{:#}", answer["changes"]);
    let page = std::fs::read_to_string(folder.path().join("life.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("2026-03-05"));
    let csv = std::fs::read_to_string(folder.path().join("life.csv")).unwrap();
    assert_eq!(csv.lines().filter(|l| l.contains(",largest-force,")).count(), 6, "{csv}");
}

#[test]
fn a_step_is_dated_and_a_drift_is_gradual() {
    let folder = tempfile::tempdir().unwrap();
    // A load cell that was bumped before the fourth month. The blocked force is about 130 N.
    let step = months(folder.path(), 6, |month, _| if month >= 3 { 6.0 } else { 0.0 });
    let answer = ask(folder.path(), &step, &[]);
    let changes = answer["changes"].as_array().unwrap();
    let offset =
        changes.iter().find(|c| c["quantity"] == "force-offset").unwrap_or_else(|| panic!("{answer:#}"));
    assert_eq!(
        (&offset["how"], &offset["from"], &offset["to"]),
        (&"at-once".into(), &step[2].as_str().into(), &step[3].as_str().into())
    );
    assert!((offset["size"].as_f64().unwrap() - 6.0).abs() < 1.0, "{offset}");
    let folder = tempfile::tempdir().unwrap();
    let drift = months(folder.path(), 8, |month, force| 0.012 * month as f64 * force);
    let answer = ask(folder.path(), &drift, &[]);
    let changes = answer["changes"].as_array().unwrap();
    let largest =
        changes.iter().find(|c| c["quantity"] == "largest-force").unwrap_or_else(|| panic!("{answer:#}"));
    assert_eq!(largest["how"], "gradual", "{changes:#?}");
}

#[test]
fn a_muscle_brings_its_table_and_the_order_is_that_of_the_dates() {
    let folder = tempfile::tempdir().unwrap();
    let mut campaigns = months(folder.path(), 3, |_, _| 0.0);
    campaigns.reverse();
    std::fs::write(folder.path().join("m.toml"), presets::miniature().description()).unwrap();
    let answer = ask(folder.path(), &campaigns, &["--muscle", "m.toml", "--reference", "2026-02-05"]);
    let names: Vec<&str> =
        answer["campaigns"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["2026-01-05", "2026-02-05", "2026-03-05"]);
    assert_eq!(answer["reference"], "2026-02-05");
    assert!(answer["campaigns"][1]["comparison"].is_null() && answer["campaigns"][0]["dated_by"] == "name");
    let deadband = answer["quantities"].as_array().unwrap().iter().find(|q| q["name"] == "deadband").unwrap();
    for value in deadband["values"].as_array().unwrap() {
        let (low, high) = (value["low"].as_f64().unwrap(), value["high"].as_f64().unwrap());
        assert!(low < high && low > 40e3 && high < 120e3, "{value}");
    }
}

#[test]
fn wrong_calls_name_the_campaign_and_the_fault() {
    let folder = tempfile::tempdir().unwrap();
    let campaigns = months(folder.path(), 1, |_, _| 0.0);
    let (status, _, said) = history(folder.path(), &[&campaigns[0]]);
    assert!(status == 2 && said.contains("two campaigns"), "{said}");
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let (status, _, said) = history(folder.path(), &[&campaigns[0], "empty"]);
    assert!(status == 1 && said.contains("no recordings") && said.contains("empty"), "{said}");
    // The same campaign with its force in another unit, under the old name.
    std::fs::create_dir(folder.path().join("2026-07-05")).unwrap();
    for entry in std::fs::read_dir(folder.path().join(&campaigns[0])).unwrap().flatten() {
        let text = std::fs::read_to_string(entry.path()).unwrap().replace("force_N", "force_kN");
        std::fs::write(folder.path().join("2026-07-05").join(entry.file_name()), text).unwrap();
    }
    let (status, _, said) = history(folder.path(), &[&campaigns[0], "2026-07-05"]);
    assert!(status == 1 && said.contains("2026-07-05"), "{said}");
    let (status, _, said) =
        history(folder.path(), &[&campaigns[0], "2026-07-05", "--reference", "elsewhere"]);
    assert!(status == 2 && said.contains("none of the campaigns"), "{said}");
}

/// A printed cylinder: four times the same seal, then another seal. The recordings are public (CC0).
#[test]
fn a_swapped_seal_is_dated_and_reruns_are_no_change() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/tudelft-printed-cylinder");
    if !data.join("kdn_1bar.csv").exists() {
        println!("no recordings in {}: skipped", data.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let life = ["o-ring257", "rerun_1_o-ring257", "rerun_2_o-ring257", "rerun_3_o-ring257", "kdn"];
    let mut campaigns = Vec::new();
    for (i, seal) in life.into_iter().enumerate() {
        let name = format!("2026-0{}-05", i + 1);
        std::fs::create_dir(folder.path().join(&name)).unwrap();
        for level in [1, 3, 5, 7] {
            let file = format!("{seal}_{level}bar.csv");
            std::fs::copy(data.join(&file), PathBuf::from(folder.path()).join(&name).join(&file)).unwrap();
        }
        campaigns.push(name);
    }
    let answer = ask(folder.path(), &campaigns, &[]);
    for c in &answer["campaigns"].as_array().unwrap()[1..4] {
        assert_eq!(c["comparison"]["verdict"], "consistent", "{c:#}");
    }
    assert_eq!(answer["campaigns"][4]["comparison"]["missing"][0]["effect"], "force-gain");
    let changes = answer["changes"].as_array().unwrap();
    assert!(!changes.is_empty() && changes.iter().all(|c| c["to"] == "2026-05-05"), "{changes:#?}");
}
