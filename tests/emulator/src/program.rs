//! The program `host` itself, as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::line::Line;

/// The program: this package's `emulated-host`, which cargo builds before any test of it.
///
/// # Panics
/// When it is not there.
pub fn path() -> PathBuf {
    // Tests lie in `deps` beside the program.
    let test = std::env::current_exe().expect("this test's path");
    let path = test.ancestors().nth(2).expect("the profile's folder").join("emulated-host");
    assert!(path.exists(), "cargo builds {} before the tests", path.display());
    path
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

/// Starts a command whose words are read when it ends.
///
/// # Panics
/// When it cannot be started.
pub fn start_piped(line: &Line, folder: &Path, arguments: &[&str]) -> Child {
    command(line, folder, arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// Ends a command as Ctrl-C does.
///
/// # Panics
/// When it is not there.
#[cfg(unix)]
pub fn interrupt(child: &Child) {
    let id = i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw).expect("a process");
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it is there");
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
