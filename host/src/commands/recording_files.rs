//! The recordings that a command writes: refused where they exist, begun, and ended with what was lost.

use std::path::PathBuf;

use pam_data::error::{DataCode, Error, Result};
use pam_data::pluralise::pluralise;
use pam_device::Losses;
use pam_device::recorder::Recorder;
use serde::Serialize;

use crate::console::Console;

/// Checks options that are times or rates.
pub(super) fn positive<const N: usize>(options: [(&str, Option<f64>); N]) -> Result<()> {
    for (option, value) in options {
        if let Some(value) = value
            && !(value > 0.0 && value.is_finite())
        {
            return Err(Error::new(DataCode::CallInvalid, format!("{option} must be above zero"))
                .value(value.to_string())
                .help("write a number above zero, or omit the option"));
        }
    }
    Ok(())
}

/// Refuses to replace a recording unless `replace` is set.
pub(super) fn refuse_existing(files: &[PathBuf], replace: bool) -> Result<()> {
    // A device such as /dev/null takes any number of recordings.
    match files.iter().find(|f| f.is_file()) {
        Some(there) if !replace => Err(Error::new(DataCode::CallInvalid, "the recording already exists")
            .file(there)
            .help("choose another name with -o, or replace it with --replace")),
        _ => Ok(()),
    }
}

/// Begins a recording in these files; `None` without any.
pub(super) fn begin(
    files: &[PathBuf],
    about: &impl Serialize,
    console: &Console,
) -> Result<Option<Recorder>> {
    if files.is_empty() {
        return Ok(None);
    }
    let recorder = Recorder::create(files, about)?;
    for file in recorder.recovered() {
        if let Some(recording) = &file.recording {
            console
                .note(format!("a recording that was cut off under this name is now {}", recording.display()));
        }
        if let Some(loss) = file.loss() {
            console.warning(loss);
        }
    }
    Ok(Some(recorder))
}

/// Ends a recording; `about` describes how it went.
pub(super) fn end(recorder: Recorder, about: &impl Serialize, console: &Console) -> Result<PathBuf> {
    if recorder.skipped() > 0 {
        console.warning(format!(
            "{} left out: not finite, or not later than the one before",
            pluralise(recorder.skipped(), "sample")
        ));
    }
    recorder.finish(about)
}

/// Warns of samples that are missing.
pub(super) fn warn_of_losses(losses: Losses, console: &Console) {
    if losses.samples > 0 {
        console.warning(format!(
            "{} missing in {}; the controller had sent {} of them, the others not: another program changed its telemetry, or it skipped \
             ticks",
            pluralise(losses.samples, "sample"),
            pluralise(losses.gaps, "gap"),
            losses.unreceived.min(losses.samples),
        ));
    }
}
