//! The short form of the trials of failing sensors.

use std::process::Command;

#[test]
fn failing_sensors_are_found_and_clean_campaigns_are_left_alone() {
    let trials = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["sensors", "--n", "4", "--seed", "4", "--check"])
        .output()
        .expect("the command starts");
    assert!(trials.status.success(), "{}", String::from_utf8_lossy(&trials.stderr));
}
