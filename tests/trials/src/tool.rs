//! The call of the tool that is judged, put together in one place.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::answer::recordings;

/// `host diagnose` on a muscle's recordings, the answer as JSON into a file; a caller may add to it.
pub fn diagnose(host: &Path, muscle: &Path, recordings: &[PathBuf], json: &Path) -> Command {
    let mut command = Command::new(host);
    command.arg("diagnose").arg("--quiet").arg("--muscle").arg(muscle);
    command.args(recordings).arg("--json").arg(json);
    command
}

/// With the checks of the bench that lie beside a trial's recordings.
pub fn add_checks(command: &mut Command, trial: &Path) {
    for check in recordings(&trial.join("checks")) {
        command.arg("--check").arg(check);
    }
}
