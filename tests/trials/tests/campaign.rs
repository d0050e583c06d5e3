//! The short version of the trials of campaigns that choose their own steps.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::process::Command;

#[test]
fn a_chosen_campaign_holds_what_is_hidden_possible_and_raises_no_false_alarm() {
    let folder = std::env::temp_dir().join(format!("pam-campaigns-short-{}", std::process::id()));
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["campaign", "--short", "-o"])
        .arg(&folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    let text = std::fs::read_to_string(folder.join("campaign.json")).unwrap();
    let _ = std::fs::remove_dir_all(&folder);
    assert!(run.status.success(), "{said}");
    let trials: serde_json::Value = serde_json::from_str(&text).unwrap();
    for trial in trials.as_array().unwrap() {
        let truth: Vec<&str> = trial["truth"].as_array().unwrap().iter().filter_map(|t| t.as_str()).collect();
        let names: Vec<&str> = trial["said"][0]["sets"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|set| set.as_array().unwrap())
            .filter_map(|name| name.as_str())
            .collect();
        assert_eq!(names.is_empty(), truth.is_empty(), "{trial:#}");
        // After ten minutes competitors may be left beside what is hidden.
        assert!(truth.is_empty() || names.iter().any(|n| truth.contains(n)), "{trial:#}");
    }
}
