//! Recordings that were cut off or damaged: what is whole goes to a new file, and the original stays where anything is missing.

mod csv;
mod mcap;
mod window;

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::part::in_use;
use super::side_file;
use pam_data::error::{DataCode, Error, Result};
use pam_data::mcap_records::MAGIC;
use pam_data::pluralise::pluralise;

use self::window::Window;

/// What was found in a damaged file, and what was not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Samples (in an MCAP samples and events) in the new file.
    pub samples: u64,
    /// Samples that are missing: as many as sequence numbers or damaged lines show, at least.
    pub samples_lost: u64,
    /// Bytes of the original that are in no record or line of the new file.
    pub bytes_lost: u64,
    /// Separate places of damage.
    pub gaps: u64,
}

/// What became of one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovered {
    /// The new recording; `None` where the original was empty and is removed.
    pub recording: Option<PathBuf>,
    /// Where the original stays; `None` where the new file holds all of it.
    pub original: Option<PathBuf>,
    /// What was found and what was lost.
    pub tally: Tally,
}

impl Recovered {
    /// What was lost, as text; `None` for nothing.
    #[must_use]
    pub fn loss(&self) -> Option<String> {
        let original = self.original.as_ref()?;
        Some(format!(
            "{} lost in {}, with them at least {}; the original stays as {}",
            pluralise(self.tally.bytes_lost, "byte"),
            pluralise(self.tally.gaps, "place"),
            pluralise(self.tally.samples_lost, "sample"),
            original.display()
        ))
    }
}

/// Makes a whole recording of one that was cut off (`NAME.part`) or damaged, under a name that no other file has. The original
/// stays unless the new file holds all of it: a `NAME.part` then as `NAME.part.original`, any other file under its own name.
///
/// # Errors
/// [`DataCode::FileUnreadable`], [`DataCode::FileUnwritable`] also when it still grows, [`DataCode::RecordingEmpty`] where nothing in
/// it is whole. The original is as it was then.
pub fn recover(path: &Path) -> Result<Recovered> {
    let unreadable = |e: std::io::Error| Error::unreadable(path, &e);
    let unwritable = |e: std::io::Error| Error::unwritable(path, &e);
    // Writing is needed only by the lock of some systems.
    let file = OpenOptions::new().read(true).write(true).open(path).or_else(|_| File::open(path));
    let file = file.map_err(unreadable)?;
    if !file.metadata().map_err(unreadable)?.is_file() {
        return Err(Error::new(DataCode::CallInvalid, "this is not a file").file(path));
    }
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return Err(in_use(path));
    }
    let text = path.to_string_lossy();
    let part = text.strip_suffix(".part").map(PathBuf::from);
    if part.is_some() && file.metadata().map_err(unreadable)?.len() == 0 {
        std::fs::remove_file(path).map_err(unwritable)?;
        return Ok(Recovered { recording: None, original: None, tally: Tally::default() });
    }
    let target = part.as_deref().unwrap_or(path);
    let mut source = Window::new(file);
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut fresh = tempfile::Builder::new().prefix(".recover-").tempfile_in(folder).map_err(unwritable)?;
    let mcap = target.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
        || source.peek(MAGIC.len()).map_err(unreadable)? == MAGIC;
    let mut out = BufWriter::new(fresh.as_file_mut());
    let copied = if mcap { mcap::copy(&mut source, &mut out) } else { csv::copy(&mut source, &mut out) };
    let tally = copied.map_err(unreadable)?;
    out.flush().map_err(unwritable)?;
    drop(out);
    if tally.samples == 0 && tally.bytes_lost > 0 {
        return Err(Error::new(
            DataCode::RecordingEmpty,
            "nothing in this file is a whole sample of a recording",
        )
        .file(path)
        .help("the file stays as it is; is it a recording of `host record`?"));
    }
    if part.is_none() && tally.bytes_lost == 0 {
        return Err(Error::new(DataCode::CallInvalid, "this recording is whole")
            .file(path)
            .help("it can be used as it is; a recording that was cut off is named RECORDING.part"));
    }
    let recording = persist(fresh, target)?;
    let original = match (&part, tally.bytes_lost) {
        (Some(_), 0) => {
            std::fs::remove_file(path).map_err(unwritable)?;
            None
        }
        (Some(_), _) => {
            let kept = free_name(&suffixed(path, ".original"));
            std::fs::rename(path, &kept).map_err(unwritable)?;
            Some(kept)
        }
        (None, _) => Some(path.to_owned()),
    };
    // What was known when the recording began is beside it.
    let side = side_file(path);
    if part.is_some() && side.exists() {
        std::fs::rename(&side, side_file(&recording)).map_err(|e| Error::unwritable(&side, &e))?;
    }
    Ok(Recovered { recording: Some(recording), original, tally })
}

fn suffixed(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

/// Gives the new file a name that no other has.
fn persist(mut fresh: tempfile::NamedTempFile, target: &Path) -> Result<PathBuf> {
    fresh.as_file().sync_all().map_err(|e| Error::unwritable(target, &e))?;
    public(fresh.as_file(), target);
    loop {
        let name = free_name(target);
        match fresh.persist_noclobber(&name) {
            Ok(_) => return Ok(name),
            Err(e) if e.error.kind() == std::io::ErrorKind::AlreadyExists => fresh = e.file,
            Err(e) => return Err(Error::unwritable(&name, &e.error)),
        }
    }
}

/// A temporary file is its owner's only; a recording is as readable as the one that it comes from.
fn public(fresh: &File, target: &Path) {
    let part = super::part::part_of(target);
    if let Ok(mode) = std::fs::metadata(&part).or_else(|_| std::fs::metadata(target)) {
        // A file system without permissions has none to set.
        let _ = fresh.set_permissions(mode.permissions());
    }
}

/// `path`, or where that is taken `NAME.rescued-N.EXTENSION`.
fn free_name(path: &Path) -> PathBuf {
    let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let mut name = path.to_owned();
    let mut number = 0;
    while name.exists() {
        number += 1;
        name = path.with_extension("");
        let stem = name.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        name.set_file_name(format!("{stem}.rescued-{number}{extension}"));
    }
    name
}

#[cfg(test)]
mod tests;
