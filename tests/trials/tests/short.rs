//! The short proof: a few sealed trials of the development set, asked of the tool as it is built for tests.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The tool beside this test's own program, built if it is not: with the features of the whole workspace, as in its tests, because
/// other features would compile most dependencies again.
fn host() -> PathBuf {
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--locked", "--workspace", "--bin", "host"])
        .args(if cfg!(debug_assertions) { &[][..] } else { &["--release"][..] })
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
        .status();
    assert!(built.is_ok_and(|s| s.success()), "host is built");
    Path::new(env!("CARGO_BIN_EXE_trials")).with_file_name("host")
}

#[test]
fn no_wrong_names_for_nulls_and_strangers_and_right_ones_for_what_is_plain() {
    let dir = std::env::temp_dir().join(format!("pam-trials-short-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    let proof = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["prove", "--set", "dev", "--n", "48", "--take", "10", "--check", "-o"])
        .arg(&dir)
        .arg("--host")
        .arg(host())
        .output()
        .expect("the command starts");
    assert!(proof.status.success(), "{}", String::from_utf8_lossy(&proof.stderr));
    let _ = std::fs::remove_dir_all(&dir);
}
