//! The folder of one muscle in the output, and how it appears there: whole, in one step.
//!
//! ```text
//! OUT/muscle=NAME/fits.parquet  tables.parquet  diagnoses.parquet  failures.parquet  [table.pam]  [report.html]
//! OUT/.partial/RUN/NAME/…       while the results of a muscle are written
//! ```
//! The files are written and synchronised under `.partial`, and the folder is renamed then. A reader sees the old folder, or the new one, or
//! none. The next run removes what an interrupted run leaves under `.partial`.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use pam_data::error::{Error, Result};
use pam_data::output::FolderLock;

use crate::columns::{footer, rows};
use crate::objects::Objects;
use crate::storage::{is_remote, local_only};

/// The entry of a Parquet footer that holds the key of the inputs.
pub(crate) const KEY: &str = "pam-batch-key";
/// The tables of every muscle.
pub const TABLES: [&str; 4] = ["fits", "tables", "diagnoses", "failures"];
const PARTIAL: &str = ".partial";
const PREFIX: &str = "muscle=";

/// The name of a muscle's folder, as engines decode it: what is not a letter, digit, `-`, `_` or `.` is percent-encoded.
///
/// ```
/// assert_eq!(pam_fleet::partition::folder_name("mini 1/a"), "muscle=mini%201%2Fa");
/// assert_eq!(pam_fleet::partition::muscle_name("muscle=mini%201%2Fa").as_deref(), Some("mini 1/a"));
/// ```
#[must_use]
pub fn folder_name(muscle: &str) -> String {
    let mut name = String::from(PREFIX);
    for byte in muscle.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_.".contains(&byte) {
            name.push(char::from(byte));
        } else {
            name.push_str(&format!("%{byte:02X}"));
        }
    }
    name
}

/// The muscle of a folder; `None` for a folder of another kind.
#[must_use]
pub fn muscle_name(folder: &str) -> Option<String> {
    let encoded = folder.strip_prefix(PREFIX)?.as_bytes();
    let mut bytes = Vec::with_capacity(encoded.len());
    let mut at = 0;
    while let Some(&byte) = encoded.get(at) {
        let code = encoded.get(at + 1..at + 3).filter(|_| byte == b'%');
        match code.and_then(|c| std::str::from_utf8(c).ok()).and_then(|c| u8::from_str_radix(c, 16).ok()) {
            Some(decoded) => {
                bytes.push(decoded);
                at += 3;
            }
            None => {
                bytes.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(bytes).ok()
}

/// The folders of all muscles in an output, sorted by name.
///
/// # Errors
/// An output that cannot be read.
pub(crate) fn muscles(output: &Path) -> Result<Vec<(String, PathBuf)>> {
    local_only(output)?;
    let entries = fs::read_dir(output).map_err(|e| Error::unreadable(output, &e))?;
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| Error::unreadable(output, &e))?;
        if let Some(muscle) = entry.file_name().to_str().and_then(muscle_name) {
            found.push((muscle, entry.path()));
        }
    }
    found.sort();
    Ok(found)
}

/// The output of a batch: a folder, or a place in a bucket.
#[derive(Debug)]
pub enum Output {
    /// A folder of this machine.
    Folder(Folder),
    /// A place in a bucket.
    Bucket(Bucket),
}

/// A place in a bucket.
#[derive(Debug)]
pub struct Bucket(Objects);

impl Output {
    /// Opens the output, creates it where needed, and removes what interrupted runs left.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn open(root: &Path) -> Result<Self> {
        let address = root.to_string_lossy();
        if is_remote(&address) {
            return Ok(Self::Bucket(Bucket(Objects::open(&address)?)));
        }
        Folder::open(Path::new(address.strip_prefix("file://").unwrap_or(&address))).map(Self::Folder)
    }

    /// Whether results for this key are there, complete.
    #[must_use]
    pub fn has(&self, muscle: &str, key: &str) -> bool {
        match self {
            Self::Folder(folder) => folder.has(muscle, key),
            Self::Bucket(bucket) => bucket.0.has(muscle, key),
        }
    }

    /// Whether the stored results of a muscle list a failure.
    #[must_use]
    pub(crate) fn has_failures(&self, muscle: &str) -> bool {
        match self {
            Self::Folder(folder) => folder.has_failures(muscle),
            Self::Bucket(bucket) => bucket.0.has_failures(muscle),
        }
    }

    /// Makes the results of a muscle visible, in place of earlier ones.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn publish(&self, muscle: &str, files: &[(String, Vec<u8>)]) -> Result<()> {
        match self {
            Self::Folder(folder) => folder.publish(muscle, files),
            Self::Bucket(bucket) => bucket.0.publish(muscle, files),
        }
    }
}

/// A folder for the results, with this run's place for unfinished ones.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    run: PathBuf,
    /// Held for as long as this run lives; the operating system releases it when the process ends.
    _lock: File,
}

