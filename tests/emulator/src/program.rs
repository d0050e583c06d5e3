//! The program `host` itself, as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;

use crate::line::Line;

/// The program, built once a process.
///
/// # Panics
/// With the compiler's words when it cannot be built.
pub fn path() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut build = Command::new(cargo);
        build.args(["build", "--quiet", "--locked", "--package", "host", "--bin", "host"]);
        if !cfg!(debug_assertions) {
            build.arg("--release");
        }
        let output = build.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("cargo runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // Tests lie in `deps` beside the program.
        let test = std::env::current_exe().expect("this test's path");
        test.ancestors().nth(2).expect("the profile's folder").join("host")
    })
}

fn command(line: &Line, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(path());
    command.args(arguments).args(["--port", line.address()]).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs a command with a device.
///
/// # Panics
/// When it cannot be started.
pub fn run(line: &Line, folder: &Path, arguments: &[&str]) -> Output {
    command(line, folder, arguments).output().expect("the program starts")
}

/// Runs a command that must succeed, and gives what it printed.
///
/// # Panics
/// With its words when it fails.
pub fn done(line: &Line, folder: &Path, arguments: &[&str]) -> String {
    let output = run(line, folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "host {arguments:?}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Starts a command and leaves it running.
///
/// # Panics
/// When it cannot be started.
pub fn start(line: &Line, folder: &Path, arguments: &[&str]) -> Child {
    command(line, folder, arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}
