//! One program at a time writes results into a folder. The wait for another one is bounded, and its end names that program.

use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::{DataCode, Error, Result};

/// How long one program may write its results while this one waits. The pages of the largest reports take some seconds on a slow
/// disk; a program that takes longer is stopped, or its disk is.
const PATIENCE: Duration = Duration::from_secs(60);
/// Pause between two attempts.
const PAUSE: Duration = Duration::from_millis(10);

/// While this lives, other runs of this program write no results into the same folders: the table, the report and the JSON that
/// exist afterwards are those of one run.
#[derive(Debug)]
pub struct FolderLock {
    _locked: Vec<File>,
}

impl FolderLock {
    /// Waits for the folders of these files. One that cannot be locked, as on some network drives, is not waited for.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`] where one program holds a folder for a minute: it is named.
    pub fn of<'a>(paths: impl IntoIterator<Item = Option<&'a Path>>) -> Result<Self> {
        Self::within(paths, PATIENCE)
    }

    fn within<'a>(paths: impl IntoIterator<Item = Option<&'a Path>>, patience: Duration) -> Result<Self> {
        let folder = |path: &Path| {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            fs::canonicalize(folder).ok()
        };
        // In one order for all, so that no two runs wait for each other.
        let folders: BTreeSet<PathBuf> =
            paths.into_iter().flatten().filter(|p| *p != Path::new("-")).filter_map(folder).collect();
        let mut locked = Vec::new();
        for folder in folders {
            locked.extend(lock(&folder, patience)?);
        }
        Ok(Self { _locked: locked })
    }
}

fn lock(folder: &Path, patience: Duration) -> Result<Option<File>> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    let mut held_by = None;
    let mut since = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Err(TryLockError::WouldBlock) => {}
        }
        // Many programs may wait for one folder: each of them has its time.
        let holder = holder(&file);
        if holder != held_by {
            (held_by, since) = (holder, Instant::now());
        }
        if since.elapsed() >= patience {
            return Err(held(folder, held_by, patience));
        }
        std::thread::sleep(PAUSE);
    }
}

fn held(folder: &Path, holder: Option<u32>, patience: Duration) -> Error {
    let seconds = patience.as_secs();
    let error = |who: String| {
        Error::new(
            DataCode::FileUnwritable,
            format!("{who} has been writing its results to this folder for {seconds} s"),
        )
        .file(folder)
    };
    match holder {
        Some(id) if is_stopped(id) => error(format!("{}, which is stopped,", process_description(id))).help(format!(
            "continue it with `kill -CONT {id}` or end it with `kill -KILL {id}`; or write to another folder"
        )),
        Some(id) => error(process_description(id))
            .help(format!("wait for it or end it with `kill {id}`; or write to another folder")),
        None => error("another program".into()).help("end it or wait for it; or write to another folder"),
    }
}

fn process_description(id: u32) -> String {
    match fs::read_to_string(format!("/proc/{id}/comm")) {
        Ok(name) => format!("the program {} (process {id})", name.trim_end().escape_debug()),
        Err(_) => format!("process {id}"),
    }
}

/// Whether a signal has stopped a program.
fn is_stopped(id: u32) -> bool {
    let Ok(status) = fs::read_to_string(format!("/proc/{id}/stat")) else { return false };
    // The name before the state may hold any character.
    status.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with(['T', 't']))
}

/// The process that holds the lock of a file, where the system lists it.
#[cfg(target_os = "linux")]
fn holder(file: &File) -> Option<u32> {
    use std::os::linux::fs::MetadataExt;
    let node = format!(":{}", file.metadata().ok()?.st_ino());
    let locks = fs::read_to_string("/proc/locks").ok()?;
    // 1: FLOCK  ADVISORY  WRITE 1234 00:2f:5678 0 EOF; behind an arrow those that wait.
    locks.lines().find_map(|line| {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let holds = cells.get(1) == Some(&"FLOCK") && cells.get(5)?.ends_with(&node);
        holds.then(|| cells.get(4)?.parse().ok().filter(|id| *id > 0)).flatten()
    })
}

#[cfg(not(target_os = "linux"))]
fn holder(_: &File) -> Option<u32> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::write_whole;

    #[test]
    fn the_results_of_one_run_are_written_together() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::thread::scope(|scope| {
            for run in 0..4 {
                let (table, report) = (path("t"), path("r"));
                scope.spawn(move || {
                    for round in 0..20 {
                        let text = format!("{run} {round}");
                        let _guard = FolderLock::of([Some(table.as_path()), None, Some(report.as_path())])
                            .expect("a lock");
                        write_whole(&table, text.as_bytes()).expect("written");
                        write_whole(&report, text.as_bytes()).expect("written");
                        let read = |p: &Path| fs::read(p).expect("readable");
                        assert_eq!(read(&table), read(&report));
                    }
                });
            }
        });
    }

    #[test]
    fn a_folder_that_stays_locked_is_an_error_that_names_the_holder() {
        let folder = tempfile::tempdir().expect("a folder");
        let result = folder.path().join("result");
        let patience = Duration::from_millis(30);
        let first = FolderLock::within([Some(result.as_path())], patience).expect("a lock");
        let error = FolderLock::within([Some(result.as_path())], patience).expect_err("it is held");
        assert_eq!((error.code().name(), error.exit_status()), ("file::unwritable", 1));
        #[cfg(target_os = "linux")]
        assert!(error.to_string().contains(&format!("process {}", std::process::id())), "{error}");
        drop(first);
        FolderLock::within([Some(result.as_path())], patience).expect("a lock");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_program_that_is_stopped_is_distinguished_from_one_that_runs() {
        let mut stopped =
            std::process::Command::new("sh").args(["-c", "kill -STOP $$"]).spawn().expect("a program");
        let deadline = Instant::now() + Duration::from_secs(60);
        while !is_stopped(stopped.id()) {
            assert!(Instant::now() < deadline, "it stops");
            std::thread::sleep(PAUSE);
        }
        let error = held(Path::new("."), Some(stopped.id()), PATIENCE);
        assert!(error.cause().contains("which is stopped"), "{error}");
        assert!(!is_stopped(std::process::id()));
        stopped.kill().and_then(|()| stopped.wait()).expect("it ends");
    }
}