impl Folder {
    /// Opens the output, creates it where needed, and removes what interrupted runs left.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn open(root: &Path) -> Result<Self> {
        let unwritable = |path: &Path, e: io::Error| Error::unwritable(path, &e);
        let partial = root.join(PARTIAL);
        fs::create_dir_all(&partial).map_err(|e| unwritable(root, e))?;
        // One run at a time looks for leftovers and makes its own place.
        let _lock = FolderLock::of([Some(partial.join("lock").as_path())])?;
        remove_leftovers(&partial);
        let run = tempfile::Builder::new().prefix("run-").tempdir_in(&partial);
        let run = run.map_err(|e| unwritable(&partial, e))?.keep();
        let path = run.join("lock");
        let lock = File::create(&path).map_err(|e| unwritable(&path, e))?;
        lock.try_lock().map_err(|e| unwritable(&path, e.into()))?;
        Ok(Self { root: root.to_path_buf(), run, _lock: lock })
    }

    /// Whether results for this key are there, complete.
    #[must_use]
    pub fn has(&self, muscle: &str, key: &str) -> bool {
        let folder = self.root.join(folder_name(muscle));
        TABLES.iter().all(|table| {
            File::open(folder.join(format!("{table}.parquet")))
                .is_ok_and(|f| footer(f, KEY).as_deref() == Some(key))
        })
    }

    /// Whether the stored results of a muscle list a failure.
    #[must_use]
    pub(crate) fn has_failures(&self, muscle: &str) -> bool {
        File::open(self.root.join(folder_name(muscle)).join("failures.parquet")).is_ok_and(|f| rows(f) > 0)
    }

    /// Makes the results of a muscle visible, in place of earlier ones.
    ///
    /// # Errors
    /// Files that cannot be written; nothing has changed then.
    pub fn publish(&self, muscle: &str, files: &[(String, Vec<u8>)]) -> Result<()> {
        let name = folder_name(muscle);
        let fresh = self.run.join(&name);
        let target = self.root.join(&name);
        let written = write_all(&fresh, files).and_then(|()| replace(&fresh, &target));
        let synced = written.and_then(|()| sync_folder(&self.root));
        if synced.is_err() {
            let _ = fs::remove_dir_all(&fresh);
        }
        synced.map_err(|e| Error::unwritable(&target, &e))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.run);
        // Other runs may be at work: a folder that is not empty stays.
        let _ = fs::remove_dir(self.root.join(PARTIAL));
    }
}

/// Removes the folders of runs that ended without removing them: no process holds their lock.
fn remove_leftovers(partial: &Path) {
    for entry in fs::read_dir(partial).into_iter().flatten().flatten() {
        let path = entry.path();
        match File::open(path.join("lock")) {
            Ok(lock) if lock.try_lock().is_ok() => {
                let _ = fs::remove_dir_all(&path);
            }
            Ok(_) => {}
            // Interrupted before its lock was there.
            Err(_) => {
                let _ = fs::remove_dir(&path);
            }
        }
    }
}

fn write_all(folder: &Path, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for (name, bytes) in files {
        let mut file = File::create(folder.join(name))?;
        file.write_all(bytes)?;
        file.sync_all()?;
    }
    sync_folder(folder)
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

fn replace(fresh: &Path, target: &Path) -> io::Result<()> {
    match fs::rename(fresh, target) {
        Ok(()) => Ok(()),
        // A folder with files exists: results for other inputs.
        Err(e) if target.is_dir() => {
            exchange(fresh, target).or_else(|_| move_aside(fresh, target)).map_err(|_| e)
        }
        Err(e) => Err(e),
    }?;
    if fresh.exists() { fs::remove_dir_all(fresh) } else { Ok(()) }
}

/// Both folders change places in one step.
#[cfg(target_os = "linux")]
fn exchange(fresh: &Path, target: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, fresh, CWD, target, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Where folders cannot be exchanged: for a moment a reader finds no results of this muscle.
fn move_aside(fresh: &Path, target: &Path) -> io::Result<()> {
    let mut old = OsString::from(fresh);
    old.push(".old");
    fs::rename(target, &old)?;
    fs::rename(fresh, target)?;
    fs::remove_dir_all(&old)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{Columns, Values};

    fn files(key: &str) -> Vec<(String, Vec<u8>)> {
        let table = Columns(vec![("x".into(), Values::Count(vec![Some(1)]))]);
        let bytes = table.to_parquet(&[(KEY, key)]).expect("written");
        TABLES.iter().map(|t| (format!("{t}.parquet"), bytes.clone())).collect()
    }

    #[test]
    fn results_appear_whole_and_replace_older_ones() {
        let root = tempfile::tempdir().expect("a folder");
        let output = Folder::open(root.path()).expect("opened");
        assert!(!output.has("a b", "1"));
        output.publish("a b", &files("1")).expect("published");
        assert!(output.has("a b", "1") && !output.has("a b", "2"));
        output.publish("a b", &files("2")).expect("replaced");
        assert!(output.has("a b", "2") && !output.has("a b", "1"));
        fs::remove_file(root.path().join("muscle=a%20b/tables.parquet")).expect("removed");
        assert!(!output.has("a b", "2"), "an incomplete folder counts as none");
        drop(output);
        let left: Vec<_> =
            fs::read_dir(root.path()).expect("a folder").flatten().map(|e| e.file_name()).collect();
        assert_eq!(left, ["muscle=a%20b"]);
        assert_eq!(muscles(root.path()).expect("read")[0].0, "a b");
    }

    #[test]
    fn remains_of_an_interrupted_run_are_removed_and_a_running_one_is_kept() {
        let root = tempfile::tempdir().expect("a folder");
        let dead = root.path().join(PARTIAL).join("run-dead");
        fs::create_dir_all(dead.join("muscle=a")).expect("made");
        fs::write(dead.join("lock"), "").expect("written");
        let first = Folder::open(root.path()).expect("opened");
        assert!(!dead.exists());
        fs::create_dir(first.run.join("muscle=b")).expect("made");
        let second = Folder::open(root.path()).expect("opened");
        assert!(first.run.join("muscle=b").exists(), "the first run still lives");
        drop((first, second));
        assert!(!root.path().join(PARTIAL).exists());
    }

    #[test]
    fn names_are_encoded_one_to_one() {
        for name in ["a", "a b", "ä/ö", "%41", "..", "a=b", "100%", "%zz"] {
            let folder = folder_name(name);
            assert!(!folder.contains('/') && muscle_name(&folder).as_deref() == Some(name), "{folder}");
        }
        assert_eq!(muscle_name("other"), None);
    }
}
